"""Figures of classes of conditions: the answer at once, and controllers beside each other."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.commands.compare.csv_data import metrics_of
from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.controller_ranking import Ranking
from wristctl.plotting.kinds import draw_front
from wristctl.plotting.loop_figures import envelope, label
from wristctl.plotting.style import (
    BLACK,
    GREY,
    ORANGE,
    PURPLE,
    TENDON_COLOURS,
    colour,
    columns_within,
    figure,
    grid,
    headed,
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
                "color": colour(row.split("/")[0]),
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
