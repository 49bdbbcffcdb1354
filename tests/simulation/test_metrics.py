"""Metrics on signals whose metrics are known in closed form."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.values import LAST_MOVES, multi_step, one_move
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.metrics import METRICS, metrics_of, of_trajectory, summed
from wristctl.simulation.reference import motion
from wristctl.simulation.trajectory import Trajectory
from wristctl.study_files.load import load_study

PERIOD, HORIZON = 1e-4, 5.0
TIME = np.arange(float(round(HORIZON / PERIOD))) * PERIOD
STILL = np.full((len(TIME), 2), 3.0)


def test_first_order_response_has_its_closed_form_metrics() -> None:
    tau, final = 0.2, 0.5
    theta = final * (1 - np.exp(-TIME / tau))
    found = metrics_of(PERIOD, theta, np.full_like(TIME, final), STILL, one_move(final, 0.0, HORIZON))
    assert found["rmse"] == pytest.approx(final * math.sqrt(tau / 2 / HORIZON), rel=1e-3)
    assert found["settling"] == pytest.approx(tau * math.log(50), abs=2 * PERIOD)
    assert found["settling_5"] == pytest.approx(tau * math.log(20), abs=2 * PERIOD)
    assert found["iae"] == pytest.approx(final * tau, rel=1e-3)
    assert found["overshoot"] == 0.0
    after = HORIZON - found["settling"]
    assert found["rmse_settled"] == pytest.approx(0.02 * final * math.sqrt(tau / 2 / after), rel=1e-2)
    assert found["rmse_move"] == found["rmse"]


def test_settling_after_the_motion_is_what_the_motion_leaves() -> None:
    tau, final = 0.2, 0.5
    late = final * (1 - np.exp(-TIME / tau))
    for rest, left in ((0.0, tau * math.log(50)), (0.5, tau * math.log(50) - 0.5), (1.0, 0.0)):
        found = metrics_of(PERIOD, late, np.full_like(TIME, final), STILL, one_move(final, rest, HORIZON))
        assert found["settling_after"] == pytest.approx(left, abs=2 * PERIOD), "a perfect follower has none left"
    never = metrics_of(PERIOD, 0.9 * late, np.full_like(TIME, final), STILL, one_move(final, 1.0, HORIZON))
    assert math.isnan(never["settling_after"])


def test_underdamped_response_has_its_closed_form_overshoot() -> None:
    zeta, w = 0.3, 8.0
    wd = w * math.sqrt(1 - zeta**2)
    for final in (0.4, -0.4):
        shape = 1 - np.exp(-zeta * w * TIME) * (np.cos(wd * TIME) + zeta * w / wd * np.sin(wd * TIME))
        found = metrics_of(PERIOD, final * shape, np.full_like(TIME, final), STILL, one_move(final, 0.0, HORIZON))
        assert found["overshoot"] == pytest.approx(100 * math.exp(-math.pi * zeta / math.sqrt(1 - zeta**2)), rel=1e-4)


@LAST_MOVES
@pytest.mark.parametrize("passing", [0.1, 0.0, -0.1])
def test_a_last_move_is_judged_by_its_own_size_and_side(before: float, final: float, passing: float) -> None:
    """From 2 s on; for 0.5 s the angle is beyond the target by a tenth of the move, or short of it."""
    reference, goals = multi_step(before, final, 2.0, 5.0)
    time = np.arange(5000) * 1e-3
    theta = reference + passing * goals.move * ((time > 2.0) & (time < 2.5))
    found = metrics_of(1e-3, theta, reference, STILL[:5000], goals)
    assert found["overshoot"] == pytest.approx(max(0.0, 100.0 * passing), abs=1e-9)
    assert found["settling"] == pytest.approx(2.5 if passing else 2.0, abs=2e-3)
    assert found["settling_after"] == pytest.approx(0.5 if passing else 0.0, abs=2e-3)
    near = reference + 0.019 * goals.move * (time > 2.0)
    assert metrics_of(1e-3, near, reference, STILL[:5000], goals)["settling"] == pytest.approx(2.0, abs=2e-3)
    off = reference + 0.021 * goals.move * (time > 2.0)
    assert math.isnan(metrics_of(1e-3, off, reference, STILL[:5000], goals)["settling"])


@pytest.mark.parametrize("angles", ["[20, 12]", "[-20, -12]", "[10, -10]", "[10, 25]"])
def test_a_rollout_is_judged_as_its_recorded_course(angles: str) -> None:
    lines = [f"simulate.reference={{kind: multi-step, angles_deg: {angles}}}", "simulate.horizon=3.0"]
    study = load_study([], [*lines, "simulate.controller=pid-dob", "simulate.loop.plant_segments=1"])
    done = simulate(study).first
    course = done.trajectory
    followed = motion(study.simulate.reference, study.wrist, 3.0, 1e-3)
    found = metrics_of(1e-3, course.theta, course.theta_ref, course.tension, followed.goals)
    names = set(found) - {"saturation", "motor_limited"}
    assert {name: found[name] for name in names} == {name: pytest.approx(done.metrics[name]) for name in names}
    assert 0.0 <= found["overshoot"] < 30.0 and 1.0 < found["settling"] < 3.0


def test_constant_error_is_its_own_rmse_and_steady_state() -> None:
    found = metrics_of(PERIOD, np.full_like(TIME, 0.492), np.full_like(TIME, 0.5), STILL, one_move(0.5, 0.0, HORIZON))
    assert found["rmse"] == pytest.approx(0.008)
    assert found["steady_state"] == pytest.approx(0.008)
    assert found["settling"] == 0.0 and found["rmse_settled"] == pytest.approx(0.008, rel=1e-4)


def test_what_never_enters_the_band_never_settles() -> None:
    found = metrics_of(PERIOD, np.full_like(TIME, 0.48), np.full_like(TIME, 0.5), STILL, one_move(0.5, 0.0, HORIZON))
    assert math.isnan(found["settling"]) and math.isnan(found["rmse_settled"])
    assert found["settling_5"] == 0.0


def test_leaving_the_band_at_the_end_means_never_settled() -> None:
    theta = np.full_like(TIME, 0.5)
    theta[-1] = 0.6
    assert math.isnan(
        metrics_of(PERIOD, theta, np.full_like(TIME, 0.5), STILL, one_move(0.5, 0.0, HORIZON))["settling"]
    )


def test_move_window_ends_where_the_reference_rests() -> None:
    reference = np.minimum(TIME, 1.0)
    theta = np.where(TIME <= 1.0, reference - 0.02, reference)
    found = metrics_of(PERIOD, theta, reference, STILL, one_move(1.0, 1.0, HORIZON))
    assert found["rmse_move"] == pytest.approx(0.02)
    assert found["rmse"] == pytest.approx(0.02 * math.sqrt(1 / 5), rel=1e-3)


def test_tension_metrics_count_both_sides() -> None:
    plus = 10.0 + 5.0 * np.sign(np.sin(2 * np.pi * 10 * (TIME + PERIOD / 2)))
    tension = np.stack([plus, np.full_like(TIME, 2.0)], axis=1)
    saturated = (TIME < 0.5).astype(float)
    found = metrics_of(PERIOD, TIME, TIME, tension, one_move(5.0, 0.0, HORIZON), saturated)
    assert found["peak_tension"] == 15.0
    assert found["rms_tension"] == pytest.approx(math.sqrt((125.0 + 4.0) / 2), rel=1e-6)
    assert found["chattering"] == pytest.approx(10.0 * 20, rel=0.02)
    assert found["saturation"] == pytest.approx(0.1)
    assert found["slack"] == 0.0
    assert metrics_of(PERIOD, TIME, TIME, 0 * tension, one_move(5.0, 0.0, HORIZON))["slack"] == 1.0


def test_what_a_rollout_that_failed_still_tells_is_its_effort_and_how_it_was_computed() -> None:
    told = {name for name, metric in METRICS.items() if not metric.of_error}
    effort = {"peak_tension", "rms_tension", "chattering", "saturation", "slack", "energy", "motor_limited"}
    assert told == effort | {"substeps", "drift"}


def test_every_metric_states_unit_and_formula() -> None:
    found = metrics_of(PERIOD, TIME, TIME, STILL, one_move(5.0, 0.0, HORIZON))
    assert set(found) == set(summed())
    assert all(metric.formula for metric in METRICS.values())


@pytest.mark.parametrize("planes", [1, 2])
def test_motors_limit_where_they_are_slower_than_the_command_and_nowhere_else(planes: int) -> None:
    """Spools with a hundredth of the acceleration are late for most of a quick move; torques as commanded never are."""
    reference, horizon = "{kind: minimum-jerk, duration: 0.5, angle_deg: 30.0}", 1.0
    shares = {}
    for name, loop in {
        "as commanded": "{}",
        "quick": "{actuator: {level: tendon, step_acceleration: 5.0e+5}, control_period: 5.0e-3}",
        "slow": "{actuator: {level: tendon, step_acceleration: 500.0}, control_period: 5.0e-3}",
    }.items():
        settings = [f"reference={reference}", f"horizon={horizon}", "controller=feedforward", f"loop={loop}"]
        study = load_study([], [*settings, f"loop.planes={planes}"], "simulate")
        shares[name] = wristctl.simulate(study).metrics["motor_limited"]
    assert shares["as commanded"] == 0.0 and shares["quick"] < 0.05 and shares["slow"] > 0.5


def test_what_the_motors_of_a_recording_withheld_is_not_known() -> None:
    found = metrics_of(PERIOD, TIME, TIME, STILL, one_move(5.0, 0.0, HORIZON))
    assert math.isnan(found["motor_limited"]) and found["saturation"] == 0.0


def test_nothing_settles_or_overshoots_where_the_last_angle_is_where_it_began() -> None:
    time = np.arange(5000.0) * 1e-3
    swing = 0.1 * np.sin(time)
    found = metrics_of(1e-3, swing, swing, np.full((5000, 2), 2.0), one_move(1e-17, 1.0, 5.0))
    assert all(math.isnan(found[name]) for name in ("settling", "settling_5", "overshoot", "rmse_settled"))
    assert found["rmse"] == 0.0


def test_the_steady_state_is_that_of_the_last_tenth_of_the_horizon() -> None:
    """|e| = t: its mean over the last tenth is 0.95 T."""
    found = metrics_of(PERIOD, TIME, 0.0 * TIME, STILL, one_move(5.0, 0.0, HORIZON))
    assert found["steady_state"] == pytest.approx(0.95 * HORIZON, rel=1e-4)


def test_metrics_of_a_trajectory_are_those_of_its_tip_and_of_the_true_wanted_angle() -> None:
    """The tip 3 mm off, in the last tenth 5 mm; the angle 0.02 rad off what was wanted."""
    time = np.arange(1000.0) * 1e-3
    away = np.where(time < 0.9 - 1e-9, 3e-3, 5e-3)
    wanted = np.tile((0.08, 0.0), (1000, 1))
    still: dict[str, Any] = {name: np.zeros(1000) for name in ("rate", "theta_ref", "torque_wanted", "torque")}
    course = Trajectory(
        label="", time=time, theta=np.full(1000, 0.12), theta_desired=np.full(1000, 0.10), tip_desired=wanted,
        tip=wanted + away[:, None] * np.array([0.6, -0.8]), segment_theta=np.zeros((1000, 4)),
        tension=np.zeros((1000, 2)), outside=0.25, **still,
    )  # fmt: skip
    assert of_trajectory(course) == {
        "energy": 0.0,
        "rmse_desired": pytest.approx(0.02),
        "tip_rmse_mm": pytest.approx(math.sqrt(0.9 * 9.0 + 0.1 * 25.0)),
        "tip_steady_mm": pytest.approx(5.0),
        "missing": 0.0,
        "oscillation": pytest.approx(0.0, abs=1e-15),
        "hunting": pytest.approx(math.nan, nan_ok=True),
        "observer_consistency": pytest.approx(math.nan, nan_ok=True),
        "outside_domain": 0.25,
        "substeps": 1.0,
        "drift": 0.0,
        "range_untracked": 0.0,
        "plateau": 0.0,
        "jump": 0.0,
    }


def test_errors_in_two_planes_are_distances() -> None:
    """Off by 0.03 rad toward radial and 0.04 toward flexion; the tip by 2, 3 and 6 mm along the three axes."""
    path, tips, still = np.zeros((1000, 2)), np.zeros((1000, 3)), np.zeros((1000, 4))
    course = Trajectory(
        "", np.arange(1000.0) * 1e-3, path + np.array([-0.03, 0.04]), still, path, path, path,
        tips + np.array([2e-3, -3e-3, 6e-3]), tips, path, path, still,
    )  # fmt: skip
    found = of_trajectory(course)
    assert found["rmse_desired"] == pytest.approx(0.05)
    assert (found["tip_rmse_mm"], found["tip_steady_mm"]) == pytest.approx((7.0, 7.0))


def test_the_observer_is_judged_by_what_it_expects_of_itself_in_both_planes() -> None:
    """Off by 0.02 rad toward ulnar and 0.06 toward flexion: where it expects that it is as good as it thinks."""
    off, path, tips = np.tile((0.02, -0.06), (50, 1)), np.zeros((50, 2)), np.zeros((50, 3))
    course = Trajectory(
        "", np.arange(50.0), path, path, path, path, path, tips, tips, path, path, np.zeros((50, 4)), seen=path + off
    )
    for expected, judged in (((0.02, 0.06), 1.0), ((0.06, 0.02), 1.0), ((0.01, 0.03), 2.0)):
        assert replace(course, expected=np.array(expected)).consistency == pytest.approx(judged)
    for unknown in ((0.02, 0.0), (math.nan, 0.06)):
        assert math.isnan(replace(course, expected=np.array(unknown)).consistency)
    assert math.isnan(course.consistency) and math.isnan(replace(course, seen=None, expected=0.1).consistency)
