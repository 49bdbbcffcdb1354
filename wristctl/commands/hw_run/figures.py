"""Figures of trials: bends and paths wanted and obtained, errors and tensions, with and without a push."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

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
    SILVER,
    SIMULATED,
    VERMILLION,
    WANTED,
    figure,
    legend_below,
    line,
    logarithmic,
    title,
)

# In the paper's order.
DIRECTIONS = ("extension", "flexion", "radial", "ulnar")

_COLOURS = ORANGE, PURPLE, BLUE, VERMILLION
_TRUE: dict[str, Any] = {"color": VERMILLION, "linewidth": 0.8, "label": "true"}


class Course(NamedTuple):
    """A trial that is drawn beside the logged one: N samples, P planes; SI units."""

    time: Array
    bend: Array
    """(N, P)"""
    error: Array
    """(N, P)"""


@dataclass(frozen=True)
class LoggedTrial:
    """One trial over time, N samples in P planes, as logged; SI units."""

    direction: str
    """Or the path."""
    label: str
    """controller/gains"""
    repetition: int
    planes: tuple[str, ...]
    time: Array
    bend: Array
    """(N, P)"""
    bend_ref: Array
    """(N, P)"""
    wanted: Array
    """(N, P)"""
    tension: Mapping[str, Array]
    """(N,) each, by what is said of the tendons"""
    simulated: Course | None = None
    """The same trial in simulation."""
    true: Course | None = None
    """As it truly was on an emulated rig."""
    push: tuple[float, float] | None = None
    """When the push began and ended [s]."""


def desired_and_obtained(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Desired and obtained bending angle [deg] over time [s], one panel for each direction."""
    picture, panels = _panels(courses)
    for course in courses:
        _draw_beside(panels, course, "bend")
        for panel, wanted, bend in zip(_own(panels, course), course.wanted.T, course.bend.T, strict=True):
            panel.plot(course.time, np.degrees(bend), label=course.label, **line(course.label))
            panel.plot(course.time, np.degrees(wanted), **WANTED)
    return _finished(picture, panels, courses, heading, "bending angle [deg]")


def paths(courses: Sequence[LoggedTrial], reach: Array, heading: str = "") -> Figure:
    """Paths in the plane of bends [deg]; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    picture = Figure(figsize=(5.2, 5.6), layout="constrained")
    axes = picture.add_subplot()
    axes.plot(*np.rad2deg(reach).T, color=SILVER, label="in reach")
    for course in courses:
        axes.plot(*np.rad2deg(course.wanted).T, **WANTED | {"label": "wanted"})
        axes.plot(*np.rad2deg(course.bend).T, color=BLUE, linewidth=1.0, label="measured")
        if course.true is not None:
            axes.plot(*np.rad2deg(course.true.bend).T, **_TRUE)
    axes.set_aspect("equal", adjustable="datalim")  # a box of another shape would push the title off the picture
    axes.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]")
    title(axes, heading)
    legend_below(picture)
    return picture


def errors(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Error e = bend - reference [deg] over time [s], one panel for each direction, and for each plane of two."""
    picture, panels = _panels(courses, sharey=True)
    for course in courses:
        _draw_beside(panels, course, "error")
        for panel, error in zip(_own(panels, course), (course.bend - course.bend_ref).T, strict=True):
            panel.plot(course.time, np.degrees(error), label=course.label, **line(course.label))
            panel.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    return _finished(picture, panels, courses, heading, "error [deg]")


def tensions(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Commanded tension [N] of tendons over time [s], one panel for each direction."""
    picture, panels = _panels(courses, by_plane=False, sharey=True)
    for course in courses:
        for number, (name, tension) in enumerate(course.tension.items()):
            colour = _COLOURS[number % len(_COLOURS)]
            panels[course.direction, ""].plot(course.time, tension, color=colour, linewidth=1.0, label=name)
    return _finished(picture, panels, courses, heading, "tension [N]")


def lateness(late: Array, period: float) -> Figure:
    """Histogram of the lateness of ticks [ms]."""
    picture, ((axes,),) = figure(height=2.6)
    axes.hist(1e3 * late, bins=np.linspace(0.0, 1e3 * max(period, float(late.max())), 60).tolist(), color=BLUE)
    logarithmic(axes.yaxis)
    axes.set(xlabel="from due to begun [ms]", ylabel="ticks [1]")
    return picture


# Panels by motion and plane; the plane is empty where there is one panel for all.
_Panels = dict[tuple[str, str], Axes]


def _own(panels: _Panels, course: LoggedTrial) -> list[Axes]:
    """Panels of a trial, in the order of its planes."""
    return [panel for (direction, _), panel in panels.items() if direction == course.direction]


def _draw_beside(panels: _Panels, course: LoggedTrial, what: str) -> None:
    """What is simulated and what is true, beside the first repetition alone."""
    styles: list[tuple[Course | None, dict[str, Any]]] = [
        (course.true, _TRUE),
        (course.simulated, {"color": line(course.label)["color"], "label": f"{course.label}, simulated"} | SIMULATED),
    ]
    for drawn, style in styles if course.repetition == 0 else []:
        if drawn is not None:
            for panel, values in zip(_own(panels, course), getattr(drawn, what).T, strict=True):
                panel.plot(drawn.time, np.degrees(values), **style)


def _panels(courses: Sequence[LoggedTrial], by_plane: bool = True, **shared: Any) -> tuple[Figure, _Panels]:
    motions = dict.fromkeys(course.direction for course in courses)
    names = [name for name in DIRECTIONS if name in motions] + [name for name in motions if name not in DIRECTIONS]
    planes = courses[0].planes if by_plane and len(courses[0].planes) > 1 else ("",)
    keys = [(name, plane) for name in names for plane in planes]
    columns = min(2, len(keys))
    rows = -(-len(keys) // columns)
    picture, axes = figure(rows, columns, height=0.9 + 1.9 * rows, sharex=True, **shared)
    for panel in axes.flat[len(keys) :]:
        panel.set_visible(False)
    return picture, dict(zip(keys, axes.ravel().tolist(), strict=False))


def _finished(picture: Figure, panels: _Panels, courses: Sequence[LoggedTrial], heading: str, ylabel: str) -> Figure:
    for (name, plane), panel in panels.items():
        title(panel, f"{name}, toward {plane}" if plane else name)
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
