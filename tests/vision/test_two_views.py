"""A camera at a right angle to each plane tells that plane's bend, whatever the other one is."""

from __future__ import annotations

import math
from itertools import product
from typing import Literal

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.vision.camera import Frame
from wristctl.vision.detector import side_angle, square_angle
from wristctl.vision.marker import Sighting, SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.two_views import NEAR, bend_seen, paired_bends
from wristctl.vision.view import Pinhole, View
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import spatial_frames, tip_bends

WRIST, OPEN = WristParameters(), Gates(rate=1e6)
EDGE = np.radians(35.0)
Plane = Literal[0, 1]
Side = Literal["right", "left"]

bends = st.tuples(*2 * [st.floats(-EDGE, EDGE)])
poses = st.builds(
    SceneSettings,
    tilt_deg=st.floats(-20.0, 20.0), pan_deg=st.floats(-20.0, 20.0), roll_deg=st.floats(-30.0, 30.0),
    distance=st.floats(0.2, 0.5), distortion=st.floats(-0.1, 0.1),
)  # fmt: skip


def segments_of(bend: tuple[float, float], uneven: float = 0.0) -> np.ndarray:
    """Coordinates of four segments; uneven ones do not all bend alike, nor in one plane."""
    each = np.tile(np.array(bend) / 4.0, 4)
    return each * (1.0 + uneven * np.array([-1.0, 0.5, -0.3, -0.5, 0.3, 0.5, 1.0, -0.5]))


def before(plane: Plane, side: float) -> np.ndarray:
    """From the wrist's axes to those of the camera that looks at a plane: along, toward its + side, away."""
    if plane == 0:
        return np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, side]])
    return np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -side, 0.0]])


def projected(q: np.ndarray, plane: Plane, camera: Pinhole, mounted: float) -> Sighting:
    """What an ideal tracker says of a marker that is turned on its flag by `mounted` [rad]."""
    (centre,), (frame,) = spatial_frames(q, WRIST.length, np.ones(1))
    axes = before(plane, camera.side)
    place, turn = axes @ centre, axes @ frame @ axes.T
    half, c, s = 0.01, math.cos(mounted), math.sin(mounted)
    square = np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]]) * half  # up, and right in the picture
    up, right = square[:, 0], camera.side * square[:, 1]
    flat = np.stack([c * up - s * right, s * up + c * right, np.full(4, -0.028)], axis=1)
    tip = camera.project(place + flat @ turn.T)
    base = camera.project(np.stack([up - 0.022, right, np.full(4, -0.028)], axis=1))
    view = camera.view
    theta = camera.side * (side_angle(view.rectify(tip)) - square_angle(view.rectify(base))) - mounted
    return Sighting(0.0, 0, math.remainder(theta, math.tau), SightingVerdict.OK, np.stack([base, tip]), plane=plane)


@given(bend=bends, pose=poses, plane=st.sampled_from([0, 1]), positive=st.sampled_from(["right", "left"]))
def test_an_ideal_picture_tells_the_bend_exactly(
    bend: tuple[float, float], pose: SceneSettings, plane: Plane, positive: Side
) -> None:
    q, camera = segments_of(bend, uneven=0.4), Pinhole(pose, positive)
    true = tip_bends(q)
    seen = bend_seen(projected(q, plane, camera, 0.0), camera.view, true[1 - plane], side=camera.side)
    assert seen == pytest.approx(true[plane], abs=2e-6)


@given(bend=bends, mounted=st.floats(-0.1, 0.1), plane=st.sampled_from([0, 1]))
def test_a_marker_that_is_turned_on_its_flag_tells_the_bend_of_an_arc_exactly(
    bend: tuple[float, float], mounted: float, plane: Plane
) -> None:
    q, camera = segments_of(bend), Pinhole(SceneSettings(tilt_deg=5.0), "right")
    sighting = projected(q, plane, camera, mounted)
    assert bend_seen(sighting, camera.view, bend[1 - plane], mounted) == pytest.approx(bend[plane], abs=2e-6)
    if abs(bend[0]) < 1e-3 and abs(bend[1]) < 1e-3:
        assert bend_seen(sighting, camera.view, bend[1 - plane]) == pytest.approx(bend[plane], abs=1e-4)


@given(bend=bends, plane=st.sampled_from([0, 1]))
def test_without_a_calibrated_view_the_angle_is_that_of_the_tangent_from_far_away(
    bend: tuple[float, float], plane: Plane
) -> None:
    size = math.hypot(*bend)
    along, across = math.cos(size), float(np.sinc(size / math.pi)) * bend[plane]
    nothing = np.full((2, 4, 2), math.nan)
    far = Sighting(0.0, 0, math.atan2(across, along), SightingVerdict.OK, nothing, plane=plane)
    assert bend_seen(far, View(), bend[1 - plane]) == pytest.approx(bend[plane], abs=1e-9)


def seen_at(times: Array, thetas: Array, plane: Plane) -> list[Sighting]:
    """Sightings whose angles are those of the tangent from far away; none where the angle is nan."""
    corners = np.full((2, 4, 2), math.nan)
    return [
        Sighting(time, k, theta, SightingVerdict.OK, corners, plane=plane)
        for k, (time, theta) in enumerate(zip(times.tolist(), thetas.tolist(), strict=True))
    ]


@pytest.mark.parametrize("later", [0, 1])
def test_a_bend_is_told_where_the_other_camera_sees_before_after_and_near(later: int) -> None:
    """One camera looks for a second; the other begins after it, ends before it, and sees nothing for a while."""
    whole = np.arange(0.0, 1.0, 0.02)
    part = np.arange(0.21, 0.8, 0.02)
    angles = np.where((part > 0.4) & (part < 0.6), math.nan, 0.2)
    sightings = [seen_at(whole, np.full(len(whole), 0.3), 0), seen_at(part, angles, 1)]
    if later == 0:
        sightings = [seen_at(part, angles, 0), seen_at(whole, np.full(len(whole), 0.3), 1)]
    bends = paired_bends(sightings, [View(), View()], [0.0, 0.0], [1.0, 1.0])
    told = np.isfinite(bends[1 - later])
    np.testing.assert_array_equal(np.isfinite(bends[later]), np.isfinite(angles))
    known = part[np.isfinite(angles)]
    near = np.abs(whole[:, None] - known).min(axis=1) <= NEAR
    np.testing.assert_array_equal(told, near & (whole >= known[0]) & (whole <= known[-1]))
    assert told.sum() >= 15 and np.ptp(bends[1 - later][told]) < 1e-9
    both = float(bends[1 - later][told][0]), float(bends[later][np.isfinite(angles)][0])
    size = math.hypot(*both)
    for bend, angle in zip(both, (0.3, 0.2), strict=True):  # of the one arc whose tangent looks so from either side
        assert math.tan(angle) * math.cos(size) == pytest.approx(bend * math.sin(size) / size, abs=1e-5)
    unseen = [sightings[1 - later], [each._replace(theta=math.nan) for each in sightings[later]]]
    ordered = unseen if later == 1 else unseen[::-1]
    assert not any(np.isfinite(each).any() for each in paired_bends(ordered, [View()] * 2, [0.0] * 2, [1.0] * 2))


def test_no_angle_is_no_bend() -> None:
    unseen = Sighting(0.0, 0, math.nan, SightingVerdict.NO_TIP, np.full((2, 4, 2), math.nan))
    assert math.isnan(bend_seen(unseen, View(), 0.0))


@pytest.mark.parametrize("positive", ["right", "left"])
@pytest.mark.parametrize("pose", [{}, {"tilt_deg": 6.0, "pan_deg": -7.0, "roll_deg": 3.0}])
def test_rendered_pictures_tell_both_bends_within_their_noise_over_the_whole_range(
    positive: Side, pose: dict[str, float]
) -> None:
    """To 35 degrees in both planes at once: 0.3 deg at the corners of the range, 0.06 deg on average."""
    errors = []
    for plane in (0, 1):
        markers = Markers(base=2 * plane, tip=2 * plane + 1, positive=positive)
        scene = Scene(SceneSettings.model_validate(pose), WRIST, markers, plane=plane)
        tracker, rng = Tracker(markers, scene.view, OPEN, plane=plane), np.random.default_rng(0)
        for number, bend in enumerate(product(np.radians([-35.0, 0.0, 17.0, 35.0]), repeat=2)):
            q = segments_of(bend, uneven=0.2)
            sighting = tracker.see(Frame(scene.render(q, rng), number / 60.0, number))
            assert sighting.plane == plane and sighting.verdict is SightingVerdict.OK, np.degrees(bend)
            true = tip_bends(q)
            errors.append(bend_seen(sighting, scene.view, true[1 - plane], side=tracker.side) - true[plane])
    off = np.degrees(np.abs(errors))
    assert off.max() < 0.3 and np.sqrt((off**2).mean()) < 0.06


@pytest.mark.parametrize("plane", [0, 1])
@pytest.mark.parametrize("positive", ["right", "left"])
@pytest.mark.parametrize("model", PLANTS_IN_SPACE)
def test_the_rendered_marker_is_where_the_tip_of_its_plant_is(model: str, positive: Side, plane: Plane) -> None:
    """Of one joint bent by 35 deg in either plane: a link's tip is 2 mm, some 7 px, from that of an arc."""
    markers, q = Markers(base=2 * plane, tip=2 * plane + 1, positive=positive), np.radians([[35.0, 0.0], [0.0, -35.0]])
    scene = Scene(SceneSettings(), WRIST, markers, model, plane)
    axes, rng = before(plane, scene.camera.side), np.random.default_rng(0)
    for bent, tip in zip(q, PLANTS_IN_SPACE[model].tips(WRIST, q), strict=True):
        (centre,), (frame,) = PLANTS_IN_SPACE[model].frames(WRIST, bent, np.ones(1))
        np.testing.assert_allclose(centre, tip, atol=1e-15)
        flag = axes @ tip + axes @ frame @ axes.T @ [0.0, 0.0, -SceneSettings().marker_offset]
        sighting = Tracker(markers, scene.view, OPEN, plane=plane).see(Frame(scene.render(bent, rng), 0.0, 0))
        assert sighting.verdict is SightingVerdict.OK
        off = sighting.corners[1].mean(axis=0) - scene.camera.project(flag[None])[0]
        assert np.hypot(*off) < 1.0


def test_one_camera_alone_is_degrees_off_where_the_other_plane_is_bent() -> None:
    """By the slope of a tangent that leans away too, and by perspective."""
    q, camera = segments_of((EDGE, EDGE)), Pinhole(SceneSettings(), "right")
    sighting = projected(q, 0, camera, 0.0)
    assert abs(math.degrees(sighting.theta - EDGE)) > 2.0
    assert abs(math.degrees(bend_seen(sighting, View(), EDGE) - EDGE)) > 0.5


@pytest.mark.parametrize("plane", [0, 1])
def test_a_covered_corner_of_a_tilted_marker_is_refused(plane: Plane) -> None:
    markers = Markers(base=2 * plane, tip=2 * plane + 1)
    scene, rng = Scene(SceneSettings(), WRIST, markers, plane=plane), np.random.default_rng(0)
    tracker = Tracker(markers, scene.view, OPEN, plane=plane)
    q = segments_of((0.4, 0.5))
    assert tracker.see(Frame(scene.render(q, rng), 0.0, 0)).verdict is SightingVerdict.OK
    assert tracker.see(Frame(scene.render(q, rng, covered=True), 1.0, 1)).verdict is SightingVerdict.NO_TIP
    whole = projected(q, plane, scene.camera, 0.0).corners[1]
    assert tracker._is_tilted_square(scene.view.rectify(whole))
    pulled = whole.copy()
    pulled[0] += 0.2 * (whole[2] - whole[0])
    assert not tracker._is_tilted_square(scene.view.rectify(pulled))


def test_a_slipped_marker_is_seen_turned() -> None:
    markers = Markers(base=2, tip=3)
    scene, rng = Scene(SceneSettings(), WRIST, markers, plane=1), np.random.default_rng(0)
    tracker = Tracker(markers, scene.view, OPEN, plane=1)
    q = segments_of((0.0, 0.3))
    first = tracker.see(Frame(scene.render(q, rng), 0.0, 0)).theta
    assert first == pytest.approx(0.3, abs=2e-3)
    assert tracker.see(Frame(scene.render(q, rng, turned=0.05), 1.0, 1)).theta - first == pytest.approx(0.05, abs=3e-3)
