"""Figures of trials as in the paper: desired and obtained angle, error, in four directions, with and without a push."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    LIGHT,
    ORANGE,
    PURPLE,
    SIMULATED,
    WANTED,
    figure,
    legend_below,
    line,
    logarithmic,
    title,
)

# In the paper's order.
DIRECTIONS = ("extension", "flexion", "radial", "ulnar")

_SIDES = {"tendons that pull": ORANGE, "tendons that hold against": PURPLE}


@dataclass(frozen=True)
class LoggedTrial:
    """One trial over time, T samples, as logged; SI units."""

    direction: str
    label: str
    """controller/gains"""
    repetition: int
    time: Array
    theta: Array
    theta_ref: Array
    theta_desired: Array
    tension: Array
    """(T, 2), per tendon of the side that the direction lies on and of the other"""
    simulated: tuple[Array, Array, Array] | None = None
    """Time, angle and error of the same trial in simulation."""
    push: tuple[float, float] | None = None
    """When the push began and ended [s]."""


def desired_and_obtained(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Desired and obtained bending angle [deg] over time [s], one panel for each direction."""
    picture, panels = _panels(courses)
    for course in courses:
        panel = panels[course.direction]
        _draw_simulated(panel, course, 1)
        panel.plot(course.time, np.degrees(course.theta), label=course.label, **line(course.label))
        panel.plot(course.time, np.degrees(course.theta_desired), **WANTED)
    return _finished(picture, panels, courses, heading, "bending angle [deg]")


def errors(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Error e = theta - theta_ref [deg] over time [s], one panel for each direction."""
    picture, panels = _panels(courses, sharey=True)
    for course in courses:
        panel = panels[course.direction]
        _draw_simulated(panel, course, 2)
        panel.plot(course.time, np.degrees(course.theta - course.theta_ref), label=course.label, **line(course.label))
        panel.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    return _finished(picture, panels, courses, heading, "error [deg]")


def tensions(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Commanded tension [N] of each tendon of both sides over time [s], one panel for each direction."""
    picture, panels = _panels(courses, sharey=True)
    for course in courses:
        for (side, colour), tension in zip(_SIDES.items(), course.tension.T, strict=True):
            panels[course.direction].plot(course.time, tension, color=colour, linewidth=1.0, label=side)
    return _finished(picture, panels, courses, heading, "tension [N]")


def lateness(late: Array, period: float) -> Figure:
    """Histogram of the lateness of ticks [ms]."""
    picture, ((axes,),) = figure(height=2.6)
    axes.hist(1e3 * late, bins=np.linspace(0.0, 1e3 * max(period, float(late.max())), 60).tolist(), color=BLUE)
    logarithmic(axes.yaxis)
    axes.set(xlabel="from due to begun [ms]", ylabel="ticks [1]")
    return picture


def _draw_simulated(panel: Axes, course: LoggedTrial, which: Literal[1, 2]) -> None:
    """Angle (1) or error (2) in simulation, beside the first repetition alone."""
    if course.simulated is not None and course.repetition == 0:
        style: Any = {"color": line(course.label)["color"], "label": f"{course.label}, simulated"}
        panel.plot(course.simulated[0], np.degrees(course.simulated[which]), **style | SIMULATED)


def _panels(courses: Sequence[LoggedTrial], **shared: Any) -> tuple[Figure, dict[str, Axes]]:
    names = [name for name in DIRECTIONS if any(course.direction == name for course in courses)]
    columns = min(2, len(names))
    rows = -(-len(names) // columns)
    picture, axes = figure(rows, columns, height=0.9 + 1.9 * rows, sharex=True, **shared)
    for panel in axes.flat[len(names) :]:
        panel.set_visible(False)
    return picture, dict(zip(names, axes.ravel().tolist(), strict=False))


def _finished(
    picture: Figure, panels: dict[str, Axes], courses: Sequence[LoggedTrial], heading: str, ylabel: str
) -> Figure:
    for name, panel in panels.items():
        title(panel, name)
        pushes = {course.push for course in courses if course.direction == name and course.push is not None}
        for start, end in pushes:
            panel.axvspan(start, end, color=LIGHT, zorder=0.5, label="push")
    for panel in list(panels.values())[-2:]:
        panel.set_xlabel("time [s]")
        panel.tick_params(labelbottom=True)  # of three panels the second has an empty place below it
    picture.suptitle(heading, fontsize=10.0)
    picture.supylabel(ylabel, fontsize=10.0)
    legend_below(picture)
    return picture
