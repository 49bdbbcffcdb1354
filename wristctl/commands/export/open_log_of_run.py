"""The motions of a run as an open log, which commands and other programs read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.commands.export.recorded_motions import Columns, RecordedMotion, Stream, motions_of
from wristctl.config.wrist import WristParameters
from wristctl.errors import FILE
from wristctl.records import Run
from wristctl.records.log_columns import units_of
from wristctl.records.open_log import OpenLog, write_log


def open_log_of(run: Run) -> OpenLog:
    """Motions of a run, one after the other. Raises UserError for a run that holds none."""
    motions = motions_of(run)
    parts = [_merged(motion.measured) for motion in motions]
    names = list(dict.fromkeys(name for part in parts for name in part))
    if len(parts) > 1:
        names.sort(key=_order)
    columns: dict[str, Array] = {
        name: np.concatenate([part.get(name, np.full(len(part["time"]), np.nan)) for part in parts]) for name in names
    }
    if run.kind == "hw-run" and _mass_is_said(run):
        columns["mass"] = np.full(len(columns["time"]), run.config.wrist.hand_mass)
    return OpenLog(run.path, "log", columns, _trials(motions, parts))


def _mass_is_said(run: Run) -> bool:
    """Whether somebody has said the hand's mass: of a rig of one's own the default is nobody's."""
    default = WristParameters.model_fields["hand_mass"].default
    return run.config.hw_run.rig is None or run.config.wrist.hand_mass != default


def write_open_log(run: Run, path: Path) -> None:
    """Write the motions of a run as an open log."""
    write_log(open_log_of(run), path, FILE)


def _trials(motions: Sequence[RecordedMotion], parts: Sequence[Columns]) -> dict[str, np.ndarray]:
    """The column `trial`; none of a run's only motion."""
    if not any(motion.name for motion in motions):
        return {}
    trials = [np.full(len(part["time"]), motion.name) for motion, part in zip(motions, parts, strict=True)]
    return {"trial": np.concatenate(trials)}


def _order(name: str) -> tuple[bool, str]:
    return name != "time", name


def _merged(streams: Sequence[Stream]) -> Columns:
    """Columns at times of their own as columns at all times, in their order; cells of other times are empty."""
    time = np.unique(np.concatenate([stream.time for stream in streams]))
    merged = {"time": time}
    for stream in streams:
        rows = np.searchsorted(time, stream.time)
        for name, column in stream.columns.items():
            if units_of(name) is None:
                continue
            merged[name] = np.full(len(time), np.nan)
            merged[name][rows] = column
    return merged
