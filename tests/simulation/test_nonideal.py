"""What a real wrist has: friction, backlash, creep, end stops and faults, against closed forms and the statics."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.simulation.spools import rest_angle, spooled
from wristctl.config.errors import UserError
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Actuator, Plant, Sensor, TrueActuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.simulation.frames import readings
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import Outcome, rollout
from wristctl.wrist.tendon_friction import bristle, capstan

WRIST = WristParameters()
STIFF = Actuator(level="tendon", friction=0.1, sheath=1.0)
HOME = WRIST.pretension / STIFF.tendon_stiffness
"""What both sides have reeled in at pretension on the straight wrist [m]."""


def minimum_jerk(begin: float, end: float, duration: float, h: float = 1e-3) -> np.ndarray:
    s = np.arange(0.0, duration, h) / duration
    return begin + (end - begin) * s**3 * (10.0 - 15.0 * s + 6.0 * s**2)


def antagonists(travel: np.ndarray) -> np.ndarray:
    """Spools (T, 2) that reel in on the + side what they pay out on the other."""
    return HOME + np.stack([travel, -travel], axis=1)


@pytest.mark.parametrize(("sheath", "presliding"), [(0.0, 2e-5), (1.0, 5e-6), (1.0, 2e-5), (3.0, 2e-5), (3.0, 1e-4)])
def test_the_dead_band_lies_between_the_roots_of_the_statics(sheath: float, presliding: float) -> None:
    """Held spools, approached in 7 s from either side: friction holds the wrist where its bristles are bent fully."""
    actuator = STIFF.model_copy(update={"sheath": sheath, "presliding": presliding})
    at = 5e-3
    found, exact = [], []
    for beyond, z in ((-6e-3, 1.0), (6e-3, -1.0)):
        path = np.concatenate(
            [minimum_jerk(0.0, at + beyond, 3.0), minimum_jerk(at + beyond, at, 7.0), np.full(2000, at)]
        )
        found.append(spooled(antagonists(path), actuator).theta[-1])
        exact.append(rest_angle((HOME + at, HOME - at), actuator, (z, -z), WRIST, 4))
    width = exact[1] - exact[0]
    assert 1e-4 < width < 0.03
    assert found[1] - found[0] == pytest.approx(width, rel=0.01)
    np.testing.assert_allclose(found, exact, atol=0.01 * width)


def cycle(frequency: float, actuator: Actuator) -> tuple[float, float]:
    """Work of friction and of the raw loop at the spool [J] over one period of the spools, after half a one."""
    h = 1e-3
    time = np.arange(0.0, 1.5 / frequency, h)
    done = spooled(antagonists(5e-3 * np.sin(2.0 * np.pi * frequency * time)), actuator)
    last = slice(round(0.5 / frequency / h), None)
    friction, raw = 0.0, 0.0
    for side in ("plus", "minus"):
        x, spool, wrist = (getattr(done, f"{name}{side}")[last] for name in ("x_", "spool_", ""))
        friction += float(np.trapezoid(spool - wrist, x))
        raw += float(np.trapezoid(spool, x))
    return friction, raw


@pytest.mark.parametrize("sheath", [0.0, 3.0])
def test_frictions_work_does_not_know_how_fast_it_goes(sheath: float) -> None:
    actuator = STIFF.model_copy(update={"sheath": sheath})
    (slow, raw_slow), (fast, raw_fast) = cycle(0.004, actuator), cycle(0.04, actuator)
    assert slow > 1e-3 and fast == pytest.approx(slow, rel=0.01)
    assert raw_fast - fast > 3.0 * (raw_slow - slow) > 0.0, "the wrist's own damping does"


def test_in_slip_a_tendon_pulls_by_the_capstan() -> None:
    done = spooled(antagonists(minimum_jerk(0.0, 5e-3, 5.0)) + 1e-3, STIFF)
    slipping = slice(3000, 3500)
    phi = STIFF.sheath + np.abs(done.theta)
    assert (phi[slipping] > 1.1).all()
    np.testing.assert_allclose((done.spool_plus / done.plus)[slipping], np.exp(0.1 * phi)[slipping], rtol=1e-9)
    np.testing.assert_allclose((done.spool_minus / done.minus)[slipping], np.exp(-0.1 * phi)[slipping], rtol=1e-9)


@kernel
def _element(travels: Any, exponent: float, presliding: float, begin: float, out: Any) -> None:
    z = begin + 0.0 * rows_of(travels)[0]
    for k in range(travels.shape[0]):
        z = bristle(z, rows_of(travels)[k], 1.0 / presliding + 0.0 * z)
        row = rows_of(out[k])
        row[0], row[1] = z, capstan(exponent + 0.0 * z, 1.0 + 0.0 * z, z)


def element(
    travels: np.ndarray, exponent: float, presliding: float, begin: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """The bristle's state after each travel (T, ...) [m], and the wrist's pull over the spool's."""
    out = np.empty((len(travels), 2, *travels.shape[1:]))
    _element(np.ascontiguousarray(travels), exponent, presliding, begin, out)
    return out[:, 0], out[:, 1]


def test_the_bristle_never_leaves_its_bounds() -> None:
    """In 1e7 moves of 1 nm to 1 mm, either way."""
    rng = np.random.default_rng(0)
    for _ in range(10):
        travels = 10.0 ** rng.uniform(-9.0, -3.0, (125_000, 8)) * rng.choice([-1.0, 1.0], (125_000, 8))
        z, ratio = element(travels, 0.4, 2e-5)
        assert np.abs(z).max() <= 1.0
        np.testing.assert_allclose(ratio, np.exp(-0.4 * z), rtol=4e-16)


def test_the_bristle_is_a_function_of_the_path_alone() -> None:
    once, _ = element(np.array([3e-5]), 0.1, 2e-5, -0.5)
    often, _ = element(np.full(300, 1e-7), 0.1, 2e-5, -0.5)
    assert once[-1] == pytest.approx(1.0 - 1.5 * np.exp(-1.5), rel=1e-15)
    assert often[-1] == pytest.approx(once[-1], rel=1e-13)


def stored(pull: float, exponent: float, z: float, presliding: float) -> float:
    """Energy of a bent bristle [J]: s P (z - (1 - exp(-mu phi z))/(mu phi))."""
    return presliding * pull * (z + np.expm1(-exponent * z) / exponent)


Moves = st.lists(st.tuples(st.floats(-1e-4, 1e-4), st.floats(0.1, 60.0), st.floats(0.01, 0.7)), min_size=1, max_size=12)


@settings(deadline=None, max_examples=60)
@given(Moves, st.floats(-1.0, 1.0))
def test_friction_gives_no_energy_but_what_a_changing_pull_puts_in(
    moves: list[tuple[float, float, float]], z: float
) -> None:
    """Work lost between spool and wrist, less what is stored, plus what changes of pull and of wrap put in there."""
    s, balance = 2e-5, 0.0
    pull, exponent = moves[0][1:]
    for travel, next_pull, next_exponent in moves:
        fine = np.full(2000, travel / 2000)
        states, left = element(fine, exponent, s, z)
        left = np.concatenate([[np.exp(-exponent * z)], left])
        lost = pull * float(np.trapezoid(1.0 - left, dx=travel / 2000))
        alone = lost - (stored(pull, exponent, states[-1], s) - stored(pull, exponent, z, s))
        assert alone >= -1e-9 * pull * s, "at constant pull it is passive"
        balance, z = balance + alone, float(states[-1])
        pull, exponent = next_pull, next_exponent  # at rest: what the store gains is what this put in
        assert stored(pull, exponent, z, s) >= -1e-15 * pull * s
    assert balance >= -1e-8 * s


def test_pulls_that_change_while_the_bristle_is_bent_can_give_energy() -> None:
    """The known flaw of an exponent on a pull that varies (docs/worlds.md): microjoules a cycle, and it is counted."""
    s, exponent, created = 2e-5, 0.4, 0.0
    z = 0.0
    for _ in range(20):
        created = 0.0
        for travel, pull in ((4e-6, 60.0), (4e-6, 10.0), (-4e-6, 60.0), (-4e-6, 10.0)):
            states, left = element(np.full(2000, travel / 2000), exponent, s, z)
            left = np.concatenate([[np.exp(-exponent * z)], left])
            created -= pull * float(np.trapezoid(1.0 - left, dx=travel / 2000))
            z = float(states[-1])
    assert 1e-6 < created < 1e-4


def test_a_tendon_that_is_held_relaxes_as_one_maxwell_branch_does() -> None:
    pull = spooled(np.full((3000, 2), HOME + 1e-4), STIFF, TrueActuator(creep=0.2, creep_time=0.7)).spool_plus
    time = 1e-3 * np.arange(3000)
    np.testing.assert_allclose(pull / pull[0], 1.0 - 0.2 * (1.0 - np.exp(-time / 0.7)), rtol=1e-12)


def test_a_loaded_spring_creeps_to_its_relaxed_stiffness() -> None:
    """Without tendons and gravity, under a small force: K before, (1 - f) K at last."""
    light = WRIST.model_copy(update={"gravity": (0.0, 0.0)})
    slack, force = np.full((20_000, 2), -0.05), 0.05
    at_once = spooled(slack, STIFF, plant=TrueWrist(), wrist=light, force=force).theta[-1]
    at_last = spooled(slack, STIFF, plant=TrueWrist(creep=0.25, creep_time=1.5), wrist=light, force=force).theta[-1]
    assert at_once == pytest.approx(force * WRIST.length / (2.0 * WRIST.stiffness), rel=0.2)
    assert at_last == pytest.approx(at_once / 0.75, rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("dissipation", [0.0, 3.0])
def test_end_stops_throw_back_no_faster_than_they_are_hit_and_hold(sign: float, dissipation: float) -> None:
    """A wrist thrown at its stop without springs' damping, tendons or gravity."""
    free = WRIST.model_copy(update={"gravity": (0.0, 0.0), "damping": 1e-9, "stiffness": 1e-9})
    stop = TrueWrist(end_stop_deg=30.0, end_stop_stiffness=50.0, end_stop_dissipation=dissipation)
    slack, rate = np.full((3000, 2), -0.05), np.array([6.0 * sign])
    done = spooled(slack, STIFF, plant=stop, wrist=free, h=1e-4, n=1, rate=rate)
    limit = np.radians(30.0)
    touching = np.flatnonzero(sign * done.theta > limit)
    first = touching[0]
    last = first + np.flatnonzero(sign * done.theta[first:] <= limit)[0] - 1
    rebound = abs(done.rate[last + 1]) / abs(done.rate[first])
    assert (sign * done.theta).max() < limit + np.radians(12.0)
    assert rebound == pytest.approx(1.0, abs=0.02) if dissipation == 0.0 else rebound < 0.6


def test_a_wrist_pressed_against_its_stop_bends_little_beyond_it() -> None:
    """By the torque that is left of the force over the stiffness of both; each of more segments stops at its share."""
    light = WRIST.model_copy(update={"gravity": (0.0, 0.0)})
    stop, limit = TrueWrist(end_stop_deg=20.0, end_stop_stiffness=50.0), np.radians(20.0)
    slack = np.full((3000, 2), -0.05)
    bend = spooled(slack, STIFF, plant=stop, wrist=light, force=20.0, n=1).theta[-1]
    arm = 0.5 * WRIST.length * np.sin(bend) / bend  # of a force at the tip of one arc, nearly
    expected = (20.0 * arm - WRIST.stiffness * limit) / (WRIST.stiffness + 50.0)
    assert bend - limit == pytest.approx(expected, rel=0.25)
    pulled, soft = slack + np.array([0.07, 0.0]), STIFF.model_copy(update={"tendon_stiffness": 2e3})
    one, four = (spooled(pulled, soft, plant=stop, wrist=light, n=n).theta[-1] - limit for n in (1, 4))
    assert one > 1e-3 and four == pytest.approx(one, rel=0.3)  # a tendon's moment is the same on each segment


@pytest.mark.parametrize(("stiffness", "sheath"), [(2e3, 0.0), (20e3, 1.0), (100e3, 3.0)])
def test_a_step_of_a_millisecond_is_as_good_as_twenty(stiffness: float, sheath: float) -> None:
    """Elastic tendons and friction are in the step's Jacobian: without, stiff tendons would ring or lag."""
    actuator = STIFF.model_copy(update={"tendon_stiffness": stiffness, "sheath": sheath})
    path = np.concatenate([minimum_jerk(0.0, 8e-3, 0.4), np.full(200, 8e-3), minimum_jerk(8e-3, 0.0, 0.4)])
    both = antagonists(path) + (WRIST.pretension / stiffness - HOME)
    coarse = spooled(both, actuator).theta
    fine = spooled(np.repeat(both, 20, axis=0), actuator, h=5e-5).theta[::20]
    assert np.degrees(np.abs(coarse - fine).max()) < 0.01


@pytest.mark.parametrize("sensor", ["ideal", "camera"])
def test_a_loop_of_ten_milliseconds_needs_nobody_to_choose_its_substeps(sensor: str) -> None:
    """Stiff tendons, much friction: RMSE within 1 % or 0.001 deg of twenty times the substeps (docs/accuracy.md)."""
    loop = Loop.model_validate(
        {
            "control_period": 1e-2,
            "actuator": {"level": "tendon", "tendon_stiffness": 1e5, "sheath": 3.0},
            "sensor": {"level": sensor},
        }
    )
    assert loop.steps == 10
    own, fine = (loops([each]).metrics["rmse"][0] for each in (loop, loop.model_copy(update={"substeps": 200})))
    assert abs(own - fine) <= max(0.01 * fine, np.radians(0.001))


def test_a_spool_lags_in_its_backlash_and_no_further() -> None:
    path = np.concatenate([np.linspace(0.0, 1e-3, 200), np.linspace(1e-3, 0.0, 200), np.linspace(0.0, 1e-3, 200)])
    done = spooled(antagonists(path), STIFF, TrueActuator(backlash=2e-4))
    told = HOME + path
    np.testing.assert_allclose(done.given_plus[:200], told[:200], atol=1e-15)
    np.testing.assert_allclose(done.given_plus[200:400], np.minimum(told[199], told[200:400] + 2e-4), atol=1e-15)
    np.testing.assert_allclose(done.given_plus[400:], np.maximum(told[399] + 2e-4, told[400:]), atol=1e-15)


def test_one_of_two_tendons_that_breaks_leaves_half_the_pull() -> None:
    done = spooled(np.full((1000, 2), HOME), STIFF, TrueActuator(broken_at=0.5))
    assert done.spool_plus[499] == pytest.approx(2.0 * WRIST.pretension)
    assert done.spool_plus[500] == pytest.approx(WRIST.pretension) and done.spool_minus[500] > 1.9 * WRIST.pretension
    assert done.theta[-1] < -1e-3 and done.theta[499] == 0.0


def test_tendons_that_slip_stay_slipped() -> None:
    done = spooled(np.full((1000, 2), HOME + 1e-3), STIFF, TrueActuator(slips_at=0.5, slip=3e-4))
    np.testing.assert_allclose(done.given_plus[:500], HOME + 1e-3)
    np.testing.assert_allclose(done.given_plus[500:], HOME + 7e-4)


def test_a_motor_falls_back_by_electrical_turns_where_it_is_pulled_harder_than_it_holds() -> None:
    """Standing: by its torque. Turning at half of the speed at which it has none left: by half of that."""
    turn = 4 * STIFF.microstep * STIFF.step_length
    hardest = 2.0 * 0.3 / STIFF.pulley_radius
    ramp = minimum_jerk(0.0, 4e-3, 1.0)
    both = HOME + np.stack([ramp, ramp], axis=1)  # co-contracted: it stays straight
    for top_speed, share in ((None, 1.0), (2.0 * np.diff(ramp).max() / 1e-3 / STIFF.step_length, 0.5)):
        done = spooled(both, STIFF, TrueActuator(torque=0.3, top_speed=top_speed))
        lost = (HOME + ramp) - done.given_plus
        assert lost[-1] > turn / 2
        np.testing.assert_allclose(lost / turn, np.rint(lost / turn), atol=1e-9)
        first = np.flatnonzero(lost > 0.0)[0]
        assert done.spool_plus[first - 1] > share * hardest * 0.99
        assert done.spool_plus[: first - 1].max() <= hardest * 1.001
        speed = np.diff(ramp).max() / 1e-3 if top_speed else 0.0
        assert top_speed is None or done.spool_plus[first - 1] < hardest, speed


LEVELS = {
    "ideal": Loop(plant_segments=2),
    "lagged": Loop(plant_segments=2, actuator=Actuator(level="lagged")),
    "tendon": Loop(
        plant_segments=2,
        control_period=5e-3,
        actuator=Actuator(level="tendon", friction=0.0),
        sensor=Sensor(level="camera"),
    ),
}


def loops(all_loops: list[Loop]) -> Outcome:
    law, count = controller("smc-tracking"), len(all_loops)
    followed = motion(Reference(duration=0.5), WRIST, 1.0, all_loops[0].control_period)
    gains = np.repeat([gains_of(law, "camera")], count, axis=0)
    streams = [(3, 1)] * count
    return rollout(
        law, gains, [followed], np.zeros(count, np.int64), all_loops, WRIST, streams=streams, record=True, threads=1
    )


@pytest.mark.parametrize("level", LEVELS)
def test_a_feature_at_nothing_gives_the_bits_of_the_feature_absent(level: str) -> None:
    """Beside a loop that has them all a loop without any is compiled with them."""
    ideal = LEVELS[level]
    facts = TrueActuator(friction=0.2, sheath=1.0, backlash=1e-4, creep=0.1)
    other = ideal.model_copy(update={"plant": Plant(creep=0.1, end_stop_deg=32.0, actuator=facts)})
    alone, beside = loops([ideal, ideal]), loops([ideal, other])
    assert alone.samples is not None and beside.samples is not None
    assert alone.samples[0].tobytes() == beside.samples[0].tobytes()
    assert alone.samples[0].tobytes() != beside.samples[1].tobytes()


@pytest.mark.parametrize("burst", [1.0, 3.0, 12.0])
def test_frames_are_lost_in_bursts_of_the_length_given(burst: float) -> None:
    sensor = Sensor(level="camera", dropped=0.2)
    seen = readings(100_000, [sensor], [(1,)], [burst])[0, :, 1]
    assert 1.0 - seen.mean() == pytest.approx(0.2, rel=0.1)
    runs = [len(list(each)) for lost, each in itertools.groupby(seen) if lost == 0.0]
    assert np.mean(runs) == pytest.approx(max(burst, 1.25), rel=0.1)


def test_an_end_stop_inside_the_references_range_is_refused() -> None:
    short = LEVELS["ideal"].model_copy(update={"plant": Plant(end_stop_deg=29.0)})
    with pytest.raises(UserError, match="inside the reference's range, 30 deg"):
        loops([short])
