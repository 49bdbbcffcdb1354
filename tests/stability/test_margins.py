"""Margins are python-control's, and where they say that a loop becomes unstable, its eigenvalues do."""

from __future__ import annotations

import math

import control
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.stability.conftest import closed, linear, periodic
from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.stability.margins import NEUTRAL, PoleCount, frequencies, margins
from wristctl.stability.sampled_loop import SampledLoop

S, PERIOD = control.tf("s"), 0.01
PLANTS = {
    "lag": 8.0 / ((0.1 * S + 1) * (0.02 * S + 1)),
    "integrator": 12.0 / (S * (0.05 * S + 1)),
    "double integrator with lead": 40.0 * (0.2 * S + 1) / (S * S * (0.01 * S + 1)),
    "conditionally stable": 900.0 * (0.1 * S + 1) ** 2 / (S**3 * (0.002 * S + 1)),
    "resonances, many crossings": 5.0 / (S + 5) + 30.0 / (S * S + 0.6 * S + 900.0) + 80.0 / (S * S + 1.5 * S + 6400.0),
    "unstable plant, stable loop": 6.0 * (0.05 * S + 1) / ((0.3 * S - 1) * (0.01 * S + 1)),
    "unstable loop": 300.0 / (S * (0.05 * S + 1)),
    "nearly marginal": 20.9 / (S * (0.05 * S + 1)),
    "below 1 everywhere": 0.3 / (0.1 * S + 1),
}


def _open(name: str, gain: float = 1.0) -> tuple[control.StateSpace, SampledLoop]:
    own = control.ss(control.c2d(control.ss(gain * PLANTS[name]), PERIOD))
    return own, closed(np.array(own.A), np.array(own.B)[:, 0], np.array(own.C)[0], PERIOD)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", PLANTS)
def test_margins_are_those_of_python_control(name: str) -> None:
    """Its polynomials have roots beside the unit circle too, of which it keeps the nearest: they are left out."""
    own, loop = _open(name)
    found, half = margins(loop), math.pi / PERIOD
    polynomials = control.stability_margins(control.tf(own), returnall=True, method="poly")
    gains, phases, distances, at_phase, at_gain, at_distance = polynomials
    answer = {w: complex(own(np.exp(1j * w * PERIOD))) for w in (*at_phase[at_phase > 0.01], *at_gain)}
    ours = sorted((each.omega, each.value) for each in found.phase_crossings if each.omega < 0.999 * half)
    theirs = [(w, gain) for w, gain in zip(at_phase, gains, strict=True) if w == 0.0 and gain > 1e-3]
    theirs += [(w, g) for w, g in zip(at_phase, gains, strict=True) if w > 0.01 and abs(answer[w].imag) < 1e-6]
    np.testing.assert_allclose(np.array(ours).reshape(-1, 2), np.array(theirs).reshape(-1, 2), rtol=1e-6)
    ours = sorted((each.omega, math.degrees(each.value)) for each in found.gain_crossings)
    turned = zip(at_gain, (phases + 180.0) % 360.0 - 180.0, strict=True)
    theirs = [(w, phase) for w, phase in turned if abs(abs(answer[w]) - 1.0) < 1e-6]
    np.testing.assert_allclose(np.array(ours).reshape(-1, 2), np.array(theirs).reshape(-1, 2), rtol=1e-6, atol=1e-6)
    if found.sensitivity.omega < 0.999 * half:
        inner = distances[at_distance < 0.999 * half]
        assert found.sensitivity.value == pytest.approx(1.0 / min(inner), rel=1e-6)


@pytest.mark.parametrize("name", PLANTS)
def test_a_loop_is_stable_between_its_limits_and_not_beyond(name: str) -> None:
    _, loop = _open(name)
    found = margins(loop)
    assert found.stable == (np.abs(np.linalg.eigvals(loop.transitions()[0])).max() < 1.0)
    for limit, inside in ((found.least, 1.001), (found.most, 0.999)):
        if 0.0 < limit.value < math.inf:
            assert loop.growth(limit.value * inside) < 0.0 < loop.growth(limit.value / inside)
            swings = 2.0 * math.pi * loop.modes(limit.value)[0].frequency
            assert swings == pytest.approx(limit.omega, rel=1e-6, abs=1e-6)
    if found.least.value == 0.0:
        smaller = np.geomspace(1e-6, min(1.0, found.most.value) * 0.999, 50)
        assert all(loop.growth(factor) < NEUTRAL for factor in smaller)
    if math.isinf(found.most.value):
        assert all(loop.growth(factor) < 0.0 for factor in np.geomspace(1.0, 1e3, 50))


def late(loop: SampledLoop, ticks: int) -> float:
    """The largest multiplier of a loop of one tick whose signal comes back so many ticks later."""
    (tick,) = loop.ticks
    n = len(tick.into)
    whole = np.zeros((n + ticks, n + ticks))
    whole[:n, :n] = loop.transitions(0.0)[0]
    whole[:n, n + ticks - 1 if ticks else slice(0, n)] += tick.into if ticks else np.outer(tick.into, tick.back)
    whole[n : n + 1, :n] = tick.back if ticks else whole[n : n + 1, :n]
    whole[n + 1 :, n:-1] += np.eye(max(ticks - 1, 0))
    return float(np.abs(np.linalg.eigvals(whole)).max())


@pytest.mark.parametrize("name", PLANTS)
def test_a_loop_bears_whole_ticks_of_delay_up_to_its_margin(name: str) -> None:
    _, loop = _open(name)
    found = margins(loop)
    if not found.stable:
        assert math.isnan(found.delay)
    elif math.isinf(found.delay):
        assert all(late(loop, ticks) < 1.0 for ticks in range(30))
    else:
        assert late(loop, math.floor(found.delay / PERIOD)) < 1.0 < late(loop, math.floor(found.delay / PERIOD) + 2)


@pytest.mark.parametrize("name", ["double integrator with lead", "resonances, many crossings"])
def test_what_a_plane_bears_by_itself_is_within_its_margins_and_all_of_its_phase_margin_at_some_gain(name: str) -> None:
    """Where the locus is nearest to -1 as it crosses the unit circle, which loops do whose phase rises there."""
    every = [margins(_open(name, gain)[1]) for gain in np.geomspace(0.1, 10.0, 9)]
    found = [each for each in every if each.stable]
    assert all(each.least.value < each.of_each.least < 1.0 < each.of_each.most < each.most.value for each in found)
    shares = [each.of_each.phase / abs(each.phase.value) for each in found]
    assert 0.99 < max(shares) <= 1.0 + 1e-9


def test_an_unstable_loop_tells_where_it_would_be_stable() -> None:
    found = margins(_open("unstable loop")[1])
    assert not found.stable and found.least.value == 0.0 and found.most.value < 1.0
    low = margins(_open("unstable plant, stable loop")[1])
    assert low.stable and 0.0 < low.least.value < 1.0


def test_a_narrow_range_of_stable_gains_is_found() -> None:
    """z = 14 - 10 k: stable from k = 1.3 to 1.5."""
    found = margins(closed(np.array([[14.0]]), np.array([10.0]), np.array([1.0]), PERIOD))
    assert not found.stable and (found.least.value, found.most.value) == pytest.approx((1.3, 1.5), rel=1e-9)


@pytest.mark.parametrize(("seed", "least", "most"), [(939, 0.182, 0.533), (3356, 1.168, 1.323)])
def test_of_two_ranges_of_stable_gains_the_nearer_to_one_is_told(seed: int, least: float, most: float) -> None:
    """Random loops of four states whose poles lie within the unit circle over two ranges of the gain, 1 in neither."""
    rng = np.random.default_rng(seed)
    a = rng.normal(size=(4, 4))
    a *= rng.uniform(0.5, 1.2) / np.abs(np.linalg.eigvals(a)).max()
    b, c = rng.normal(size=4), rng.normal(size=4)
    factors = np.geomspace(1e-3, 1e3, 2001)
    inside = [bool(np.abs(np.linalg.eigvals(a - k * np.outer(b, c))).max() < 1.0) for k in (*factors, 1.0)]
    assert np.diff([False, *inside]).sum() >= 3 and not inside[-1]
    found = margins(closed(a, b, c, PERIOD))
    assert not found.stable and (found.least.value, found.most.value) == pytest.approx((least, most), rel=5e-3)


@st.composite
def loops(draw: st.DrawFn) -> tuple[Array, Array, Array]:
    """A stable open loop of random poles and residues."""
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))
    n = draw(st.integers(2, 6))
    a = rng.normal(size=(n, n))
    return a * rng.uniform(0.3, 0.98) / np.abs(np.linalg.eigvals(a)).max(), rng.normal(size=n), rng.normal(size=n)


def test_a_pair_that_leaves_the_unit_circle_just_before_it_is_real_is_found() -> None:
    """It does so 0.1 % before the gain at which a real pole is -1, where the frequency is half the rate's."""
    transition = np.array([
        [-0.42888677, 0.29847215, 0.43372576, -0.00081722, 0.03077173],
        [-0.38423056, 0.48516206, -0.51023281, 0.28142618, 0.08813508],
        [0.05381203, 0.37282349, 0.31764966, -0.19466348, -0.25315414],
        [0.00443367, -0.2471016, -0.15918452, 0.52649928, 0.07873879],
        [0.57293668, 0.35749691, 0.34073549, -0.43949077, -0.02533142],
    ])  # fmt: skip
    into = np.array([-0.14470932, 0.30681288, -0.07034799, 1.92042424, -1.633986])
    back = np.array([-0.2770713, 1.283875, -0.58385162, -0.47863667, -1.399153])
    limit = margins(closed(transition, into, back, 1.0)).most.value
    largest = [
        np.abs(np.linalg.eigvals(transition - side * limit * np.outer(into, back))).max() for side in (0.9999, 1.0001)
    ]
    assert largest[0] < 1.0 < largest[1]


@settings(max_examples=40, deadline=None)
@given(loops())
@pytest.mark.slow
def test_limits_of_any_loop_are_where_eigenvalues_leave_the_unit_circle(own: tuple[Array, Array, Array]) -> None:
    loop = closed(*own, 1.0)
    found = margins(loop)
    assert found.stable == (loop.growth() < NEUTRAL)
    if found.stable and not math.isinf(found.most.value):
        assert loop.growth(0.9999 * found.most.value) < 1e-3 and loop.growth(1.0001 * found.most.value) > -1e-3
    within = np.linspace(found.least.value, min(found.most.value, 1e3), 20)[1:-1]
    assert all(loop.growth(float(factor)) < 2e-3 for factor in within if not math.isnan(found.least.value))


def _uneven(rng: np.random.Generator, size: float) -> SampledLoop:
    """Three states over five ticks, cut at two of them."""
    a, b, c = size * rng.normal(size=(3, 3)), rng.normal(size=3), rng.normal(size=3)
    cuts = (True, False, True, False, False)
    return periodic([(a + 0.1 * rng.normal(size=(3, 3)), b, c, cut) for cut in cuts], 0.1)


@pytest.mark.parametrize("seed", range(12))
def test_poles_of_a_loop_of_several_rates_are_counted(seed: int) -> None:
    loop = _uneven(np.random.default_rng(seed), 0.5)
    count = PoleCount(loop, NEUTRAL)
    for factor in (0.0, 0.2, 0.7, 1.0, 1.6, 4.0, -1.5):
        assert count.unstable(factor) == np.sum(np.abs(loop.multipliers(factor)) > math.exp(NEUTRAL * loop.lasts))


@pytest.mark.parametrize("seed", range(6))
def test_the_limits_of_a_loop_of_several_rates_are_where_its_swings_no_longer_decay(seed: int) -> None:
    """Its phase crossings tell them only nearly: what is fed back at other frequencies changes with the gain."""
    loop = _uneven(np.random.default_rng(seed), 0.3)
    found = margins(loop)
    limits = [limit.value for limit in (found.least, found.most) if 0.0 < limit.value < math.inf]
    assert limits or found.stable
    for limit in limits:
        assert loop.growth(limit) == pytest.approx(NEUTRAL, rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_what_is_added_at_uneven_cuts_is_amplified_by_the_loop(seed: int) -> None:
    """A tone goes on at the cuts for long; what it makes of itself at its own frequency is 1/(1 + L) of it."""
    loop = _uneven(np.random.default_rng(seed), 0.2)
    quiet = zip(loop.ticks, loop.transitions(0.1), strict=True)
    loop = SampledLoop(loop.period, [t._replace(transition=m, into=0.1 * t.into) for t, m in quiet])
    assert loop.growth() < -0.5
    omega, state, seen = 3.0, np.zeros(3, complex), []
    for k in range(4000):
        tick, tone = loop.ticks[k % 5], np.exp(1j * omega * loop.period * k)
        if tick.cut and k >= 2000:
            seen.append((tone + tick.back @ state) / tone)
        state = tick.transition @ state + tick.into * tone * tick.cut
    amplified = 1.0 / (1.0 + loop.response(np.array([omega]))[0])
    assert np.mean(seen) == pytest.approx(amplified, abs=5e-3)


@pytest.mark.parametrize("name", ["integrator", "resonances, many crossings", "nearly marginal"])
@pytest.mark.slow
def test_a_loop_written_out_over_several_ticks_is_the_same_loop(name: str) -> None:
    """Its modes turn further in a cycle than one can see at its end, and its cuts are as many as its ticks."""
    _, loop = _open(name)
    (tick,) = loop.ticks
    long = SampledLoop(loop.period, [tick] * 4)
    assert long.growth() == pytest.approx(loop.growth(), rel=1e-9) and not long.is_steady
    ours, theirs = ([(m.growth, m.frequency) for m in each.modes() if m.growth > -100.0] for each in (long, loop))
    np.testing.assert_allclose(sorted(ours), sorted(theirs), rtol=1e-6, atol=1e-6)
    omega = np.array([0.3, 7.0, 40.0, 150.0])
    np.testing.assert_allclose(long.response(omega), loop.response(omega), rtol=1e-6)
    one, other = margins(loop), margins(long)
    assert (other.most.value, other.delay) == pytest.approx((one.most.value, one.delay), rel=0.02)
    assert other.sensitivity.value == pytest.approx(one.sensitivity.value, rel=1e-6)


def test_a_sharp_resonance_between_the_decades_is_seen() -> None:
    sharp = control.c2d(control.ss(1.0 / (S * S + 2e-4 * S + 700.0)), PERIOD)
    loop = closed(np.array(sharp.A), np.array(sharp.B)[:, 0], np.array(sharp.C)[0], PERIOD)
    assert len(margins(loop).gain_crossings) == 2 and np.diff(frequencies(loop)).min() > 0.0


@pytest.mark.slow
def test_margins_of_a_configured_loop_are_python_controls() -> None:
    found = linear("pid", {"Kp": 10.0, "Ki": 20.0, "Kd": 0.5}, Loop(plant_segments=1, control_period=5e-3), 15.0).closed
    (tick,) = found.ticks
    own = control.ss(found.transitions(0.0)[0], tick.into[:, None], -tick.back[None], 0.0, found.period)
    _, phases, _, _, at_gain, _ = control.stability_margins(control.tf(own), returnall=True, method="poly")
    ours = margins(found)
    assert ours.delay == pytest.approx(min(np.radians((phases + 180.0) % 360.0 - 180.0) / at_gain), rel=1e-6)
    peak = max(abs(1.0 / (1.0 + complex(own(np.exp(1j * w))))) for w in np.linspace(1e-3, math.pi, 3000))
    assert peak == pytest.approx(ours.sensitivity.value, rel=1e-4)
