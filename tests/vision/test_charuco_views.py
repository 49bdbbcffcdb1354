"""What counts as a view of the board, which views differ, and what exact views tell of a camera."""

from __future__ import annotations

import math

import cv2
import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.camera import CalibrateCameraSettings, CharucoBoard
from wristctl.errors import UserError
from wristctl.vision.camera import Frame
from wristctl.vision.charuco import Album, BoardFinder, BoardView, board_of, calibrate, least_seen

PIXELS = 40
"""Of a square of the drawn board."""
LENS = np.array([[600.0, 0.0, 330.0], [0.0, 610.0, 235.0], [0.0, 0.0, 1.0]])
DISTORTION = np.array([-0.1, 0.03, 1e-3, -2e-3])
SIZE = (640, 480)


def drawn(board: CharucoBoard, right: int = 0, down: int = 0) -> NDArray[np.uint8]:
    """A picture of 640 x 480 with the board flat in it, its upper left corner so many pixels right and down."""
    ink = board_of(board).generateImage((board.columns * PIXELS, board.rows * PIXELS), marginSize=0)
    made = np.full((480, 640), 255, np.uint8)
    made[down : down + len(ink), right : right + ink.shape[1]] = ink[: 480 - down, : 640 - right]
    return made


def look(album: Album, picture: NDArray[np.uint8], name: str = "shot") -> bool:
    return album.look(Frame(picture, 0.0, 0), name)


# --- finding ----------------------------------------------------------------------------------------------------------


def test_inner_corners_are_found_where_they_are_drawn_with_their_places_on_the_board() -> None:
    board = CharucoBoard(columns=5, rows=6, square=0.03, marker=0.02)
    found = BoardFinder(board).find(drawn(board, 80, 30), "here")
    assert found is not None and found.name == "here"
    row, column = np.divmod(found.numbers, 4)
    assert sorted(found.numbers) == list(range(4 * 5))
    assert found.places == pytest.approx(0.03 * np.column_stack([column + 1, row + 1]))
    expected = PIXELS * np.column_stack([column + 1, row + 1]) + [79.5, 29.5]
    assert np.abs(found.corners - expected).max() < 0.2


def test_eight_corners_are_a_view_and_seven_are_none() -> None:
    board = CharucoBoard(columns=5, rows=3)  # two rows of four corners
    picture = drawn(board, 100, 100)
    assert BoardFinder(board).find(picture, "all") is not None
    picture[100 : 100 + 2 * PIXELS, 100 : 100 + PIXELS] = 128
    assert BoardFinder(board).find(picture, "less") is None


def test_corners_on_one_line_tell_no_camera() -> None:
    board = CharucoBoard(columns=12, rows=3)
    picture = drawn(board, 80, 100)
    both = BoardFinder(board).find(picture, "both rows")
    assert both is not None and len(both.numbers) == 22
    picture[100 + 2 * PIXELS :] = 255
    assert BoardFinder(board).find(picture, "one row") is None


# --- which are kept ---------------------------------------------------------------------------------------------------


def test_a_view_is_new_where_corners_moved_by_more_than_six_percent_of_the_width() -> None:
    board = CharucoBoard(columns=5, rows=6, square=0.03, marker=0.02)
    album = Album(board, most=5)
    assert look(album, drawn(board, 60, 30), "first")
    assert not look(album, drawn(board, 60 + 36, 30), "near")  # 38.4 px are 6 %
    assert look(album, drawn(board, 60 + 41, 30), "right")
    assert look(album, drawn(board, 60, 30 + 41), "below")
    assert not look(album, drawn(board, 60 + 20, 30 + 20), "between")
    assert [view.name for view in album.views] == ["first", "right", "below"]


def test_views_that_share_no_corner_differ() -> None:
    board = CharucoBoard(columns=8, rows=8, square=0.03, marker=0.02)
    album, whole = Album(board, most=5), drawn(board, 100, 60)
    upper, lower = whole.copy(), whole.copy()
    upper[60 + 4 * PIXELS :] = 255
    lower[: 60 + 4 * PIXELS] = 255
    assert look(album, upper, "upper") and look(album, lower, "lower")


def test_without_a_limit_every_view_is_kept_and_with_one_no_more_than_that() -> None:
    board = CharucoBoard(columns=5, rows=6, square=0.03, marker=0.02)
    pictures = [drawn(board, 60 + 60 * k, 30) for k in range(4)]
    every, three = Album(board), Album(board, most=3)
    assert [look(every, each) for each in (*pictures, pictures[0])] == [True] * 5
    assert [look(three, each) for each in pictures] == [True, True, True, False]


def test_an_album_remembers_the_last_view_and_counts_all_pictures() -> None:
    board = CharucoBoard(columns=5, rows=6, square=0.03, marker=0.02)
    album, picture = Album(board), drawn(board, 60, 30)
    assert (album.pictures, album.size, album.last) == (0, None, None)
    assert look(album, picture, "board")
    assert not look(album, np.full((480, 640), 255, np.uint8), "nothing")
    assert album.pictures == 2 and album.size == SIZE and album.last is not None and album.last.name == "board"
    assert album.last_picture is picture


def test_the_parts_that_hold_corners_are_counted_from_the_upper_left() -> None:
    board = CharucoBoard(columns=3, rows=3, square=0.03, marker=0.02)
    album = Album(board)
    assert album.seen.shape == (6, 8) and not album.seen.any()
    album.size = SIZE
    corners = np.array([[5.0, 5.0], [635.0, 5.0], [639.9, 479.9], [85.0, 165.0], [640.0, 315.0]])
    album.views.append(BoardView("some", corners, np.zeros((5, 2), np.float64), np.arange(5)))
    expected = np.zeros((6, 8), bool)
    expected[[0, 0, 5, 2, 3], [0, 7, 7, 1, 7]] = True
    assert np.array_equal(album.seen, expected)


@pytest.mark.parametrize(
    ("row", "column", "said"),
    [
        (0, 0, "upper left"), (0, 1, "top"), (0, 2, "upper right"), (1, 0, "left"), (1, 1, "middle"), (1, 2, "right"),
        (2, 0, "lower left"), (2, 1, "bottom"), (2, 2, "lower right"),
    ],
)  # fmt: skip
def test_each_part_of_the_picture_has_its_name(row: int, column: int, said: str) -> None:
    seen = np.ones((6, 9), bool)
    seen[2 * row : 2 * row + 2, 3 * column : 3 * column + 3] = False
    assert least_seen(seen) == said


# --- what they tell ---------------------------------------------------------------------------------------------------

TILTS = np.radians([0.0, 20.0, -25.0, 30.0, 35.0, -15.0, 28.0, 22.0, -32.0, 18.0])
ASIDE = [(0, 0), (0.06, 0.04), (-0.07, 0.04), (0.07, -0.05), (-0.07, -0.05), (0.0, 0.06), (0.0, -0.06), (0.09, 0.0),
         (-0.09, 0.0), (0.02, 0.02)]  # fmt: skip


def exact(number: int) -> BoardView:
    """What a camera of LENS and DISTORTION sees of a board at the numbered pose."""
    y, x = (np.ravel(each) for each in np.mgrid[1:7, 1:8])
    places = 0.025 * np.column_stack([x, y])
    axis = np.array([math.cos(number), math.sin(number), 0.0])
    middle = np.array([*ASIDE[number], 0.32 + 0.01 * number])
    turn = cv2.Rodrigues(TILTS[number] * axis)[0]
    board = np.column_stack([places - places.mean(axis=0), np.zeros(len(places))])
    seen = board @ turn.T + middle
    corners = np.asarray(cv2.projectPoints(seen, np.zeros(3), np.zeros(3), LENS, DISTORTION)[0], float).reshape(-1, 2)
    return BoardView(str(number), corners, places, np.arange(len(places)))


EXACT = [exact(number) for number in range(len(TILTS))]
SETTINGS = CalibrateCameraSettings()


def test_exact_views_give_the_camera_and_every_tilt_back() -> None:
    found = calibrate(EXACT, EXACT[0], SIZE, SETTINGS)
    assert found.view.camera_matrix == pytest.approx(LENS, abs=0.05)
    assert found.view.distortion == pytest.approx(DISTORTION, abs=1e-3)
    assert found.view.size == SIZE
    assert found.tilts == pytest.approx(np.abs(TILTS), abs=1e-4)
    assert found.error < 1e-3 and found.errors.shape == (10,) and found.deviation.shape == (8,)
    assert found.coverage == _album(EXACT).seen.mean()
    assert found.plane_error < 1e-6
    assert np.abs(found.view.rectify(EXACT[0].corners) - EXACT[0].places).max() < 1e-5


def _album(views: list[BoardView]) -> Album:
    album = Album(CharucoBoard())
    album.views, album.size = views, SIZE
    return album


def test_without_a_view_in_the_plane_the_camera_stands_square_and_the_planes_error_is_unknown() -> None:
    found = calibrate(EXACT, None, SIZE, SETTINGS)
    assert np.array_equal(found.view.plane, np.eye(3)) and math.isnan(found.plane_error)


def test_the_error_in_the_plane_is_the_distance_of_its_corners_from_their_places() -> None:
    """Root of the mean square distance, both coordinates together."""
    rng = np.random.default_rng(0)
    off = 1e-3 * rng.standard_normal(EXACT[0].places.shape)
    found = calibrate(EXACT, EXACT[0]._replace(places=EXACT[0].places + off), SIZE, SETTINGS)
    assert found.plane_error == pytest.approx(math.sqrt(2.0) * 1e-3, rel=0.15)


def test_a_residual_is_what_was_seen_less_what_was_expected() -> None:
    spoilt = list(EXACT)
    corners = EXACT[3].corners.copy()
    corners[7] += [3.0, 0.0]
    spoilt[3] = EXACT[3]._replace(corners=corners)
    found = calibrate(spoilt, None, SIZE, SETTINGS)
    residual = found.residuals[3][7]
    assert residual[0] > 2.0 and abs(residual[1]) < 0.5
    assert int(np.argmax(found.errors)) == 3
    assert found.errors[3] == pytest.approx(math.sqrt((found.residuals[3] ** 2).sum(axis=1).mean()), rel=1e-3)


def noisy(size: float) -> list[BoardView]:
    rng = np.random.default_rng(1)
    return [each._replace(corners=each.corners + size * rng.standard_normal(each.corners.shape)) for each in EXACT]


def test_the_largest_error_that_is_accepted_is_the_settings() -> None:
    views = noisy(0.5)
    error = calibrate(views, None, SIZE, SETTINGS).error
    calibrate(views, None, SIZE, SETTINGS.model_copy(update={"error": 1.01 * error}))
    with pytest.raises(UserError, match=r"reprojection error 0\.\d\d px") as told:
        calibrate(views, None, SIZE, SETTINGS.model_copy(update={"error": 0.99 * error}))
    assert told.value.exit_code == 3


def test_deviations_are_of_focal_lengths_centre_and_distortion_and_grow_with_the_noise() -> None:
    low, high = (calibrate(noisy(each), None, SIZE, SETTINGS).deviation for each in (0.1, 0.2))
    assert high == pytest.approx(2.0 * low, rel=0.15)
    assert (low[:4] > 0.01).all() and (low[4:] < 0.05).all() and (low > 0.0).all()


def test_eight_views_are_enough_and_seven_are_not() -> None:
    calibrate(EXACT[:8], None, SIZE, SETTINGS)
    with pytest.raises(UserError, match="7 different views"):
        calibrate(EXACT[:7], None, SIZE, SETTINGS)


def test_the_coverage_asked_for_is_enough() -> None:
    coverage = float(_album(EXACT).seen.mean())
    calibrate(EXACT, None, SIZE, SETTINGS.model_copy(update={"coverage": coverage}))
    with pytest.raises(UserError, match="of the picture"):
        calibrate(EXACT, None, SIZE, SETTINGS.model_copy(update={"coverage": coverage + 0.01}))


def test_the_most_tilted_view_decides_whether_the_focal_length_can_be_told() -> None:
    calibrate(EXACT, None, SIZE, SETTINGS.model_copy(update={"tilt_deg": 34.9}))
    with pytest.raises(UserError, match=r"no view is tilted by 35\.1 deg"):
        calibrate(EXACT, None, SIZE, SETTINGS.model_copy(update={"tilt_deg": 35.1}))


def distances(points: Array) -> Array:
    return np.linalg.norm(points[:, None] - points, axis=2)


def test_lengths_in_the_bending_plane_are_metres_wherever_the_board_lay() -> None:
    for number in (1, 4):
        view = calibrate(EXACT, EXACT[number], SIZE, SETTINGS).view
        assert distances(view.rectify(EXACT[number].corners)) == pytest.approx(
            distances(EXACT[number].places), abs=1e-5
        )
