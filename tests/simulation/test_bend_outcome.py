"""Rollouts in two planes tell the same metrics whatever of them is recorded, and are what their courses are."""

import numpy as np
import pytest

from tests.oracles.course_metrics import of_course
from wristctl.arrays import Array
from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.closed_loop import follow, trajectory
from wristctl.simulation.metrics import METRICS, metrics_in
from wristctl.simulation.motion import Motion
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.reference import motion
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.rollout import How, rollout
from wristctl.simulation.spatial_references import bend_path
from wristctl.wrist.directions import in_plane

pytestmark = pytest.mark.slow

LAW = controller("pid-ff")
PATH = bend_path("circumduction", 30.0, 1.0, 1.5)
# Of the first the tendons are too weak, the third bends beyond its range, the others share a world.
WRISTS = [WristParameters(tension_limit=6.0), WristParameters(), WristParameters(range_deg=20.0)]
LANES = (0, 1, 2, 1, 1, 1, 1, 1, 1, 0)
GAINS = np.outer(np.linspace(1.0, 1.3, len(LANES)), gains_of(LAW, "default"))
IGNORED = Loop(coupling="ignored")


def path_of(loop: Loop) -> Motion:
    period = max(1e-3, loop.control_period)
    return Motion.of_bends(PATH[:, :, :: round(period / 1e-3)], period, WRISTS[1].length)


def ran(loop: Loop, record: How) -> Outcome:
    streams, which = [(2, lane) for lane in range(len(LANES))], np.zeros(len(LANES), np.int64)
    return rollout(
        LAW, GAINS, [path_of(loop)], which, loop, [WRISTS[lane] for lane in LANES], None, streams, record,
        converge=False, force=np.array([0.0, 0.4, 0.0]),
    )  # fmt: skip


def alone(path: Array, loop: Loop = IGNORED) -> Simulation:
    return follow(LAW, np.array(gains_of(LAW, "default")), Motion.of_bends(path, 1e-3, 0.08), WRISTS[1], loop)


@pytest.mark.parametrize(
    "loop",
    [
        IGNORED,
        Loop.model_validate({
            "control_period": 5e-3, "actuator": {"level": "tendon", "sheath": 1.0}, "sensor": {"level": "camera"},
        }),
    ],
    ids=["ideal", "real"],
)  # fmt: skip
def test_metrics_are_those_of_the_courses_whatever_is_recorded(loop: Loop) -> None:
    nothing, briefly, everything = ran(loop, False), ran(loop, "briefly"), ran(loop, True)
    assert nothing.kept is None and briefly.kept is not None
    for outcome in (nothing, briefly):
        np.testing.assert_array_equal(outcome.failed, everything.failed)
        np.testing.assert_array_equal(outcome.until, everything.until)
        for name, values in everything.metrics.items():
            np.testing.assert_array_equal(outcome.metrics[name], values, err_msg=name)
    for own, briefs in zip(everything.each("bend"), briefly.each("bend"), strict=True):
        np.testing.assert_array_equal(briefs, own)
    for lane in range(len(LANES)):
        course = trajectory(everything, lane, path_of(loop), WRISTS[LANES[lane]], loop)
        assert course.failed == everything.failed[lane]
        found = of_course(course)
        for name, values in everything.metrics.items():  # sums run one by one, numpy's by pairs; failed ones end early
            if not course.failed and name != "motor_limited":  # no course tells what motors withhold
                np.testing.assert_allclose(values[lane], found[name], rtol=1e-9, atol=1e-12, err_msg=name)
    assert everything.failed.any() and not everything.failed.all()
    assert np.ptp(everything.metrics["saturation"]) > 0.0


def test_a_loop_in_two_planes_has_every_metric_of_one_and_those_of_its_planes() -> None:
    done = alone(PATH)
    assert done.metrics.keys() == metrics_in(2).keys()
    assert set(metrics_in(2)) - set(METRICS) == {"rmse_ulnar", "rmse_flexion", "largest_error"}
    course, off = done.trajectory, np.hypot(*done.trajectory.error.T)
    for name in ("rmse", "rmse_desired"):
        assert done.metrics[name] == pytest.approx(np.sqrt(np.mean(off**2)))
    apart = np.linalg.norm(course.tip - course.tip_desired, axis=1)
    assert done.metrics["tip_rmse_mm"] == pytest.approx(1e3 * np.sqrt(np.mean(apart**2)))
    late = off[-(len(off) // 2) :].mean() / np.hypot(*course.bend_ref.T).max()  # it never rests
    assert done.metrics["missing"] == pytest.approx(late, rel=1e-9) and done.metrics["drift"] == 0.0


@pytest.mark.parametrize("name", ["circle", "dart-thrower"])
def test_the_energy_is_of_both_planes_power_together_there_and_back(name: str) -> None:
    hanging = WristParameters(gravity=(9.81, 0.0), damping=0.01)  # what its springs hold is given back
    motion = Motion.of_bends(bend_path(name, 20.0, 1.0, 2.0), 1e-3, hanging.length)
    done = follow(LAW, np.array(gains_of(LAW, "default")), motion, hanging, IGNORED)
    course = done.trajectory
    power = course.torque[:, 0] * course.rate[:, 0] + course.torque[:, 1] * course.rate[:, 1]
    assert done.metrics["energy"] == pytest.approx(np.abs(power).sum() * 1e-3, rel=1e-9)
    assert min(power) < -0.1 * max(power) < 0.0


def test_lanes_of_one_world_and_of_equal_worlds_are_the_same() -> None:
    rows, which = GAINS[:3], np.zeros(3, np.int64)
    shared = rollout(LAW, rows, [path_of(IGNORED)], which, IGNORED, WRISTS[1])
    apart = rollout(LAW, rows, [path_of(IGNORED)], which, [IGNORED.model_copy() for _ in which], WRISTS[1])
    np.testing.assert_equal(apart.metrics, shared.metrics)


def test_the_error_at_the_end_is_the_mean_over_the_last_tenth_of_both_planes() -> None:
    done = alone(PATH)
    course = done.trajectory
    sizes = np.hypot(*(course.bend - course.bend_ref).T)
    late = course.time >= 0.9 * (course.time[-1] + 1e-3) - 1e-9
    assert late.sum() == 150
    assert done.metrics["steady_state"] == pytest.approx(sizes[late].mean(), rel=1e-12)
    assert done.metrics["largest_error"] == pytest.approx(sizes.max(), rel=1e-12)


@pytest.mark.parametrize(("side", "plane"), [(0, "ulnar"), (1, "flexion")])
@pytest.mark.parametrize("kind", ["step", "minimum-jerk"])
def test_a_motion_in_one_plane_has_the_metrics_of_the_loop_in_that_plane(kind: str, side: int, plane: str) -> None:
    """Of the four tendons two pull as the two of a side do; each is a place of its own, and chatters as one."""
    facing = in_plane(WRISTS[1], plane)
    followed = motion(Reference(kind=kind, angle_deg=20.0), facing, 1.5, 1e-3)
    path = np.zeros((2, 3, len(followed.time)))
    path[side] = followed.angles.rows
    two = alone(path).metrics
    one = follow(LAW, np.array(gains_of(LAW, "default")), followed, facing, IGNORED).metrics
    assert one.keys() < two.keys() and one["settling"] > 0.5 and one["overshoot"] > 0.0
    for name, value in one.items():
        times = 2.0 if name == "chattering" else 1.0
        assert two[name] == pytest.approx(times * value, rel=1e-6, abs=1e-9, nan_ok=True), name


def test_overshoot_is_along_the_move_and_settling_within_a_circle() -> None:
    time = 1e-3 * np.arange(1500.0)
    move = np.deg2rad([12.0, -16.0])
    path = np.zeros((2, 3, len(time)))
    path[:, 0] = move[:, None] * (time > 0.1)
    done = alone(path)
    off = done.trajectory.bend - move
    passed = (off @ move).max() / (move @ move)
    assert done.metrics["overshoot"] == pytest.approx(100.0 * passed) and passed > 0.1
    outside = np.flatnonzero(np.hypot(*off.T) > 0.05 * np.hypot(*move))
    assert done.metrics["settling_5"] == pytest.approx(time[outside[-1]])


@pytest.mark.parametrize("tendons", ["three", "six"])
def test_a_step_that_is_too_long_is_halved_for_the_rollout_that_needs_it_alone(tendons: str) -> None:
    """Stiff gains chatter between the limits at every tick; beside them a loop whose step is short enough."""
    law, wrist = controller("pid-ff"), WristParameters.model_validate({"tendons": tendons})
    soft = np.array(gains_of(law, "default"))
    rows, which = np.stack([soft, soft * [40.0, 40.0, 2.0][: len(soft)]]), np.zeros(2, np.int64)
    path = Motion.of_bends(PATH[:, :, :500], 1e-3, wrist.length)
    loop = Loop.model_validate({"coupling": "ignored", "control_period": 5e-3, "plant_segments": 2})
    coarse = Motion.of_bends(PATH[:, :, :1000:5], 5e-3, wrist.length)
    once = rollout(law, rows, [coarse], which, loop, wrist, converge=False)
    taken = rollout(law, rows, [coarse], which, loop, wrist)
    fine = rollout(law, rows, [coarse], which, loop.model_copy(update={"substeps": 64}), wrist, converge=False)
    assert path.planes == 2 and (once.steps == loop.steps).all() and (taken.steps >= once.steps).all()
    assert taken.steps[1] > taken.steps[0]
    for lane in np.flatnonzero(~taken.unconverged & ~taken.failed):
        assert taken.metrics["rmse"][lane] == pytest.approx(fine.metrics["rmse"][lane], rel=0.01)
