"""Markers are found where they were printed, once each or twice, in the whole picture or near a place."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.vision.detector import Detector, edges, print_of, square_angle

SIDE, CELL = 48.0, 8
Image = NDArray[np.uint8]


def picture(*placed: tuple[int, int, int], turned: int = 0) -> Image:
    """480 x 640 pixels of white with markers of 48 px, each by its id and where its quiet zone begins (x, y)."""
    made = np.full((480, 640), 255, np.uint8)
    for number, x, y in placed:
        ink = np.rot90(print_of(number).repeat(CELL, 0).repeat(CELL, 1), turned)
        made[y : y + len(ink), x : x + len(ink)] = ink
    return made


def corners(x: int, y: int) -> NDArray[np.float64]:
    """Of the black square, whose edge lies between pixels."""
    square = SIDE * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return square + np.array([x + CELL - 0.5, y + CELL - 0.5])


@pytest.mark.parametrize("number", [0, 1, 17, 49])
def test_a_print_is_the_dictionarys_bits_in_a_black_border_in_a_white_zone(number: int) -> None:
    ink = print_of(number)
    assert ink.shape == (8, 8)
    rim = np.ones((8, 8), bool)
    rim[1:-1, 1:-1] = False
    border = np.zeros((8, 8), bool)
    border[1:-1, 1:-1] = True
    border[2:-2, 2:-2] = False
    assert (ink[rim] == 255).all() and (ink[border] == 0).all()
    known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
    assert np.array_equal(ink[2:-2, 2:-2], 255 * known.generateImageMarker(number, 6)[1:-1, 1:-1].astype(bool))


def test_markers_are_found_by_number_with_corners_clockwise_from_the_prints_upper_left() -> None:
    found = Detector().everywhere(picture((3, 100, 50), (7, 400, 300)))
    assert set(found) == {3, 7}
    assert found[3][0] == pytest.approx(corners(100, 50), abs=0.05)
    assert found[7][0] == pytest.approx(corners(400, 300), abs=0.05)
    assert Detector().everywhere(picture()) == {}


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_corners_begin_at_the_prints_own_upper_left_however_it_is_turned(quarters: int) -> None:
    (found,) = Detector().everywhere(picture((3, 100, 50), turned=quarters))[3]
    assert found == pytest.approx(np.roll(corners(100, 50), quarters, axis=0), abs=0.05)
    assert math.cos(square_angle(found) + quarters * math.pi / 2) == pytest.approx(1.0, abs=1e-4)


def test_a_number_seen_in_two_places_is_found_in_both() -> None:
    found = Detector().everywhere(picture((3, 100, 50), (3, 400, 300)))[3]
    assert sorted(each[0, 0] for each in found) == pytest.approx([107.5, 407.5], abs=0.05)


@pytest.mark.parametrize("at", [(0, 0), (300, 200), (640 - 64, 480 - 64), (0, 480 - 64), (640 - 64, 0)], ids=str)
def test_a_marker_near_its_last_place_is_found_at_its_place_in_the_whole_picture(at: tuple[int, int]) -> None:
    image, before = picture((3, *at)), corners(*at)
    for moved in ((0.0, 0.0), (15.0, -15.0), (-15.0, 15.0)):
        (found,) = Detector().around(image, before + moved)[3]
        assert found == pytest.approx(before, abs=0.05)


@pytest.mark.parametrize("noise", [4.0, 12.0])
def test_around_its_last_place_a_noisy_marker_is_smoothed_as_in_the_whole_picture(noise: float) -> None:
    """Its corners are the same; without smoothing they are a tenth of a pixel off and more."""
    grain = np.random.default_rng(0).normal(0.0, noise, (480, 640))
    image = np.clip(0.6 * picture((3, 300, 200)) + 40.0 + grain, 0.0, 255.0).astype(np.uint8)
    (whole,), (near,) = Detector().everywhere(image)[3], Detector().around(image, corners(300, 200) + 3.0)[3]
    assert near == pytest.approx(whole, abs=0.01)
    assert np.abs(whole - corners(300, 200)).max() < 0.01 * noise


def test_around_a_place_nothing_further_than_a_side_is_looked_at() -> None:
    image, place = picture((3, 300, 200)), corners(300, 200)
    for away in ((80.0, 0.0), (-80.0, 0.0), (0.0, 80.0), (0.0, -80.0)):
        assert Detector().around(image, place + away) == {}
    assert Detector().around(image, place + 2000.0 * np.eye(2)[0]) == {}  # nor beyond the picture
    assert Detector().around(image, place - 2000.0 * np.eye(2)[1]) == {}


def test_edges_go_from_each_corner_to_the_next() -> None:
    assert edges(corners(0, 0)) == pytest.approx(SIDE * np.array([[1, 0], [0, 1], [-1, 0], [0, -1]]))


def small(side: float, x: float, y: float) -> tuple[Image, NDArray[np.float64]]:
    """Marker 3 of a black square so many px wide that begins there, as sensor and lens blur it, with noise; corners."""
    scale = side / SIDE
    fine = picture((3, 0, 0))[:64, :64]
    move = np.array([[scale, 0.0, x - scale * CELL], [0.0, scale, y - scale * CELL]])
    shown = cv2.warpAffine(
        cv2.GaussianBlur(fine, (0, 0), 0.4 / scale), move, (160, 120), flags=cv2.INTER_LINEAR, borderValue=255
    )
    noise = np.random.default_rng(int(1000.0 * (x + y))).normal(0.0, 4.0, shown.shape)
    noisy = np.clip(0.7 * shown + 30.0 + noise, 0.0, 255.0).astype(np.uint8)
    square = side * np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
    return noisy, square + np.array([x - 0.5, y - 0.5])


@pytest.mark.slow
def test_markers_of_14_px_are_found_by_the_fine_search_alone_and_so_around_where_one_was() -> None:
    """Of 150 that begin anywhere between pixels; its widest window alone misses one in ten."""
    rng, detector = np.random.default_rng(0), Detector()
    placed = [small(14.0, *rng.uniform(40.0, 60.0, 2)) for _ in range(150)]
    found = [
        (detector.everywhere(image), detector.everywhere(image, fine=True), detector.around(image, corners))
        for image, corners in placed
    ]
    coarse, fine, near = (np.mean([3 in each[k] for each in found]) for k in range(3))
    assert coarse < 0.5 and fine > 0.95 and near > 0.95
    off = [np.abs(own[3][0] - at).max() for (_, own, _), (_, at) in zip(found, placed, strict=True) if 3 in own]
    assert np.median(off) < 0.5, "px"
