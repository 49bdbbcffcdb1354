"""An open log as recordings of arcs on elastic tendons: spools, bends or tips, and what else it has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.arc_robot import ArcRecording, ArcRobot
from wristctl.records.open_log import OpenLog
from wristctl.wrist.directions import TENDONS
from wristctl.wrist.tendon_layout import TendonLayout

# Samples that are kept of all trials, shortest time between two [s], fewest of a trial, and blocks of each part.
_MOST, _SHORTEST, _FEWEST, _BLOCKS = 800, 5e-3, 20, 8
# Time between two samples of a log without times [s]; nothing that depends on time is found of it.
_NO_TIME = 1.0
# Trials from which whole ones are predicted; of fewer every second part of each.
_WHOLE = 4
GRAVITY = 9.81


def robot_of_log(log: OpenLog, wrist: WristParameters, radius_error: float) -> ArcRobot:
    """The robot that a log is of: its tendons by their numbers, its geometry by a wrist.

    Two tendons alone are antagonists in one plane; 1, 2, 4 and 5 are those of the square wrist; as many as the wrist
    has are those of `wrist.tendons`; else they are evenly around it. Raises UserError without spools or motion.
    """
    numbers = spools_of_log(log)
    if len(numbers) < 2:
        raise UserError(f"{len(numbers)} spools", log.header or str(log.file), "columns spool_1 [mm], spool_2 [mm]")
    layout = TendonLayout.of(wrist)
    angles, radius = [math.tau * k / len(numbers) for k in range(len(numbers))], wrist.tendon_radius
    if len(numbers) == 2:
        angles, radius = [0.0, math.pi], wrist.tendon_offset
    elif set(numbers) <= set(TENDONS) and 4 in numbers and 5 in numbers:
        corners = [TENDONS[number] for number in numbers]
        angles = [math.atan2(flexion, ulnar) for ulnar, flexion in corners]
    elif len(layout.places) == len(numbers) and all(place.radius > 0.0 for place in layout.places):
        angles, radius = [place.angle for place in layout.places], layout.places[0].radius
    if log.bends() is not None:
        measured = "bend"
    elif {"tip_x", "tip_y"} <= set(log.columns):
        measured = "tip"
    else:
        problem = "neither a bend nor the tip is in the log"
        raise UserError(problem, log.header or str(log.file), "columns bend_y [deg], or tip_x [mm], tip_y [mm]")
    base = ["gain", "tendon"]
    if len(numbers) > 2:
        base.append("turn")
    if "time" in log.columns:
        base += ["delay", "damping"]
    if len(_masses(log)) > 1:
        base.append("softening")
    if _has_tensions(log, numbers):
        base.append("force")
    return ArcRobot(
        (wrist.length,), tuple(angles), radius, (1,) * len(numbers), "bend" if measured == "bend" else "tip",
        tuple(base), {"gain": 1.0, "turn": 0.0, "delay": 0.03}, {"gain": radius_error},
        "time" in log.columns,
    )  # fmt: skip


def spools_of_log(log: OpenLog) -> list[int]:
    """Numbers of the tendons whose spools are in a log, sorted."""
    return sorted(int(name.removeprefix("spool_")) for name in log.columns if name.startswith("spool_"))


def _masses(log: OpenLog) -> list[float]:
    """Masses of the trials [kg], each once."""
    trials = log.trials().values()
    return sorted({round(float(np.nanmean(trial.columns["mass"])), 4) for trial in trials if "mass" in trial.columns})


def _has_tensions(log: OpenLog, numbers: Sequence[int]) -> bool:
    return any(np.isfinite(log.columns.get(f"tension_{number}", np.array([]))).any() for number in numbers)


def recordings_of_logs(logs: Sequence[OpenLog], robot: ArcRobot) -> list[ArcRecording]:
    """Trials of logs at even steps. Of four or more every second one is predicted, of fewer every second part of each.

    Raises UserError for a trial with too few samples or for logs of different robots.
    """
    trials = [(trial, name) for log in logs for name, trial in log.trials().items()]
    numbers = spools_of_log(logs[0])
    recordings = []
    for log, name in trials:
        if spools_of_log(log) != numbers:
            problem = f"tendons {', '.join(map(str, spools_of_log(log)))}, elsewhere {', '.join(map(str, numbers))}"
            raise UserError(problem, str(log.file), "logs of one robot")
        recordings.append(_recording(log, robot, numbers, len(trials), Path(log.file).stem, name))
    whole = len(recordings) >= _WHOLE
    first = 0
    for k, recording in enumerate(recordings):
        count = len(recording.time)
        block = np.arange(count) * _BLOCKS * (1 if whole else 2) // count
        fitted = np.full(count, k % 2 == 0) if whole else block % 2 == 0
        block, first = first + block, first + int(block.max()) + 1
        recordings[k] = replace(recording, fitted=fitted, asked=~fitted, block=block)
    return recordings


def everything_fitted(recordings: Sequence[ArcRecording]) -> list[ArcRecording]:
    """The recordings with all samples for fitting."""
    return [
        replace(one, fitted=np.ones(len(one.time), bool), asked=np.zeros(len(one.time), bool)) for one in recordings
    ]


def _recording(
    log: OpenLog, robot: ArcRobot, numbers: Sequence[int], trials: int, file: str, name: str
) -> ArcRecording:
    motion = log.bends() if robot.measured == "bend" else None
    if motion is None:
        empty = np.full(len(log), math.nan)
        motion = np.stack([log.columns.get(f"tip_{axis}", empty) for axis in "xyz"], axis=1)
    spools = np.stack([log.columns[f"spool_{number}"] for number in numbers], axis=1)
    tensions = np.stack([log.columns.get(f"tension_{k}", np.full(len(log), math.nan)) for k in numbers], axis=1)
    there = np.isfinite(motion).any(axis=0)
    seen, counted = np.isfinite(motion[:, there]).all(axis=1) & there.any(), np.isfinite(spools).all(axis=1)
    if min(seen.sum(), counted.sum()) < _FEWEST:
        problem = f"{int(min(seen.sum(), counted.sum()))} samples of trial {name or file}"
        raise UserError(problem, str(log.file), f"{_FEWEST} or more with spools and motion")
    most = max(_FEWEST, _MOST // trials)
    title = f"{file}, {name}" if name else file
    mass = float(np.nanmean(log.columns["mass"])) if "mass" in log.columns else 0.0
    if "time" not in log.columns:
        kept = np.flatnonzero(seen & counted)
        kept = kept[:: max(1, math.ceil(len(kept) / most))]
        time, pause = kept.astype(float), np.full(len(kept), _NO_TIME)
        columns = motion[kept], spools[kept], tensions[kept]
    else:
        clock = log.columns["time"]
        begin, end = clock[seen][0], clock[seen][-1]
        step = max(_SHORTEST, (end - begin) / most)
        time = np.arange(begin, end + 0.5 * step, step)
        pause = np.full(len(time), step)
        columns = _at(time, clock, motion), _at(time, clock, spools), _at(time, clock, tensions)
    pause[0] = math.nan
    nothing = np.zeros(len(time), bool)
    measured, reeled, pulls = columns
    return ArcRecording(
        title, file, time, reeled, measured, pause, nothing, nothing, nothing, np.zeros(len(time), np.int64), mass,
        pulls if np.isfinite(pulls).any() else None,
    )  # fmt: skip


def _at(time: Array, clock: Array, values: Array) -> Array:
    """Columns of a log at other times, by lines between the samples that are there; nan where a column is empty."""
    columns = []
    for column in values.T:
        there = np.isfinite(column)
        columns.append(np.interp(time, clock[there], column[there]) if there.any() else np.full(len(time), math.nan))
    return np.stack(columns, axis=1)
