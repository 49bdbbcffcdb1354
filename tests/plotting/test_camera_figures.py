"""Figures of a camera's calibration show its corners, its lens and its plane."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.quiver import Quiver

from wristctl.commands.calibrate.figures import lens, plane, reprojection
from wristctl.vision.charuco import BoardView, CameraCalibration
from wristctl.vision.view import View

WIDTH, HEIGHT = 320, 240
MATRIX = np.array([[300.0, 0.0, 150.0], [0.0, 300.0, 110.0], [0.0, 0.0, 1.0]])
SQUARE = View(MATRIX, np.zeros(4), np.diag([1e-3, 1e-3, 1.0]), (WIDTH, HEIGHT))
"""Without distortion, before a plane in which a pixel is a millimetre."""


def views(count: int) -> list[BoardView]:
    rng = np.random.default_rng(count)
    corners = [rng.uniform((20.0, 30.0), (300.0, 200.0), (6, 2)) for _ in range(count)]
    return [BoardView(f"v{k}", each, 1e-3 * each, np.arange(6)) for k, each in enumerate(corners)]


def calibration(seen: list[BoardView]) -> CameraCalibration:
    errors = 0.1 * np.arange(1.0, len(seen) + 1.0)
    off = [np.full((6, 2), each) * [0.5, -1.0] for each in errors]
    return CameraCalibration(SQUARE, 0.25, errors, off, np.zeros(8), np.zeros(len(seen)), 0.9, 1e-4)


def names(axes: Axes) -> tuple[str, str]:
    return axes.get_xlabel(), axes.get_ylabel()


def test_an_arrow_leads_from_each_corner_by_what_is_left_over() -> None:
    seen = views(4)
    found = calibration(seen)
    over, _ = reprojection(found, seen).axes
    (arrows,) = (each for each in over.collections if isinstance(each, Quiver))
    np.testing.assert_allclose(np.asarray(arrows.get_offsets()), np.concatenate([each.corners for each in seen]))
    np.testing.assert_allclose(np.column_stack([arrows.U, arrows.V]), np.concatenate(found.residuals))
    assert over.get_title("left") == "seen less expected, 24 corners" and names(over) == ("x [px]", "y [px]")
    assert (over.get_xlim(), over.get_ylim()) == ((0.0, WIDTH), (HEIGHT, 0.0)), "as the picture, y downward"


def test_the_key_is_as_long_as_the_longest_arrow_in_one_digit() -> None:
    seen = views(4)
    over = reprojection(calibration(seen), seen).axes[0]
    (key,) = (each for each in over.artists if hasattr(each, "labelpos"))
    assert getattr(key, "U", 0.0) == 0.4 and getattr(key, "label", "") == "0.4 px"


def test_bars_are_the_errors_of_the_views_from_above_and_a_line_is_that_of_all() -> None:
    seen = views(4)
    found = calibration(seen)
    bars = reprojection(found, seen).axes[1]
    assert [bar.get_width() for bar in bars.patches] == pytest.approx(found.errors)  # type: ignore[attr-defined]
    assert list(np.asarray(bars.lines[0].get_xdata())) == [0.25, 0.25]
    assert [label.get_text() for label in bars.get_yticklabels()] == ["v0", "v1", "v2", "v3"]
    low, high = bars.get_ylim()
    assert low > 3.0 and high < 0.0, "the first is the uppermost"
    assert bars.get_title("left") == "all views: 0.25 px"
    assert names(bars) == ("reprojection error (RMS) [px]", "view")


@pytest.mark.parametrize(("count", "every"), [(15, 1), (29, 1), (30, 2), (31, 2), (45, 3)])
def test_of_many_views_every_so_manieth_is_named(count: int, every: int) -> None:
    seen = views(count)
    bars = reprojection(calibration(seen), seen).axes[1]
    assert [label.get_text() for label in bars.get_yticklabels()] == [f"v{k}" for k in range(0, count, every)]
    assert list(bars.get_yticks()) == list(range(0, count, every))


def test_without_distortion_the_grid_stays_where_it_is() -> None:
    (axes,) = lens(SQUARE).axes
    *grid, centre = axes.lines
    for shown, straight in zip(grid[::2], grid[1::2], strict=True):
        np.testing.assert_allclose(np.asarray(shown.get_data()), np.asarray(straight.get_data()), atol=1e-3)
    assert np.asarray(centre.get_data()).ravel() == pytest.approx([150.0, 110.0])


def test_the_grid_covers_the_picture_with_squares() -> None:
    (axes,) = lens(SQUARE).axes
    shown = [np.asarray(each.get_data()) for each in axes.lines[:-1:2]]
    upright = [x[0] for x, y in shown if np.ptp(x) == 0.0]
    level = [y[0] for x, y in shown if np.ptp(y) == 0.0]
    assert len(upright) + len(level) == len(shown) and 8 < len(upright) < 20
    for at, most in ((upright, WIDTH), (level, HEIGHT)):
        assert at == pytest.approx(np.linspace(0.0, most, len(at)))
    assert upright[1] == pytest.approx(level[1], rel=0.1), "squares"
    for x, y in shown:
        along, most = (y, HEIGHT) if np.ptp(x) == 0.0 else (x, WIDTH)
        assert (along[0], along[-1]) == (0.0, most) and len(along) > 30


def test_the_undistorted_grid_is_where_the_view_puts_it_and_each_line_is_named_once() -> None:
    (axes,) = lens(replace(SQUARE, distortion=np.array([-0.2, 0.05, 0.001, 0.0]))).axes
    view = replace(SQUARE, distortion=np.array([-0.2, 0.05, 0.001, 0.0]))
    *grid, _ = axes.lines
    for shown, straight in zip(grid[::2], grid[1::2], strict=True):
        before, after = (np.asarray(each.get_data()).T for each in (shown, straight))
        np.testing.assert_allclose(after, view.undistort(before))
    named = [str(each.get_label()) for each in axes.lines if not str(each.get_label()).startswith("_")]
    assert named == ["in the picture", "undistorted", "optical axis"]
    assert names(axes) == ("x [px]", "y [px]") and axes.yaxis_inverted()
    assert not any(line.get_visible() for line in axes.get_xgridlines())


@pytest.mark.parametrize("of", ["reprojection", "lens"])
def test_a_view_of_pictures_of_any_size_is_drawn_too(of: str) -> None:
    anywhere = replace(SQUARE, size=None)
    seen = views(3)
    made = reprojection(calibration(seen)._replace(view=anywhere), seen) if of == "reprojection" else lens(anywhere)
    if of == "reprojection":
        assert (made.axes[0].get_xlim(), made.axes[0].get_ylim()) == ((0.0, 1.0), (1.0, 0.0))
    else:
        assert max(np.asarray(each.get_data()).max() for each in made.axes[0].lines[:-1:2]) == 1.0


def test_the_plane_is_set_square_in_mm_with_a_margin_around_the_board() -> None:
    corners = np.array([[x, y] for y in (80.0, 120.0) for x in (100.0, 160.0, 200.0)])
    seen = BoardView("7", corners, 1e-3 * corners, np.arange(6))
    picture = np.full((HEIGHT, WIDTH), 200, np.uint8)
    picture[75:125, 95:205] = 30  # darker where the board is
    before, after = plane(picture, seen, SQUARE).axes
    np.testing.assert_allclose(np.asarray(before.lines[0].get_data()).T, corners)
    np.testing.assert_allclose(np.asarray(after.lines[0].get_data()).T, corners, rtol=1e-5)
    assert names(before) == ("x [px]", "y [px]") and before.get_title("left").startswith("view 7:")
    assert names(after) == ("along the board's columns [mm]", "along its rows [mm]")
    left, right, bottom, top = after.images[0].get_extent()
    assert (left, right, top, bottom) == pytest.approx((70.0, 230.0, 50.0, 150.0)), "30 mm beyond its corners"
    shown = np.asarray(after.images[0].get_array())
    assert shown.shape[1] == 480 and shown.shape[0] == 300
    dark = np.argwhere(shown < 100)
    (first, last) = dark.min(axis=0), dark.max(axis=0)
    scale = 160.0 / 480.0
    assert [70.0 + scale * first[1], 70.0 + scale * last[1]] == pytest.approx([95.0, 205.0], abs=1.0)
    assert [50.0 + scale * first[0], 50.0 + scale * last[0]] == pytest.approx([75.0, 125.0], abs=1.0)
    for image in (before.images[0], after.images[0]):
        assert image.get_clim() == (0, 255), "grey as it was taken"
    assert not any(line.get_visible() for axes in (before, after) for line in axes.get_xgridlines())
