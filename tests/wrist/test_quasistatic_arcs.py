"""Rest of arcs on elastic tendons: closed forms, symmetries, and the package's own friction in one plane."""

from __future__ import annotations

import math

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.quasistatic_arcs import SMOOTH, QuasistaticArcs
from wristctl.wrist.tendon_layout import TendonLayout

RADIUS, STIFF = 0.05, 8.0
TOWARD = np.array([[math.cos(angle), math.sin(angle)] for angle in np.radians([0.0, 120.0, 240.0])])
ENDS = np.array([1, 1, 1])


def _one(
    variants: int = 1, arms: Array = RADIUS * TOWARD, ends: Array = ENDS, lengths: tuple[float, ...] = (),
    spans: int = 0, **ways: float,
) -> QuasistaticArcs:  # fmt: skip
    values = {"friction": 0.0, "sheath": 0.0, "presliding": 1e-4, "inner": 0.0, "inner_presliding": 0.01} | ways
    values = {"creep": 0.0, "creep_time": 1.0, "damping": 0.0} | values
    rows = {name: np.full(variants, value) for name, value in values.items()}
    count, tendons = arms.shape[1], len(arms)
    return QuasistaticArcs(
        arms=np.broadcast_to(arms, (variants, tendons, count)), ends=ends, stiffness=np.ones((variants, count)),
        tendon=np.full((variants, tendons), STIFF / RADIUS**2), lengths=lengths, spans=spans, smooth=SMOOTH, **rows,
    )  # fmt: skip


def _reeled(toward: Array) -> Array:
    """Lengths (1, T, 3) that would bend it so far (T, 2), were tendons stiff, and 1 cm more on each."""
    return (RADIUS * toward @ TOWARD.T + 0.01)[None]


def _pause(samples: int, step: float = 0.1) -> Array:
    return np.r_[math.nan, np.full(samples - 1, step)]


@pytest.mark.parametrize("angle", [0.3, 2.0, -1.4])
def test_taut_tendons_bend_an_arc_as_springs_in_parallel_do(angle: float) -> None:
    bend = 0.3 * np.array([[math.cos(angle), math.sin(angle)]])
    (rest,) = _one().rest(_reeled(bend), _pause(1))
    assert rest[0] == pytest.approx(1.5 * STIFF / (1.0 + 1.5 * STIFF) * bend[0], rel=1e-3)


def test_a_slack_tendon_pulls_nowhere_and_an_arc_turns_with_its_tendons() -> None:
    alone = np.array([[[0.02, -1.0, -1.0]], [[-1.0, 0.02, -1.0]], [[-1.0, -1.0, 0.02]]])
    rests = np.concatenate([_one().rest(reeled[None], _pause(1))[0] for reeled in alone])
    assert rests == pytest.approx(0.4 * STIFF / (1.0 + STIFF) * TOWARD, rel=2e-3, abs=1e-6)


def test_inner_friction_holds_a_bend_that_slack_tendons_let_go_and_tendon_friction_does_not() -> None:
    up = np.linspace(0.0, 0.4, 40)[:, None] * [[1.0, 0.0]]
    slack = np.full((1, 10, 3), -0.1)
    reeled = np.concatenate([_reeled(up), slack], axis=1)
    held = _one(inner=0.05).rest(reeled, _pause(50))[0]
    let_go = _one(friction=0.5, sheath=0.5).rest(reeled, _pause(50))[0]
    assert held[-1, 0] == pytest.approx(0.05, rel=0.15) and abs(let_go[-1, 0]) < 1e-4
    assert 0.1 < let_go[39, 0] < held[39, 0] < 0.4


def test_inner_friction_takes_its_torque_whatever_the_direction_and_begins_along_the_way() -> None:
    for angle in (0.0, 0.7, -2.1):
        way = np.linspace(0.0, 0.4, 30)[:, None] * [[math.cos(angle), math.sin(angle)]]
        free, held = (_one(inner=inner).rest(_reeled(way), _pause(30))[0, -1] for inner in (0.0, 0.1))
        lost = (free - held) @ [math.cos(angle), math.sin(angle)]
        assert lost == pytest.approx(0.1 / (1.0 + 1.5 * STIFF), rel=2e-3)
        assert (free - held) @ [-math.sin(angle), math.cos(angle)] == pytest.approx(0.0, abs=1e-8)


def test_tendon_friction_opposes_the_path_by_the_capstan_exponent() -> None:
    one = np.array([[RADIUS], [-RADIUS]]) @ [[1.0, 0.0]]
    both = np.concatenate([np.linspace(0.0, 0.3, 60), np.linspace(0.3, 0.1, 60)])
    reeled = np.stack([RADIUS * both, -0.05 - RADIUS * both], axis=1)[None]  # the antagonist is slack
    arcs = _one(arms=one, ends=np.array([1, 1]), friction=0.4, sheath=0.3, presliding=2e-4)
    bend = arcs.rest(reeled, _pause(120))[0, :, 0]
    for sample, sign in ((59, 1.0), (119, -1.0)):
        q = bend[sample]
        share = math.exp(-sign * (0.4 * 0.5 * q + 0.3))
        assert q == pytest.approx(STIFF * share * (both[sample] - q), rel=1e-3)


def test_creep_lets_a_held_bend_grow_by_the_relaxed_stiffness() -> None:
    arcs = _one(arms=np.array([[RADIUS, 0.0]]), ends=np.array([1]), creep=0.5, creep_time=2.0)
    bend = arcs.rest(np.full((1, 400, 1), 0.02), _pause(400))[0, :, 0]
    assert bend[0] == pytest.approx(0.4 * STIFF / (1.0 + STIFF), rel=1e-3)
    assert bend[-1] == pytest.approx(0.4 * STIFF / (0.5 + STIFF), rel=1e-3)
    half = bend[0] + 0.5 * (bend[-1] - bend[0])
    assert 0.8 < np.interp(half, bend, 0.1 * np.arange(400)) < 1.6


def test_damping_lets_a_bend_come_late_by_its_time_over_the_whole_stiffness() -> None:
    arcs = _one(arms=np.array([[RADIUS, 0.0]]), ends=np.array([1]), damping=1.8)
    step, samples = 0.002, 500
    reeled = np.r_[0.0, np.full(samples - 1, 0.02)][None, :, None]
    bend = arcs.rest(reeled, _pause(samples, step))[0, :, 0]
    end = 0.4 * STIFF / (1.0 + STIFF)
    late = 1.8 / (1.0 + STIFF)
    time = step * np.arange(samples)
    assert bend == pytest.approx(end * -np.expm1(-time / late), abs=0.01 * end)


def test_pulls_at_the_spools_balance_the_arc() -> None:
    bend = 0.3 * np.array([[0.6, -0.8]])
    reeled = _reeled(bend)
    rest = _one().rest(reeled, _pause(1))
    pulls = _one().pulls(reeled, rest)[0, 0]
    assert RADIUS * pulls @ TOWARD == pytest.approx(rest[0, 0], rel=1e-6) and (pulls >= 0.0).all()


def test_variants_and_recordings_one_after_the_other_are_as_alone() -> None:
    way = np.linspace(0.0, 0.3, 20)[:, None] * [[0.6, -0.8]]
    reeled = np.concatenate([_reeled(way), _reeled(way[::-1])], axis=1)
    pause = np.r_[_pause(20), _pause(20)]
    one, three = (_one(variants=n, friction=0.3, sheath=0.2, inner=0.03, creep=0.2) for n in (1, 3))
    alone = one.rest(reeled[:, 20:], _pause(20))[0]
    both = three.rest(np.concatenate([reeled] * 3), pause)
    assert both[0, 20:] == pytest.approx(alone, abs=1e-8)
    assert both[2] == pytest.approx(both[0], abs=1e-8)


def test_a_tendon_that_ends_with_the_first_arc_bends_that_alone_and_a_long_one_both_alike() -> None:
    arms = RADIUS * np.array([[1.0, 0.0, 0.0, 0.0], [1.0, 0.0, 1.0, 0.0]])
    arcs = _one(arms=arms, ends=np.array([1, 2]))
    short = arcs.rest(np.array([[[0.02, -1.0]]]), _pause(1))[0, 0]
    long = arcs.rest(np.array([[[-1.0, 0.02]]]), _pause(1))[0, 0]
    assert short == pytest.approx([0.4 * STIFF / (1.0 + STIFF), 0.0, 0.0, 0.0], rel=2e-3, abs=1e-6)
    assert long == pytest.approx([*[0.4 * STIFF / (1.0 + 2.0 * STIFF), 0.0] * 2], rel=2e-3, abs=1e-6)


def test_an_arc_that_shortens_bends_less() -> None:
    reeled = np.array([[[0.02, 0.01, 0.01]]])
    stiff = _one().rest(reeled, _pause(1))[0, 0]
    soft = _one(arms=RADIUS * np.column_stack([TOWARD, np.ones(3)])).rest(reeled, _pause(1))[0, 0]
    assert 0.0 < soft[0] < stiff[0] and soft[2] > 0.0


@pytest.mark.parametrize("spans", [1, 4])
def test_tendons_straight_between_discs_are_as_long_as_those_of_the_layout(spans: int) -> None:
    wrist = WristParameters(discs=spans + 1)
    layout = TendonLayout.of(wrist)
    places = np.array(
        [[place.radius * math.cos(place.angle), place.radius * math.sin(place.angle)] for place in layout.places]
    )
    arcs = _one(
        arms=places, ends=np.ones(len(places), int), lengths=(wrist.length,), spans=spans,
    )  # fmt: skip
    bend = np.array([0.5, -0.3])
    shorter = arcs.reeled_by(bend[None, None])[0, 0]
    angle = math.hypot(*bend)
    straight = math.sin(0.5 * angle / spans) / (0.5 * angle / spans)
    assert shorter == pytest.approx(wrist.length - (wrist.length - places @ bend) * straight, rel=1e-12)
    step = 1e-5
    for k in range(2):
        further = bend + step * np.eye(2)[k]
        by_bend = (arcs.reeled_by(further[None, None])[0, 0] - shorter) / step
        arms = layout.moment_arms(bend, wrist.length, wrist.discs)[:, k]
        assert by_bend == pytest.approx(arms, rel=1e-3)
    reeled = np.full((1, 1, len(places)), 1e-3) + (places @ bend)[None, None]
    rest = arcs.rest(reeled, _pause(1))
    pulls = arcs.pulls(reeled, rest)[0, 0]
    torque = pulls @ layout.moment_arms(rest[0, 0], wrist.length, wrist.discs)
    assert torque == pytest.approx(rest[0, 0], rel=1e-6), "springs and tendons balance"


def test_inertia_lets_a_bend_swing_with_its_own_period_and_damping() -> None:
    damping, inertia, step, samples = 0.4, 0.05, 0.002, 800
    arcs = _one(arms=np.array([[RADIUS, 0.0]]), ends=np.array([1]), damping=damping, inertia=inertia)
    reeled = np.r_[np.zeros(5), np.full(samples - 5, 0.02)] + 0.05  # its tendon stays taut
    bend = arcs.rest(reeled[None, :, None], _pause(samples, step))[0, :, 0]
    begin, end = (STIFF / (1.0 + STIFF) * length / RADIUS for length in (0.05, 0.07))
    decay = 0.5 * damping / inertia
    swing = math.sqrt((1.0 + STIFF) / inertia - decay**2)
    time = step * (np.arange(samples - 5) + 0.5)
    expected = end - (end - begin) * np.exp(-decay * time) * (
        np.cos(swing * time) + decay / swing * np.sin(swing * time)
    )
    assert bend[5:] == pytest.approx(expected, abs=0.02 * (end - begin))
    assert bend.max() - end > 0.1 * (end - begin)
