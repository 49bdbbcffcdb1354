"""Figures of trials as in the paper: wanted and obtained angle, error and tensions, and in two planes the bends.

Each is drawn with and without a push, beside the simulation of the same trials.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.commands.session import Session
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
    grid,
    legend_below,
    line,
    logarithmic,
    title,
)
from wristctl.simulation.trajectory import PLANES, Trajectory
from wristctl.wrist.directions import ACTIVE
from wristctl.wrist.directions import DIRECTIONS as WAYS

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.commands.results import Findings
    from wristctl.simulation.repetitions import Simulation

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
    picture, panels = grid(len(names), 2, 1.9, sharex=True, **shared)
    return picture, dict(zip(names, panels, strict=True))


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


class TrialBends(NamedTuple):
    """One trial: as logged, as it truly was on a bench, and in simulation."""

    motion: str
    logged: Trajectory
    true: Trajectory | None
    simulated: Trajectory
    push: tuple[float, float] | None
    """When the push began and ended [s]."""


def paths_of_bends(trials: Sequence[TrialBends], reach: Array, heading: str = "") -> Figure:
    """Paths in the plane of bends [deg]; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    picture = Figure(figsize=(5.2, 5.6), layout="constrained")
    axes = picture.add_subplot()
    axes.plot(*np.rad2deg(reach).T, color=SILVER, label="in reach")
    for trial in trials:
        axes.plot(*np.rad2deg(trial.logged.bend_ref).T, **WANTED | {"label": "wanted"})
        axes.plot(*np.rad2deg(trial.logged.bend).T, color=BLUE, linewidth=1.0, label="measured")
        if trial.true is not None:
            axes.plot(*np.rad2deg(trial.true.bend).T, color=VERMILLION, linewidth=0.8, label="true")
    axes.set_aspect("equal", adjustable="datalim")  # a box of another shape would push the title off the picture
    axes.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]")
    title(axes, heading)
    legend_below(picture)
    return picture


def errors_of_bends(trials: Sequence[TrialBends], heading: str = "") -> Figure:
    """Errors [deg] over time [s], one row of panels for each motion, one column for each plane."""
    picture, axes = figure(len(trials), 2, height=0.9 + 1.7 * len(trials), sharex=True, sharey=True)
    for trial, panels in zip(trials, axes, strict=True):
        for plane, panel in enumerate(panels):
            lines = [(trial.logged, BLUE, "measured", {}), (trial.simulated, ORANGE, "simulated", SIMULATED)]
            if trial.true is not None:
                lines.insert(1, (trial.true, VERMILLION, "true", {}))
            for course, colour, label, style in lines:
                error = np.degrees(course.error[:, plane])
                panel.plot(course.time, error, **{"color": colour, "linewidth": 1.0, "label": label} | style)
            panel.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
            if trial.push is not None:
                panel.axvspan(*trial.push, color=LIGHT, zorder=0.5, label="push")
            title(panel, f"{trial.motion}, toward {PLANES[plane]}")
    for panel in axes[-1]:
        panel.set_xlabel("time [s]")
    picture.suptitle(heading, fontsize=10.0)
    picture.supylabel("error [deg]", fontsize=10.0)
    legend_below(picture)
    return picture


def draw_trials(session: Session, done: pd.DataFrame, twins: Mapping[int, Simulation]) -> None:
    """Draw all trials that ended well, each with its simulation by its number."""
    findings, settings = session.findings, session.study.hw_run
    log = _logged(findings, "log")
    if settings.planes == 2:
        return _draw_bends(session, done, twins, log)
    courses = [
        _course(log, record, twins[record["trial"]].trajectory, _push(session, record)) for record in _records(done)
    ]
    first = settings.rows[0].label
    for prefix, pushed in (("", False), ("pushed-", True)):
        some = [course for course in courses if (course.push is not None) == pushed]
        if some:
            findings.figure(f"{prefix}directions", desired_and_obtained, some)
            findings.figure(f"{prefix}errors", errors, some)
            alone = [course for course in some if course.label == first and course.repetition == 0]
            findings.figure(f"{prefix}tensions", tensions, alone, first)
    if settings.real_time or settings.port is not None:
        late = np.concatenate([table["late"].to_numpy(float) for table in (log, _logged(findings, "between"))])
        findings.figure("lateness", lateness, late, settings.control_period)


def _draw_bends(session: Session, done: pd.DataFrame, twins: Mapping[int, Simulation], log: pd.DataFrame) -> None:
    """Draw the first repetitions of the first controller."""
    from wristctl.trial.motions import motion_of
    from wristctl.trial.rig_belief import layout_of_axes, layout_of_rig
    from wristctl.trial.trial_results import logged_course, true_course
    from wristctl.wrist.spatial.held_bends import reach_of_bends

    findings, settings, wrist = session.findings, session.study.hw_run, session.study.wrist
    truth, first, courses = _logged(findings, "truth"), settings.rows[0].label, []
    for record in _records(done):
        if record["repetition"] or record["label"] != first:
            continue
        number = record["trial"]
        logged = logged_course(log[log["trial"] == number], motion_of(settings, wrist, record["direction"]), wrist)
        true = true_course(logged, truth[truth["trial"] == number], wrist.length) if len(truth) else None
        courses.append(TrialBends(record["direction"], logged, true, twins[number].trajectory, _push(session, record)))
    reach = reach_of_bends(wrist, layout_of_rig(settings, wrist) or layout_of_axes(wrist))
    for prefix, pushed in (("", False), ("pushed-", True)):
        some = [course for course in courses if (course.push is not None) == pushed]
        if some:
            caption = "The plane of bends: wanted, measured and true, within what the tendons reach"
            findings.figure(f"{prefix}bends", paths_of_bends, some, reach, first, caption=caption)
            caption = "Errors by plane over time, measured, true and simulated"
            findings.figure(f"{prefix}errors", errors_of_bends, some, first, caption=caption)
    if courses:
        findings.overview.figure = "bends" if courses[0].push is None or len(courses) > 1 else "pushed-bends"


def _records(done: pd.DataFrame) -> list[dict[Any, Any]]:
    return done.to_dict("records")


def _push(session: Session, record: Mapping[Any, Any]) -> tuple[float, float] | None:
    push = session.study.hw_run.push
    return (push.start, push.start + push.duration) if record["push"] else None


def _logged(findings: Findings, name: str) -> pd.DataFrame:
    """A table of the run; empty where it has none."""
    import pandas as pd

    assert findings.run is not None
    file = findings.run.path / f"data/{name}.csv"
    return pd.read_csv(file) if file.is_file() else pd.DataFrame()


def _course(
    log: pd.DataFrame, record: Mapping[Any, Any], simulated: Trajectory, push: tuple[float, float] | None
) -> LoggedTrial:
    """A trial in one plane, with tensions of one tendon of the direction's side and of one of the other."""
    course, pulling = log[log["trial"] == record["trial"]], WAYS[record["direction"]].tendons
    holding = next(tendon for tendon in ACTIVE if tendon not in pulling)
    return LoggedTrial(
        direction=record["direction"], label=record["label"], repetition=record["repetition"],
        **{name: course[name].to_numpy(float) for name in ("time", "theta", "theta_ref", "theta_desired")},
        tension=course[[f"tension_{pulling[0]}", f"tension_{holding}"]].to_numpy(float),
        simulated=(simulated.time, simulated.theta, simulated.error), push=push,
    )  # fmt: skip
