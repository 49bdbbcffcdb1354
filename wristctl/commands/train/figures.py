"""Figures of data sets and trainings. Positions are drawn as on an upright wrist: x goes up, y to the right."""

from typing import Any

import numpy as np
import pandas as pd
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.learning.evaluation import ErrorMap
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    INDIGO,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    darkened,
    figure,
    legend,
    logarithmic,
    title,
)

# Colour maps, safe for the colour-blind: angles to either side of a middle, errors from dark (none) to bright.
ANGLES, ERRORS = "PuOr", "cividis"

# More dots than this are drawn as pixels, or an SVG would hold a path for each.
MOST_PATHS = 5000

_OF_PLANES = {"ulnar": INDIGO, "flexion": SKY}


def coverage(samples: pd.DataFrame, count: int | None = None) -> Figure:
    """Tip positions of a data set, coloured by bending angle; a table with x, y [m] and theta [rad].

    It may be a part of the data set, which has `count` samples. In two planes they are seen from both sides.
    """
    shown = f"{len(samples)} of {count}" if count not in (None, len(samples)) else f"{len(samples)}"
    if "z" in samples:
        return _both_sides(samples, f"{shown} samples of the tip")
    picture, axes = _workspace(1e3 * samples["y"], 1e3 * samples["x"])
    title(axes, f"{shown} samples of the tip")
    bend = float(np.degrees(samples["theta"].abs().max()))
    across, up, shade = 1e3 * samples["y"], 1e3 * samples["x"], np.degrees(samples["theta"])
    dots = _dots(axes, across, up, shade, cmap=darkened(ANGLES), vmin=-bend, vmax=bend)
    picture.colorbar(dots, ax=axes, label="bending angle [deg]")
    return picture


def learning_curves(curves: pd.DataFrame, kept: int = 0) -> Figure:
    """Errors over the epochs, the kept trial bold; a table with trial, epoch, train_loss, validation_loss [rad^2]."""
    picture, ((axes,),) = figure()
    lines = (("train_loss", BLUE, "training"), ("validation_loss", VERMILLION, "validation"))
    for trial, rows in curves.groupby("trial"):
        bold = trial == kept
        for column, colour, label in lines:
            rmse = np.degrees(np.sqrt(rows[column]))
            style = {"label": label, "zorder": 3} if bold else {"linewidth": 0.8, "alpha": 0.35}
            axes.plot(rows["epoch"], rmse, color=colour, **style)
    if curves["trial"].nunique() > 1:
        title(axes, f"trial {kept} was kept; faint: trials that were not")
    axes.set(xlabel="epoch", ylabel="RMSE of the angle [deg]")
    logarithmic(axes.yaxis, (1.0, 2.0, 5.0))
    legend(axes, loc="upper right")
    return picture


def predicted_angles(predictions: pd.DataFrame) -> Figure:
    """The network's angle over the true one, and its error; a table with theta and theta_network [rad].

    In two planes the bends of both.
    """
    if "theta" in predictions:
        shown, what = [("theta", "test samples", BLUE)], "angle"
    else:
        shown, what = [(f"bend_{plane}", f"toward {plane}", _OF_PLANES[plane]) for plane in _OF_PLANES], "bend"
    picture, axes = figure(1, 2, height=3.2)
    left, right = axes[0]
    ends = np.degrees([predictions[[name for name, _, _ in shown]].to_numpy().min(),
                       predictions[[name for name, _, _ in shown]].to_numpy().max()])  # fmt: skip
    left.plot(ends, ends, color=BLACK, linewidth=0.8, label="equal")
    right.axhline(0.0, color=BLACK, linewidth=0.8)
    for column, label, colour in shown:
        true, network = (np.degrees(predictions[name]) for name in (column, f"{column}_network"))
        dots: Any = {"color": colour, "marker": ".", "markersize": 4, "linestyle": ""}
        dots |= {"rasterized": len(true) > MOST_PATHS}
        left.plot(true, network, label=label, **dots)
        right.plot(true, network - true, **dots)
    left.set(xlabel=f"true {what} [deg]", ylabel=f"network's {what} [deg]")
    left.set_box_aspect(1)
    legend(left, loc="upper left")
    right.set(xlabel=f"true {what} [deg]", ylabel="error of the network [deg]")
    right.set_box_aspect(1)
    return picture


def error_over_workspace(tip: Array, error: Array) -> Figure:
    """Absolute error of a network at tips [m]: on a grid (A, L, 2) filled, of samples (N, 2) as dots; errors [rad]."""
    up, across = np.moveaxis(1e3 * tip, -1, 0)
    picture, axes = _workspace(across, up)
    picture.colorbar(_draw_errors(axes, across, up, error), ax=axes, label="absolute error [deg]")
    return picture


def worst_over_lengths(grid: ErrorMap) -> tuple[Array, Array]:
    """Bends (A, D, 2) [rad] of a map in two planes, and the largest error over the arc lengths (A, D) [rad]."""
    return grid.theta[:, :, 0], grid.size.max(axis=2)


def errors_over_bends(bends: Array, error: Array) -> Figure:
    """Errors of a network [rad] in the plane of bends: on a grid (A, D, 2) [rad] filled, of samples (N, 2) as dots."""
    picture, ((axes,),) = figure(height=4.6)
    across, up = np.moveaxis(np.degrees(bends), -1, 0)
    drawn = _draw_errors(axes, across, up, error, "; the worst of all arc lengths")
    axes.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]", aspect="equal")
    picture.colorbar(drawn, ax=axes, label="error over both planes [deg]")
    return picture


def _draw_errors(axes: Axes, across: Array, up: Array, error: Array, of_a_grid: str = "") -> Any:
    """Draw sizes of errors [deg] at places: a grid's filled with its greatest in a circle, those of samples as dots."""
    degrees = np.abs(np.degrees(error))
    where = f"at the circle{of_a_grid}" if error.ndim == 2 else "on the test samples"
    title(axes, f"greatest error {degrees.max():.3g} deg, {where}")
    if error.ndim == 2:
        worst = np.unravel_index(degrees.argmax(), degrees.shape)
        ring: Any = {"fillstyle": "none", "markersize": 10, "markeredgewidth": 1.5}
        axes.plot(across[worst], up[worst], "o", color=VERMILLION, **ring)
        return axes.pcolormesh(across, up, degrees, shading="gouraud", cmap=ERRORS, vmin=0.0, rasterized=True)
    order = np.argsort(degrees)
    return _dots(axes, across[order], up[order], degrees[order], s=8.0, cmap=ERRORS, vmin=0.0)


def _dots(axes: Axes, across: ArrayLike, up: ArrayLike, values: ArrayLike, **options: Any) -> Any:
    """Draw samples as dots coloured by their values, which are smaller where they are many, as pixels beyond some."""
    count = np.size(values)
    size = {"s": float(np.clip(12_000 / count, 0.5, 12.0)), "rasterized": count > MOST_PATHS}
    return axes.scatter(across, up, c=values, linewidths=0.0, **size | options)


def _both_sides(samples: pd.DataFrame, heading: str) -> Figure:
    size = np.degrees(np.hypot(samples["bend_ulnar"], samples["bend_flexion"]))
    picture, (panels,) = figure(1, 2, height=2.2)
    for axes, aside, toward in zip(panels, "yz", _OF_PLANES, strict=True):
        dots = _dots(axes, 1e3 * samples[aside], 1e3 * samples["x"], size, cmap=ERRORS, vmin=0.0)
        axes.set(xlabel=f"{aside}, toward {toward} [mm]", ylabel="x [mm]", aspect="equal")
    title(panels[0], heading)
    picture.colorbar(dots, ax=list(panels), label="size of the bend [deg]")
    return picture


def accuracy_against_cost(grid: pd.DataFrame, chosen: int) -> Figure:
    """Cross-validated RMSE over multiply-adds: a table with activation, hidden, multiply_adds, rmse_deg, error_deg."""
    picture, ((axes,),) = figure(height=4.2)
    colours = (BLUE, VERMILLION, GREEN, ORANGE, PURPLE)
    for colour, (activation, rows) in zip(colours, grid.groupby("activation", sort=False), strict=False):
        rows = rows.sort_values("multiply_adds")
        axes.errorbar(
            rows["multiply_adds"], rows["rmse_deg"], rows["error_deg"], color=colour, marker="o", markersize=4,
            linewidth=0.8, capsize=2.0, label=str(activation),
        )  # fmt: skip
    chosen_row = grid.iloc[chosen]
    axes.plot(
        chosen_row["multiply_adds"],
        chosen_row["rmse_deg"],
        "o",
        color=BLACK,
        fillstyle="none",
        markersize=12,
        label="chosen",
    )
    logarithmic(axes.xaxis)
    logarithmic(axes.yaxis)
    axes.set(xlabel="multiply-adds of one angle", ylabel="cross-validated RMSE [deg]")
    title(axes, "mean over the folds with its standard error")
    legend(axes, loc="best")
    return picture


def _workspace(across: ArrayLike, up: ArrayLike) -> tuple[Figure, Axes]:
    """A figure as tall as a map of these positions [mm] needs at equal scales; of a single one a millimetre is seen."""
    low, high = (np.array([f(across), f(up)]) for f in (np.min, np.max))
    width, height = np.maximum(high - low, 1.0)
    picture, ((axes,),) = figure(height=float(np.clip(5.6 * height / width + 1.1, 2.4, 7.0)))
    edge = np.maximum(0.04 * width, 0.5 * (1.0 - (high - low)))
    axes.set(xlim=(low[0] - edge[0], high[0] + edge[0]), ylim=(low[1] - edge[1], high[1] + edge[1]), aspect="equal")
    axes.set(xlabel="y [mm]", ylabel="x [mm]")
    return picture, axes
