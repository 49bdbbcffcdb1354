"""Figures of a motion in two planes: the plane of bends with the tendons' reach, and errors and pulls over time."""

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.plotting.loop_figures import draw_course, draw_sizes_of_errors, label
from wristctl.plotting.style import (
    BLACK,
    DOTTED,
    GREEN,
    INDIGO,
    SKY,
    TENDON_COLOURS,
    WANTED,
    figure,
    legend_below,
    line,
    title,
)
from wristctl.simulation.trajectory import Trajectory
from wristctl.wrist.directions import toward_words

# In colours that no tendon has: they share a legend.
_OF_PLANES = (("toward ulnar", INDIGO), ("toward flexion", SKY))
# Line style of a path that is wanted in the plane of bends.
WANTED_PATH = WANTED | {"label": "wanted"}
# Largest distance of a wanted bend from a line on which the motion counts as, over the largest bend.
_ON_A_LINE = 1e-6


def bend_motion(course: Trajectory, reach: Array, heading: str = "") -> Figure:
    """Left the plane of bends; right the errors of both planes [deg] and the pulls at all places [N] over time [s].

    Of a motion along a line the bend along it is drawn over time instead, and no reach.
    """
    picture, axes = figure(2, 2, height=4.6, width_ratios=(1.0, 1.25))
    for panel in axes[:, 0]:
        panel.remove()
    paths = [(course.bend_ref, WANTED_PATH), (course.bend, {"color": GREEN, "label": "followed"})]
    _draw_bends(picture.add_subplot(axes[0, 0].get_gridspec()[:, 0]), course.time, paths, heading, reach)
    errors, pulls = axes[:, 1]
    for error, (name, shade) in zip(course.error.T, _OF_PLANES, strict=True):
        draw_course(errors, course.time, np.degrees(error), shade, f"error {name}")
    errors.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    errors.set_ylabel("error [deg]")
    for number, pull in enumerate((course.tension if course.acting is None else course.acting).T):
        shade = TENDON_COLOURS[number % len(TENDON_COLOURS)]
        draw_course(pulls, course.time, pull, shade, f"tendon {number + 1}")
    pulls.set(xlabel="time [s]", ylabel="pull [N]")
    legend_below(picture)
    return picture


def bend_overlay(courses: Sequence[Trajectory], heading: str = "") -> Figure:
    """Left the paths in the plane of bends; right the size of the error [deg] over time [s]; a line for each course.

    Of a motion along a line the bends along it are drawn over time. What nobody can measure is drawn as 0.001 deg.
    """
    picture, ((left, right),) = figure(1, 2, height=3.8, width_ratios=(1.0, 1.25))
    followed = [(course.bend, {**line(course.label), "label": label(course)}) for course in courses]
    _draw_bends(left, courses[0].time, [(courses[0].bend_ref, WANTED_PATH), *followed], heading)
    draw_sizes_of_errors(right, courses)
    right.set_xlabel("time [s]")
    legend_below(picture)
    return picture


def line_of(path: Array) -> Array | None:
    """The unit vector (2,) toward the largest of bends (N, 2) that lie on a line through straight; None of others."""
    largest = path[np.argmax(np.hypot(*path.T))]
    size = np.hypot(*largest)
    toward: Array = largest / (size or 1.0)
    aside = path @ np.array([-toward[1], toward[0]])
    return toward if size and np.abs(aside).max() <= _ON_A_LINE * size else None


def _draw_bends(
    axes: Axes,
    time: Array,
    paths: Sequence[tuple[Array, Mapping[str, Any]]],
    heading: str,
    reach: Array | None = None,
) -> None:
    """Draw paths (N, 2) [rad] in the plane of bends, or over time (N,) [s] where the first one is on a line."""
    toward = line_of(paths[0][0])
    if toward is None:
        return draw_plane_of_bends(axes, paths, heading, reach)
    for path, style in paths:
        axes.plot(time, np.rad2deg(path @ toward), **style)
    words = toward_words(float(np.rad2deg(np.arctan2(toward[1], toward[0]))))
    axes.set(xlabel="time [s]", ylabel=f"bend {words} [deg]")
    title(axes, heading)


def draw_plane_of_bends(
    axes: Axes, paths: Iterable[tuple[Array, Mapping[str, Any]]], heading: str = "", reach: Array | None = None
) -> None:
    """Draw paths (N, 2) [rad] in the plane of bends [deg], each in its style with its label.

    `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it.
    """
    if reach is not None:
        axes.plot(*np.rad2deg(reach).T, **DOTTED, label="in reach")
    for path, style in paths:
        axes.plot(*np.rad2deg(path).T, **style)
    axes.set_aspect("equal", adjustable="datalim")  # a box of another shape would push the title off the picture
    axes.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]")
    title(axes, heading)
