"""The gates of a sighting, at their limits: corners come from the test, not from pictures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.camera import Gates, Markers
from wristctl.vision import marker
from wristctl.vision.camera import Frame
from wristctl.vision.marker import Sighting, SightingVerdict, Tracker
from wristctl.vision.view import View

OK, NO_TIP, NO_BASE, SHAPE, MOVED, SWAPPED, JUMP = (
    SightingVerdict[each] for each in ("OK", "NO_TIP", "NO_BASE", "SHAPE", "BASE_MOVED", "SWAPPED", "JUMP")
)
SIDE = 40.0
UPRIGHT = 0.5 * SIDE * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
PICTURE = np.zeros((480, 640), np.uint8)


def square(x: float = 320.0, y: float = 400.0, degrees: float = 0.0) -> Array:
    """Corners of a marker here, turned clockwise."""
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    found: Array = UPRIGHT @ np.array([[c, s], [-s, c]]) + np.array([x, y])
    return found


BASE, TIP = square(), square(y=150.0)


class Scripted:
    """Finds what it is given; counts how often it looked at the whole picture."""

    def __init__(self) -> None:
        self.seen: dict[int, list[Array]] = {}
        self.whole = 0

    def everywhere(self, _image: Any, fine: bool = False) -> dict[int, list[Array]]:
        self.whole += not fine
        return self.seen

    def around(self, _image: Any, corners: Array) -> dict[int, list[Array]]:
        near = {number: [e for e in each if abs(e - corners).max() < SIDE] for number, each in self.seen.items()}
        return {number: each for number, each in near.items() if each}


class Eye:
    """A tracker that is shown corners, one frame after the other."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.monkeypatch, self.time, self.number = monkeypatch, 0.0, 0

    def open(self, markers: Markers | None = None, view: View | None = None, **gates: float) -> Eye:
        self.detector = Scripted()
        self.monkeypatch.setattr(marker, "Detector", lambda: self.detector)
        known = Gates.model_validate({"rate": 10.0, "margin_deg": 1.0, **gates})
        self.tracker = Tracker(markers or Markers(), view or View(), known)
        return self

    def see(self, base: Array | None = BASE, tip: Array | None = TIP, wait: float = 0.01, **more: Any) -> Sighting:
        self.time, self.number = self.time + wait, self.number + 1
        markers = {0: base, 1: tip, **{int(name[1:]): each for name, each in more.items()}}
        self.detector.seen = {number: [each] for number, each in markers.items() if each is not None}
        return self.tracker.see(Frame(PICTURE, self.time, self.number))


@pytest.fixture
def eye(monkeypatch: pytest.MonkeyPatch) -> Eye:
    return Eye(monkeypatch).open()


def test_a_sighting_has_the_frames_time_and_number_the_angle_and_both_markers_corners(eye: Eye) -> None:
    seen = eye.see(tip=square(y=150.0, degrees=20.0))
    assert (seen.time, seen.number, seen.verdict) == (0.01, 1, OK)
    assert math.degrees(seen.theta) == pytest.approx(20.0)
    assert np.array_equal(seen.corners, np.stack([BASE, square(y=150.0, degrees=20.0)]))


def test_the_angle_is_of_the_tip_against_the_base_and_counts_toward_the_chosen_side(eye: Eye) -> None:
    base, tip = square(degrees=5.0), square(y=150.0, degrees=20.0)
    assert math.degrees(eye.see(base, tip).theta) == pytest.approx(15.0)
    assert math.degrees(eye.open(Markers(positive="left")).see(base, tip).theta) == pytest.approx(-15.0)
    eye.open().tracker.zero = 0.1
    assert eye.see(base, tip).theta == pytest.approx(math.radians(15.0) - 0.1)


def test_angles_are_between_minus_and_plus_half_a_turn(eye: Eye) -> None:
    assert math.degrees(eye.see(square(degrees=-30.0), square(y=150.0, degrees=160.0)).theta) == pytest.approx(-170.0)


def test_other_markers_and_other_numbers_do_not_count(eye: Eye) -> None:
    assert eye.see(n7=square(x=100.0)).verdict is OK
    swapped = eye.open(Markers(base=4, tip=2)).see(None, None, n4=BASE, n2=square(y=150.0, degrees=9.0))
    assert math.degrees(swapped.theta) == pytest.approx(9.0)


@pytest.mark.parametrize(("ratio", "verdict"), [(1.11, OK), (1.13, SHAPE)])
@pytest.mark.parametrize("axis", [0, 1])
def test_a_tip_may_be_so_much_longer_than_wide(eye: Eye, ratio: float, verdict: SightingVerdict, axis: int) -> None:
    stretched = TIP.copy()
    stretched[:, axis] = (stretched[:, axis] - stretched[:, axis].mean()) * ratio + stretched[:, axis].mean()
    assert eye.see(tip=stretched).verdict is verdict


@pytest.mark.parametrize(("degrees", "verdict"), [(5.9, OK), (-5.9, OK), (6.1, SHAPE), (-6.1, SHAPE)])
def test_a_tips_corners_may_be_so_far_from_right_angles(eye: Eye, degrees: float, verdict: SightingVerdict) -> None:
    middle = TIP.mean(axis=0)
    shear = np.array([[1.0, math.tan(math.radians(degrees))], [0.0, 1.0]])
    assert eye.see(tip=(TIP - middle) @ shear.T + middle).verdict is verdict


def test_one_bad_corner_of_the_tip_is_enough_and_of_the_base_it_is_as_if_it_were_unseen(eye: Eye) -> None:
    for corner in range(4):
        bent = UPRIGHT.copy()
        bent[corner] *= 0.7
        assert eye.open().see(tip=bent + TIP.mean(axis=0)).verdict is SHAPE
        assert eye.open().see(base=bent + BASE.mean(axis=0)).verdict is NO_BASE


@pytest.mark.parametrize(("pixels", "verdict"), [(0.099 * SIDE, OK), (0.101 * SIDE, MOVED)])
@pytest.mark.parametrize("toward", [(1.0, 0.0), (0.0, -1.0)])
def test_a_base_may_move_by_a_tenth_of_its_side(
    eye: Eye, pixels: float, verdict: SightingVerdict, toward: tuple[float, float]
) -> None:
    eye.see()
    assert eye.see(base=BASE + pixels * np.array(toward)).verdict is verdict


def test_one_corner_that_moved_is_a_base_that_moved(eye: Eye) -> None:
    eye.see()
    bent = BASE.copy()
    bent[1, 0] += 0.102 * SIDE
    assert eye.see(base=bent).verdict is MOVED


def test_a_base_is_believed_for_its_memory_and_learnt_anew_after_it(eye: Eye) -> None:
    eye.open(base_memory=0.5).see()
    assert eye.see(base=None, wait=0.49).verdict is OK
    assert eye.see(base=None, wait=0.02).verdict is NO_BASE
    assert eye.see(base=BASE + 30.0).verdict is OK


def test_a_base_that_moved_does_not_renew_the_old_one(eye: Eye) -> None:
    eye.see()
    for _ in range(4):
        assert eye.see(base=BASE + 30.0, tip=TIP + 30.0, wait=0.12).verdict is MOVED
    assert eye.see(base=BASE + 30.0, tip=TIP + 30.0, wait=0.05).verdict is OK


def test_the_base_is_the_mean_of_what_was_seen_of_it(eye: Eye) -> None:
    """All alike while there are few, then fading with its memory."""
    turned = [0.0, 0.9, 0.3]
    for degrees, mean in zip(turned, (0.0, 0.45, 0.4), strict=True):
        assert math.degrees(eye.see(base=square(degrees=degrees)).theta) == pytest.approx(-mean, abs=0.01)
    eye.open(base_memory=0.1)
    eye.see()
    assert math.degrees(eye.see(base=square(degrees=1.0), wait=0.09).theta) == pytest.approx(
        -(1.0 - math.exp(-0.9)), abs=0.01
    )


def test_without_a_tip_the_base_is_still_averaged_and_remembered(eye: Eye) -> None:
    assert eye.see(tip=None).verdict is NO_TIP
    assert eye.see(base=None).verdict is OK


@pytest.mark.parametrize(("ahead", "verdict"), [(1.1, OK), (0.9, SWAPPED), (-2.0, SWAPPED)])
def test_the_tip_lies_a_side_ahead_of_the_base_at_least(eye: Eye, ahead: float, verdict: SightingVerdict) -> None:
    """In the direction of the base's own top edge."""
    for degrees in (0.0, 90.0, 200.0):
        turn = math.radians(degrees)
        up = SIDE * np.array([math.sin(turn), -math.cos(turn)])
        base = square(320.0, 240.0, degrees)
        x, y = np.array([320.0, 240.0]) + ahead * up
        assert eye.open().see(base, square(float(x), float(y), degrees)).verdict is verdict


@pytest.mark.parametrize(("degrees", "verdict"), [(6.7, OK), (-6.7, OK), (6.8, JUMP), (-6.8, JUMP)])
def test_an_angle_may_change_by_its_rate_and_a_margin(eye: Eye, degrees: float, verdict: SightingVerdict) -> None:
    """10 rad/s in 10 ms are 5.73 deg, and 1 deg on top."""
    eye.see()
    assert eye.see(tip=square(y=150.0, degrees=degrees)).verdict is verdict


def test_after_a_refused_frame_the_last_used_one_counts(eye: Eye) -> None:
    eye.see()
    far = square(y=150.0, degrees=12.0)
    assert eye.see(tip=far).verdict is JUMP and math.isnan(eye.see(tip=far, wait=0.001).theta)
    assert eye.see(tip=far).verdict is OK, "21 ms are 12 deg, and 1 deg on top"


def test_the_whole_picture_is_searched_only_where_a_marker_is_not_where_it_was(eye: Eye) -> None:
    eye.see()
    eye.see()
    assert eye.detector.whole == 1
    eye.see(tip=square(x=450.0, y=150.0))
    assert eye.detector.whole == 2
    eye.see(tip=None)
    assert eye.see(tip=square(x=450.0, y=150.0)).verdict is OK and eye.detector.whole == 4


def test_corners_are_judged_as_the_view_sets_them_square(eye: Eye) -> None:
    squeezed = np.array([[1.0, 0.0, 0.0], [0.0, 1.3, 0.0], [0.0, 0.0, 1.0]])
    base, tip = (each / np.array([1.0, 1.3]) for each in (BASE, square(y=150.0, degrees=30.0)))
    assert eye.see(base, tip).verdict is not OK
    again = eye.open(view=View(plane=squeezed)).see(base, tip)
    assert again.verdict is OK and math.degrees(again.theta) == pytest.approx(30.0)
    assert np.array_equal(again.corners, np.stack([base, tip])), "in pixels"
