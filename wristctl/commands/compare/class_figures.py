"""Figures of classes of conditions: the answer at once, and controllers beside each other."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.comparison.class_standing import ClassStanding
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.comparison_data import metrics_of
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

_BESIDE = ("smc", "pid", "feedforward")
"""Laws that are shown beside the best whatever they rank: the paper's, the usual one, and none."""
MOST = 5
"""Controllers on one axis."""


def shown_rows(standing: ClassStanding) -> list[str]:
    """Which rows a figure of several shows: the best two, then the best of the paper's law, of PID and feedforward."""
    order = [standing.labels[row] for row in standing.standing.order]
    beside = [standing.labels[row] for name in _BESIDE if (row := standing.best(name)) is not None]
    return list(dict.fromkeys([*order[:2], *beside, *order[2:]]))[:MOST]


def tension_rows(courses: Sequence[Trajectory], heading: str = "") -> Figure:
    """Tension per tendon [N] of both sides over time [s]: a panel for each controller, on one scale.

    A course that jumps at every tick is drawn from its least to its largest value, so that it fills an area.
    """
    made, axes = figure(len(courses), 1, height=0.9 + 1.05 * len(courses), sharex=True, sharey=True)
    for panel, course in zip(axes[:, 0], courses, strict=True):
        for shade, name, tension in zip((ORANGE, PURPLE), ("+ side", "- side"), course.tension.T, strict=True):
            panel.plot(*envelope(course.time, tension), color=shade, linewidth=0.9, label=name)
        title(panel, label(course))
    largest = max(float(np.nanpercentile(course.tension, 99.5)) for course in courses)
    axes[0, 0].set_ylim(0.0, 1.15 * largest)
    axes[-1, 0].set_xlabel("time [s]")
    made.supylabel("commanded tension of each tendon [N]", fontsize=9.0)
    made.suptitle(heading, fontsize=10.0, x=0.02, ha="left")
    legend_below(made)
    return made


def error_against_variation(
    results: Sequence[ComparedRow], classes: Sequence[ClassStanding], heading: str = ""
) -> Figure:
    """RMSE [deg] against the tensions' total variation [N/s] of each row, medians over motions: a panel for each class.

    A line joins what nothing beats in both (Pareto's front); a row that is unreliable, does not arrive or is not
    physical is a cross and no part of it.
    """
    columns = columns_within(len(classes), 1.8)
    deep = -(-len(classes) // columns)
    made, axes = figure(deep, columns, height=2.4 * deep + 0.9, sharex=True, sharey=True)
    seen: dict[str, Line2D] = {}
    for panel, standing in zip(axes.ravel().tolist(), classes, strict=False):
        points, stands = _points(standing.of(results)), standing.standing
        sound = {label: stands.fate(row) in ("ranked", "too few to tell") for row, label in enumerate(standing.labels)}
        for row, (error, variation) in points.items():
            style = {"color": colour(row.split("/")[0]), "linestyle": "none", "marker": "o" if sound[row] else "x"}
            (drawn,) = panel.plot(variation, error, markersize=5.0, **style)
            seen.setdefault(row.split("/")[0], drawn)
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
    made.suptitle(heading, fontsize=10.0, x=0.02, ha="left")
    handles = [
        Line2D([], [], color=each.get_color(), marker="o", linestyle="none", label=law) for law, each in seen.items()
    ]
    handles += [
        Line2D([], [], color=GREY, marker="x", linestyle="none", label="no good"),
        Line2D([], [], color=BLACK, linewidth=0.8, label="Pareto"),
    ]
    legend_under(made, handles, 5)
    return made


def pareto_front(points: np.ndarray) -> np.ndarray:
    """Of points (P, 2) those that no other equals or beats in both, by the second, (F, 2)."""
    kept = [each for each in points if not any((other <= each).all() and (other < each).any() for other in points)]
    return np.array(sorted(kept, key=lambda each: (each[1], each[0]))).reshape(-1, 2)


def _points(results: Sequence[ComparedRow]) -> dict[str, tuple[float, float]]:
    """Median RMSE [deg] and variation of each row over its motions."""
    points = {}
    for row in dict.fromkeys(each.label for each in results):
        own = [each for each in results if each.label == row]
        known = [metrics_of(each) for each in own]
        error, variation = (np.array([each[name] for each in known]) for name in ("rmse", "chattering"))
        if np.isfinite(error).any():
            points[row] = float(np.degrees(np.nanmedian(error))), max(float(np.nanmedian(variation)), 1e-3)
    return points


_BEST = "best, or tied with it"
_MARKS: dict[str, dict[str, Any]] = {
    _BEST: {"marker": "o", "markersize": 7.0, "markeredgecolor": BLACK},
    "ranked": {"marker": "o", "markersize": 4.5},
    "too few to tell": {"marker": "o", "markersize": 4.5, "markerfacecolor": "none"},
    "unreliable": {"marker": "x", "color": VERMILLION, "markersize": 6.0, "markeredgewidth": 1.8},
    "does not arrive": {"marker": "v", "color": GREY, "markersize": 5.5},
    "not physical": {"marker": "^", "color": GREY, "markersize": 5.5},
}
"""By what becomes of a row."""
_SHOWN = {"ranked": "behind it", "unreliable": "fails, swings or chatters"}


def answer_figure(found: Sequence[ClassStanding]) -> Figure:
    """RMSE [deg] of each row in each class, log, with its 95 % interval; rows from best to worst over all classes."""
    labels = _rows(found)
    columns = columns_within(len(found), 1.1)
    deep = -(-len(found) // columns)
    made, axes = figure(deep, columns, height=deep * (0.85 + 0.2 * len(labels)) + 0.95, sharey=True)
    for panel, each in zip(axes.ravel().tolist(), found, strict=False):
        _panel(panel, each, labels)
    for panel in axes.ravel().tolist()[len(found) :]:
        panel.set_visible(False)
    axes[0, 0].set_yticks(range(len(labels)), [label.removesuffix("/default") for label in labels])
    axes[0, 0].invert_yaxis()
    axes[-1, (columns - 1) // 2].set_xlabel("RMSE [deg]: geometric mean with 95 % interval", fontsize=9.0)
    plain: dict[str, Any] = {"linestyle": "none", "color": GREY}
    kinds = {_kind(each, row) for each in found for row in range(len(each.labels))}
    handles = [
        Line2D([], [], label=_SHOWN.get(name, name), **plain | mark) for name, mark in _MARKS.items() if name in kinds
    ]
    legend_under(made, handles, 3)
    return made


def _panel(panel: Axes, each: ClassStanding, labels: Sequence[str]) -> None:
    for row, name in enumerate(each.labels):
        mean, place, kind = each.means[row], labels.index(name), _kind(each, row)
        style = {"color": colour(name.split("/")[0])} | _MARKS[kind]
        ends = np.degrees([mean.low, mean.high])
        if np.isfinite(ends).all():
            panel.plot(ends, [place, place], color=style["color"], linewidth=1.4)
        panel.plot(np.degrees(mean.value), place, linestyle="none", **style)
    logarithmic(panel.xaxis)
    panel.set_ylim(-0.7, len(labels) - 0.3)
    panel.tick_params(axis="x", which="minor", labelbottom=False)
    panel.tick_params(axis="x", labelsize=7.5)
    title(panel, f"{fill(each.name, 12)}\n{each.cells}")


def _kind(each: ClassStanding, row: int) -> str:
    return _BEST if each.standing.group(row) == 1 else each.standing.fate(row)


def _rows(found: Sequence[ClassStanding]) -> list[str]:
    """Labels by their mean place over the classes."""
    places: dict[str, list[int]] = {}
    for each in found:
        for place, row in enumerate(each.standing.order):
            places.setdefault(each.labels[row], []).append(place)
    return sorted(places, key=lambda label: float(np.mean(places[label])))
