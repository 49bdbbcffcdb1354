"""Figures of a comparison: of conditions, and of every controller on every reference of a loop, or on every loop."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Rectangle

from wristctl.arrays import Array
from wristctl.commands.compare.csv_data import metrics_of
from wristctl.commands.printed_table import degrees
from wristctl.comparison.bootstrap import MEASURABLE
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import Ranking
from wristctl.comparison.paper import T2
from wristctl.comparison.repetition_spread import spread
from wristctl.config.loop import Loop
from wristctl.plotting.kinds import draw_cells, draw_front, name_rows
from wristctl.plotting.loop_figures import envelope, label
from wristctl.plotting.style import (
    BLACK,
    GREY,
    ORANGE,
    PURPLE,
    TENDON_COLOURS,
    WIDTH,
    PowersOfTen,
    colour,
    columns_within,
    figure,
    grid,
    headed,
    legend_below,
    legend_under,
    line,
    logarithmic,
    title,
)
from wristctl.simulation.trajectory import Trajectory
from wristctl.study_files.keys import field_at, unit_of

# Subject of the columns of a figure.
Across = Literal["reference", "loop"]

# Width [in] of names and bar, and width [in] that a cell needs for its number in small letters, and in the usual ones.
_BESIDE_CELLS, _NUMBER, _USUAL_NUMBER = 2.3, 0.47, 0.6
# Mean width of a letter of a column's name [in].
_LETTER = 0.07
# Hatch of a row that diverged.
_FAILED = "///"


def rmse_map(
    results: Sequence[ComparedRow], heading: str = "", across: Across = "reference", beside: bool = True
) -> Figure:
    """RMSE [deg] of each controller as number and colour (log); columns as `across` says.

    `beside`: with the paper's T2 in a column of its own.

    Of repetitions it is the median, with its 95 % interval below and how many of them failed. What diverged is hatched
    and marked with an x.
    """
    rows, columns = _names(results, across)
    values = np.full((len(rows), len(columns)), np.nan)
    printed = np.full((len(rows), 1), np.nan)
    below: dict[tuple[int, int], str] = {}
    for result in results:
        index = rows.index(_row(results, result))
        place = index, columns.index(getattr(result, across))
        values[place] = np.degrees(metrics_of(result)["rmse"])
        if len(result.repeated.failed) > 1:
            below[place] = _below(result)
        printed[index] = np.degrees(T2[result.controller].rmse) if beside and result.controller in T2 else np.nan
    shown = np.concatenate([values, printed], axis=1)
    positive = shown[shown > 0.0]
    norm = LogNorm(max(np.degrees(MEASURABLE), positive.min(initial=10.0)), positive.max(initial=0.01))
    widths = (len(columns), 1)
    shape = {"width": max(WIDTH, 2.5 + 0.9 * len(columns)), "height": 1.2 + (0.62 if below else 0.34) * len(rows)}
    beside = bool(np.isfinite(printed).any())
    fig, axes = figure(1, 1 + beside, width_ratios=widths[: 1 + beside], sharey=True, **shape)
    ours = axes[0, 0]
    room = (fig.get_figwidth() - _BESIDE_CELLS) / (len(columns) + beside)
    narrow = room < _NUMBER  # then colours and bar have to do
    size = 9.0 if room >= _USUAL_NUMBER else 7.5
    turned = 90.0 if room < _USUAL_NUMBER else 0.0

    def drawn(panel: Axes, cells: Array, texts: Mapping[tuple[int, int], str]) -> AxesImage:
        def said(row: int, column: int) -> dict[str, Any]:
            text = texts.get((row, column), "")
            return {"s": f"{degrees(np.radians(cells[row, column]))}{text}", "fontsize": 7.5 if text else size}

        return draw_cells(panel, cells, "cividis", norm, None if narrow else said)

    image = drawn(ours, values, below)
    if beside:
        drawn(axes[0, 1], printed, {})
        axes[0, 1].set_xticks([0], ["the paper's T2" if turned else "the paper's\nT2"], rotation=turned)
    ground = "none" if narrow else "w"
    for row, column in np.argwhere(np.isnan(values)):
        ours.add_patch(Rectangle((column - 0.5, row - 0.5), 1.0, 1.0, fill=False, hatch=_FAILED, edgecolor=GREY))
        ours.text(
            column,
            row,
            "x",
            ha="center",
            va="center",
            fontsize=11.0,
            fontweight="bold",
            backgroundcolor=ground,
        )
    ours.set_yticks(range(len(rows)), rows)
    names = columns if turned else [fill(name, 10) for name in columns]
    if turned:  # upright names take their height from the cells
        fig.set_figheight(fig.get_figheight() + _LETTER * max(map(len, names)))
    ours.set_xticks(range(len(columns)), names, rotation=turned)
    title(ours, heading)
    bar = fig.colorbar(image, ax=axes[0].tolist(), pad=0.02, label="RMSE [deg]", format=PowersOfTen())
    bar.minorformatter = PowersOfTen()
    bar.ax.tick_params(labelsize=9.0)
    return fig


def variation_dots(results: Sequence[ComparedRow], heading: str = "") -> Figure:
    """Total variation of tension per second [N/s], log, of each controller: a dot is a reference, a line their median.

    Of repetitions a dot is their median, with its 95 % interval; a row of which something failed is marked x.
    """
    rows, _ = _names(results, "reference")
    fig, ((axes,),) = figure(height=1.6 + 0.24 * len(rows))
    for index, name in enumerate(rows):
        of_row = [result for result in results if _row(results, result) == name]
        spreads = [spread(result.repeated.metrics["chattering"]) for result in of_row]
        values = np.array([repeated.median for repeated in spreads])
        positive = values[np.isfinite(values) & (values > 0.0)]
        failed = any(result.repeated.failed.any() for result in of_row)
        shade = colour(of_row[0].controller)
        dots = np.full(len(positive), index)
        axes.plot(positive, dots, "x" if failed else "o", color=shade, markersize=4.5, alpha=0.8)
        median = [np.median(positive)] * 2 if len(positive) else []
        axes.plot(median, [index - 0.3, index + 0.3][: len(median)], color=BLACK)
        for dot in spreads:
            if dot.interval is not None:
                axes.plot(dot.interval, [index, index], color=shade, linewidth=1.0)
    logarithmic(axes.xaxis)
    name_rows(axes, rows)
    axes.set_xlabel("total variation of tension per second [N/s]")
    title(axes, heading)
    handles = [
        Line2D([], [], linestyle="none", marker="o", color=GREY, label="a reference"),
        Line2D([], [], linestyle="none", marker="x", color=GREY, label="a reference, row failed somewhere"),
        Line2D([], [], color=BLACK, label="median over references"),
    ]
    legend_under(fig, handles, 3)
    return fig


def _row(results: Sequence[ComparedRow], result: ComparedRow) -> str:
    """The row's name: controller and gains, and the inverse where several are compared."""
    several = len({compared.inverse for compared in results}) > 1
    return f"{result.label}, {result.inverse}" if several else result.label


def _names(results: Sequence[ComparedRow], across: Across) -> tuple[list[str], list[str]]:
    """Rows and columns in the order of the results."""
    rows = dict.fromkeys(_row(results, result) for result in results)
    return list(rows), list(dict.fromkeys(getattr(result, across) for result in results))


def _below(result: ComparedRow) -> str:
    """The interval of a repeated row's RMSE, and how many repetitions failed."""
    rmse, failed = spread(result.repeated.metrics["rmse"]), result.repeated.failed
    ends = "" if rmse.interval is None else "\n{} to {}".format(*map(degrees, rmse.interval))
    return ends + (f"\n{failed.sum()} of {rmse.n} failed" if failed.any() else "")


# Fewest sizes that make a curve.
_FEWEST = 3


def series_of_sizes(loops: Mapping[str, Loop]) -> dict[str, dict[str, float]]:
    """Leaves in which at least three loops differ by a number and by nothing else: their sizes by name of the loop."""
    flat = {name: _leaves(loop.model_dump(), "") for name, loop in loops.items()}
    series: dict[str, dict[str, float]] = {}
    leaves = dict.fromkeys(leaf for flat_leaves in flat.values() for leaf in flat_leaves)
    for leaf in leaves:
        alike: dict[Any, dict[str, float]] = {}
        for name, settings in flat.items():
            if isinstance(settings.get(leaf), int | float) and not isinstance(settings[leaf], bool):
                other_leaves = tuple(sorted((key, repr(value)) for key, value in settings.items() if key != leaf))
                alike.setdefault(other_leaves, {})[name] = float(settings[leaf])
        longest = max(alike.values(), key=len, default={})
        if len(set(longest.values())) >= _FEWEST:
            series[leaf] = dict(sorted(longest.items(), key=lambda pair: pair[1]))
    return series


def error_over_disturbance(results: Sequence[ComparedRow], leaf: str, sizes: Mapping[str, float]) -> Figure:
    """RMSE [deg], log, of each row over a leaf of the loop, medians over motions; a line ends where the row fails."""
    fig, ((axes,),) = figure(height=3.6)
    for row in dict.fromkeys(result.label for result in results):
        errors = []
        for loop in sizes:
            of_loop = [result for result in results if result.label == row and result.loop == loop]
            failed = any(result.repeated.failed.any() for result in of_loop)
            errors.append(np.nan if failed else np.median([metrics_of(result)["rmse"] for result in of_loop]))
        axes.plot(list(sizes.values()), np.degrees(errors), marker="o", markersize=3.5, label=row, **line(row))
    logarithmic(axes.yaxis)
    _, field = field_at(("simulate", "loop", *leaf.split(".")))
    unit = unit_of(field) if field is not None else ""
    axes.set(xlabel=f"{leaf} [{unit or '1'}]", ylabel="RMSE [deg]")
    title(axes, f"error over {leaf}")
    legend_below(fig)
    return fig


def _leaves(node: Mapping[str, Any], begin: str) -> dict[str, Any]:
    """Leaves of nested mappings by their key paths."""
    flattened: dict[str, Any] = {}
    for key, value in node.items():
        flattened |= _leaves(value, f"{begin}{key}.") if isinstance(value, Mapping) else {f"{begin}{key}": value}
    return flattened


# Laws shown beside the best whatever their rank: the paper's, the usual one, and none.
_BESIDE = ("smc", "pid", "feedforward")
# Controllers on one axis, at most.
MOST = 5


def shown_rows(standing: Ranking) -> list[str]:
    """Rows that a figure of several shows: the best two, then the best of the paper's law, of PID and feedforward."""
    order = [standing.labels[row] for row in standing.standing.order]
    beside = [standing.labels[row] for name in _BESIDE if (row := standing.best(name)) is not None]
    return list(dict.fromkeys([*order[:2], *beside, *order[2:]]))[:MOST]


def tension_rows(courses: Sequence[Trajectory], heading: str = "") -> Figure:
    """Tension per tendon [N] of all places over time [s]: a panel for each controller, on one scale.

    A course that jumps at every tick is drawn from its least to its largest value, so that it fills an area.
    """
    fig, axes = figure(len(courses), 1, height=0.9 + 1.05 * len(courses), sharex=True, sharey=True)
    for panel, course in zip(axes[:, 0], courses, strict=True):
        for shade, name, tension in zip(*_places(course), course.tension.T, strict=True):
            panel.plot(*envelope(course.time, tension), color=shade, linewidth=0.9, label=name)
        title(panel, label(course))
    largest = max(float(np.nanpercentile(course.tension, 99.5)) for course in courses)
    axes[0, 0].set_ylim(0.0, 1.15 * largest)
    axes[-1, 0].set_xlabel("time [s]")
    fig.supylabel("commanded tension of each tendon [N]", fontsize=9.0)
    headed(fig, heading)
    legend_below(fig)
    return fig


def _places(course: Trajectory) -> tuple[Sequence[str], Sequence[str]]:
    """Colour and name of each place of tendons."""
    if course.planes == 1:
        return (ORANGE, PURPLE), ("+ side", "- side")
    count = course.tension.shape[1]
    return [TENDON_COLOURS[t % len(TENDON_COLOURS)] for t in range(count)], [f"tendon {t + 1}" for t in range(count)]


def error_against_variation(results: Sequence[ComparedRow], classes: Sequence[Ranking], heading: str = "") -> Figure:
    """RMSE [deg] against the tensions' total variation [N/s] of each row, medians over motions: a panel for each class.

    A line joins what nothing beats in both (Pareto's front); a row that is unreliable, does not arrive or is not
    physical is a cross and no part of it.
    """
    columns = columns_within(len(classes), 1.8)
    fig, panels = grid(len(classes), columns, 2.4, sharex=True, sharey=True)
    drawn_laws: dict[str, Line2D] = {}
    for panel, standing in zip(panels, classes, strict=True):
        points, stands = _points(standing.of(results)), standing.standing
        sound = {label: stands.fate(row) in ("ranked", "too few to tell") for row, label in enumerate(standing.labels)}
        for row, (error, variation) in points.items():
            style: dict[str, Any] = {
                "color": colour(row),
                "linestyle": "none",
                "marker": "o" if sound[row] else "x",
            }
            (drawn,) = panel.plot(variation, error, markersize=5.0, **style)
            drawn_laws.setdefault(row.split("/")[0], drawn)
        errors, costs = np.array(list(points.values())).reshape(-1, 2).T
        usable = np.array([sound[row] for row in points], bool)
        draw_front(panel, costs, errors, usable, {"color": BLACK, "linewidth": 0.8, "zorder": 1.5})
        title(panel, standing.name)
    for panel in panels:
        logarithmic(panel.xaxis)
        logarithmic(panel.yaxis)
        panel.tick_params(axis="both", which="minor", labelbottom=False, labelleft=False)
    first_in_row = panels[::columns]
    first_in_row[-1].set_xlabel("total variation of tension per second [N/s]", loc="left")
    for panel in first_in_row:
        panel.set_ylabel("RMSE [deg]")
    headed(fig, heading)
    handles = [
        Line2D([], [], color=mark.get_color(), marker="o", linestyle="none", label=law)
        for law, mark in drawn_laws.items()
    ]
    handles += [
        Line2D([], [], color=GREY, marker="x", linestyle="none", label="no good"),
        Line2D([], [], color=BLACK, linewidth=0.8, label="Pareto"),
    ]
    legend_under(fig, handles, 5)
    return fig


def _points(results: Sequence[ComparedRow]) -> dict[str, tuple[float, float]]:
    """Median RMSE [deg] and variation of each row over its motions."""
    points = {}
    for row in dict.fromkeys(result.label for result in results):
        motions = [result for result in results if result.label == row]
        metrics = [metrics_of(result) for result in motions]
        error, variation = (np.array([values[name] for values in metrics]) for name in ("rmse", "chattering"))
        if np.isfinite(error).any():
            points[row] = float(np.degrees(np.nanmedian(error))), max(float(np.nanmedian(variation)), 1e-3)
    return points
