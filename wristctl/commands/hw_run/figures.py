"""Figures of trials: bends and paths wanted and obtained, errors and tensions, with and without a push."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.commands.session import Session
from wristctl.plotting.bend_figure import WANTED_PATH, draw_plane_of_bends
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    LIGHT,
    SIMULATED,
    TENDON_COLOURS,
    VERMILLION,
    WANTED,
    figure,
    grid,
    headed,
    legend_below,
    line,
    logarithmic,
    title,
)
from wristctl.simulation.error_ellipse import error_ellipse
from wristctl.trial.log import column_of
from wristctl.trial.rig_belief import layout_of_axes, layout_of_rig, names_of_planes, numbers_of, places_of_tendons
from wristctl.wrist.directions import DIRECTIONS as WAYS
from wristctl.wrist.spatial.held_bends import reach_of_bends

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.commands.results import Findings
    from wristctl.config.hw_run import HwRunSettings
    from wristctl.simulation.repetitions import Simulation
    from wristctl.wrist.tendon_layout import TendonLayout

# In the paper's order.
DIRECTIONS = ("extension", "flexion", "radial", "ulnar")

# Standard deviations at which an ellipse of errors is drawn.
_DEVIATIONS = 2.0
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


def bends_over_time(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Desired and obtained bending angle [deg] over time [s], one panel for each direction."""
    return _over_time(courses, "bend", heading)


def errors(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Error e = bend - reference [deg] over time [s], one panel for each direction, and for each plane of two."""
    return _over_time(courses, "error", heading)


def _over_time(courses: Sequence[LoggedTrial], what: Literal["bend", "error"], heading: str) -> Figure:
    picture, panels = _panels(courses, sharey=what == "error")
    for course in courses:
        _draw_beside(panels, course, what)
        drawn = course.bend if what == "bend" else course.bend - course.bend_ref
        for panel, values, wanted in zip(_own(panels, course), drawn.T, course.wanted.T, strict=True):
            panel.plot(course.time, np.degrees(values), label=course.label, **line(course.label))
            if what == "bend":
                panel.plot(course.time, np.degrees(wanted), **WANTED)
            else:
                panel.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    return _finished(picture, panels, courses, heading, "bending angle [deg]" if what == "bend" else "error [deg]")


def paths(courses: Sequence[LoggedTrial], reach: Array, heading: str = "") -> Figure:
    """Paths in the plane of bends [deg]; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    picture = Figure(figsize=(5.2, 5.6), layout="constrained")
    drawn = list[tuple[Array, Mapping[str, Any]]]()
    for course in courses:
        drawn += [(course.wanted, WANTED_PATH), (course.bend, {"color": BLUE, "linewidth": 1.0, "label": "measured"})]
        drawn += [(course.true.bend, _TRUE)] if course.true is not None else []
    draw_plane_of_bends(picture.add_subplot(), drawn, heading, reach)
    legend_below(picture)
    return picture


def ellipses(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Error toward flexion over that toward ulnar [deg], and the ellipse of its covariance, a panel for each motion.

    The first repetition of each controller, as measured; of the true error the ellipse alone.
    """
    picture, panels = _panels(courses, by_plane=False, height=3.4)
    for course in courses:
        if course.repetition:
            continue
        panel, error = panels[course.direction, ""], course.bend - course.bend_ref
        colour = line(course.label)["color"]
        panel.plot(*np.rad2deg(error).T, color=colour, linewidth=0.5, alpha=0.5)
        panel.plot(*_outline(error), color=colour, linewidth=1.6, label=course.label)
        if course.true is not None:
            panel.plot(*_outline(course.true.error), **_TRUE | {"linewidth": 1.2})
    for (name, _), panel in panels.items():
        title(panel, name)
        panel.set_aspect("equal", adjustable="datalim")
        panel.set(xlabel="error toward ulnar [deg]", ylabel="error toward flexion [deg]")
    headed(picture, heading)
    legend_below(picture)
    return picture


def _outline(error: Array) -> Array:
    """Line (2, K) [deg] at two standard deviations about the mean of an error (N, 2) [rad]."""
    outline: Array = np.rad2deg(error.mean(axis=0) + error_ellipse(error).outline(_DEVIATIONS)).T
    return outline


def tensions(courses: Sequence[LoggedTrial], heading: str = "") -> Figure:
    """Commanded tension [N] of tendons over time [s], one panel for each direction."""
    picture, panels = _panels(courses, by_plane=False, sharey=True)
    for course in courses:
        for number, (name, tension) in enumerate(course.tension.items()):
            colour = TENDON_COLOURS[number % len(TENDON_COLOURS)]
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


def _panels(
    courses: Sequence[LoggedTrial], by_plane: bool = True, height: float = 1.9, **shared: Any
) -> tuple[Figure, _Panels]:  # fmt: skip
    motions = dict.fromkeys(course.direction for course in courses)
    names = [name for name in DIRECTIONS if name in motions] + [name for name in motions if name not in DIRECTIONS]
    planes = courses[0].planes if by_plane and len(courses[0].planes) > 1 else ("",)
    keys = [(name, plane) for name in names for plane in planes]
    picture, panels = grid(len(keys), 2, height, sharex=True, **shared)
    return picture, dict(zip(keys, panels, strict=True))


def _finished(picture: Figure, panels: _Panels, courses: Sequence[LoggedTrial], heading: str, ylabel: str) -> Figure:
    for (name, plane), panel in panels.items():
        title(panel, f"{name}, toward {plane}" if plane else name)
        pushes = {course.push for course in courses if course.direction == name and course.push is not None}
        for start, end in pushes:
            panel.axvspan(start, end, color=LIGHT, zorder=0.5, label="push")
    for panel in list(panels.values())[-2:]:
        panel.set_xlabel("time [s]")
        panel.tick_params(labelbottom=True)  # of three panels the second has an empty place below it
    headed(picture, heading)
    picture.supylabel(ylabel, fontsize=10.0)
    legend_below(picture)
    return picture


def draw_trials(session: Session, done: pd.DataFrame, twins: Mapping[int, Simulation]) -> None:
    """Draw all trials that ended well, each with its simulation by its number."""
    findings, settings, wrist = session.findings, session.study.hw_run, session.study.wrist
    log, layout, first = _logged(findings, "log"), layout_of_rig(settings, wrist), settings.rows[0].label
    truth = _logged(findings, "truth")
    courses = [_course(record, log, truth, settings, layout, twins) for record in done.to_dict("records")]
    for prefix, pushed in (("", False), ("pushed-", True)):
        some = [course for course in courses if (course.push is not None) == pushed]
        if not some:
            continue
        alone = [course for course in some if course.label == first and course.repetition == 0]
        said = ", with a push" * pushed
        if settings.planes == 1:
            caption = f"The bend, wanted and obtained, in each direction{said}"
            findings.figure(f"{prefix}directions", bends_over_time, some, caption=caption)
        else:
            reach = reach_of_bends(wrist, layout or layout_of_axes(wrist))
            caption = "The plane of bends: wanted, measured and true, within what the tendons reach" + said
            findings.figure(f"{prefix}bends", paths, alone, reach, first, caption=caption)
            findings.overview.figure = findings.overview.figure or f"{prefix}bends"
            caption = f"Error in the plane of bends{said}, and its ellipse at {_DEVIATIONS:g} standard deviations"
            only = first if len(settings.rows) == 1 else ""
            findings.figure(f"{prefix}ellipses", ellipses, some, only, caption=caption)
        findings.figure(f"{prefix}errors", errors, some, caption=f"The error of the bend over time{said}")
        findings.figure(f"{prefix}tensions", tensions, alone, first, caption=f"Commanded tensions over time{said}")
    if settings.real_time or settings.port is not None:
        logs = (log, _logged(findings, "between"))
        late = np.concatenate([table["late"].to_numpy(float) for table in logs])
        findings.figure("lateness", lateness, late, settings.control_period)


def _course(
    record: Mapping[Any, Any], logs: pd.DataFrame, truths: pd.DataFrame, settings: HwRunSettings,
    layout: TendonLayout | None, twins: Mapping[int, Simulation],
) -> LoggedTrial:  # fmt: skip
    """One trial, as logged, beside its simulation and what is true of it."""
    log, direction, push = logs[logs["trial"] == record["trial"]], record["direction"], settings.push
    planes = names_of_planes(settings.planes, WAYS[direction].plane if settings.planes == 1 else "")

    def of_planes(name: str, table: pd.DataFrame = log) -> Array:
        return table[[column_of(name, plane, len(planes)) for plane in planes]].to_numpy(float)

    time, wanted, true = log["time"].to_numpy(float), of_planes("bend_ref"), None
    # What is true is known beyond the last tick, where no bend was asked for.
    if len(truths) and len(truth := truths[(truths["trial"] == record["trial"]) & (truths["time"] <= time[-1])]):
        at, bend = truth["time"].to_numpy(float), of_planes("bend", truth)
        asked = np.stack([np.interp(at, time, course) for course in wanted.T], axis=1)
        true = Course(at, bend, bend - asked)
    simulated = twins[record["trial"]].trajectory
    return LoggedTrial(
        direction=direction,
        label=record["label"],
        repetition=record["repetition"],
        planes=planes,
        time=time,
        bend=of_planes("bend"),
        bend_ref=wanted,
        wanted=of_planes("bend_desired") if len(planes) == 1 else wanted,
        tension=_tensions(log, direction, planes, layout),
        simulated=Course(simulated.time, simulated.bend, simulated.bend - simulated.bend_ref),
        true=true,
        push=(push.start, push.start + push.duration) if record["push"] else None,
    )


def _logged(findings: Findings, name: str) -> pd.DataFrame:
    """A table of the run; empty where it has none."""
    import pandas as pd

    assert findings.run is not None
    file = findings.run.path / f"data/{name}.csv"
    return pd.read_csv(file) if file.is_file() else pd.DataFrame()


def _tensions(
    log: pd.DataFrame, direction: str, planes: Sequence[str], layout: TendonLayout | None
) -> dict[str, Array]:  # fmt: skip
    """Commanded tensions (N,) by tendon; in one plane of one on the direction's side, and of one on the other."""
    columns = {f"tendon {number}": log[f"tension_{number}"].to_numpy(float) for number in numbers_of(layout)}
    if len(planes) > 1:
        return columns
    place, side = places_of_tendons(planes, layout), 0 if WAYS[direction].sign > 0 else 1
    pulls, holds = (int(np.flatnonzero((place == side) == on)[0]) for on in (True, False))
    tensions = list(columns.values())
    return {"tendons that pull": tensions[pulls], "tendons that hold against": tensions[holds]}
