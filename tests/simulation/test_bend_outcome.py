"""Rollouts in two planes tell the same metrics whatever of them is recorded, and are what their courses are."""

import numpy as np
import pytest

from wristctl.config.loop import Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.simulation.bend_course import BEND_METRICS
from wristctl.simulation.bend_outcome import BendOutcome
from wristctl.simulation.reference import motion
from wristctl.simulation.rollout import How, rollout
from wristctl.simulation.two_planes import bend_path, rollout_bends
from wristctl.simulation.worlds import World
from wristctl.wrist.directions import in_plane

pytestmark = pytest.mark.slow

LAW = controller("pid-ff")
PATH = bend_path("circumduction", 30.0, 1.0, 1.5)
# Of the first the tendons are too weak, the third bends beyond its range, the others share a world.
WRISTS = [WristParameters(tension_limit=6.0), WristParameters(), WristParameters(range_deg=20.0)]
LANES = (0, 1, 2, 1, 1, 1, 1, 1, 1, 0)


def ran(loop: Loop, record: How) -> BendOutcome:
    every = loop.control_period / 1e-3
    path = PATH[:, :, :: max(1, round(every))]
    worlds = [World(loop, WRISTS[lane]) for lane in LANES]
    gains = np.outer(np.linspace(1.0, 1.3, len(LANES)), gains_of(LAW, "default"))
    force = np.array([0.0, 0.4, 0.0])
    streams = [(2, lane) for lane in range(len(LANES))]
    return rollout_bends(LAW, gains, path, worlds, None, force, streams, record=record)


@pytest.mark.parametrize(
    "loop",
    [
        Loop(coupling="ignored"),
        pytest.param(
            Loop.model_validate({
                "control_period": 5e-3, "actuator": {"level": "tendon", "sheath": 1.0}, "sensor": {"level": "camera"},
            }),
            marks=pytest.mark.slow,
        ),
    ],
    ids=["ideal", "real"],
)  # fmt: skip
def test_metrics_are_those_of_the_courses_whatever_is_recorded(loop: Loop) -> None:
    nothing, briefly, everything = ran(loop, False), ran(loop, "briefly"), ran(loop, True)
    assert not nothing.courses and not briefly.courses and nothing.bends is None
    for outcome in (nothing, briefly):
        np.testing.assert_array_equal(outcome.failed, everything.failed)
        np.testing.assert_array_equal(outcome.until, everything.until)
        for name, values in everything.metrics.items():
            np.testing.assert_array_equal(outcome.metrics[name], values, err_msg=name)
    metrics = everything.all_metrics()
    np.testing.assert_equal(briefly.all_metrics(), metrics)
    assert list(metrics) == list(BEND_METRICS)
    assert set(BEND_METRICS) - set(nothing.metrics) == {"oscillation"}
    for lane, course in enumerate(everything.courses):
        assert (course.failed, course.until) == (everything.failed[lane], everything.until[lane])
        for name, value in course.metrics().items():  # sums run one by one, numpy's by pairs
            np.testing.assert_allclose(metrics[name][lane], value, rtol=1e-12, atol=1e-14, err_msg=name)
    assert everything.failed.any() and not everything.failed.all()
    assert np.ptp(everything.metrics["saturation"]) > 0.0


def test_lanes_of_one_world_and_of_equal_worlds_are_the_same() -> None:
    loop, gains = Loop(coupling="ignored"), np.tile(gains_of(LAW, "default"), (3, 1))
    shared = rollout_bends(LAW, gains, PATH, [World(loop, WRISTS[1])] * 3)
    apart = rollout_bends(LAW, gains, PATH, [World(loop.model_copy(), WRISTS[1]) for _ in range(3)])
    np.testing.assert_equal(apart.metrics, shared.metrics)


def test_the_error_at_the_end_is_the_mean_over_the_last_tenth_of_both_planes() -> None:
    loop, gains = Loop(coupling="ignored"), np.tile(gains_of(LAW, "default"), (1, 1))
    outcome = rollout_bends(LAW, gains, PATH, [World(loop, WRISTS[1])], record=True)
    (course,) = outcome.courses
    sizes = np.hypot(*(course.bend - course.bend_ref).T)
    late = course.time >= 0.9 * (course.time[-1] + 1e-3) - 1e-9
    assert late.sum() == 150
    assert outcome.metrics["steady_state"][0] == pytest.approx(sizes[late].mean(), rel=1e-12)
    assert outcome.metrics["largest_error"][0] == pytest.approx(sizes.max(), rel=1e-12)


@pytest.mark.parametrize("kind", ["step", "minimum-jerk"])
def test_a_motion_in_one_plane_has_the_metrics_of_the_loop_in_that_plane(kind: str) -> None:
    """Of the four tendons two pull as the two of a side do; each is a place of its own, and chatters as one."""
    loop, ulnar = Loop(coupling="ignored"), in_plane(WRISTS[1], "ulnar")
    gains = np.array([gains_of(LAW, "default")])
    followed = motion(Reference(kind=kind, angle_deg=20.0), ulnar, 1.5, 1e-3)
    path = np.zeros((2, 3, len(followed.time)))
    path[0] = followed.angles.rows
    two = rollout_bends(LAW, gains, path, [World(loop, WRISTS[1])]).metrics
    one = rollout(LAW, gains, [followed], np.zeros(1, np.int64), loop, ulnar, converge=False).metrics
    assert one.keys() < two.keys() and one["settling"][0] > 0.5 and one["overshoot"][0] > 0.0
    for name, values in one.items():
        times = 2.0 if name == "chattering" else 1.0
        assert two[name][0] == pytest.approx(times * values[0], rel=1e-6, abs=1e-12), name


def test_overshoot_is_along_the_move_and_settling_within_a_circle() -> None:
    time = 1e-3 * np.arange(1500.0)
    move = np.deg2rad([12.0, -16.0])
    path = np.zeros((2, 3, len(time)))
    path[:, 0] = move[:, None] * (time > 0.1)
    gains = np.array([gains_of(LAW, "default")])
    outcome = rollout_bends(LAW, gains, path, [World(Loop(coupling="ignored"), WRISTS[1])], record=True)
    off = outcome.courses[0].bend - move
    passed = (off @ move).max() / (move @ move)
    assert outcome.metrics["overshoot"][0] == pytest.approx(100.0 * passed) and passed > 0.1
    outside = np.flatnonzero(np.hypot(*off.T) > 0.05 * np.hypot(*move))
    assert outcome.metrics["settling_5"][0] == pytest.approx(time[outside[-1]])
