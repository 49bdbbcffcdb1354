"""One motor by itself: its sense and slack are found, and the wrist is bent no further than it may."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import nullcontext

import pytest

from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.hw_run import CalibrateWristSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.motors_ready import in_sight
from wristctl.trial.rig_belief import pull_directions
from wristctl.trial.rig_strokes import RigStrokes, axis_tried
from wristctl.trial.safety import SafetyStop
from wristctl.trial.testbeds import EmulatedTestbed
from wristctl.vision.view import View


def bench_of(
    faults: Sequence[object] = (), **motors: object
) -> tuple[VirtualBench, EmulatedTestbed, CalibrateWristSettings]:
    bench_settings = {"motors": motors, "person": {"takes": 0.0}, "camera": {"frame_rate": 30.0}, "faults": faults}
    given = {"bench": bench_settings, "homing": {"frames": 2}}
    settings = CalibrateWristSettings.model_validate(given)
    bench = VirtualBench(settings.bench, WristParameters(), 0)
    return bench, EmulatedTestbed(bench, settings, [View()], None), settings


@pytest.mark.parametrize(("axis", "reversed_axis"), [(2, None), (0, 0)])
@pytest.mark.slow
def test_sense_and_slack_of_a_motor_are_found_within_two_degrees(axis: int, reversed_axis: int | None) -> None:
    slack = (3e-4, 2e-4, 4e-4, 2.5e-4)
    bench, testbed, settings = bench_of(slack=slack, reversed=tuple(k == reversed_axis for k in range(4)))
    found = axis_tried(testbed, settings, WristParameters(), axis)
    assert found.sense == (-1 if axis == reversed_axis else 1)
    bent = (
        2.0 * abs(found.bend.theta) * WristParameters().tendon_offset
    )  # a tendon alone bends across the plane as much
    assert slack[axis] + bent - 5e-5 < found.taken_up < slack[axis] + 1.5 * bent + 1.2e-4
    assert (found.bend.theta > 0.0) == (axis in (2, 3)), "tendons 4 and 5 are on the ulnar side"
    truth, motion = bench.truth(0.0), bench.motion()
    assert math.radians(0.9) < abs(truth.angle).max() < math.radians(settings.max_deg)
    assert motion.steps == (0, 0, 0, 0) and not any(motion.energised)
    others = [step for k, step in enumerate(motion.last_step) if k != axis]
    assert others == [None, None, None]


@pytest.mark.slow
def test_a_tendon_that_is_off_bends_nothing_and_that_is_said() -> None:
    bench, testbed, settings = bench_of(slack=(0.02,) * 4)
    short = settings.model_copy(update={"homing": settings.homing.model_copy(update={"slack": 5e-4})})
    with pytest.raises(SafetyStop, match=r"axis 1 does not bend the wrist within 0\.5 mm"):
        axis_tried(testbed, short, WristParameters(), 1)
    assert not any(bench.motion().energised)


@pytest.mark.slow
def test_a_tendon_on_another_motor_is_named_once_it_is_let_go() -> None:
    exchanged = {"kind": "motors-exchanged", "axis": 0, "size": 2.0, "at": 0.0, "since": "power-on"}
    bench, testbed, settings = bench_of((exchanged,), slack=(3e-4,) * 4)
    with pytest.raises(SafetyStop, match="axis 0 bends the wrist to the other side than tendon 1 should: as tendon"):
        axis_tried(testbed, settings, WristParameters(), 0)
    assert bench.motion().steps == (0, 0, 0, 0)


def before_two_cameras(wrist: WristParameters) -> tuple[EmulatedTestbed, CalibrateWristSettings]:
    camera = {"frame_rate": 30.0}
    given = {"bench": {"person": {"takes": 0.0}, "camera": camera, "camera_2": camera}, "homing": {"frames": 2}}
    settings = CalibrateWristSettings.model_validate({"planes": 2, **given})
    bench = VirtualBench(settings.bench, wrist, 0, settings.markers, settings.markers_2)
    return EmulatedTestbed(bench, settings, [View(), View()], None), settings


@pytest.mark.slow
@pytest.mark.parametrize("axis", [1, 2])
def test_before_two_cameras_an_axis_bends_the_wrist_toward_its_tendon(axis: int) -> None:
    testbed, settings = before_two_cameras(WristParameters())
    found = axis_tried(testbed, settings, WristParameters(), axis)
    assert found.sense == 1
    toward = math.atan2(found.bend.away, found.bend.theta)
    assert math.cos(toward - pull_directions()[axis]) > math.cos(math.radians(10.0))
    assert math.radians(0.9) < found.bend.askew < math.radians(settings.max_deg)


@pytest.mark.slow
@pytest.mark.parametrize(("axis", "flexion_ratio", "plane"), [(0, 0.3, 1), (1, 3.0, 0)])
def test_a_tendon_counts_as_taut_by_the_plane_that_bends_most_to_either_side(
    axis: int, flexion_ratio: float, plane: int
) -> None:
    """One plane is softer, and both tendons bend the wrist to that plane's other side."""
    wrist = WristParameters(flexion_ratio=flexion_ratio, gravity=(9.81, 0.0))
    testbed, settings = before_two_cameras(wrist)
    bend = axis_tried(testbed, settings, wrist, axis).bend
    most, least = (bend.away, bend.theta) if plane else (bend.theta, bend.away)
    assert -math.radians(1.4) < most < -math.radians(1.0) and abs(least) < 0.7 * abs(most)


@pytest.mark.slow
@pytest.mark.parametrize(("furthest", "refused"), [(1.8, True), (2.4, False)])
def test_a_stroke_stops_by_the_bend_of_both_planes_together(furthest: float, refused: bool) -> None:
    """1.2 mm bend this wrist by 1.3 deg in the one and 1.6 in the other, 2 in all."""
    wrist = WristParameters(flexion_ratio=0.3, gravity=(9.81, 0.0))
    testbed, settings = before_two_cameras(wrist)
    stops = pytest.raises(SafetyStop, match="a stroke of axis 0 bends the wrist too far") if refused else nullcontext()
    with stops, in_sight(testbed, settings, wrist) as (board, _, tracking):
        strokes = RigStrokes(board, tracking, settings, 0, math.radians(furthest))
        strokes._stroke(0, round(1.2e-3 / settings.actuator.step_length), 0.15)
