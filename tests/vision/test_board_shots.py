"""Rendered pictures of the calibration board show it whole, held in all poses within reach, and then in the plane."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest

from wristctl.arrays import Array
from wristctl.config.camera import CharucoBoard, SceneSettings
from wristctl.vision.camera import Frame
from wristctl.vision.charuco import BoardFinder, BoardView
from wristctl.vision.scene import board_shots
from wristctl.vision.view import Pinhole

BOARD = CharucoBoard(columns=6, rows=8, square=0.02, marker=0.015)
PLAIN = SceneSettings(noise=0.0, gradient=0.0, blur=0.0, distortion=0.0, tilt_deg=10.0, pan_deg=-4.0)
CAMERA = Pinhole(PLAIN, "right")
MIDDLE = np.array([0.5 * 6 * 0.02, 0.5 * 8 * 0.02])
VIEWS = 9


@pytest.fixture(scope="module")
def shots() -> list[Frame]:
    return list(board_shots(PLAIN, BOARD, VIEWS, np.random.default_rng(5)))


@pytest.fixture(scope="module")
def seen(shots: list[Frame]) -> list[BoardView]:
    finder = BoardFinder(BOARD)
    found = [finder.find(frame.image, str(frame.number)) for frame in shots]
    assert all(found)
    return [each for each in found if each]


@pytest.fixture(scope="module")
def poses(seen: list[BoardView]) -> list[tuple[Array, Array]]:
    """Axes (3, 3) and middle (3,) of each board before the camera, by where its corners are seen."""
    found = []
    for view in seen:
        board = np.column_stack([view.places - MIDDLE, np.zeros(len(view.places))])
        _, turn, move = cv2.solvePnP(board, view.corners, CAMERA.matrix, CAMERA.distortion)
        expected = cv2.projectPoints(board, turn, move, CAMERA.matrix, CAMERA.distortion)[0].reshape(-1, 2)
        assert np.sqrt(((expected - view.corners) ** 2).mean()) < 0.15  # it looks like a flat board
        found.append((np.asarray(cv2.Rodrigues(turn)[0], float), np.asarray(move, float).ravel()))
    return found


@pytest.mark.slow
def test_there_are_as_many_pictures_as_asked_for_numbered_and_of_the_cameras_size(shots: list[Frame]) -> None:
    assert [frame.number for frame in shots] == list(range(VIEWS)) == [frame.time for frame in shots]
    assert {frame.image.shape for frame in shots} == {(PLAIN.height, PLAIN.width)}


def test_most_of_the_board_is_seen_in_most_pictures_and_all_of_it_in_the_plane(seen: list[BoardView]) -> None:
    assert np.median([len(view.corners) for view in seen]) > 0.6 * 5 * 7
    assert len(seen[-1].corners) == 5 * 7


def test_boards_in_hand_are_tilted_by_15_to_40_degrees_toward_different_sides(poses: list[tuple[Array, Array]]) -> None:
    normals = np.array([turn[:, 2] for turn, _ in poses[:-1]])
    tilts = np.degrees(np.arccos(normals[:, 2]))
    assert tilts.min() > 14.0 and tilts.max() < 41.0 and np.ptp(tilts) > 5.0
    toward = np.sort(np.arctan2(normals[:, 1], normals[:, 0]))
    assert np.diff([*toward, toward[0] + math.tau]).max() < math.pi


def test_boards_in_hand_are_upright_and_on_their_side_in_turn(poses: list[tuple[Array, Array]]) -> None:
    for number, (turn, _) in enumerate(poses[:-1]):
        roll = math.degrees(math.atan2(turn[1, 0], turn[0, 0]))
        assert abs(roll - 90.0 * (number % 2)) < 25.0 + 15.0  # tilting turns it a little too


def test_boards_in_hand_fill_a_good_part_of_the_picture(poses: list[tuple[Array, Array]]) -> None:
    """The longer side is a 1.5th to a 0.9th of the picture's height at its distance."""
    distances = np.array([move[2] for _, move in poses[:-1]])
    shares = 8 * 0.02 * CAMERA.matrix[0, 0] / distances / PLAIN.height
    assert shares.min() > 1 / 1.53 and shares.max() < 1 / 0.88 and np.ptp(shares) > 0.1


def test_their_middles_go_around_the_pictures_middle_out_to_its_edges(poses: list[tuple[Array, Array]]) -> None:
    pixels = np.array([(CAMERA.matrix @ (move / move[2]))[:2] for _, move in poses[:-1]])
    places = pixels / (PLAIN.width, PLAIN.height) - 0.5
    away = np.hypot(*places.T)
    assert away == pytest.approx(0.36 * np.sqrt((np.arange(VIEWS - 1) + 0.5) / (VIEWS - 1)), abs=0.01)
    turns = np.diff(np.unwrap(np.arctan2(places[:, 1], places[:, 0])))
    assert turns == pytest.approx(math.tau * (3.0 - math.sqrt(5.0)) / 2.0, abs=0.05)  # the golden angle spreads them


def test_the_last_board_lies_in_the_bending_plane_on_its_side_before_the_wrist(seen: list[BoardView]) -> None:
    found = CAMERA.view.rectify(seen[-1].corners)
    askew = math.radians(93.0)
    turn = np.array([[math.cos(askew), -math.sin(askew)], [math.sin(askew), math.cos(askew)]])
    expected = (seen[-1].places - MIDDLE) @ turn.T + [0.0, -PLAIN.height_above]
    assert np.abs(found - expected).max() < 2e-4


def test_ink_and_paper_are_as_far_apart_as_the_contrast_says() -> None:
    (frame,) = (
        each
        for each in board_shots(PLAIN.model_copy(update={"contrast": 0.75}), BOARD, 2, np.random.default_rng(0))
        if each.number
    )
    levels, counts = np.unique(frame.image, return_counts=True)
    ink, paper = (round(128 + 0.75 * (each - 128)) for each in (0, 255))
    common = {int(level) for level, count in zip(levels, counts, strict=True) if count > 3000}
    assert common == {ink, paper, 122} and levels.min() == ink and levels.max() == paper


@pytest.mark.slow
def test_boards_in_hand_are_the_seeds_and_the_one_in_the_plane_is_not(shots: list[Frame]) -> None:
    again = list(board_shots(PLAIN, BOARD, 2, np.random.default_rng(5)))
    other = list(board_shots(PLAIN, BOARD, 2, np.random.default_rng(6)))
    assert again[-1].image.tobytes() == shots[-1].image.tobytes() == other[-1].image.tobytes()
    assert again[0].image.tobytes() != other[0].image.tobytes()
