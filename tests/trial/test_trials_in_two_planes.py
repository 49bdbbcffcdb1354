"""Trials of a wrist that bends in two planes at once: it follows, is pushed, loses a tendon, and is logged."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pydantic import ValidationError

from tests.oracles.course_metrics import of_course
from tests.trial.conftest import WRIST, Done
from tests.trial.in_two_planes import CIRCLING, PLANES, THREE, THREE_AT_ZERO, circling, performed, rmse, true_errors
from wristctl.commands.adoption import with_planes
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.simulation.motion import Motion
from wristctl.study_files.load import load_study
from wristctl.trial.homing import Zero
from wristctl.trial.motions import back, motion_of
from wristctl.trial.residuals import Limit, limits_of
from wristctl.trial.rig_belief import TOWARD
from wristctl.trial.run_limits import Logged, stop_of
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.trial.tracking import Tracking
from wristctl.trial.trial_results import evaluated, logged_course, twin
from wristctl.trial.trials import Trial, motions_of, trials_of

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def round_trip(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A sound trial, and the way back."""
    return performed(tmp_path_factory.mktemp("round"))


@pytest.fixture(scope="module")
def cut(tmp_path_factory: pytest.TempPathFactory) -> Done:
    """A trial that loses tendon 4 while it goes round."""
    lost = {"kind": "tendon-detached", "at": 0.8, "axis": 2}
    bench = {"motors": {"slack": (0.0,) * 4}, "person": {"takes": 0.1}, "faults": (lost,)}
    return performed(tmp_path_factory.mktemp("cut"), bench=bench)


def test_the_true_wrist_goes_round_within_half_a_degree_in_both_planes(round_trip: Done) -> None:
    assert round_trip.error is None and round_trip.experiment.outcomes == {0: "ok"}
    assert round_trip.experiment.odd == {0: ""}
    assert (rmse(true_errors(round_trip)) < 0.4).all()
    log = round_trip.table("log")
    assert np.degrees(log[[f"bend_{p}" for p in PLANES]].abs().max()).min() > 10.0, "in both planes"


def test_three_tendons_take_the_true_wrist_round_as_its_simulation_goes(tmp_path: Path) -> None:
    """The board's fourth axis winds none of them and stands; the log has three tendons."""
    done = performed(tmp_path, zero=THREE_AT_ZERO, wrist=THREE)
    assert done.error is None and done.experiment.outcomes == {0: "ok"} and done.experiment.odd == {0: ""}
    log, truth = done.table("log"), done.table("truth")
    assert np.degrees(log[[f"bend_{p}" for p in PLANES]].abs().max()).min() > 10.0, "in both planes"
    for name, table in (("tension", log), ("position", log), ("sent", log), ("pull", truth)):
        assert [column for column in map(str, table) if column.startswith(f"{name}_")] == [
            f"{name}_{k}" for k in (1, 2, 3)
        ]
    assert done.bench.motion().steps[3] == 0 and min(np.ptp(log[f"position_{k}"]) for k in (1, 2, 3)) > 100
    study = load_study([], ["wrist.tendons=three"]).model_copy(update={"hw_run": circling()})
    simulation = twin(study, Trial(0, "circumduction", 0, 0.0, 0), None, None)
    simulated, true = np.degrees(simulation.trajectory.error), true_errors(done)
    assert (rmse(true) < 0.4).all() and rmse(simulated) == pytest.approx(rmse(true), rel=0.25)


@pytest.mark.parametrize("axis", range(3))
def test_of_three_tendons_the_one_that_is_lost_is_named(tmp_path: Path, axis: int) -> None:
    lost = {"kind": "tendon-detached", "at": 0.2 + 0.3 * axis, "axis": axis}
    bench = {"motors": {"slack": (0.0,) * 4}, "person": {"takes": 0.1}, "faults": (lost,)}
    done = performed(tmp_path, zero=THREE_AT_ZERO, wrist=THREE, bench=bench)
    assert isinstance(done.error, SafetyStop) and done.experiment.outcomes[0] != "ok"
    assert f"axis {axis} (tendon {axis + 1})" in done.error.what


def test_a_trial_does_not_count_whose_resting_tendon_is_lost(tmp_path: Path) -> None:
    """It follows its reference as if nothing were, and so does the way back; small moves after it find the tendon."""
    lost = {"kind": "tendon-detached", "at": 0.1, "axis": 1}
    bench = {"motors": {"slack": (0.0,) * 4}, "person": {"takes": 0.1}, "faults": (lost,)}
    done = performed(
        tmp_path, bench=bench, reference={"duration": 0.5, "angle_deg": 10.0}, directions=("ulnar-flexion",), back=1.0
    )
    assert (rmse(true_errors(done)) < 1.0).all()
    assert isinstance(done.error, SafetyStop) and "axis 1 (tendon 2) bends the wrist by" in done.error.what
    assert done.experiment.outcomes[0].startswith("after it: axis 1 (tendon 2) bends the wrist by")


def test_a_fast_trial_and_its_simulation_agree(tmp_path: Path) -> None:
    """Spools of both move with the reference, neither ahead of it: 120 deg/s at most, ticks of 10 ms."""
    thrown: dict[str, Any] = {
        "reference": {"kind": "dart-thrower", "angle_deg": 30.0, "turn": 1.5}, "horizon": 1.8,
        "rows": ({"controller": "smc-tracking", "gains": "hardware"},),
    }  # fmt: skip
    done, settings = performed(tmp_path, **thrown), circling(**thrown)
    assert done.error is None
    study, followed = load_study([]).model_copy(update={"hw_run": settings}), motion_of(settings, WRIST, "dart-thrower")
    simulation = twin(study, Trial(0, "dart-thrower", 0, 0.0, 0), None, None)
    simulated, true = np.degrees(simulation.trajectory.error), true_errors(done)
    assert rmse(simulated) == pytest.approx(rmse(true), rel=0.2)
    ahead = [lead(errors, followed) for errors in (simulated, true)]
    assert np.abs(ahead[0] - ahead[1]).max() < 1.5e-3


def lead(errors: np.ndarray, followed: Motion) -> np.ndarray:
    """Time (2,) [s] by which each plane's bend is ahead of its reference, of errors (T, 2) [deg]."""
    times = []
    for plane, (bend, rate, _) in enumerate(np.degrees(followed.angles.rows.reshape(2, 3, -1))):
        terms = np.stack([rate, bend], axis=1)  # a wrong gain is no lead
        times.append(np.linalg.lstsq(terms, errors[:, plane])[0][0])
    return np.array(times)


def test_every_frame_is_logged_with_its_camera_and_fused_where_it_was_taken(round_trip: Done) -> None:
    frames, truth = round_trip.table("frames"), round_trip.table("truth")
    for plane in PLANES:
        seen = frames[(frames["plane"] == plane) & (frames["verdict"] == "ok")]
        assert len(seen) > 60
        true = np.interp(seen["captured"], truth["time"], truth[f"bend_{plane}"])
        within = (seen["captured"] > 0.05).to_numpy()
        assert np.degrees(np.abs(seen["bend"] - true)[within]).max() < 0.25, "the other plane's bend is taken out"
    ulnar, flexion = (set(frames.loc[frames["plane"] == plane, "captured"].round(6)) for plane in PLANES)
    assert not ulnar & flexion, "the cameras are not synchronous"


def test_it_comes_back_to_zero_along_a_straight_line(round_trip: Done) -> None:
    between = round_trip.table("between")
    wanted = between[[f"bend_ref_{p}" for p in PLANES]].to_numpy()[-60:]
    assert np.abs(between[[f"bend_{p}" for p in PLANES]].to_numpy()[-1]) == pytest.approx([0.0, 0.0], abs=0.01)
    away = wanted[np.hypot(*wanted.T) > 0.01]
    assert np.ptp(np.arctan2(away[:, 1], away[:, 0])) < 1e-9 and len(away) > 10


def test_a_rows_metrics_are_those_of_its_log_by_the_formulas_of_simulation(round_trip: Done) -> None:
    log, truth = round_trip.table("log"), round_trip.table("truth")
    followed = round_trip.experiment.motions["circumduction"]
    trial = Trial(0, "circumduction", 0, 0.0, 0)
    values = evaluated(trial, log, followed, circling(), truth)
    course = logged_course(log, followed, WRIST)
    assert values["rmse"] == of_course(course)["rmse"]
    assert values["true_rmse_ulnar"] == pytest.approx(np.radians(rmse(true_errors(round_trip))[0]), rel=1e-3)
    assert math.hypot(values["true_rmse_ulnar"], values["true_rmse_flexion"]) == pytest.approx(values["true_rmse"])
    assert math.isnan(values["recovery"]) and math.isnan(values["push_torque"])
    short = evaluated(trial, log[log["time"] < 1.0], followed, circling(), truth)
    assert all(map(math.isnan, short.values()))


def test_the_same_seed_gives_the_same_bytes(round_trip: Done, tmp_path: Path) -> None:
    again = performed(tmp_path)
    for file in round_trip.folder.iterdir():
        assert (again.folder / file.name).read_bytes() == file.read_bytes(), file.name


def test_a_lost_tendon_stops_the_motors_and_is_named_by_where_the_wrist_goes(cut: Done) -> None:
    assert isinstance(cut.error, SafetyStop)
    stop = cut.experiment.stop
    assert stop is not None and stop.halt.verified and stop.time is not None
    assert 0.8 < stop.time < 1.4
    assert "likely the tendon of axis 2 (tendon 4) is off its pulley" in stop.reason
    assert "axis 0" not in stop.reason and "axis 3" not in stop.reason


def test_residuals_of_the_log_give_the_same_stop_again(cut: Done) -> None:
    settings = circling()
    limits: tuple[Limit, ...] = limits_of(settings.within(WRIST))
    again = stop_of(Logged(cut.table("residuals"), limits, settings, WRIST))
    assert again is not None and again.trial == 0
    begin = cut.table("log").query("trial == 0").iloc[0]
    stop = cut.experiment.stop
    assert stop is not None and stop.time is not None
    assert again.clock - (begin["clock"] - begin["time"]) == pytest.approx(stop.time, abs=0.03)
    assert not {"across", "doubted"} & set(cut.table("residuals").columns), "the other camera sees it"


def test_norms_of_both_planes_are_what_is_limited(round_trip: Done) -> None:
    values, log = round_trip.table("residuals"), round_trip.table("log")
    of_trial = values[values["trial"] == 0].iloc[: len(log)]
    for name, column in (("angle", "bend"), ("rate", "rate"), ("load", "load")):
        norm = np.hypot(*(log[f"{column}_{plane}"].to_numpy() for plane in PLANES))
        np.testing.assert_allclose(of_trial[name].to_numpy(), norm, rtol=1e-9)


def test_a_push_from_the_side_is_held_and_stops_nothing(tmp_path: Path) -> None:
    push = {"force": 2.0, "start": 0.5, "duration": 0.3}
    done = performed(tmp_path, push=push, push_toward_deg=130.0, without_push=False)
    assert done.error is None and done.experiment.odd == {0: ""}
    errors = true_errors(done)
    assert (rmse(errors) < 0.5).all() and 0.3 < np.hypot(*errors.T).max() < 2.0


def test_a_diagonal_direction_bends_alike_in_both_planes(tmp_path: Path) -> None:
    move = {"kind": "minimum-jerk", "angle_deg": 10.0, "duration": 0.5}
    done = performed(tmp_path, planes=2, reference=move, directions=("radial-flexion",), horizon=0.9)
    assert done.error is None
    log = done.table("log").iloc[-1]
    ends = np.degrees([log["bend_ulnar"], log["bend_flexion"]])
    assert ends == pytest.approx(10.0 * np.array([-1.0, 1.0]) / math.sqrt(2.0), abs=0.4)


def test_stored_positions_of_a_rig_with_one_camera_are_refused(tmp_path: Path) -> None:
    done = performed(tmp_path, zero=Zero((1, 1, 1, 1), (1380.0,) * 4, (0.0,), (0.0,) * 4))
    assert isinstance(done.error, UserError) and done.error.what == "the calibration knows 1 cameras of 2"
    assert not any(done.bench.motion().steps)


def test_a_path_in_two_planes_makes_the_rig_one_in_two_planes() -> None:
    def rig(**changes: Any) -> HwRunSettings:
        given = {key: value for key, value in CIRCLING.items() if key != "planes"} | changes
        return with_planes(Study(hw_run=HwRunSettings.model_validate(given))).hw_run

    assert rig().planes == 2 and motions_of(rig()) == ["circumduction"]
    assert rig(push_toward_deg=30.0).push_toward_deg == 30.0
    straight = {"kind": "minimum-jerk"}
    one = rig(reference=straight)
    assert one.planes == 1 and len(motions_of(one)) == 4
    with pytest.raises(UserError, match="circumduction bends in two planes, and the rig in one"):
        rig(planes=1)
    for alike in ({}, {"planes": 1}):
        with pytest.raises((UserError, ValidationError), match="ulnar-flexion lies between two planes"):
            rig(reference=straight, directions=("ulnar-flexion",), **alike)
        with pytest.raises((UserError, ValidationError), match="push_toward_deg is of a rig in two planes"):
            rig(reference=straight, push_toward_deg=30.0, **alike)
    assert rig(real_time=True).planes == 2


def test_directions_are_shuffled_together_where_nobody_turns_the_wrist() -> None:
    settings = circling(planes=2, reference={"kind": "minimum-jerk"}, directions=tuple(TOWARD), repetitions=2)
    trials = trials_of(settings, np.random.default_rng(0))
    assert len(trials) == 16 and {trial.direction for trial in trials} == set(TOWARD)
    assert {trial.plane for trial in trials[:8]} >= {"", "ulnar", "flexion"}


def test_one_set_up_serves_trials_in_all_directions(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    begun: list[object] = []
    tracking = EmulatedTestbed.tracking

    def counted(testbed: EmulatedTestbed) -> Tracking:
        begun.append(testbed)
        return tracking(testbed)

    monkeypatch.setattr(EmulatedTestbed, "tracking", counted)
    short = {"kind": "minimum-jerk", "angle_deg": 8.0, "duration": 0.3}
    toward = ("ulnar", "flexion", "ulnar-flexion")
    done = performed(tmp_path, planes=2, reference=short, directions=toward, horizon=0.5, back=0.3)
    assert done.error is None and list(done.experiment.outcomes.values()) == ["ok"] * 3
    assert len(begun) == 1


@pytest.mark.parametrize(("name", "degrees"), TOWARD.items())
def test_a_move_goes_where_its_direction_says(name: str, degrees: float) -> None:
    settings = circling(planes=2, reference={"kind": "minimum-jerk", "angle_deg": 20.0}, directions=(name,))
    motion = motion_of(settings, WRIST, name)
    toward = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    assert motion.final == pytest.approx(math.radians(20.0) * toward, abs=1e-6)
    pushed = Trial(0, name, 0, 2.0, 0).disturbances(settings, motion)
    against = math.radians(pushed.toward_deg)
    assert pushed.push.force == 2.0 and np.array([math.cos(against), math.sin(against)]) == pytest.approx(-toward)


def test_a_path_beyond_the_wrists_range_is_refused_before_anything_moves() -> None:
    settings = circling(reference={"kind": "circle", "angle_deg": 60.0, "turn": 1.2})
    with pytest.raises(UserError, match="a bend of 60 deg is beyond the wrist's range"):
        motion_of(settings, WRIST, "circle")


def test_the_way_back_is_straight_and_ends_at_rest() -> None:
    motion = back(np.array([0.3, -0.1]), 1.0, 0.2, 0.01, 2)
    bends: Any = motion.bend_ref
    assert bends[0] == pytest.approx([0.3, -0.1]) and bends[-1] == pytest.approx([0.0, 0.0])
    assert np.allclose(bends[:, 1], -bends[:, 0] / 3.0) and not np.any(
        [motion.rate_ref[-1], motion.acceleration_ref[-1]]
    )
