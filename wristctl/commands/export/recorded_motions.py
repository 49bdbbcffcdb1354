"""The motions of a run: what was measured, commanded and wanted, each at times of its own."""

from __future__ import annotations

import logging
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.export.model import study_of
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.spool_paths import answered, count_times, has_rates, spool_paths
from wristctl.records import Run
from wristctl.records.find import a_run
from wristctl.records.log_columns import units_of
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, tendons_of
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

if TYPE_CHECKING:
    import pandas as pd

_log = logging.getLogger(__name__)

Columns = dict[str, Array]
# Columns of a table of a motion in one plane, by their names in an open log.
_MOTION = {"theta": "bend_y", "tip_x": "tip_x", "tip_y": "tip_y"}
# The same in two planes; those of tendons follow.
_BENDS = {"bend_ulnar": "bend_y", "bend_flexion": "bend_z"} | {name: name for name in ("tip_x", "tip_y", "tip_z")}
_WANTED = {"theta_ref": "bend_y", "bend_ref_ulnar": "bend_y", "bend_ref_flexion": "bend_z"}
# Time between two rows of a rig's spools [s].
_SPOOLS_EVERY = 2e-3
# Units of columns that an open log does not have.
_UNITS = {"rate_y": "rad/s", "rate_z": "rad/s", "torque_y": "N m", "torque_z": "N m"}


def si_unit(name: str) -> str:
    """SI unit of a column of a motion: `m` of spool_1."""
    units = units_of(name)
    return _UNITS[name] if units is None else next(unit for unit, scale in units.items() if scale == 1.0)


@dataclass(frozen=True)
class Stream:
    """Values that were taken at the same N times; nan where one was not."""

    time: Array
    """(N,) [s] since the motion began."""
    columns: Columns
    """(N,) each, SI units, by the names of an open log; rate_y and torque_y beside them."""


@dataclass(frozen=True)
class RecordedMotion:
    """One motion of a wrist."""

    name: str
    """Name of the trial; empty of a run's only motion."""
    task: str
    """What the wrist was to do, in words."""
    measured: Sequence[Stream]
    commands: Stream | None = None
    """Spools that motors were to wind, tensions or torques."""
    reference: Stream | None = None
    """Bends that the controller followed."""
    begin: float | None = None
    """Start on the run's clock [s]; None where the run has none."""


def motions_of(run: Run) -> list[RecordedMotion]:
    """Motions of a run. Raises UserError for a run that holds none."""
    if (run.path / "data").is_dir():
        for name, read in _READERS.items():
            if run.has(f"data/{name}") and (motions := read(run)):
                return motions
    problem = f"{a_run(run.kind)} holds no motion over time"
    kinds = "name a simulate, compare, track or hw-run run"
    modes = "analyse --of hysteresis or gen-data --source transitions"
    raise UserError(problem, str(run.path), f"{kinds}, or one of {modes}")


def _trials(run: Run) -> list[RecordedMotion]:
    """Trials of a rig: spools on their way from count to count, bends at those of the frames, in one plane tips too."""
    log, frames, kinds = (run.data(name) for name in ("log", "frames", "trials"))
    motors, motions = run.config.hw_run.actuator, list[RecordedMotion]()
    for row in kinds.itertuples():
        number, direction = row.trial, DIRECTIONS.get(str(row.direction))
        ticks = log[log.trial == number]
        seen = frames[(frames.trial == number) & (frames.verdict == "ok")]
        measured = [_reeled(ticks, motors), *_tensions(ticks)] if run.config.hw_run.rig else [_reeled(ticks, motors)]
        flexion = direction is not None and direction.plane == "flexion"
        measured += _bends_seen(seen, "captured") if "plane" in seen else [_sight(seen, flexion)]
        time = ticks.time.to_numpy(float) if "time" in ticks else np.empty(0)
        targets, wanted = _of_tendons(ticks, "target", motors.step_length), _columns(ticks, _WANTED)
        if flexion and "theta_ref" in ticks:
            wanted = {"bend_z": wanted["bend_y"]}
        asked, led = (Stream(time, columns) if columns and len(time) else None for columns in (targets, wanted))
        begin = float((ticks.clock - ticks.time).iloc[0]) if {"clock", "time"} <= set(ticks) and len(ticks) else None
        motions.append(RecordedMotion(f"{number}", _task_of_trial(row), measured, asked, led, begin))
    return motions


def _reeled(log: pd.DataFrame, motors: Actuator) -> Stream:
    """Lengths on the spools [m] in one trial, so often that lines between them turn no corner that a ramp has not.

    Those of the counts alone where the log has no step rates.
    """
    ticks = answered(log)
    counted = count_times(ticks).mean(axis=1)
    if not has_rates(log) or len(counted) < 2:
        return Stream(counted, _of_tendons(ticks, "position", motors.step_length))
    times = np.arange(counted[0], counted[-1], _SPOOLS_EVERY)
    lengths = motors.step_length * spool_paths(log, motors)(times)
    return Stream(times, {f"spool_{tendon}": column for tendon, column in zip(ACTIVE, lengths.T, strict=True)})


def _tensions(ticks: pd.DataFrame) -> list[Stream]:
    """Tensions that a robot of one's own measured, at the times of the looks that gave them; empty without any."""
    pulls = {name: match[1] for name in map(str, ticks.columns) if (match := re.fullmatch(r"pull_(\d+)", name))}
    times = next((name for name in ("captured", "captured_ulnar", "captured_flexion") if name in ticks), None)
    if times is None:
        return []
    told = ticks[np.isfinite(ticks[times]) & ticks[[*pulls]].notna().any(axis=1)] if pulls else ticks[:0]
    if not len(told):
        return []
    columns = {f"tension_{tendon}": told[name].to_numpy(float) for name, tendon in pulls.items()}
    return [Stream(told[times].to_numpy(float), columns)]


def _of_tendons(table: pd.DataFrame, quantity: str, step: float) -> Columns:
    """Counts of all spools [steps] as lengths [m]."""
    named = {name: match[1] for name in map(str, table.columns) if (match := re.fullmatch(rf"{quantity}_(\d+)", name))}
    return {f"spool_{tendon}": step * table[name].to_numpy(float) for name, tendon in named.items()}


def _sight(seen: pd.DataFrame, flexion: bool) -> Stream:
    """Bends and tips that one camera saw, which looks at the plane of the motion."""
    bend, tip = ("bend_z", "tip_z") if flexion else ("bend_y", "tip_y")
    sights = {bend: seen.theta.to_numpy(float)}
    if "tip_x" in seen:
        sights |= {"tip_x": seen.tip_x.to_numpy(float), tip: seen.tip_y.to_numpy(float)}
    return Stream(seen.captured.to_numpy(float), sights)


def _bends_seen(frames: pd.DataFrame, clock: str) -> list[Stream]:
    """Bends at the times of the frames that show them, of two cameras; `clock` is the column of these times."""
    parts = []
    for plane, name in (("ulnar", "bend_y"), ("flexion", "bend_z")):
        of_plane = frames[frames.plane == plane]
        parts.append(Stream(of_plane[clock].to_numpy(float), {name: of_plane.bend.to_numpy(float)}))
    return parts


def _task_of_trial(row: object) -> str:
    """Task of a trial by its row of the table of trials."""
    controller, gains = getattr(row, "controller", ""), getattr(row, "gains", "")
    by = f" with {controller}/{gains}" if controller and gains else ""
    push = float(getattr(row, "push", 0.0) or 0.0)
    return f"bend {getattr(row, 'direction', '')}{by}{f', pushed by {push:g} N' if push else ''}"


def _columns(table: pd.DataFrame, names: Mapping[str, str]) -> Columns:
    return {name: table[theirs].to_numpy(float) for theirs, name in names.items() if theirs in table}


def _simulated(run: Run) -> list[RecordedMotion]:
    """A simulated motion, with the spools of its tendons where it has any; with pulls where these are the spools' too.

    In one plane a side's columns are of one tendon, in two planes a place's pull is of all of its tendons.
    """
    in_space, (study, _) = run.has("data/bends.csv"), study_of(run)
    table = _whole(run.data("bends"), "bend_ulnar") if in_space else _whole(run.data("trajectory"), "theta")
    columns, commands = _columns(table, _BENDS if in_space else _MOTION), Columns()
    free, pull = _slides_freely(study.simulate.loop), "pull" if in_space else "tension"
    sides = zip(("plus", "plus", "minus", "minus"), tendons_of("ulnar"), (1, 1, 1, 1), strict=True)
    for column, number, alike in _numbered(study.wrist) if in_space else sides:
        if f"{pull}_{column}" in table:
            commands[f"tension_{number}"] = table[f"{pull}_{column}"].to_numpy(float) / alike
        if f"spool_{column}" in table:
            columns[f"spool_{number}"] = table[f"spool_{column}"].to_numpy(float)
        if free and (in_space or f"spool_{column}" in table):
            columns[f"tension_{number}"] = table[f"acting_{column}"].to_numpy(float) / alike
    settings, time = run.config.simulate, table.time.to_numpy(float)
    return [
        RecordedMotion(
            "",
            f"{settings.reference.kind} with {settings.controller}",
            [Stream(time, columns)],
            Stream(time, commands) if commands else None,
            Stream(time, wanted) if (wanted := _columns(table, _WANTED)) else None,
        )
    ]


def _whole(table: pd.DataFrame, bend: str) -> pd.DataFrame:
    """A table of a simulated motion as far as the wrist stayed within its range: its bends end there."""
    bends = np.flatnonzero(np.isfinite(table[bend].to_numpy(float)))
    last = int(bends[-1]) + 1 if len(bends) else 0
    if 0 < last < len(table):
        _log.warning("the wrist left its range at %.3g s: what came then is left out", table.time.iloc[last - 1])
    return table.iloc[:last]


def _slides_freely(loop: Loop) -> bool:
    """Whether a tendon pulls as much at its spool as at the wrist."""
    return not loop.actuator.winds or not loop.plant.actuator.of(loop.actuator).friction


def _tracked(run: Run) -> list[RecordedMotion]:
    """What one camera saw, or the bends that two cameras saw."""
    table = run.data("track")
    if "plane" in table:
        seen = _bends_seen(table[np.isfinite(table.bend)], "time")
    else:
        seen = [Stream(table.time.to_numpy(float), _columns(table, _MOTION))]
    return [RecordedMotion("", "recorded by hand or by another program", seen)]


def _numbered(wrist: WristParameters) -> list[tuple[int, int, int]]:
    """Number of each place's column, number of its tendon in an open log, and how many tendons are there.

    Tendons of the square wrist have the numbers 1, 2, 4 and 5, others those of `wrist.tendons`; what bends nothing has
    none.
    """
    places = TendonLayout.of(wrist).places
    numbers = ACTIVE if wrist.tendons == "four" else range(1, len(places) + 1)
    every = enumerate(zip(numbers, places, strict=True), 1)
    return [(column, number, place.multiplicity) for column, (number, place) in every if place.radius > 0.0]


def _compared(run: Run) -> list[RecordedMotion]:
    """Every motion of a comparison, by its number."""
    arrays = run.array("trajectories")
    names = _MOTION if "theta" in arrays else _BENDS
    shape = arrays[next(iter(names))].shape
    over_time = {
        name: np.broadcast_to(values, shape).astype(float)
        for name, values in arrays.items()
        if values.shape in (shape, shape[-1:])
    }
    tasks = [f"motion {number}" for number in range(shape[0])]
    if run.has("data/comparison.csv") and len(rows := run.data("comparison")) == shape[0]:
        tasks = [f"{row.reference} with {row.controller}/{row.gains}, {row.loop}" for row in rows.itertuples()]
    sides = {"tension_plus": "tension_1", "tension_minus": "tension_2"}
    for column, tendon, alike in _numbered(run.config.wrist):
        if f"pull_{column}" in over_time:
            over_time[f"pull_{column}"] /= alike
            sides[f"pull_{column}"] = f"tension_{tendon}"
    motions = []
    for number, task in enumerate(tasks):
        whole = np.isfinite(over_time[next(iter(names))][number])  # a wrist that left its range has no bends from then

        def of_motion(wanted: Mapping[str, str], at: int = number, rows: Array = whole) -> Stream | None:
            columns = {name: over_time[theirs][at][rows] for theirs, name in wanted.items() if theirs in over_time}
            return Stream(over_time["time"][at][rows], columns) if columns else None

        seen = of_motion(names)
        motions.append(RecordedMotion(f"{number}", task, [seen] if seen else [], of_motion(sides), of_motion(_WANTED)))
    return motions


def _loops(run: Run) -> list[RecordedMotion]:
    """Hysteresis loops by their numbers; tensions are those of one tendon."""
    courses, motions = run.data("courses"), list[RecordedMotion]()
    alike, names, bends = [TENDONS_PER_SIDE] * 2, ["plus", "minus"], {"bend_y": "theta"}
    if "given_plus" not in courses:  # of two planes
        alike = list(TendonLayout.of(run.config.wrist).multiplicity)
        names = [str(place) for place in range(1, len(alike) + 1)]
        bends = {"bend_y": "bend_ulnar", "bend_z": "bend_flexion"}
    for number, table in courses.groupby("loop", sort=False):
        columns, commands = Columns(), Columns()
        for tendon, (name, count) in enumerate(zip(names, alike, strict=True), 1):
            if run.config.hysteresis.drive == "spools":
                columns[f"spool_{tendon}"] = table[f"given_{name}"].to_numpy(float)
                commands[f"spool_{tendon}"] = columns[f"spool_{tendon}"]
            columns[f"tension_{tendon}"] = table[f"spool_{name}"].to_numpy(float) / count
        columns |= {ours: table[theirs].to_numpy(float) for ours, theirs in bends.items()}
        time = table.time.to_numpy(float)
        given = Stream(time, commands) if commands else None
        motions.append(RecordedMotion(f"{number}", "hysteresis loop", [Stream(time, columns)], given))
    return motions


def _transitions(run: Run) -> list[RecordedMotion]:
    """Random motions of `gen-data --source transitions`; none of a run of samples without time."""
    arrays = run.array("samples")
    if not {"bend", "rate", "torque", "period"} <= set(arrays):
        return []
    motions = []
    for number, (bend, rate, torque) in enumerate(zip(*(arrays[k] for k in ("bend", "rate", "torque")), strict=True)):
        time, planes = float(arrays["period"]) * np.arange(float(len(bend))), "yz"[: bend.shape[1]]

        def columns(name: str, values: Array, planes: str = planes) -> Columns:
            return {f"{name}_{plane}": values[:, p].astype(float) for p, plane in enumerate(planes)}

        seen = Stream(time, columns("bend", bend) | columns("rate", rate))
        motions.append(RecordedMotion(f"{number}", "random motion", [seen], Stream(time, columns("torque", torque))))
    return motions


_READERS: Mapping[str, Callable[[Run], list[RecordedMotion]]] = {
    "log.csv": _trials,
    "trajectory.csv": _simulated,
    "bends.csv": _simulated,
    "track.csv": _tracked,
    "trajectories.npz": _compared,
    "courses.csv": _loops,
    "samples.npz": _transitions,
}
"""By the file of a run that holds its motions."""
