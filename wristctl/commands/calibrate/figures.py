"""Figures of a camera's calibration: what the views leave unexplained, the lens, and the bending plane set square."""

from collections.abc import Sequence

import cv2
import numpy as np
from matplotlib.figure import Figure

from wristctl.plotting.style import BLUE, DISTORTED, LIGHT, STRAIGHT, VERMILLION, figure, legend_below, title
from wristctl.vision.camera import Image
from wristctl.vision.charuco import BoardView, CameraCalibration
from wristctl.vision.view import View

_PARTS, _FINE = 12, 60


def reprojection(calibration: CameraCalibration, views: Sequence[BoardView]) -> Figure:
    """Seen less expected position of the corners over the picture, and RMS of each view [px]."""
    picture, ((over, bars),) = figure(1, 2, width=9.0, height=4.0, width_ratios=(1.5, 1))
    width, height = calibration.view.size or (1, 1)
    corners, off = np.concatenate([view.corners for view in views]), np.concatenate(calibration.residuals)
    arrows = over.quiver(*corners.T, *off.T, angles="xy", color=BLUE, width=0.002)
    longest = float(f"{np.abs(off).max():.0e}")
    over.quiverkey(arrows, 0.82, 1.04, longest, f"{longest:g} px", labelpos="E", fontproperties={"size": 9.0})
    over.set(xlim=(0, width), ylim=(height, 0), xlabel="x [px]", ylabel="y [px]", aspect="equal")
    title(over, f"seen less expected, {len(corners)} corners")
    names = [view.name for view in views]
    bars.barh(np.arange(len(names)), calibration.errors, color=BLUE)
    bars.axvline(calibration.error, color=VERMILLION, linewidth=1.2)
    title(bars, f"all views: {calibration.error:.2f} px")
    every = max(1, len(names) // 15)
    bars.set_yticks(np.arange(len(names))[::every], names[::every])
    bars.set(xlabel="reprojection error (RMS) [px]", ylabel="view", ylim=(len(names) - 0.3, -0.7))
    bars.grid(False, axis="y")
    return picture


def lens(view: View) -> Figure:
    """A square grid as the lens shows it, and where the calibration puts it back."""
    picture, ((axes,),) = figure(height=4.6)
    width, height = view.size or (1, 1)
    rows = round(_PARTS * height / width)
    for k, (count, across) in enumerate(((_PARTS, height), (rows, width))):
        for place in np.linspace(0.0, (width, height)[k], count + 1):
            along = np.linspace(0.0, across, _FINE)
            line = np.column_stack([np.full(_FINE, place), along][:: 1 - 2 * k])
            straight = view.undistort(line)
            for shown, style, label in ((line, DISTORTED, "in the picture"), (straight, STRAIGHT, "undistorted")):
                axes.plot(*shown.T, **style, label=label if k + place == 0 else None)
    centre = view.camera_matrix[:2, 2]
    axes.plot(*centre, marker="+", color=VERMILLION, markersize=9.0, linestyle="", label="optical axis")
    axes.set(xlabel="x [px]", ylabel="y [px]", aspect="equal")
    axes.grid(False)
    axes.invert_yaxis()
    title(axes, "a square grid of the picture, undistorted")
    legend_below(picture)
    return picture


def plane(picture: Image, board_view: BoardView, view: View) -> Figure:
    """The view in the bending plane, undistorted and set square: the board's squares are squares, in mm."""
    sheet, ((before, after),) = figure(1, 2, width=9.0, height=3.9)
    before.imshow(picture, cmap="gray", vmin=0, vmax=255)
    before.plot(*board_view.corners.T, linestyle="", marker="+", color=VERMILLION, markersize=5.0)
    before.set(xlabel="x [px]", ylabel="y [px]")
    title(before, f"view {board_view.name}: the board in the bending plane")
    low, high = board_view.places.min(axis=0) - 0.03, board_view.places.max(axis=0) + 0.03
    scale = 480.0 / float((high - low).max())
    onto = np.array([[scale, 0.0, -scale * low[0]], [0.0, scale, -scale * low[1]], [0.0, 0.0, 1.0]]) @ view.plane
    size = tuple(int(side) for side in np.ceil(scale * (high - low)))
    square = cv2.warpPerspective(cv2.undistort(picture, view.camera_matrix, view.distortion), onto, size)
    extent = (1e3 * low[0], 1e3 * high[0], 1e3 * high[1], 1e3 * low[1])
    after.imshow(square, cmap="gray", vmin=0, vmax=255, extent=extent)
    after.plot(*(1e3 * view.rectify(board_view.corners)).T, linestyle="", marker="+", color=VERMILLION, markersize=5.0)
    after.set(xlabel="along the board's columns [mm]", ylabel="along its rows [mm]")
    title(after, "undistorted and set square")
    for axes in (before, after):
        axes.grid(False)
        axes.spines[:].set_color(LIGHT)
    return sheet
