"""The angle from two markers in rendered pictures is right, and what cannot be believed is refused."""

from __future__ import annotations

import os

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.vision.conftest import FRAME_RATE, Array, bent, frames
from wristctl.config.camera import Gates, Markers, SceneSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.vision.camera import Frame, Image
from wristctl.vision.detector import askew, edges, square_angle
from wristctl.vision.marker import MEANING, Sighting, SightingVerdict, Tracker
from wristctl.vision.scene import Scene
from wristctl.vision.view import View
from wristctl.wrist.kinematics import chain_tip

COUNT = 200 if os.environ.get("WRISTCTL_THOROUGH") else 30
SQUARE = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])


def errors(scene: Scene, view: View, degrees: Array) -> Array:
    """Errors [deg] of one frame after the other, all of which must be usable."""
    tracker = Tracker(Markers(), view, Gates())
    seen = [tracker.see(frame) for frame in frames(scene, degrees)]
    assert {each.verdict for each in seen} == {SightingVerdict.OK}
    return np.degrees([each.theta for each in seen]) - degrees


@pytest.mark.parametrize("distance", [0.30, 0.21, 0.165], ids=["41 px", "61 px", "81 px"])
@pytest.mark.slow
def test_angle_scatters_by_less_than_a_tenth_of_a_degree_at_40_to_80_px(distance: float) -> None:
    settings = SceneSettings(distance=distance, height_above=0.019, noise=4.0)
    scene = Scene(settings, WristParameters(length=0.06))
    off = errors(scene, scene.view, np.linspace(-40.0, 40.0, COUNT))
    assert off.std() <= 0.1
    assert abs(off.mean()) <= 0.15  # the part that calibrating the straight wrist takes away


def test_nearly_all_markers_of_20_px_are_found() -> None:
    """The usual search alone finds both in seven of ten pictures."""
    scene = Scene(SceneSettings(distance=0.57, height_above=0.019, noise=4.0), WristParameters(length=0.06))
    degrees = np.linspace(-40.0, 40.0, COUNT)
    tracker = Tracker(Markers(), scene.view, Gates())
    seen = [tracker.see(frame) for frame in frames(scene, degrees)]
    found = np.array([each.verdict is SightingVerdict.OK for each in seen])
    off = np.degrees([each.theta for each in seen])[found] - degrees[found]
    sides = [np.linalg.norm(edges(each.corners[1]), axis=1).mean() for each in seen if not np.isnan(each.theta)]
    assert np.median(sides) == pytest.approx(20.0, abs=1.0)
    assert found.mean() >= 0.95 and off.std() <= 0.7


@pytest.mark.parametrize("pose", [{"tilt_deg": 10.0}, {"pan_deg": 10.0}], ids=str)
@pytest.mark.slow
def test_homography_corrects_a_tilt_of_ten_degrees(pose: dict[str, float]) -> None:
    scene = Scene(SceneSettings.model_validate(pose), WristParameters())
    degrees = np.linspace(-45.0, 45.0, COUNT)
    uncorrected = errors(scene, View(), degrees)
    corrected = errors(scene, scene.view, degrees)
    assert np.sqrt(np.mean(corrected**2)) <= 0.15
    assert np.sqrt(np.mean(uncorrected**2)) > 2.0 * np.sqrt(np.mean(corrected**2))


def test_angle_does_not_depend_on_the_cameras_side_or_roll() -> None:
    for positive, roll in (("left", 0.0), ("right", 90.0), ("right", 180.0)):
        markers = Markers(positive=positive)  # type: ignore[arg-type]
        scene = Scene(SceneSettings(roll_deg=roll, height_above=0.04), WristParameters(), markers)
        tracker = Tracker(markers, scene.view, Gates())
        (frame,) = frames(scene, np.array([20.0]))
        assert np.degrees(tracker.see(frame).theta) == pytest.approx(20.0, abs=0.4)


@pytest.mark.parametrize("positive", ["right", "left"])
def test_the_tip_is_where_the_last_disc_is_in_metres_from_the_first(positive: str) -> None:
    """Four segments that do not bend alike: no one arc ends there."""
    markers = Markers(positive=positive)  # type: ignore[arg-type]
    scene, rng = Scene(SceneSettings(tilt_deg=8.0), WristParameters(), markers), np.random.default_rng(2)
    angles = rng.uniform(-0.2, 0.2, (COUNT, 4))
    pictures = [Frame(scene.render(each, rng), 0.2 * k, k) for k, each in enumerate(angles)]
    tips = chain_tip(angles, WristParameters().length)
    tracker = Tracker(markers, scene.view, Gates())
    off = np.array([(seen.tip_x, seen.tip_y) for seen in map(tracker.see, pictures)]) - tips
    assert np.sqrt(np.mean(off**2, axis=0)).max() < 2e-4 and np.abs(off.mean(axis=0)).max() < 1e-4
    moved = Tracker(markers.model_copy(update={"base_at": -0.03, "side": 0.01}), scene.view, Gates()).see(pictures[0])
    assert moved.tip_x == pytest.approx(-0.03 + 0.5 * (tips[0, 0] + 0.022), abs=4e-4)
    assert moved.tip_y == pytest.approx(0.5 * tips[0, 1], abs=4e-4)


def test_corners_lie_where_the_marker_was_drawn(scene: Scene) -> None:
    (frame,) = frames(scene, np.array([0.0]))
    seen = Tracker(Markers(), View(), Gates()).see(frame)
    half, ahead = 0.5 * Markers().side, WristParameters().length
    places = np.array([[1, -1], [1, 1], [-1, 1], [-1, -1]]) * half + (ahead, 0.0)
    drawn = scene.camera.project(np.column_stack([places, np.full(4, -SceneSettings().marker_offset)]))
    assert np.abs(seen.corners[1] - drawn).max() < 0.5


def test_zero_is_subtracted(scene: Scene) -> None:
    (frame,) = frames(scene, np.array([12.0]))
    plain = Tracker(Markers(), View(), Gates()).see(frame).theta
    assert Tracker(Markers(), View(), Gates(), zero=0.1).see(frame).theta == pytest.approx(plain - 0.1)


@pytest.mark.slow
def test_a_base_once_averaged_makes_the_angle_quieter(scene: Scene) -> None:
    still = frames(scene, np.full(60, 10.0))
    with_memory, without = (
        np.array([tracker.see(frame).theta for frame in still])[20:]
        for tracker in (Tracker(Markers(), View(), Gates(base_memory=each)) for each in (0.5, 1e-6))
    )
    assert with_memory.std() < 0.9 * without.std()


# --- gates ------------------------------------------------------------------------------------------------------------


class Story:
    """Frames of one wrist at 10 deg, changed one by one, before one tracker."""

    def __init__(self, scene: Scene, gates: Gates | None = None) -> None:
        self._scene, self._rng, self._number, self._time = scene, np.random.default_rng(1), 0, 0.0
        self.tracker = Tracker(Markers(), View(), gates or Gates())

    def picture(self, degrees: float = 10.0, **faults: bool) -> Image:
        return self._scene.render(bent(degrees), self._rng, **faults)

    def see(self, image: Image, wait: float = 1.0 / FRAME_RATE) -> Sighting:
        self._number += 1
        self._time += wait
        return self.tracker.see(Frame(image, self._time, self._number))


@pytest.fixture
def story(scene: Scene) -> Story:
    return Story(scene)


def without(image: Image, corners: Array) -> Image:
    """The picture with grey over a marker."""
    changed = image.copy()
    cv2.fillConvexPoly(changed, np.rint(corners).astype(np.int32), 128)
    return changed


def test_a_covered_tip_is_said_and_found_again(story: Story) -> None:
    assert story.see(story.picture()).verdict is SightingVerdict.OK
    covered = story.see(story.picture(covered=True))
    assert covered.verdict is SightingVerdict.NO_TIP and np.isnan(covered.theta)
    assert np.isfinite(covered.corners[0]).all() and np.isnan(covered.corners[1]).all()
    again = story.see(story.picture(), wait=0.3)
    assert again.verdict is SightingVerdict.OK and np.degrees(again.theta) == pytest.approx(10.0, abs=0.5)


def test_a_clamped_base_is_believed_for_a_while_and_then_no_more(story: Story) -> None:
    image = story.picture()
    base = story.see(image).corners[0]
    hidden = without(image, base)
    shortly = story.see(hidden, wait=0.4)
    assert shortly.verdict is SightingVerdict.OK and np.isnan(shortly.corners[0]).all()
    assert story.see(hidden, wait=0.2).verdict is SightingVerdict.NO_BASE


def test_without_a_base_from_the_start_there_is_no_angle(story: Story, scene: Scene) -> None:
    image = story.picture()
    base = Story(scene).see(image).corners[0]
    assert story.see(without(image, base)).verdict is SightingVerdict.NO_BASE


@pytest.mark.parametrize("seen_before", [True, False])
def test_swapped_markers_are_told_from_moved_ones(story: Story, seen_before: bool) -> None:
    if seen_before:
        assert story.see(story.picture()).verdict is SightingVerdict.OK
    assert story.see(story.picture(swapped=True)).verdict is SightingVerdict.SWAPPED
    assert story.see(story.picture(swapped=True), wait=1.0).verdict is SightingVerdict.SWAPPED
    assert story.see(story.picture(), wait=1.0).verdict is SightingVerdict.OK


def test_a_tips_marker_where_the_base_was_is_refused_though_no_base_is_seen(story: Story) -> None:
    tip = story.see(story.picture()).corners[1]
    assert story.see(without(story.picture(swapped=True), tip)).verdict is SightingVerdict.SWAPPED


def test_a_knocked_camera_is_said_and_then_learnt(story: Story) -> None:
    image = story.picture()
    story.see(image)
    knocked = np.roll(image, 12, axis=1)
    assert story.see(knocked).verdict is SightingVerdict.BASE_MOVED
    assert story.see(knocked, wait=0.6).verdict is SightingVerdict.OK


def test_a_marker_seen_twice_is_refused(story: Story) -> None:
    image = story.picture()
    (left, top), (right, bottom) = (edge(story.see(image).corners[1], axis=0).astype(int) for edge in (np.min, np.max))
    pad = 8
    patch = image[top - pad : bottom + pad, left - pad : right + pad]
    image[20 : 20 + patch.shape[0], 20 : 20 + patch.shape[1]] = patch
    assert Tracker(Markers(), View(), Gates()).see(Frame(image, 0.0, 0)).verdict is SightingVerdict.TWICE


def test_a_marker_that_is_no_square_is_refused(story: Story) -> None:
    image = story.picture(0.0)
    squeezed = cv2.resize(image, None, fx=1.0, fy=0.8, interpolation=cv2.INTER_AREA)
    assert story.see(np.asarray(squeezed, np.uint8)).verdict is SightingVerdict.SHAPE


def test_a_jump_is_refused_until_there_was_time_for_it(story: Story) -> None:
    assert story.see(story.picture(0.0)).verdict is SightingVerdict.OK
    assert story.see(story.picture(30.0)).verdict is SightingVerdict.JUMP  # 30 deg in a 60th of a second
    late = story.see(story.picture(30.0))
    assert late.verdict is SightingVerdict.OK and np.degrees(late.theta) == pytest.approx(30.0, abs=0.5)


def test_a_tip_that_leaves_its_surroundings_is_found_in_the_whole_picture(story: Story) -> None:
    assert story.see(story.picture(-40.0)).verdict is SightingVerdict.OK
    assert story.see(story.picture(40.0), wait=0.2).verdict is SightingVerdict.OK


def test_pictures_of_another_size_than_calibrated_are_an_error() -> None:
    tracker = Tracker(Markers(), View(size=(1280, 720)), Gates())
    with pytest.raises(UserError, match="640 x 480, but the calibration is of 1280 x 720"):
        tracker.see(Frame(np.zeros((480, 640), np.uint8), 0.0, 0))


def test_every_verdict_is_explained() -> None:
    assert set(MEANING) == set(SightingVerdict)


# --- the angle of a square -------------------------------------------------------------------------------------------


@given(st.floats(-3.1, 3.1), st.floats(0.1, 500.0), st.floats(-1e3, 1e3))
def test_a_turned_square_has_the_angle_it_was_turned_by(angle: float, size: float, place: float) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    corners = size * SQUARE @ turn.T + place
    assert square_angle(corners) == pytest.approx(angle, abs=1e-9)
    assert askew(corners) == pytest.approx(0.0, abs=1e-9)


@given(st.floats(-3.1, 3.1), st.floats(0.5, 0.99))
def test_no_angle_is_more_off_than_the_square_is_askew(angle: float, squeeze: float) -> None:
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    pressed = np.array([1.0, squeeze])
    off = np.angle(np.exp(1j * (square_angle(SQUARE @ turn.T * pressed) - angle)))
    assert abs(off) <= askew(SQUARE * pressed) + 1e-9
