"""The motions of a run as an open log, which commands and other programs read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.export.model import identified_in
from wristctl.commands.inputs_of_loops import found_in, with_found
from wristctl.config.loop import Loop
from wristctl.config.study import Study
from wristctl.errors import FILE, UserError
from wristctl.identification.measured_trials import answered
from wristctl.records import Run
from wristctl.records.formats import read_arrays, read_table
from wristctl.records.open_log import OpenLog, write_log
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, tendons_of
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendons import TENDONS_PER_SIDE

if TYPE_CHECKING:
    import pandas as pd

Columns = dict[str, Array]
# Columns of a table of a motion in one plane, by their names in an open log.
_MOTION = {"time": "time", "theta": "bend_y", "tip_x": "tip_x", "tip_y": "tip_y"}
# The same in two planes; those of tendons follow.
_BENDS = {"time": "time", "bend_ulnar": "bend_y", "bend_flexion": "bend_z"} | {
    name: name for name in ("tip_x", "tip_y", "tip_z")
}


def open_log_of(run: Run) -> OpenLog:
    """Motions of a run, one after the other. Raises UserError for a run that holds none."""
    if (run.path / "data").is_dir():
        for name, convert in _CONVERTED.items():
            if run.has(f"data/{name}"):
                columns, words = convert(run)
                return OpenLog(run.path, "log", columns, words)
    problem = f"a {run.kind} run holds no motion over time"
    raise UserError(problem, str(run.path), "name a simulate, compare, track, hysteresis or hw-run run")


def write_open_log(run: Run, path: Path) -> None:
    """Write the motions of a run as an open log."""
    write_log(open_log_of(run), path, FILE)


def _trials(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """Trials of a rig: spools at the times of the ticks, bends at those of the frames, in one plane tips too."""
    log, frames, kinds = (run.data(name) for name in ("log", "frames", "trials"))
    step = run.config.hw_run.actuator.step_length
    parts: list[tuple[Columns, str]] = []
    for row in kinds.itertuples():
        number, direction = row.trial, DIRECTIONS.get(str(row.direction))
        flexion = direction is not None and direction.plane == "flexion"
        ticks, seen = answered(log[log.trial == number]), frames[(frames.trial == number) & (frames.verdict == "ok")]
        positions = [name for name in ticks.columns if name.startswith("position_")]
        spools = {name.replace("position", "spool"): step * ticks[name].to_numpy(float) for name in positions}
        if "plane" in seen:
            parts.append(
                (_merged([(ticks.counted.to_numpy(float), spools), *_bends_seen(seen, "captured")]), f"{number}")
            )
            continue
        bend, tip = ("bend_z", "tip_z") if flexion else ("bend_y", "tip_y")
        sights = {bend: seen.theta.to_numpy(float)}
        if "tip_x" in seen:
            sights |= {"tip_x": seen.tip_x.to_numpy(float), tip: seen.tip_y.to_numpy(float)}
        both = [(ticks.counted.to_numpy(float), spools), (seen.captured.to_numpy(float), sights)]
        parts.append((_merged(both), f"{number}"))
    names = sorted({name for columns, _ in parts for name in columns}, key=_order)
    columns = {
        name: np.concatenate([part.get(name, np.full(len(part["time"]), np.nan)) for part, _ in parts])
        for name in names
    }
    return columns, {"trial": np.concatenate([np.full(len(part["time"]), trial) for part, trial in parts])}


def _bends_seen(frames: pd.DataFrame, clock: str) -> list[tuple[Array, Columns]]:
    """Bends at the times of the frames that show them, of two cameras; `clock` is the column of these times."""
    parts = []
    for plane, name in (("ulnar", "bend_y"), ("flexion", "bend_z")):
        of_plane = frames[frames.plane == plane]
        parts.append((of_plane[clock].to_numpy(float), {name: of_plane.bend.to_numpy(float)}))
    return parts


def _order(name: str) -> tuple[bool, str]:
    return name != "time", name


def _merged(parts: list[tuple[Array, Columns]]) -> Columns:
    """Columns at times of their own as columns at all times, in their order; cells of other times are empty."""
    time = np.concatenate([times for times, _ in parts])
    order, begin, merged = np.argsort(time, kind="stable"), 0, {"time": time}
    for times, columns in parts:
        for name, column in columns.items():
            merged[name] = np.full(len(time), np.nan)
            merged[name][begin : begin + len(times)] = column
        begin += len(times)
    return {name: column[order] for name, column in merged.items()}


def _simulated(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """A simulated motion in one plane, with the spools of the four tendons where it has any."""
    columns, _ = _motion("trajectory.csv")(run)
    table, loop = read_table(run.file("data/trajectory.csv")), _study_of(run).simulate.loop
    for tendon, side in zip(tendons_of("ulnar"), ("plus", "plus", "minus", "minus"), strict=True):
        if f"spool_{side}" in table:
            columns[f"spool_{tendon}"] = table[f"spool_{side}"].to_numpy(float)
            if _slides_freely(loop):
                columns[f"tension_{tendon}"] = table[f"acting_{side}"].to_numpy(float)
    return columns, {}


def _study_of(run: Run) -> Study:
    """The study of a simulate run, with the wrist, motors and sensor that were identified where they were."""
    source = identified_in(run)
    if source is None:
        return run.config
    return with_found(run.config, "simulate", found_in(source))


def _slides_freely(loop: Loop) -> bool:
    """Whether a tendon pulls as much at its spool as at the wrist."""
    return loop.actuator.level != "tendon" or not loop.plant.actuator.of(loop.actuator).friction


def _motion(file: str) -> Callable[[Run], tuple[Columns, Mapping[str, np.ndarray]]]:
    def columns(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
        table = read_table(run.file(f"data/{file}"))
        return {name: table[old].to_numpy(float) for old, name in _MOTION.items() if old in table}, {}

    return columns


def _tracked(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """What one camera saw, or the bends that two cameras saw."""
    table = read_table(run.file("data/track.csv"))
    if "plane" not in table:
        return _motion("track.csv")(run)
    return _merged(_bends_seen(table[np.isfinite(table.bend)], "time")), {}


def _bends(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """A motion in two planes with the spools of all tendons, and with their pulls where these are the spools' too.

    Tendons of the square wrist have the numbers 1, 2, 4 and 5, others those of `wrist.tendons`.
    """
    table, study = read_table(run.file("data/bends.csv")), _study_of(run)
    wrist, loop = study.wrist, study.simulate.loop
    columns = {name: table[old].to_numpy(float) for old, name in _BENDS.items()}
    places = TendonLayout.of(wrist).places
    square = ACTIVE if wrist.tendons == "four" else range(1, len(places) + 1)
    for column, (number, place) in enumerate(zip(square, places, strict=True), 1):
        if place.radius == 0.0:
            continue
        if f"spool_{column}" in table:
            columns[f"spool_{number}"] = table[f"spool_{column}"].to_numpy(float)
        if _slides_freely(loop):
            columns[f"tension_{number}"] = table[f"acting_{column}"].to_numpy(float) / place.multiplicity
    return columns, {}


def _compared(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """Every motion of a comparison is a trial, by its number."""
    arrays = read_arrays(run.file("data/trajectories.npz"))
    shape = arrays["theta"].shape
    columns = {
        name: np.broadcast_to(arrays[old], shape).astype(float).ravel()
        for old, name in _MOTION.items()
        if old in arrays and arrays[old].shape[-1:] == shape[-1:]
    }
    return columns, {"trial": np.repeat(np.arange(shape[0]), shape[1]).astype(str)}


def _loops(run: Run) -> tuple[Columns, Mapping[str, np.ndarray]]:
    """Every hysteresis loop is a trial; tensions are those of one tendon."""
    table: pd.DataFrame = read_table(run.file("data/courses.csv"))
    columns = {"time": table.time.to_numpy(float)}
    for number, side in enumerate(("plus", "minus"), 1):
        if run.config.hysteresis.drive == "spools":
            columns[f"spool_{number}"] = table[f"given_{side}"].to_numpy(float)
        columns[f"tension_{number}"] = table[f"spool_{side}"].to_numpy(float) / TENDONS_PER_SIDE
    return columns | {"bend_y": table.theta.to_numpy(float)}, {"trial": table.loop.to_numpy().astype(str)}


_CONVERTED: Mapping[str, Callable[[Run], tuple[Columns, Mapping[str, np.ndarray]]]] = {
    "log.csv": _trials,
    "trajectory.csv": _simulated,
    "bends.csv": _bends,
    "track.csv": _tracked,
    "trajectories.npz": _compared,
    "courses.csv": _loops,
}
"""By the file of a run that holds its motions."""
