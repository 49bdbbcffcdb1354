"""Loops in two planes behind a camera, motors and tendons: as in one plane, under turns, and with a tendon lost."""

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.bend_course import BendCourse
from wristctl.simulation.bend_paths import circumduction, dart_thrower, turned
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.rollout import rollout
from wristctl.simulation.two_planes import rollout_bends, simulate_two_planes
from wristctl.simulation.worlds import World
from wristctl.wrist.directions import in_plane

pytestmark = pytest.mark.slow

LAW = controller("pid-ff")
GAINS = np.array(gains_of(LAW, "hardware"))
WRIST = WristParameters()
PERIOD = 5e-3
TIME = PERIOD * np.arange(300.0)
HORIZON = 1.5
REAL = {
    "control_period": PERIOD,
    "coupling": "ignored",
    "spool_lead": False,
    "actuator": {"level": "tendon", "sheath": 1.0},
    "sensor": {"level": "camera", "noise_deg": 0.0},
    "plant": {"stiffness_scale": 0.8},
}


def real(**changes: object) -> Loop:
    return Loop.model_validate(REAL | changes)


def followed(path: Array, loop: Loop, **how: object) -> BendCourse:
    return simulate_two_planes(LAW, GAINS, path, WRIST, loop=loop, **how)  # type: ignore[arg-type]


def line() -> Array:
    """A swing (3, T) in one plane."""
    bends: Array = turned(dart_thrower(TIME, np.deg2rad(25.0), 1.0), -40.0)[0]
    return bends


@pytest.mark.parametrize("side", [0, 1])
def test_camera_motors_and_rubbing_tendons_are_those_of_one_plane(side: int) -> None:
    path = np.zeros((2, 3, len(TIME)))
    path[side] = line()
    wrist = WRIST.model_copy(update={"flexion_ratio": 1.4})
    course = simulate_two_planes(LAW, GAINS, path, wrist, loop=real())
    facing = in_plane(wrist, ("ulnar", "flexion")[side])
    motion = Motion(TIME, Angles.of(line()), np.zeros((len(TIME), 2)), None, 0.0, HORIZON, HORIZON)
    planar = rollout(
        LAW, GAINS[None], [motion], np.zeros(1, np.int64), real(substeps=5), facing, streams=[(0,)], record=True
    )
    assert course.bend[:, side] == pytest.approx(planar.column("theta", 0), abs=1e-6)
    assert course.bend_seen[:, side] == pytest.approx(planar.column("seen", 0), abs=1e-6)
    assert course.load_seen[:, side] == pytest.approx(planar.column("load", 0), abs=1e-5)
    pulling = int(np.argmax(course.acting[-1]))
    sides = [planar.column(f"acting_{name}", 0) for name in ("plus", "minus")]
    nearest = min(np.abs(course.acting[:, pulling] - tension).max() for tension in sides)
    assert nearest < 1e-3
    assert np.abs(course.bend[:, 1 - side]).max() < 1e-9


def test_a_path_turned_by_a_right_angle_leaves_the_same_errors_behind_a_camera() -> None:
    path = circumduction(TIME, np.deg2rad(20.0), 1.0)
    plain, aside = followed(path, real()), followed(turned(path, 90.0), real())
    assert aside.bend[:, 1] == pytest.approx(plain.bend[:, 0], abs=1e-7)
    assert aside.bend[:, 0] == pytest.approx(-plain.bend[:, 1], abs=1e-7)


def test_lanes_are_what_each_is_alone_and_noise_is_each_ones_own() -> None:
    path, loop = circumduction(TIME[:100], np.deg2rad(20.0), 1.0), real(sensor={"level": "camera"})
    streams = [(3, k) for k in range(3)]
    worlds, rows = [World(loop, WRIST)] * 3, np.tile(GAINS, (3, 1))
    together = rollout_bends(LAW, rows, path, worlds, None, None, streams, record=True).courses
    alone = followed(path, loop, stream=(3, 1))
    np.testing.assert_array_equal(together[1].bend, alone.bend)
    assert np.abs(together[0].bend - together[2].bend).max() > 1e-6
    seen: Array = np.asarray(alone.bend_seen - alone.bend)
    assert abs(float(np.atleast_2d(np.corrcoef(seen[40:].T))[0, 1])) < 0.9  # the two planes' noise is not one


@pytest.mark.parametrize("tendon", [1, 4])
def test_a_tendon_that_is_lost_pulls_no_more_and_the_others_hold_what_they_can(tendon: int) -> None:
    loop = real(plant={"actuator": {"broken_at": 0.7, "broken_tendon": tendon}})
    course = followed(circumduction(TIME, np.deg2rad(10.0), 1.0), loop)
    late = TIME > 0.7 - 1e-9
    assert not course.acting[late, tendon - 1].any() and course.acting[~late, tendon - 1].all()
    assert course.acting[late].sum(axis=1).min() > 0.0
    with pytest.raises(UserError, match="tendon 5 of 4"):
        followed(circumduction(TIME, 0.1, 1.0), real(plant={"actuator": {"broken_at": 0.7, "broken_tendon": 5}}))


def test_slack_in_one_tendon_bends_the_wrist_away_until_it_is_reeled_in() -> None:
    still = np.zeros((2, 3, len(TIME)))
    slack = followed(still, real(plant={"actuator": {"slack": (0.0, 0.0, 0.0, 1e-3)}}))
    other = followed(still, real(plant={"actuator": {"slack": (0.0, 1e-3)}}))
    assert not slack.acting[0, 3] and slack.acting[0, :3].all()
    assert np.hypot(*slack.bend.T).max() > np.deg2rad(0.1)
    assert slack.metrics()["slack"] > 0.0 and not other.acting[0, 1]
    cosine = (slack.bend[20] * other.bend[20]).sum() / np.hypot(*slack.bend[20]) / np.hypot(*other.bend[20])
    assert cosine < 0.5  # away from another tendon


def test_spools_that_run_ahead_follow_a_fast_motion_with_less_pull() -> None:
    path = dart_thrower(TIME, np.deg2rad(30.0), 1.5)
    late, ahead = followed(path, real()).metrics(), followed(path, real(spool_lead=True)).metrics()
    assert ahead["rmse"] < 0.5 * late["rmse"]
    assert ahead["peak_tension"] < 0.5 * late["peak_tension"]
    still = np.zeros((2, 3, 100))
    np.testing.assert_array_equal(followed(still, real()).bend, followed(still, real(spool_lead=True)).bend)
