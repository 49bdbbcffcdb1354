"""An open log as recordings of arcs on elastic tendons: spools, bends or tips, and what else it has."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.arc_robot import ArcRecording, ArcRobot, inertia_of_arc
from wristctl.records.open_log import OpenLog
from wristctl.wrist.directions import TENDONS
from wristctl.wrist.tendon_layout import TendonLayout

# Samples that are kept of all trials, shortest time between two [s], fewest of a trial, and blocks of each part.
_MOST, _SHORTEST, _FEWEST, _BLOCKS = 800, 5e-3, 20, 8
# Time between two samples [s] beyond which other trials do not make those of a trial fewer: a model that is followed in
# longer steps takes other inertia and damping for the same motion.
_OFTEN = 0.025
# Time between two samples of a log without times [s]; nothing that depends on time is found of it.
_NO_TIME = 1.0
# Trials from which whole ones are predicted; of fewer parts of each.
_WHOLE = 4
# Correlation with the motion from which a spool goes with it.
_GOES_WITH = 0.5
SETTLE = 0.5
"""Time [s] after which a robot moves as if it had been followed from before."""
# Largest share of a recording that this may be.
_LONGEST = 0.25
# Change over the first two samples over the usual one from which a recording begins in motion, and change to the first
# of them over that to the second: a robot at rest only begins to move.
_MOVES, _AS_FAST = 0.2, 0.75
# Stretch below which a tendon passes smoothly from slack to taut [m]: a fifth of what 0.4 N do to one of 20 kN/m.
_SMOOTH = 4e-6
GRAVITY = 9.81


def robot_of_logs(
    logs: Sequence[OpenLog], wrist: WristParameters, radius_error: float, widest: float = 0.25
) -> ArcRobot:
    """The robot that logs are of: its tendons by their numbers, its geometry by a wrist; `widest` as ArcRobot has it.

    Two tendons alone are antagonists in one plane; of four numbered 1 to 4 in a log of one plane the motion says which
    side each pulls to (`plus_side`); 1, 2, 4 and 5 are those of the square wrist; as many as the wrist has are those of
    `wrist.tendons`; else they are evenly around it. Raises UserError without spools or motion, for logs that are not
    alike, and for tendons on several circles.
    """
    log, numbers = logs[0], spools_of_log(logs[0])
    if len(numbers) < 2:
        if numbers:
            problem = f"spool_{numbers[0]} is its only spool, and two or more tendons bend a wrist"
            fix = "a column spool_2 [mm], ... for each other tendon; of a motor that winds both it is the negative"
        else:
            problem = "it has no motors: neither spools nor tensions or currents"
            fix = (
                "columns spool_1 [mm], spool_2 [mm], or tension_1 [N], or current_1 [mA], ... of all tendons, beside it"
            )
            fix += "; or the motors' log too, to join it to"
        raise UserError(problem, log.header or str(log.file), fix)
    _check_alike(logs, numbers)
    measured = _measured(log)
    angles, radius, paired = _tendons(logs, numbers, wrist)
    base = ["gain", "tendon"]
    if not paired:
        base.append("turn")
    timed = all("time" in log.columns for log in logs)
    if timed:
        base += ["delay", "damping", "inertia"]
    if len(_masses(logs)) > 1:
        base.append("softening")
    if any(_has_tensions(log, numbers) for log in logs):
        base.append("force")
    known_to = {"gain": radius_error}
    inertia = inertia_of_arc(wrist) / wrist.stiffness  # of a wrist that may be another: it is known to itself
    if timed:
        known_to["inertia"] = inertia
    return ArcRobot(
        (wrist.length,), tuple(angles), radius, (1,) * len(numbers), measured, tuple(base),
        {"gain": 1.0, "turn": 0.0, "delay": 0.03, "inertia": inertia}, known_to, timed, wrist.discs - 1,
        True, _SMOOTH, widest, ("delay",) if any(log.two_clocks for log in logs) else (),
    )  # fmt: skip


def _check_alike(logs: Sequence[OpenLog], numbers: Sequence[int]) -> None:
    """UserError where logs have other tendons, measure something else, or where only some have masses."""
    for log in logs:
        if spools_of_log(log) != numbers:
            own, others = (", ".join(f"spool_{k}" for k in each) for each in (spools_of_log(log), numbers))
            problem = f"its tendons are {own or 'none'}, and those of {logs[0].file.name} {others}"
            raise UserError(problem, log.header or str(log.file), "logs of one robot, each with all of its spools")
        if _measured(log) != _measured(logs[0]):
            problem = f"the {_measured(log)}, in {logs[0].file.name} the {_measured(logs[0])}"
            raise UserError(problem, log.header or str(log.file), "logs that measure the same")
    trials = [(log, name, trial) for log in logs for name, trial in log.trials().items()]
    weighed = [mass_of_log(trial) is not None for _, _, trial in trials]
    if any(weighed) and not all(weighed):
        log, name, _ = trials[weighed.index(False)]
        where = f"{log.file}, trial {name}" if name else log.header or str(log.file)
        raise UserError("no mass, which other trials have", where, "mass [kg] in every trial, or in none")


def _measured(log: OpenLog) -> Literal["bend", "tip"]:
    if log.bends() is not None:
        return "bend"
    if {"tip_x", "tip_y"} <= set(log.columns):
        return "tip"
    problem = "neither a bend nor the tip is in the log"
    raise UserError(problem, log.header or str(log.file), "columns bend_y [deg], or tip_x [mm], tip_y [mm]")


def _tendons(
    logs: Sequence[OpenLog], numbers: Sequence[int], wrist: WristParameters
) -> tuple[Sequence[float], float, bool]:
    """Directions of the tendons [rad], radius of their circle [m], and whether they are of two sides alone."""
    layout, plane = TendonLayout.of(wrist), _plane(logs)
    pairs_radius = layout.places[0].radius if layout.planes == 1 else wrist.tendon_offset
    places = [place for place in layout.places if place.radius > 0.0]
    if not isinstance(wrist.tendons, str) and len(places) == len(numbers):
        if max(place.radius for place in places) > 1.001 * min(place.radius for place in places):
            fix = "one radius, for arcs have their tendons on a circle; model: wrist takes each place as it is"
            raise UserError("tendons on several circles", "wrist.tendons", fix)
        if len({place.multiplicity for place in places}) > 1 or any(place.ends_at for place in places):
            fix = "model: wrist, which takes each place as it is"
            raise UserError(
                "more tendons at a place than at another, or one that ends before the tip", "wrist.tendons", fix
            )
        return [place.angle for place in places], places[0].radius, layout.planes == 1
    if len(numbers) == 2:
        return [plane or 0.0, math.pi + (plane or 0.0)], pairs_radius, True
    if set(numbers) <= set(TENDONS) and 4 in numbers and 5 in numbers:
        corners = [TENDONS[number] for number in numbers]
        return [math.atan2(flexion, ulnar) for ulnar, flexion in corners], wrist.tendon_radius, False
    if plane is not None and len(numbers) == 4 and (plus := plus_side(logs)) is not None:
        return [plane if number in plus else plane + math.pi for number in numbers], pairs_radius, True
    if len(places) == len(numbers):
        return [place.angle for place in places], places[0].radius, False
    return [math.tau * k / len(numbers) for k in range(len(numbers))], wrist.tendon_radius, False


def _plane(logs: Sequence[OpenLog]) -> float | None:
    """Direction of the one plane that logs measure [rad]; None where they measure two."""
    names = {name for log in logs for name in log.columns}
    if "inclination" in names or {"bend_y", "bend_z"} <= names:
        return None
    if _measured(logs[0]) == "tip":
        return None if "tip_z" in names else 0.0
    return 0.0 if "bend_y" in names else 0.5 * math.pi


def plus_side(logs: Sequence[OpenLog]) -> tuple[int, ...] | None:
    """Numbers of the two tendons of four that reel in as the one measured bend, or tip's place, grows.

    None where a tendon does not go with the motion. Raises UserError where not two go either way.
    """
    numbers = spools_of_log(logs[0])
    column = next(name for name in ("bend_y", "bend_z", "tip_y") if name in logs[0].columns)
    products = np.zeros((len(numbers), 3))
    for trial in (trial for log in logs for trial in log.trials().values()):
        motion = trial.columns.get(column, np.full(len(trial), math.nan))
        clock = trial.columns.get("time", np.arange(float(len(trial))))
        seen = np.isfinite(motion)
        spools = np.stack([trial.columns[f"spool_{number}"] for number in numbers], axis=1)
        if not seen.any() or not np.isfinite(spools).any():
            continue
        reeled, moved = lines_at(clock[seen], clock, spools), motion[seen]
        reeled, moved = reeled - reeled.mean(axis=0), moved - moved.mean()
        products += np.stack([reeled.T @ moved, np.sum(reeled**2, axis=0), np.full(len(numbers), moved @ moved)], 1)
    sizes = np.sqrt(products[:, 1] * products[:, 2])
    likeness = np.divide(products[:, 0], sizes, out=np.zeros(len(numbers)), where=sizes > 0.0)
    if not (np.abs(likeness) >= _GOES_WITH).all():
        return None
    plus = tuple(number for number, alike in zip(numbers, likeness, strict=True) if alike > 0.0)
    minus = tuple(number for number in numbers if number not in plus)
    if len(plus) != 2:
        reel_in, pay_out = (", ".join(map(str, side)) or "none" for side in (plus, minus))
        problem = f"as the motion grows spools {reel_in} reel in and {pay_out} pay out: not two on either side"
        fix = "reeled in is positive: check the spools' senses; or give each tendon's place in wrist.tendons"
        raise UserError(problem, logs[0].header or str(logs[0].file), fix)
    return plus


def spools_of_log(log: OpenLog) -> list[int]:
    """Numbers of the tendons whose spools are in a log, sorted."""
    return log.tendons_of("spool")


def mass_of_log(log: OpenLog) -> float | None:
    """Mean mass [kg] of a log, or of one of its trials; None where nobody weighed it."""
    column = log.columns.get("mass", np.empty(0))
    return float(np.nanmean(column)) if np.isfinite(column).any() else None


def _masses(logs: Sequence[OpenLog]) -> set[float]:
    """Masses of the trials [kg], each once."""
    masses = [mass_of_log(trial) for log in logs for trial in log.trials().values()]
    return {round(mass, 4) for mass in masses if mass is not None}


def _has_tensions(log: OpenLog, numbers: Sequence[int]) -> bool:
    return any(np.isfinite(log.columns.get(f"tension_{number}", np.array([]))).any() for number in numbers)


def recordings_of_logs(logs: Sequence[OpenLog], robot: ArcRobot) -> list[ArcRecording]:
    """Trials of logs at even steps. Of four or more half are predicted, of fewer half of the parts of each.

    Which are follows Thue and Morse's sequence: where every second one was, a motion that comes back would be fitted at
    some of its phases and predicted at others.

    Raises UserError for a trial with too few samples.
    """
    trials = [(trial, name) for log in logs for name, trial in log.trials().items()]
    numbers = spools_of_log(logs[0])
    recordings = []
    for log, name in trials:
        recordings.append(_recording(log, robot, numbers, len(trials), Path(log.file).stem, name))
    return [_settled(one) if robot.timed else one for one in in_parts(recordings)]


def _settled(recording: ArcRecording) -> ArcRecording:
    """Without the begin of a recording that begins in motion: nobody knows how the robot came there.

    The model has it at rest there, so that the begin would say what damping and friction are.
    """
    if not _begins_in_motion(recording.measured):
        return recording
    return without_begin(recording, min(SETTLE, _LONGEST * (recording.time[-1] - recording.time[0])))


def without_begin(recording: ArcRecording, lasting: float) -> ArcRecording:
    """The recording whose first part [s] is neither fitted nor predicted."""
    late = recording.time >= recording.time[0] + lasting
    return replace(recording, fitted=recording.fitted & late, asked=recording.asked & late)


def in_parts(recordings: Sequence[ArcRecording]) -> list[ArcRecording]:
    """Recordings with what is fitted and what is predicted, as `recordings_of_logs` has it."""
    whole, first, parted = len(recordings) >= _WHOLE, 0, list[ArcRecording]()
    for k, recording in enumerate(recordings):
        count = len(recording.time)
        block = np.arange(count) * _BLOCKS * (1 if whole else 2) // count
        fitted = _is_fitted(np.full(count, k) if whole else block)
        block, first = first + block, first + int(block.max()) + 1
        parted.append(replace(recording, fitted=fitted, asked=~fitted, block=block))
    return parted


def _is_fitted(numbers: NDArray[np.int64]) -> NDArray[np.bool_]:
    """Whether the numbers' binary ones are even."""
    even: NDArray[np.bool_] = np.bitwise_count(numbers) % 2 == 0
    return even


def _begins_in_motion(measured: Array) -> bool:
    """Whether bends or tips (T, d) move from the first sample on as fast as after it; from rest they only begin to."""
    whole = np.nan_to_num(measured)
    first, second = np.linalg.norm(np.diff(whole[:3], axis=0), axis=1)
    usual = math.sqrt(float(np.mean(np.sum((whole[2:] - whole[:-2]) ** 2, axis=1))))
    return bool(first > _AS_FAST * second and np.linalg.norm(whole[2] - whole[0]) > _MOVES * usual)


def rate_of_logs(logs: Sequence[OpenLog]) -> float:
    """Readings of the motion per second: of what is there of bends or the tip, the median over trials."""
    rates = []
    for trial in (trial for log in logs for trial in log.trials().values()):
        times = [trial.columns["time"][np.isfinite(column)] for column in _motion(trial)]
        rates += [1.0 / float(np.median(np.diff(clock))) for clock in times if len(clock) > 1]
    return float(np.median(rates))


def readings_of_log(log: OpenLog) -> int:
    """Number of samples at which some of the motion was read."""
    return int(np.isfinite(np.stack(_motion(log))).any(axis=0).sum())


def _motion(log: OpenLog) -> list[Array]:
    """Columns of the motion: of bends or of the tip."""
    return [column for name, column in log.columns.items() if name.startswith(("bend_", "tip_", "inclination"))]


def everything_fitted(recordings: Sequence[ArcRecording]) -> list[ArcRecording]:
    """The recordings with all samples for fitting that were fitted or predicted."""
    return [replace(one, fitted=one.fitted | one.asked, asked=np.zeros(len(one.time), bool)) for one in recordings]


def _recording(
    log: OpenLog, robot: ArcRobot, numbers: Sequence[int], trials: int, file: str, name: str
) -> ArcRecording:
    motion = log.bends() if robot.measured == "bend" else None
    if motion is None:
        empty = np.full(len(log), math.nan)
        motion = np.stack([log.columns.get(f"tip_{axis}", empty) for axis in "xyz"], axis=1)
    spools = np.stack([log.columns[f"spool_{number}"] for number in numbers], axis=1)
    tensions = np.stack([log.columns.get(f"tension_{k}", np.full(len(log), math.nan)) for k in numbers], axis=1)
    seen, counted = np.isfinite(motion), np.isfinite(spools).all(axis=1)
    seen = seen[:, seen.any(axis=0)]
    if not robot.timed:
        seen = np.logical_and.reduce(seen, axis=1, keepdims=True)
    fewest = int(min(*seen.sum(axis=0), counted.sum())) if seen.size else 0
    if fewest < _FEWEST:
        raise UserError(
            f"{fewest} samples of trial {name or file} have spools and motion", str(log.file), f"{_FEWEST} or more"
        )
    most = max(_FEWEST, _MOST // trials)
    title = f"{file}, {name}" if name else file
    mass = mass_of_log(log) or 0.0
    if not robot.timed:
        kept = np.flatnonzero(seen[:, 0] & counted)
        kept = kept[:: max(1, math.ceil(len(kept) / most))]
        time, pause = kept.astype(float), np.full(len(kept), _NO_TIME)
        columns = motion[kept], spools[kept], tensions[kept]
    else:
        clock = log.columns["time"]
        read = [clock[column] for column in seen.T]
        begin, end = max(times[0] for times in read), min(times[-1] for times in read)
        # Even readings are taken as they are: lines between them would make a quick motion smaller than the spools'.
        step = min((end - begin) / most, max(_OFTEN, (end - begin) / _MOST))
        shortest = max(_SHORTEST, step, *(float(np.median(np.diff(times))) for times in read))
        time, step = np.linspace(begin, end, 1 + round((end - begin) / shortest), retstep=True)
        pause = np.full(len(time), step)
        columns = lines_at(time, clock, motion), lines_at(time, clock, spools), lines_at(time, clock, tensions)
    pause[0] = math.nan
    nothing = np.zeros(len(time), bool)
    measured, reeled, pulls = columns
    return ArcRecording(
        title, file, time, reeled, measured, pause, nothing, nothing, nothing, np.zeros(len(time), np.int64), mass,
        pulls if np.isfinite(pulls).any() else None,
    )  # fmt: skip


def lines_at(time: Array, clock: Array, values: Array) -> Array:
    """Columns of a log at other times, by lines between the samples that are there; nan where a column is empty."""
    columns = []
    for column in values.T:
        there = np.isfinite(column)
        columns.append(np.interp(time, clock[there], column[there]) if there.any() else np.full(len(time), math.nan))
    return np.stack(columns, axis=1)
