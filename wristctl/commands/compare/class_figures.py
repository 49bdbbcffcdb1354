"""Figures of classes of conditions: the answer at once, and controllers beside each other."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.commands.compare.csv_data import metrics_of
from wristctl.comparison.class_standing import ClassStanding
from wristctl.comparison.combinations import ComparedRow
from wristctl.plotting.loop_figures import envelope, label
from wristctl.plotting.style import (
    BLACK,
    GREY,
    ORANGE,
    PURPLE,
    VERMILLION,
    colour,
    columns_within,
    figure,
    legend_below,
    legend_under,
    logarithmic,
    title,
)
from wristctl.simulation.trajectory import Trajectory

# Laws shown beside the best whatever their rank: the paper's, the usual one, and none.
_BESIDE = ("smc", "pid", "feedforward")
# Controllers on one axis, at most.
MOST = 5


def shown_rows(standing: ClassStanding) -> list[str]:
    """Rows that a figure of several shows: the best two, then the best of the paper's law, of PID and feedforward."""
    order = [standing.labels[row] for row in standing.standing.order]
    beside = [standing.labels[row] for name in _BESIDE if (row := standing.best(name)) is not None]
    return list(dict.fromkeys([*order[:2], *beside, *order[2:]]))[:MOST]


def tension_rows(courses: Sequence[Trajectory], heading: str = "") -> Figure:
    """Tension per tendon [N] of both sides over time [s]: a panel for each controller, on one scale.

    A course that jumps at every tick is drawn from its least to its largest value, so that it fills an area.
    """
    fig, axes = figure(len(courses), 1, height=0.9 + 1.05 * len(courses), sharex=True, sharey=True)
    for panel, course in zip(axes[:, 0], courses, strict=True):
        for shade, name, tension in zip((ORANGE, PURPLE), ("+ side", "- side"), course.tension.T, strict=True):
            panel.plot(*envelope(course.time, tension), color=shade, linewidth=0.9, label=name)
        title(panel, label(course))
    largest = max(float(np.nanpercentile(course.tension, 99.5)) for course in courses)
    axes[0, 0].set_ylim(0.0, 1.15 * largest)
    axes[-1, 0].set_xlabel("time [s]")
    fig.supylabel("commanded tension of each tendon [N]", fontsize=9.0)
    fig.suptitle(heading, fontsize=10.0, x=0.02, ha="left")
    legend_below(fig)
    return fig


def error_against_variation(
    results: Sequence[ComparedRow], classes: Sequence[ClassStanding], heading: str = ""
) -> Figure:
    """RMSE [deg] against the tensions' total variation [N/s] of each row, medians over motions: a panel for each class.

    A line joins what nothing beats in both (Pareto's front); a row that is unreliable, does not arrive or is not
    physical is a cross and no part of it.
    """
    columns = columns_within(len(classes), 1.8)
    deep = -(-len(classes) // columns)
    fig, axes = figure(deep, columns, height=2.4 * deep + 0.9, sharex=True, sharey=True)
    drawn_laws: dict[str, Line2D] = {}
    for panel, standing in zip(axes.ravel().tolist(), classes, strict=False):
        points, stands = _points(standing.of(results)), standing.standing
        sound = {label: stands.fate(row) in ("ranked", "too few to tell") for row, label in enumerate(standing.labels)}
        for row, (error, variation) in points.items():
            style = {"color": colour(row.split("/")[0]), "linestyle": "none", "marker": "o" if sound[row] else "x"}
            (drawn,) = panel.plot(variation, error, markersize=5.0, **style)
            drawn_laws.setdefault(row.split("/")[0], drawn)
        front = pareto_front(np.array([points[row] for row in points if sound[row]]).reshape(-1, 2))
        panel.plot(front[:, 1], front[:, 0], color=BLACK, linewidth=0.8, zorder=1.5)
        title(panel, standing.name)
    for panel in axes.ravel().tolist()[len(classes) :]:
        panel.set_visible(False)
    for panel in axes.ravel().tolist():
        logarithmic(panel.xaxis)
        logarithmic(panel.yaxis)
        panel.tick_params(axis="both", which="minor", labelbottom=False, labelleft=False)
    axes[-1, 0].set_xlabel("total variation of tension per second [N/s]", loc="left")
    for panel in axes[:, 0]:
        panel.set_ylabel("RMSE [deg]")
    fig.suptitle(heading, fontsize=10.0, x=0.02, ha="left")
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


def pareto_front(points: np.ndarray) -> np.ndarray:
    """Points of Pareto's front, (F, 2), among points (P, 2), sorted by the second coordinate.

    A point is on the front where no other is at least as small in both coordinates and smaller in one.
    """
    kept = [point for point in points if not any((rival <= point).all() and (rival < point).any() for rival in points)]
    return np.array(sorted(kept, key=lambda point: (point[1], point[0]))).reshape(-1, 2)


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


_BEST = "best, or tied with it"
# Markers by the fate of a row.
_MARKS: dict[str, dict[str, Any]] = {
    _BEST: {"marker": "o", "markersize": 7.0, "markeredgecolor": BLACK},
    "ranked": {"marker": "o", "markersize": 4.5},
    "too few to tell": {"marker": "o", "markersize": 4.5, "markerfacecolor": "none"},
    "unreliable": {"marker": "x", "color": VERMILLION, "markersize": 6.0, "markeredgewidth": 1.8},
    "does not arrive": {"marker": "v", "color": GREY, "markersize": 5.5},
    "not physical": {"marker": "^", "color": GREY, "markersize": 5.5},
}
_SHOWN = {"ranked": "behind it", "unreliable": "fails, swings or chatters"}


def answer_figure(standings: Sequence[ClassStanding]) -> Figure:
    """RMSE [deg] of each row in each class, log, with its 95 % interval; rows from best to worst over all classes."""
    labels = _rows(standings)
    columns = columns_within(len(standings), 1.1)
    deep = -(-len(standings) // columns)
    fig, axes = figure(deep, columns, height=deep * (0.85 + 0.2 * len(labels)) + 0.95, sharey=True)
    for panel, standing in zip(axes.ravel().tolist(), standings, strict=False):
        _panel(panel, standing, labels)
    for panel in axes.ravel().tolist()[len(standings) :]:
        panel.set_visible(False)
    axes[0, 0].set_yticks(range(len(labels)), [label.removesuffix("/default") for label in labels])
    axes[0, 0].invert_yaxis()
    axes[-1, (columns - 1) // 2].set_xlabel("RMSE [deg]: geometric mean with 95 % interval", fontsize=9.0)
    plain: dict[str, Any] = {"linestyle": "none", "color": GREY}
    kinds = {_kind(class_standing, row) for class_standing in standings for row in range(len(class_standing.labels))}
    handles = [
        Line2D([], [], label=_SHOWN.get(name, name), **plain | mark) for name, mark in _MARKS.items() if name in kinds
    ]
    legend_under(fig, handles, 3)
    return fig


def _panel(panel: Axes, standing: ClassStanding, labels: Sequence[str]) -> None:
    for row, name in enumerate(standing.labels):
        mean, place, kind = standing.means[row], labels.index(name), _kind(standing, row)
        style = {"color": colour(name.split("/")[0])} | _MARKS[kind]
        ends = np.degrees([mean.low, mean.high])
        if np.isfinite(ends).all():
            panel.plot(ends, [place, place], color=style["color"], linewidth=1.4)
        panel.plot(np.degrees(mean.value), place, linestyle="none", **style)
    logarithmic(panel.xaxis)
    panel.set_ylim(-0.7, len(labels) - 0.3)
    panel.tick_params(axis="x", which="minor", labelbottom=False)
    panel.tick_params(axis="x", labelsize=7.5)
    title(panel, f"{fill(standing.name, 12)}\n{standing.cells}")


def _kind(standing: ClassStanding, row: int) -> str:
    return _BEST if standing.standing.group(row) == 1 else standing.standing.fate(row)


def _rows(standings: Sequence[ClassStanding]) -> list[str]:
    """Labels by their mean place over the classes."""
    places: dict[str, list[int]] = {}
    for standing in standings:
        for place, row in enumerate(standing.standing.order):
            places.setdefault(standing.labels[row], []).append(place)
    return sorted(places, key=lambda label: float(np.mean(places[label])))
