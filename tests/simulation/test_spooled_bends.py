"""Loops in two planes behind a camera, motors and tendons: as in one plane, under turns, and with a tendon lost."""

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.rollout import rollout
from wristctl.simulation.spatial_references import circumduction, dart_thrower, turned
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.directions import in_plane
from wristctl.wrist.tendon_layout import TendonLayout

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


def simulated(path: Array, loop: Loop, wrist: WristParameters = WRIST, stream: tuple[int, ...] = (0,)) -> Simulation:
    return follow(LAW, GAINS, Motion.of_bends(path, PERIOD, wrist.length), wrist, loop, stream=stream)


def followed(path: Array, loop: Loop, wrist: WristParameters = WRIST, stream: tuple[int, ...] = (0,)) -> Trajectory:
    return simulated(path, loop, wrist, stream).trajectory


def line() -> Array:
    """A swing (3, T) in one plane."""
    bends: Array = turned(dart_thrower(TIME, np.deg2rad(25.0), 1.0), -40.0)[0]
    return bends


def test_a_zero_that_is_wrong_is_each_cameras_and_is_not_seen() -> None:
    """The wrist rests off by it in either plane, as far as the spools let the controller."""
    sound, wrong = (
        followed(np.zeros((2, 3, len(TIME))), real(plant={"sensor": {"zero_deg": zero}})) for zero in (0.0, 1.0)
    )
    assert np.rad2deg(np.asarray(wrong.seen)[-1] - wrong.bend[-1]) == pytest.approx([1.0, 1.0], abs=0.05)
    assert (np.rad2deg(sound.bend[-1] - wrong.bend[-1]) > 0.1).all()


@pytest.mark.parametrize("side", [0, 1])
def test_camera_motors_and_rubbing_tendons_are_those_of_one_plane(side: int) -> None:
    path = np.zeros((2, 3, len(TIME)))
    path[side] = line()
    wrist = WRIST.model_copy(update={"flexion_ratio": 1.4})
    course = followed(path, real(substeps=5), wrist)
    facing = in_plane(wrist, ("ulnar", "flexion")[side])
    motion = Motion(TIME, Angles.of(line()), np.zeros((len(TIME), 2)), None, 0.0, HORIZON, HORIZON)
    planar = rollout(
        LAW, GAINS[None], [motion], np.zeros(1, np.int64), real(substeps=5), facing, streams=[(0,)], record=True
    )
    assert course.bend[:, side] == pytest.approx(planar.column("theta", 0), abs=1e-6)
    assert np.asarray(course.seen)[:, side] == pytest.approx(planar.column("seen", 0), abs=1e-6)
    assert np.asarray(course.load)[:, side] == pytest.approx(planar.column("load", 0), abs=1e-5)
    pulling = int(np.argmax(np.asarray(course.acting)[-1]))
    sides = [planar.column(f"acting_{name}", 0) for name in ("plus", "minus")]
    nearest = min(np.abs(np.asarray(course.acting)[:, pulling] - tension).max() for tension in sides)
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
    motion, which = Motion.of_bends(path, PERIOD, WRIST.length), np.zeros(3, np.int64)
    together = rollout(LAW, np.tile(GAINS, (3, 1)), [motion], which, loop, WRIST, None, streams, record=True)
    alone = followed(path, loop, stream=(3, 1))
    np.testing.assert_array_equal(together.part("bend", 1), alone.bend)
    assert np.abs(together.part("bend", 0) - together.part("bend", 2)).max() > 1e-6
    seen: Array = np.asarray(alone.seen) - alone.bend
    assert abs(float(np.atleast_2d(np.corrcoef(seen[40:].T))[0, 1])) < 0.9  # the two planes' noise is not one


@pytest.mark.parametrize("tendon", [1, 4])
def test_a_tendon_that_is_lost_pulls_no_more_and_the_others_hold_what_they_can(tendon: int) -> None:
    loop = real(plant={"actuator": {"broken_at": 0.7, "broken_tendon": tendon}})
    course = followed(circumduction(TIME, np.deg2rad(10.0), 1.0), loop)
    late = TIME > 0.7 - 1e-9
    assert not np.asarray(course.acting)[late, tendon - 1].any() and np.asarray(course.acting)[~late, tendon - 1].all()
    assert np.asarray(course.acting)[late].sum(axis=1).min() > 0.0
    with pytest.raises(UserError, match="tendon 5 of 4"):
        followed(circumduction(TIME, 0.1, 1.0), real(plant={"actuator": {"broken_at": 0.7, "broken_tendon": 5}}))


@pytest.mark.parametrize("level", ["ideal", "tendon"])
def test_of_tendons_alike_at_a_place_one_breaks_and_the_rest_of_them_goes_on(level: str) -> None:
    places = tuple({"angle_deg": angle, "multiplicity": 1 + (angle == 90.0)} for angle in (90.0, 210.0, 330.0))
    wrist = WristParameters.model_validate({"tendons": places})
    still, faults = np.zeros((2, 3, 100)), {"actuator": {"broken_at": 0.2, "broken_tendon": 1}}
    loop = real(plant=faults, actuator={"level": level, "friction": 0.0}, sensor={"level": "ideal"})
    pulls = np.asarray(followed(still, loop, wrist).acting) / wrist.pretension
    assert pulls[39] == pytest.approx([1.0, 2.0, 2.0], abs=0.1), "two balance two others"
    assert pulls[40] == pytest.approx([0.5, 2.0, 2.0], abs=0.1), "of one tendon on average"


@pytest.mark.parametrize("tendon", [1, 4])
def test_a_place_that_slips_pays_out_once_and_bends_the_wrist_away_from_it(tendon: int) -> None:
    still, facts = np.zeros((2, 3, 100)), {"slips_at": 0.2, "slip": 2e-4, "slipping_tendon": tendon}
    loop = real(plant={"actuator": facts}, actuator={"level": "tendon", "friction": 0.0}, sensor={"level": "ideal"})
    course = followed(still, loop)
    before, after = np.asarray(course.acting)[39], np.asarray(course.acting)[40]
    slack = np.maximum(before[tendon - 1] - 2e-4 * loop.actuator.tendon_stiffness, 0.0)
    assert after[tendon - 1] == pytest.approx(slack) and np.delete(after, tendon - 1) == pytest.approx(before[1])
    place = TendonLayout.of(WRIST).cross_section[tendon - 1]
    assert course.bend[60] @ place < -1e-6
    with pytest.raises(UserError, match="tendon 5 of 4 cannot slip"):
        followed(still, real(plant={"actuator": facts | {"slipping_tendon": 5}}))


def test_slack_in_one_tendon_bends_the_wrist_away_until_it_is_reeled_in() -> None:
    still = np.zeros((2, 3, len(TIME)))
    loose = simulated(still, real(plant={"actuator": {"slack": (0.0, 0.0, 0.0, 1e-3)}}))
    slack = loose.trajectory
    other = followed(still, real(plant={"actuator": {"slack": (0.0, 1e-3)}}))
    assert not np.asarray(slack.acting)[0, 3] and np.asarray(slack.acting)[0, :3].all()
    assert np.hypot(*slack.bend.T).max() > np.deg2rad(0.1)
    assert loose.metrics["slack"] > 0.0 and not np.asarray(other.acting)[0, 1]
    cosine = (slack.bend[20] * other.bend[20]).sum() / np.hypot(*slack.bend[20]) / np.hypot(*other.bend[20])
    assert cosine < 0.5  # away from another tendon


def test_spools_that_run_ahead_follow_a_fast_motion_with_less_pull() -> None:
    path = dart_thrower(TIME, np.deg2rad(30.0), 1.5)
    late, ahead = simulated(path, real()).metrics, simulated(path, real(spool_lead=True)).metrics
    assert ahead["rmse"] < 0.5 * late["rmse"]
    assert ahead["peak_tension"] < 0.5 * late["peak_tension"]
    still = np.zeros((2, 3, 100))
    np.testing.assert_array_equal(followed(still, real()).bend, followed(still, real(spool_lead=True)).bend)
