"""The pose of a camera that nobody calibrated, by the two markers that it sees anyway."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.camera_pose import CameraPose, pose_of
from wristctl.vision.detector import square_angle
from wristctl.vision.marker import SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import Pinhole, View

MARKERS, WRIST, SIZE = Markers(), WristParameters(), (640, 480)
_SQUARE = 0.5 * MARKERS.side * np.array([1 - 1j, 1 + 1j, -1 + 1j, -1 - 1j])
"""x up and y to the right, from the top left on."""


def shown(camera: SceneSettings, theta: float = 0.0, nearer: float = 0.0) -> Array:
    """Corners (2, 4, 2) [px] of base and tip by the pinhole alone; the tip's flag may be `nearer` [m]."""
    arc = WRIST.length * np.sinc(0.5 * theta / np.pi) * np.exp(0.5j * theta)
    base, tip = MARKERS.base_at + _SQUARE, arc + 0.02 * np.exp(1j * theta) + _SQUARE * np.exp(1j * theta)
    places = np.stack([base, tip])
    depth = np.broadcast_to(-camera.marker_offset - np.array([[0.0], [nearer]]), places.shape)
    return Pinhole(camera, "right").project(np.stack([places.real, places.imag, depth], axis=-1))


def seen_at(pose: CameraPose, corners: Array) -> tuple[float, float]:
    """Angle [deg] of the tip's marker against the base's, and its size over the base's, once the plane is square."""
    base, tip = (pose.view.rectify(marker) for marker in corners)
    sizes = [math.dist(marker[0], marker[1]) + math.dist(marker[3], marker[2]) for marker in (base, tip)]
    return math.degrees(square_angle(tip) - square_angle(base)), sizes[1] / sizes[0]


# Degrees of apparent bend across for the logarithm of a size.
ACROSS = math.degrees(2.0 * MARKERS.distance / WRIST.length)
POSES = st.floats(-10.0, 10.0), st.floats(-10.0, 10.0), st.floats(-5.0, 5.0), st.floats(-0.2, 0.05)


@settings(max_examples=60, deadline=None)
@given(*POSES, st.floats(-50.0, 50.0))
def test_up_to_ten_degrees_off_square_angle_and_size_are_those_of_a_square_camera(
    tilt: float, pan: float, roll: float, distortion: float, theta: float
) -> None:
    """Without it a size errs by up to 9 deg of bend across, and an angle by 0.7 deg."""
    camera = SceneSettings(tilt_deg=tilt, pan_deg=pan, roll_deg=roll, distortion=distortion)
    pose = pose_of([shown(camera)], SIZE, MARKERS)
    straight, bent = seen_at(pose, shown(camera)), seen_at(pose, shown(camera, math.radians(theta)))
    assert bent[0] - straight[0] == pytest.approx(theta, abs=0.2)
    assert ACROSS * math.log(bent[1] / straight[1]) == pytest.approx(0.0, abs=0.7)
    assert pose.misfit < 2e-3


@pytest.mark.parametrize(("tilt", "pan"), [(0.0, 0.0), (6.0, 0.0), (0.0, 6.0), (-8.0, 3.0), (4.0, -7.0)])
def test_the_pose_is_that_of_the_camera(tilt: float, pan: float) -> None:
    pose = pose_of([shown(SceneSettings(tilt_deg=tilt, pan_deg=pan))], SIZE, MARKERS)
    assert math.degrees(pose.tilt) == pytest.approx(tilt, abs=0.6) and pose.distortion == pytest.approx(-0.05, abs=0.04)
    assert math.degrees(pose.pan) == pytest.approx(pan, abs=0.4)
    normal = Pinhole(SceneSettings(tilt_deg=tilt, pan_deg=pan), "right").rotation[:, 2]
    assert math.degrees(pose.oblique) == pytest.approx(math.degrees(math.acos(normal[2])), abs=0.5)
    focal = 320.0 / math.tan(math.radians(30.0))
    assert pose.view.size == SIZE and pose.view.camera_matrix[0, 0] == pytest.approx(focal, rel=0.05)


def test_flags_of_two_depths_are_not_taken_for_a_tilt() -> None:
    """2 mm between flags that stand 0.1 m apart would be 1.1 deg."""
    level = pose_of([shown(SceneSettings(distortion=0.0), nearer=2e-3)], SIZE, MARKERS)
    assert abs(math.degrees(level.tilt)) < 0.5


def test_a_lifted_corner_is_no_square_of_any_pose() -> None:
    corners = shown(SceneSettings(pan_deg=5.0))
    corners[1, 0] += 3.0
    flat = pose_of([shown(SceneSettings(pan_deg=5.0))], SIZE, MARKERS)
    assert pose_of([corners], SIZE, MARKERS).misfit > 0.006 > 2.0 * flat.misfit


def test_a_tracker_sees_an_oblique_plane_square_after_a_moment_of_rest() -> None:
    """Rendered, with noise: bent by 30 deg, the marker's size is what it was."""
    scene, rng = Scene(SceneSettings(pan_deg=8.0, tilt_deg=-5.0), WRIST, MARKERS), np.random.default_rng(3)
    tracker = Tracker(MARKERS, View(), Gates(rate=1e3))

    def sightings(theta: float, first: int) -> list[tuple[float, float]]:
        frames = [Frame(scene.render(np.full((1, 4), theta / 4), rng), k / 60, k) for k in range(first, first + 12)]
        looked = [tracker.see(frame) for frame in frames]
        assert {sighting.verdict for sighting in looked} == {SightingVerdict.OK}
        if first == 0:
            assert tracker.stand_square(looked) is not None
        return [(sighting.theta, sighting.size) for sighting in looked]

    sightings(0.0, 0)
    straight = np.median(sightings(0.0, 12), axis=0)
    for number, theta in enumerate((0.52, -0.52)):
        bent = np.median(sightings(theta, 24 + 12 * number), axis=0)
        assert bent[0] - straight[0] == pytest.approx(theta, abs=2e-3)
        assert ACROSS * math.log(bent[1] / straight[1]) == pytest.approx(0.0, abs=0.5)


def test_a_calibrated_camera_is_left_as_it_is() -> None:
    scene = Scene(SceneSettings(pan_deg=8.0), WRIST, MARKERS)
    tracker = Tracker(MARKERS, scene.view, Gates())
    sighting = tracker.see(Frame(scene.render(np.zeros((1, 4)), np.random.default_rng(0)), 0.0, 0))
    assert tracker.stand_square([sighting]) is None and Tracker(MARKERS, View(), Gates()).stand_square([]) is None
