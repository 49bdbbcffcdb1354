"""Figures of a motion in two planes: the plane of bends with the tendons' reach, and errors and pulls over time."""

from collections.abc import Sequence

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

# In colours that no tendon has: they share a legend.
_OF_PLANES = (("toward ulnar", INDIGO), ("toward flexion", SKY))


def bend_figure(course: Trajectory, reach: Array, heading: str = "") -> Figure:
    """The plane of bends; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    picture = Figure(figsize=(5.0, 5.0), layout="constrained")
    _plane_of_bends(picture.add_subplot(), course, reach, heading).legend(loc="upper right")
    return picture


def bend_motion(course: Trajectory, reach: Array, heading: str = "") -> Figure:
    """Left the plane of bends; right the errors of both planes [deg] and the pulls at all places [N] over time [s]."""
    picture, axes = figure(2, 2, height=4.6, width_ratios=(1.0, 1.25))
    for panel in axes[:, 0]:
        panel.remove()
    _plane_of_bends(picture.add_subplot(axes[0, 0].get_gridspec()[:, 0]), course, reach, heading)
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

    What nobody can measure is drawn as 0.001 deg.
    """
    picture, ((left, right),) = figure(1, 2, height=3.8, width_ratios=(1.0, 1.25))
    left.plot(*np.rad2deg(courses[0].bend_ref).T, **WANTED | {"label": "wanted"})
    for course in courses:
        left.plot(*np.rad2deg(course.bend).T, label=label(course), **line(course.label))
    left.set_aspect("equal", adjustable="datalim")
    left.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]")
    draw_sizes_of_errors(right, courses)
    title(left, heading)
    legend_below(picture)
    return picture


def _plane_of_bends(axes: Axes, course: Trajectory, reach: Array, heading: str) -> Axes:
    axes.plot(*np.rad2deg(reach).T, **DOTTED, label="in reach")
    axes.plot(*np.rad2deg(course.bend_ref).T, **WANTED | {"label": "wanted"})
    axes.plot(*np.rad2deg(course.bend).T, color=GREEN, label="followed")
    axes.set_aspect("equal")
    axes.set_xlabel("bend toward ulnar [deg]")
    axes.set_ylabel("bend toward flexion [deg]")
    title(axes, heading)
    return axes
