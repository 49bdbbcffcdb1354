"""Figures of a comparison: every controller on every reference of one loop, or on one reference of every loop."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.patches import Rectangle

from wristctl.arrays import Array
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.comparison_data import metrics_of
from wristctl.comparison.paper import T2
from wristctl.comparison.statistics import spread
from wristctl.report.loop_figures import draw_desired, within_half_a_move
from wristctl.report.style import GREY, WIDTH, PowersOfTen, colour, figure, line, logarithmic, title, undress

Across = Literal["reference", "loop"]
"""What the columns of a figure are."""

_EVERY = 10
"""Small panels show every tenth sample."""

_FAILED = "///"
"""Hatch of what diverged."""


def angle_grid(results: Sequence[ComparedRow], heading: str = "", across: Across = "reference") -> Figure:
    """Desired and obtained angle [deg] over time [s]: rows of controllers and gains, columns as `across` says."""
    rows, columns = _names(results, across)
    size = {"width": max(WIDTH, 1.0 + 1.3 * len(columns)), "height": 1.0 + 1.05 * len(rows)}
    made, axes = figure(len(rows), len(columns), sharex=True, sharey=True, **size)
    for result in results:
        panel = axes[rows.index(_row(results, result)), columns.index(getattr(result, across))]
        course = result.simulation.trajectory
        panel.plot(course.time[::_EVERY], np.degrees(course.theta[::_EVERY]), **line(course.label))
        draw_desired(panel, [course])
        if result.simulation.failed:
            panel.text(0.98, 0.06, "diverged", transform=panel.transAxes, ha="right", fontsize=9.0)
    within_half_a_move(panel, [result.simulation.trajectory for result in results])  # all share one scale
    for panel, name in zip(axes[0], columns, strict=True):
        title(panel, fill(name, 16))
    for panel, name in zip(axes[:, -1], rows, strict=True):
        panel.text(1.03, 0.5, name.replace("/", "/\n"), transform=panel.transAxes, va="center", fontsize=9.0)
    made.suptitle(heading, fontsize=10.0)
    made.supxlabel("time [s]", fontsize=10.0)
    made.supylabel("bending angle [deg]", fontsize=10.0)
    return made


def rmse_map(results: Sequence[ComparedRow], heading: str = "", across: Across = "reference") -> Figure:
    """RMSE [rad] of each controller as number and colour (log), beside the paper's T2; columns as `across` says.

    Of repetitions it is the median, with its 95 % interval below and how many of them failed. What diverged is hatched
    and marked with an x.
    """
    rows, columns = _names(results, across)
    values = np.full((len(rows), len(columns)), np.nan)
    printed = np.full((len(rows), 1), np.nan)
    below: dict[tuple[int, int], str] = {}
    for result in results:
        at = rows.index(_row(results, result))
        place = at, columns.index(getattr(result, across))
        values[place] = metrics_of(result)["rmse"]
        if len(result.repeated.failed) > 1:
            below[place] = _below(result)
        printed[at] = T2[result.controller].rmse if result.controller in T2 else np.nan
    known = np.concatenate([values, printed], axis=1)
    positive = known[known > 0.0]
    norm = LogNorm(positive.min(initial=1e-1), positive.max(initial=1e-3))
    widths = (len(columns), 1)
    size = {"width": max(WIDTH, 2.5 + 0.9 * len(columns)), "height": 1.2 + (0.62 if below else 0.34) * len(rows)}
    made, ((ours, paper),) = figure(1, 2, width_ratios=widths, sharey=True, **size)
    image = _cells(ours, values, norm, below)
    _cells(paper, printed, norm)
    for row, column in np.argwhere(np.isnan(values)):
        ours.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, fill=False, hatch=_FAILED, edgecolor=GREY))
        ours.text(column, row, "x", ha="center", va="center", fontsize=11.0, fontweight="bold", backgroundcolor="w")
    ours.set_yticks(range(len(rows)), rows)
    ours.set_xticks(range(len(columns)), [fill(name, 10) for name in columns])
    paper.set_xticks([0], ["the paper's\nT2"])
    title(ours, heading)
    bar = made.colorbar(image, ax=[ours, paper], pad=0.02, label="RMSE [rad]", format=PowersOfTen())
    bar.minorformatter = PowersOfTen()
    bar.ax.tick_params(labelsize=9.0)
    return made


def chattering_bars(results: Sequence[ComparedRow], heading: str = "") -> Figure:
    """Total variation of tension per second [N/s], log, of each controller: the bar is the median over the references.

    Dots are the single references, of repetitions their medians with 95 % intervals; what diverged is hatched.
    """
    rows, _ = _names(results, "reference")
    made, ((axes,),) = figure(height=1.1 + 0.3 * len(rows))
    for at, name in enumerate(rows):
        own = [result for result in results if _row(results, result) == name]
        spreads = [spread(result.repeated.metrics["chattering"]) for result in own]
        values = np.array([each.median for each in spreads])
        failed = any(result.repeated.failed.any() for result in own)
        hatch = {"hatch": _FAILED, "edgecolor": "w"} if failed else {}
        axes.barh(at, np.median(values), height=0.6, color=colour(own[0].controller), **hatch)
        axes.plot(values, np.full(len(values), at), "o", color="w", markeredgecolor="k", markersize=4.0)
        for each in spreads:
            if each.interval is not None:
                axes.plot(each.interval, [at, at], color="k", linewidth=1.0)
    logarithmic(axes.xaxis)
    axes.set_yticks(range(len(rows)), rows)
    axes.invert_yaxis()
    axes.grid(False, axis="y")
    axes.set_xlabel("chattering: total variation of tension per second [N/s]")
    title(axes, heading)
    return made


def _row(results: Sequence[ComparedRow], result: ComparedRow) -> str:
    """The row's name: controller and gains, and the inverse where several are compared."""
    several = len({each.inverse for each in results}) > 1
    return f"{result.label}, {result.inverse}" if several else result.label


def _names(results: Sequence[ComparedRow], across: Across) -> tuple[list[str], list[str]]:
    """Rows and columns in the order of the results."""
    rows = dict.fromkeys(_row(results, result) for result in results)
    return list(rows), list(dict.fromkeys(getattr(result, across) for result in results))


def _below(result: ComparedRow) -> str:
    """The interval of a repeated row's RMSE, and how many repetitions failed."""
    found, failed = spread(result.repeated.metrics["rmse"]), result.repeated.failed
    ends = "" if found.interval is None else "\n{:.2g} to {:.2g}".format(*found.interval)
    return ends + (f"\n{failed.sum()} of {found.n} failed" if failed.any() else "")


def _cells(axes: Axes, values: Array, norm: LogNorm, below: Mapping[tuple[int, int], str] | None = None) -> AxesImage:
    """Values (rows, columns) as coloured cells with their numbers, texts below them; nothing where they are nan."""
    undress(axes)
    image = axes.imshow(values, norm=norm, cmap="cividis", aspect="auto")
    for row, column in np.argwhere(np.isfinite(values)):
        value = values[row, column]
        text = (below or {}).get((int(row), int(column)), "")
        ink = "w" if value <= 0.0 or norm(value) < 0.5 else "k"
        axes.text(column, row, f"{value:.2g}{text}", ha="center", va="center", fontsize=7.5 if text else 9.0, color=ink)
    return image
