"""What a trial's log shows in numbers, from logs that are written by hand."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pandas as pd
import pytest

from tests.trial.conftest import WRIST, settings_of
from tests.trial.in_two_planes import PLANES, circling
from tests.values import LAST_MOVES, multi_step
from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import DirectionName
from wristctl.config.plant import Push
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.oscillation import WINDOW
from wristctl.study_files.load import load_study
from wristctl.trial.motions import motion_of
from wristctl.trial.trial_results import JUDGED, evaluated, twin
from wristctl.trial.trials import Trial
from wristctl.wrist.directions import DIRECTIONS

PERIOD, HORIZON = 5e-3, 3.0
SETTINGS = settings_of(horizon=HORIZON, control_period=PERIOD)
MOTION = motion_of(SETTINGS, WRIST, "ulnar")
TIME = MOTION.time
PUSH = Push(force=2.0, start=2.0, duration=0.4)
TENSIONS = {1: 2.0, 2: 6.0, 4: 10.0, 5: 14.0}
NAMES = {f"tension_{tendon}": value for tendon, value in TENSIONS.items()}


def course(error: float | Array = 0.0, load: float | Array = 0.3, **columns: Any) -> pd.DataFrame:
    known = {"time": TIME, "theta": MOTION.theta_ref + error, "error": error + 0.0 * TIME, "load": load}
    return pd.DataFrame(known | {"torque_wanted": 0.5, "torque": 0.5} | NAMES | columns)


def pushed_by(push: Push, period: float = PERIOD) -> HwRunSettings:
    """Settings with this push and control period."""
    return SETTINGS.model_copy(update={"push": push, "control_period": period})


def found(
    log: pd.DataFrame, truth: pd.DataFrame | None = None, pushed: bool = False, push: Push = PUSH
) -> dict[str, float]:
    trial = Trial(0, "ulnar", 0, push.force if pushed else 0.0, 0)
    return evaluated(trial, log, MOTION, pushed_by(push), truth)


def bump(start: float, end: float, size: float) -> Array:
    """A load of 0.3 N m with a push on top."""
    return 0.3 + np.where((start <= TIME) & (end > TIME), size, 0.0)


def test_a_constant_error_is_its_own_rmse_and_steady_state() -> None:
    values = found(course(error=0.01))
    assert values["rmse"] == pytest.approx(0.01) and values["steady_state"] == pytest.approx(0.01)
    assert values["iae"] == pytest.approx(0.01 * HORIZON)
    assert values["overshoot"] == pytest.approx(100.0 * 0.01 / MOTION.final, rel=1e-6)


@pytest.mark.parametrize("size", [0.012, 0.001])
def test_a_swing_that_goes_on_at_rest_has_its_size(size: float) -> None:
    values = found(course(error=size * np.sin(2.0 * np.pi * 8.0 * TIME)))
    assert values["oscillation"] == pytest.approx(size, rel=0.05)
    assert found(course(error=0.02))["oscillation"] < 1e-6


def test_no_error_settles_with_the_reference() -> None:
    assert MOTION.rest - 0.15 < found(course())["settling"] < MOTION.rest


@pytest.mark.parametrize(("direction", "peak", "other"), [("ulnar", 12.0, 4.0), ("flexion", 10.0, 6.0)])
def test_a_sides_tension_is_the_mean_of_its_two_tendons(direction: Any, peak: float, other: float) -> None:
    """4 and 5 pull toward ulnar, 2 and 5 toward flexion."""
    values = evaluated(Trial(0, direction, 0, 0.0, 0), course(), MOTION, pushed_by(PUSH), None)
    assert values["peak_tension"] == pytest.approx(peak) and values["chattering"] == 0.0
    assert values["rms_tension"] == pytest.approx(math.sqrt(0.5 * (peak**2 + other**2)))


def test_the_law_is_saturated_where_it_wanted_another_torque() -> None:
    wanted = np.where(TIME < 0.25 * HORIZON, 0.6, 0.5) + 1e-12
    assert found(course(torque_wanted=wanted))["saturation"] == pytest.approx(0.25, abs=0.01)


def test_a_log_sampled_a_little_late_is_judged_on_the_motions_own_grid() -> None:
    late = TIME + 0.4 * PERIOD
    angle = np.interp(late, TIME, MOTION.theta_ref) + 0.01
    assert found(course(time=late, theta=angle))["rmse"] == pytest.approx(0.01, rel=0.01)


@pytest.mark.parametrize("rows", [0, 1, len(TIME) - 1])
def test_a_log_that_is_not_whole_has_no_numbers_but_all_their_names(rows: int) -> None:
    whole = found(course(), pushed=True)
    part = found(course().iloc[:rows], pushed=True)
    assert set(part) == set(whole) and all(map(math.isnan, part.values()))
    assert {f"true_{name}" for name in JUDGED} | {"recovery", "true_recovery", "push_torque"} <= set(part)


def test_without_a_push_there_is_nothing_to_recover_from() -> None:
    values = found(course(load=bump(2.0, 2.4, 0.1)))
    assert all(math.isnan(values[name]) for name in ("recovery", "true_recovery", "push_torque"))


def test_a_push_is_found_in_the_load_and_recovered_from_after_its_end() -> None:
    error = np.where((TIME > 2.0) & (TIME < 2.7), 0.05 * MOTION.final, 0.001 * MOTION.final)
    values = found(course(error=error, load=bump(2.0, 2.4, 0.1)), pushed=True)
    assert values["push_torque"] == pytest.approx(0.1)
    assert values["recovery"] == pytest.approx(0.3, abs=2 * PERIOD)


@pytest.mark.parametrize(("start", "seen"), [(1.55, True), (1.3, False)])
def test_a_person_may_push_half_a_second_early(start: float, seen: bool) -> None:
    values = found(course(load=bump(start, start + 0.1, 0.1)), pushed=True)
    assert (values["push_torque"] == pytest.approx(0.1)) == seen


def test_nobody_pushes_before_the_move_is_over() -> None:
    early = Push(force=2.0, start=MOTION.rest + 0.2, duration=0.2)
    load = bump(MOTION.rest - 0.1, MOTION.rest, 0.1)
    assert math.isnan(found(course(load=load), pushed=True, push=early)["push_torque"])


@pytest.mark.parametrize(("size", "seen"), [(0.0101, True), (-0.0101, True), (0.0099, False)])
def test_a_hundredth_of_a_newton_metre_is_a_push(size: float, seen: bool) -> None:
    values = found(course(load=bump(2.0, 2.4, size)), pushed=True)
    assert math.isnan(values["push_torque"]) != seen and math.isnan(values["recovery"]) != seen


def true_course(error: float | Array) -> pd.DataFrame:
    """The bench's own, twice as dense and not from the same instants."""
    time = np.arange(-0.1, HORIZON + 0.1, 2e-3)
    wrong = np.interp(time, TIME, error + 0.0 * TIME)
    return pd.DataFrame({"time": time, "theta": np.interp(time, TIME, MOTION.theta_ref) + wrong})


def test_the_true_angle_is_judged_beside_the_estimated_one() -> None:
    values = found(course(error=0.01), true_course(0.02))
    assert values["rmse"] == pytest.approx(0.01) and values["true_rmse"] == pytest.approx(0.02, rel=0.01)
    assert values["true_steady_state"] == pytest.approx(0.02, rel=0.01)
    assert math.isnan(values["true_recovery"])
    assert {name for name in values if name.startswith("true_")} == {
        *(f"true_{each}" for each in JUDGED),
        "true_recovery",
    }


def test_the_true_recovery_counts_from_when_the_push_should_end() -> None:
    error = np.where((TIME > 2.0) & (TIME < 2.7), 0.05 * MOTION.final, 0.0)
    values = found(course(), true_course(error), pushed=True)
    assert values["true_recovery"] == pytest.approx(2.7 - 2.4, abs=2 * PERIOD)
    assert math.isnan(values["recovery"]), "the log shows no push"


def test_without_any_truth_nothing_true_is_known() -> None:
    for truth in (None, true_course(0.0).iloc[:0]):
        values = found(course(), truth, pushed=True)
        assert math.isnan(values["true_rmse"]) and values["rmse"] == pytest.approx(0.0, abs=1e-12)


@LAST_MOVES
def test_a_trial_of_several_moves_is_judged_by_its_last_one(before: float, final: float) -> None:
    """A perfect follower, and one that leaves the target by a tenth of the move until half a second after a push."""
    reference, goals = multi_step(before, final, 0.6, HORIZON)
    rows: Array = np.stack([reference, 0.0 * reference, 0.0 * reference])
    time: Array = 1e-3 * np.arange(float(len(reference)))
    tips = np.zeros((len(time), 2))
    followed = Motion(time, Angles.of(rows), tips, goals.move, goals.begin, goals.rest, HORIZON)
    trial = Trial(0, "ulnar", 0, 2.0, 0)

    def judged(error: Array) -> dict[str, float]:
        load = 0.3 + 0.1 * ((time >= 2.0) & (time < 2.4))
        log = pd.DataFrame({"time": time, "theta": reference + error, "error": error, "load": load} | NAMES)
        truth = pd.DataFrame({"time": time, "theta": reference + error})
        return evaluated(trial, log.assign(torque=0.5, torque_wanted=0.5), followed, pushed_by(PUSH, 1e-3), truth)

    perfect = judged(0.0 * time)
    assert perfect["overshoot"] == 0.0 and perfect["settling"] == perfect["true_settling"]
    assert perfect["settling"] == pytest.approx(0.6, abs=2e-3) and perfect["recovery"] == 0.0
    passing = judged(np.where((time > 2.0) & (time < 2.9), 0.1 * goals.move, 0.0))
    assert passing["overshoot"] == pytest.approx(10.0)
    assert passing["recovery"] == pytest.approx(0.5, abs=5e-3) == passing["true_recovery"]
    near = judged(np.where((time > 2.0) & (time < 2.9), 0.019 * goals.move, 0.0))
    far = judged(np.where((time > 2.0) & (time < 2.9), -0.021 * goals.move, 0.0))
    assert near["recovery"] == near["true_recovery"] == 0.0 and far["recovery"] > 0.4 < far["true_recovery"]


def test_a_perfect_follower_of_five_degrees_back_passes_nothing() -> None:
    settings = settings_of(
        reference={"kind": "multi-step", "angles_deg": (30.0, 25.0)}, horizon=HORIZON, control_period=PERIOD
    )
    followed = motion_of(settings, WRIST, "radial")
    log = course(theta=followed.theta_ref)
    values = evaluated(Trial(0, "radial", 0, 0.0, 0), log, followed, pushed_by(PUSH), None)
    assert values["overshoot"] == 0.0 and values["settling"] == pytest.approx(1.0, abs=2 * PERIOD)


@pytest.mark.parametrize("of", ["", "true_"])
@pytest.mark.parametrize("kind", ["minimum-jerk", "circumduction", "diagonal"])
def test_in_two_planes_a_move_settles_when_it_does_in_one_and_a_path_without_an_end_never(kind: str, of: str) -> None:
    """The wrist is a perfect follower, which in one plane settles shortly before its reference rests."""
    reference = {"kind": kind, "angle_deg": 20.0, "duration": 1.0}
    settings = circling(planes=2, reference=reference, directions=("ulnar-flexion",), horizon=2.0)
    followed = motion_of(settings, WRIST, "ulnar-flexion")
    bends = {f"bend_{plane}": column for plane, column in zip(PLANES, followed.bend_ref.T, strict=True)}
    rest = {f"{name}_{plane}": 0.0 for name in ("error", "load", "torque", "torque_wanted") for plane in PLANES}
    log = pd.DataFrame({"time": followed.time, **bends}).assign(**rest, **dict.fromkeys(NAMES, 5.0))
    values = evaluated(Trial(0, "ulnar-flexion", 0, 0.0, 0), log, followed, settings, log)
    settled = values[f"{of}settling"]
    assert math.isnan(settled) if kind == "circumduction" else 0.8 < settled < 1.0


@pytest.mark.parametrize("direction", ["ulnar", "radial", "flexion", "extension"])
def test_a_trials_push_in_simulation_is_the_benchs_and_against_the_bend(direction: DirectionName) -> None:
    """Feedforward does not resist: the angle gives way to the straight side while it is pushed."""
    rows = ({"controller": "feedforward", "gains": "default"},)
    changes = {"rows": rows, "push": {"force": 2.0, "start": 0.6, "duration": 0.4}, "horizon": 1.0}
    settings = settings_of(directions=(direction,), **changes)
    trial = Trial(0, direction, 0, 2.0, 0)
    study = load_study([]).model_copy(update={"hw_run": settings})
    pushed, free = (twin(study, each, None, None).trajectory for each in (trial, trial._replace(push=0.0)))
    sign = DIRECTIONS[direction].sign
    given = sign * (pushed.theta - free.theta)[pushed.time > 0.75]
    assert sign * free.theta[-1] > 0.05 and (given < 0.0).all() and given.min() < -0.003


def test_a_simulation_as_its_observer_sees_it_has_the_errors_and_the_swing_of_that() -> None:
    rows = ({"controller": "feedforward", "gains": "default"},)
    study = load_study([]).model_copy(update={"hw_run": settings_of(directions=("ulnar",), rows=rows, horizon=3.5)})
    true, seen = (twin(study, Trial(0, "ulnar", 0, 0.0, 0), None, None, seen=one) for one in (False, True))
    course = seen.trajectory
    np.testing.assert_array_equal(course.theta, true.trajectory.seen)
    off = course.theta - course.theta_ref
    assert seen.metrics["rmse"] == pytest.approx(math.sqrt(float(np.square(off).mean())), rel=0.02)
    assert seen.metrics["rmse"] != pytest.approx(true.metrics["rmse"], rel=1e-3)
    rest = course.time > course.time[-1] - WINDOW
    line = np.polynomial.Polynomial.fit(course.time[rest], course.theta[rest], 1)(course.time[rest])
    assert 0.5 < seen.metrics["oscillation"] / (0.5 * np.ptp(course.theta[rest] - line)) <= 1.0  # the trend is no line
    assert seen.metrics["peak_tension"] == true.metrics["peak_tension"]


@pytest.mark.slow
def test_a_wrist_that_gravity_bends_out_of_its_rigs_plane_is_simulated_in_both() -> None:
    study = load_study([], ["wrist.gravity_flexion=5", "hw-run={planes: 1, horizon: 0.3}"])
    assert twin(study, Trial(0, "ulnar", 0, 0.0, 0), None, None).trajectory.planes == 2
