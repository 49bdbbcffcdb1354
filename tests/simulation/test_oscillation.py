"""Oscillation at rest on closed forms, and a wrist that leaves its range."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.config.plant import Plant
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.oscillation import (
    FASTEST,
    LIMIT_CYCLE,
    at_rest,
    chatter,
    hunting,
    oscillation,
    oscillation_frequency,
    oscillations,
    sustained,
)
from wristctl.simulation.reference import motion
from wristctl.simulation.repetitions import Repeated, Simulation
from wristctl.simulation.rollout import rollout
from wristctl.simulation.trajectory import Trajectory
from wristctl.study_files.load import load_study

TIME = np.linspace(0.0, 4.999, 5000)
SOFT = ("simulate.controller=smc-tracking", "simulate.gains=camera", "simulate.loop.sensor.level=camera",
    "simulate.loop.actuator={level: tendon, tendon_stiffness: 2000.0}")  # fmt: skip


def course(theta: Array, theta_ref: Array) -> Trajectory:
    nothing: Array = np.zeros(len(theta))
    pair: Array = np.zeros((len(theta), 2))
    return Trajectory(
        "", TIME[: len(theta)], theta, theta[:, None], nothing, theta_ref, theta_ref, pair, pair, nothing, nothing, pair
    )


def test_loops_with_other_references_beside_each_other_are_judged_as_alone() -> None:
    """Some rest at the end, some move slowly or fast, and some go as fast as others, at other phases."""
    rng, time = np.random.default_rng(0), 1e-3 * np.arange(3000)
    rates = [0.0, 0.34, 0.5, 0.5, 0.9, 2.0, 2.0]
    courses = [0.3 * np.sin(2.0 * np.pi * rate * time + phase) for phase, rate in enumerate(rates)]
    references = np.array(
        [*courses, *(motion(Reference(duration=each), WristParameters(), 3.0, 1e-3).theta_ref for each in (1.0, 2.0))]
    )
    which = rng.permutation(np.repeat(np.arange(len(references)), 2))
    swings = rng.uniform(1e-3, 1e-2, (len(which), 1)) * np.sin(
        2.0 * np.pi * rng.uniform(6.0, 30.0, (len(which), 1)) * time
    )
    theta = 0.9 * references[which] + swings
    first = np.zeros(1, np.int64)
    alone = [
        oscillations(each[None], references[None, own], first, 1e-3)[0] for each, own in zip(theta, which, strict=True)
    ]
    assert oscillations(theta, references, which, 1e-3) == pytest.approx(alone, rel=1e-9)
    assert np.ptp(alone) > 1e-3


@pytest.mark.parametrize("frequency", [2.0, 7.0, 40.0, 200.0])
def test_a_swing_about_a_creeping_angle_is_its_amplitude_and_its_frequency(frequency: float) -> None:
    swing = 3e-3 * np.sin(2.0 * np.pi * frequency * TIME)
    done = course(0.5 + 0.01 * TIME + swing, np.full(5000, 0.5))
    assert oscillation(done) == pytest.approx(3e-3, rel=0.05)
    assert oscillation_frequency(done) == pytest.approx(frequency, abs=1.0)


@pytest.mark.parametrize("time_constant", [0.2, 0.5, 2.0])
def test_a_wrist_that_creeps_to_its_place_does_not_swing(time_constant: float) -> None:
    creeping = np.deg2rad(1.0) * np.exp(-(TIME - 4.0) / time_constant)
    assert oscillation(course(0.5 + creeping, np.full(5000, 0.5))) < 0.7 * LIMIT_CYCLE
    swing = 4e-3 * np.sin(2.0 * np.pi * 5.0 * TIME)
    assert oscillation(course(0.5 + creeping + swing, np.full(5000, 0.5))) == pytest.approx(4e-3, rel=0.15)


def test_only_what_is_left_at_rest_is_called_a_limit_cycle() -> None:
    buzz, phase = 4e-3 * np.sin(2.0 * np.pi * 25.0 * TIME), np.pi * TIME
    still, turning = course(0.5 + buzz, np.full(5000, 0.5)), course(0.5 * np.sin(phase) + buzz, 0.5 * np.sin(phase))
    fates = [
        Repeated.once(Simulation(each, {"oscillation": oscillation(each)}, False, 5.0)).fate
        for each in (still, turning)
    ]
    assert fates[0].startswith("LIMIT CYCLE: +-0.23 deg at 25 Hz")
    assert fates[1].startswith("RIPPLE: +-0.24 deg at 25 Hz")


def marked(theta: Array, theta_ref: Array) -> Repeated:
    done = course(theta, theta_ref)
    return Repeated.once(Simulation(done, {"oscillation": oscillation(done)}, False, 5.0))


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("time_constant", [0.05, 0.27, 0.5, 1.0, 3.0])
def test_the_tail_of_a_move_of_any_time_constant_is_no_limit_cycle_and_a_swing_on_it_is(
    time_constant: float, side: float
) -> None:
    """An error of 11 deg is left when the reference comes to rest, 2 s before the end."""
    reference = side * 0.05 * np.minimum(TIME, 3.0)
    tail = side * 0.2 * np.exp(-np.maximum(TIME - 3.0, 0.0) / time_constant)
    slow = marked(reference + tail, reference)
    assert slow.swing == 0.0 and "LIMIT CYCLE" not in slow.fate and "RIPPLE" not in slow.fate
    for frequency in (2.0, 3.3, 5.0, 12.0, 20.0):
        swinging = marked(reference + tail + side * 3e-3 * np.sin(2.0 * np.pi * frequency * TIME), reference)
        assert swinging.swing == pytest.approx(3e-3, rel=0.15) and "limit cycle" in swinging.marks


@pytest.mark.parametrize(("rest", "long"), [(1.0, False), (1.9, False), (2.0, True), (4.0, True)])
def test_a_swing_is_a_limit_cycle_only_where_the_reference_has_rested_for_two_seconds(rest: float, long: bool) -> None:
    reference = 0.1 * np.minimum(TIME, 5.0 - rest)
    done = marked(reference + 4e-3 * np.sin(2.0 * np.pi * 5.0 * TIME), reference)
    assert at_rest(done.first.trajectory) == long == (done.swing > 0.0) == ("limit cycle" in done.marks)
    assert done.fate.startswith("LIMIT CYCLE" if long else "RIPPLE")
    brief = course(np.zeros(1900), np.zeros(1900))
    assert not at_rest(brief), "a course of 1.9 s"


def test_feedforward_behind_a_tip_path_does_not_swing() -> None:
    """It has no feedback; within the second after the path, what is left of the move looks like a swing."""
    path = ["simulate.controller=feedforward", "simulate.gains=default",
            "simulate.reference={kind: tip-path, inverse: closed-form}"]  # fmt: skip
    short, longer = simulate(load_study([], path)), simulate(load_study([], [*path, "simulate.horizon=6"]))
    assert short.metrics["oscillation"][0] > LIMIT_CYCLE and short.swing == 0.0 and short.marks == []
    assert longer.metrics["oscillation"][0] < 0.1 * LIMIT_CYCLE and longer.fate == ""


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_an_answer_to_jumps_is_no_swing_in_motion_and_a_swing_on_a_smooth_motion_is(sign: float) -> None:
    time = np.arange(0.0, 5.0, 5e-3)
    square, sine = (sign * 0.3 * wave(np.sin(2.0 * np.pi * 0.6 * time)) for wave in (np.sign, np.asarray))
    buzz = math.radians(1.0) * np.sin(2.0 * np.pi * 6.0 * time)
    amplitudes = sustained(
        np.array([square, sine, sine]) + buzz * [[1.0], [1.0], [0.0]],
        np.array([square, sine]),
        np.array([0, 1, 1]),
        5e-3,
    )
    assert math.isnan(amplitudes[0])
    assert amplitudes[1:] == pytest.approx([math.radians(1.0), 0.0], rel=0.25, abs=1e-6)


def test_what_was_before_the_last_second_does_not_count() -> None:
    early = np.where(TIME < 4.0, 0.2 * np.sin(30.0 * TIME), 0.0)
    assert oscillation(course(0.5 + early, np.full(5000, 0.5))) < 1e-12
    assert np.isnan(oscillation_frequency(course(np.full(5000, 0.5), np.full(5000, 0.5))))


@pytest.mark.parametrize("frequency", [0.3, 0.5, 2.0])
def test_a_lag_behind_a_sine_is_no_oscillation_and_a_buzz_on_it_is(frequency: float) -> None:
    phase = 2.0 * np.pi * frequency * TIME
    reference, theta = 0.5 * np.sin(phase), 0.45 * np.sin(phase - 0.3) + 0.02 * np.cos(3.0 * phase)
    assert oscillation(course(theta, reference)) < 5e-4 < LIMIT_CYCLE
    buzz = 4e-3 * np.sin(2.0 * np.pi * 25.0 * TIME)
    assert oscillation(course(theta + buzz, reference)) == pytest.approx(4e-3, rel=0.2)


@pytest.mark.parametrize("period", [5.0, 12.0, 20.0])
def test_hunting_is_what_a_long_hold_shows_and_one_second_cannot(period: float) -> None:
    time: Array = np.arange(65_000.0) * 1e-3
    slow = 2e-3 * np.sin(2.0 * np.pi * time / period)
    moved = np.minimum(time, 5.0) * 0.1
    done = replace(course(moved + slow, moved), time=time)
    assert hunting(done) == pytest.approx(2e-3, rel=0.2) and oscillation(done) < 0.6e-3
    assert hunting(replace(done, theta=moved + 1e-4 * time)) < 1e-9
    fading = slow * (time < 30.0)
    assert hunting(replace(done, theta=moved + fading)) < 1e-9, "the first half of the hold does not count"
    short = replace(done, time=time[:24_000], theta=(moved + slow)[:24_000], theta_ref=moved[:24_000])
    assert np.isnan(hunting(short)), "19 s of rest"
    lost = np.where(time < 60.0, moved, np.nan)
    assert np.isnan(hunting(replace(done, theta=lost)))


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_hunting_is_looked_for_in_the_last_half_of_the_hold_and_not_of_the_course(side: float) -> None:
    """The last move is at 25 of 60 s, and dies out within 7 s of it: after the middle of the course."""
    time: Array = np.arange(60_000.0) * 1e-3
    reference: Array = np.where(time >= 25.0, side * 0.5, 0.0)
    settling = reference - side * 0.1 * np.exp(-np.maximum(time - 25.0, 0.0)) * (time >= 25.0)
    nothing: Array = np.zeros(len(time))
    done = replace(course(nothing, nothing), time=time, theta=settling, theta_ref=reference)
    assert hunting(done) < 1e-6
    slow = 2e-3 * np.sin(2.0 * np.pi * time / 8.0)
    assert hunting(replace(done, theta=settling + slow)) == pytest.approx(2e-3, rel=0.2)


def test_tensions_chatter_where_they_cross_their_range_faster_than_a_wrist_follows() -> None:
    """Tensions of both sides that go between 2 and 60 N so many times a second."""
    rates = np.array([0.0, 12.0, FASTEST, 38.0, 500.0, np.nan])
    found = chatter(4.0 * 58.0 * rates, 58.0)
    np.testing.assert_allclose(found, [0.0, 0.0, 0.0, 38.0, 500.0, 0.0])
    assert chatter([4.0 * 58.0 * 30.0] * 2, [58.0, 100.0]).tolist() == pytest.approx([30.0, 0.0]), "each wrist's own"


@pytest.mark.parametrize(("often", "marks"), [(1, []), (2, ["chatters"]), (3, ["chatters"])])
def test_of_several_repetitions_the_middle_one_says_whether_a_loop_chatters(often: int, marks: list[str]) -> None:
    once, rates = marked(np.full(5000, 0.5), np.full(5000, 0.5)), np.where(np.arange(3) >= 3 - often, 300.0, 2.0)
    metrics = {"oscillation": np.zeros(3), "chattering": 4.0 * 58.0 * rates}
    done = replace(once, metrics=metrics, failed=np.zeros(3, bool), until=np.full(3, 5.0), tension_range=58.0)
    assert done.marks == marks and done.chatter == (300.0 if marks else 0.0)
    assert ("CHATTERS" in done.fate) == bool(marks) and ("300 times a second" in done.fate) == bool(marks)


@pytest.mark.parametrize("law", ["super-twisting", "smc-tracking"])
@pytest.mark.parametrize("direction", ["ulnar", "radial"])
@pytest.mark.slow
def test_laws_that_slam_the_tendons_of_a_longer_wrist_are_marked(law: str, direction: str) -> None:
    row = [f"simulate.controller={law}", "simulate.gains=default", f"simulate.direction={direction}"]
    longer = simulate(load_study([], [*row, "wrist.length=0.12"]))
    assert 300.0 < longer.chatter < 500.0 and longer.marks == ["chatters"] and longer.swing == 0.0
    assert simulate(load_study([], row)).marks == []
    free = simulate(load_study([], [*row, "wrist.length=0.12", "simulate.loop.limits=false"]))
    assert "chatters" in free.marks and free.chatter > longer.chatter, "a loop without limits goes by the wrist's"


def test_what_chattered_by_its_integration_step_alone_does_not_chatter() -> None:
    row = ["simulate.controller=ct-dob", "simulate.gains=hardware", "wrist.length=0.12"]
    assert simulate(load_study([], row)).marks == []
    assert simulate(load_study([], [*row, "simulate.loop.substeps=1"])).marks == ["chatters", "not converged"]


def test_of_a_wrist_that_has_failed_or_had_no_second_it_is_not_known() -> None:
    lost = np.where(TIME < 4.5, 0.1, np.nan)
    assert np.isnan(oscillation(course(lost, np.full(5000, 0.1))))
    assert np.isnan(oscillation(course(np.zeros(900), np.zeros(900))))


def test_a_wrist_fails_when_it_leaves_its_range_by_five_degrees_and_not_before() -> None:
    """Springs that lost 40 %, and a law that does not look: the wrist bends on beyond what is wanted."""
    law, period = controller("feedforward"), 1e-3
    wide = WristParameters(range_deg=170.0)
    followed = [motion(Reference(angle_deg=40.0), wide, 2.0, period)]
    loop = Loop(plant=Plant(stiffness_scale=0.6))

    def done(wrist: WristParameters) -> tuple[bool, float, Array]:
        found = rollout(law, np.zeros((1, 0)), followed, np.zeros(1, np.int64), loop, wrist, record=True)
        return bool(found.failed[0]), float(found.until[0]), np.degrees(found.column("theta", 0))

    failed, _, free = done(wide)
    largest = np.abs(free).max()
    assert not failed and 50.0 < largest < 170.0
    for range_deg in (largest - 5.5, largest - 4.5):
        failed, until, theta = done(WristParameters(range_deg=range_deg))
        assert failed == (range_deg + 5.0 < largest)
        if failed:
            outside = int(np.flatnonzero(np.abs(free) > range_deg + 5.0)[0])
            assert until == pytest.approx(outside * period, abs=1.5 * period)
            assert np.isfinite(theta[: outside - 1]).all() and np.isnan(theta[outside + 1 :]).all()


def test_soft_tendons_behind_a_camera_fail_or_swing_by_the_steppers_acceleration() -> None:
    slow = simulate(load_study([], [*SOFT]))
    assert slow.failed.any() or slow.metrics["oscillation"][0] > LIMIT_CYCLE
    assert slow.fate.startswith("FAILED: left its range at") or "LIMIT CYCLE: +-" in slow.fate
    quick = simulate(load_study([], [*SOFT, "simulate.loop.actuator.step_acceleration=400000.0"]))
    assert not quick.failed.any() and quick.metrics["oscillation"][0] < 2.0 * LIMIT_CYCLE


def test_a_pull_that_no_tendon_bears_is_told_and_one_that_it_bears_is_not() -> None:
    row = ["simulate.controller=smc-tracking", "simulate.gains=default", "simulate.reference.kind=step"]
    free = simulate(load_study([], [*row, "simulate.loop.limits=false"]))
    assert "NOT PHYSICAL" in free.fate and f"{free.metrics['peak_tension'][0]:.3g} N" in free.fate
    assert simulate(load_study([], row)).fate == ""


@pytest.mark.parametrize(("halving", "swings"), [(0.1, False), (0.25, False), (2.0, True), (math.inf, True)])
def test_a_swing_that_dies_out_after_a_push_is_none(halving: float, swings: bool) -> None:
    """0.6 deg at the begin of the last second, with its half-life [s]."""
    reference = np.full(len(TIME), 0.5)
    age = np.maximum(0.0, TIME - 4.0)
    swing = np.deg2rad(0.6) * np.cos(2.0 * np.pi * 4.0 * age) * 0.5 ** (age / halving) * (TIME >= 4.0)
    left = oscillation(course(reference + swing, reference))
    assert (left > LIMIT_CYCLE) == swings
    if math.isinf(halving):
        assert left == pytest.approx(np.deg2rad(0.6), rel=0.05)
    moving = 0.5 + 0.2 * np.sin(2.0 * np.pi * 0.5 * TIME)
    assert oscillation(course(moving + swing, moving)) > oscillation(course(moving, moving)), "only at rest"
