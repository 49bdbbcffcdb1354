"""An open log of tendons' tensions or motors' currents as recordings of an arc, and where the search begins."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import Phrase, Setting, UserError
from wristctl.identification.arc_robot import ArcRecording, inertia_of_arc
from wristctl.identification.driven_forward import STEP
from wristctl.identification.driven_robot import Drive, DrivenRobot
from wristctl.identification.log_model import SETTLE, in_parts, lines_at, mass_of_log, without_begin
from wristctl.records.open_log import OpenLog
from wristctl.wrist.tendon_layout import TendonLayout

# Samples that are kept of all trials, and fewest of a trial.
_MOST, _FEWEST = 4000, 40
# Share of a column's steps that are none, from which it is held between its changes as a command is.
_HELD = 0.5
# Delays that the search begins from [s].
_DELAYS = np.linspace(0.0, 0.4, 21)
# Standard deviation of a motion over its noise, and least one [rad], and range of a drive over the largest, from which
# they move.
_MOVES, _LEAST, _DRIVES = 2.0, 1e-4, 0.02
# Bend for a tendon's pull over the largest, below which it does not pull.
_IDLE = 0.05
# Error of a motion over its size by which it is judged what a straight line tells, and largest deviations then: of
# stiffness and gains over the value, of directions [rad].
_ERROR, _WIDEST, _ASIDE = 0.02, 0.25, math.radians(15.0)
# Share of the stiffness that weight may take: standard deviation.
_WEIGHT = 0.3
# Share of the squared pull of a tendon off the plane of all from which they pull in two.
_ONE_PLANE = 0.02


def drive_of_log(log: OpenLog, settings: IdentifySettings) -> Drive | None:
    """What moves the wrist by a log: None where spools do, or where nothing is known of its tendons."""
    if log.tendons_of("spool"):
        return None
    if log.tendons_of("tension") or (log.tendons_of("current") and _newtons(settings) is not None):
        return "tension"
    return "current" if log.tendons_of("current") else None


def _newtons(settings: IdentifySettings) -> float | None:
    """Tension [N] of an ampere; None where nobody says it. Raises UserError where one of two numbers is missing."""
    torque, radius = settings.torque_constant, settings.spool_radius
    if (torque is None) != (radius is None):
        missing = "spool_radius" if radius is None else "torque_constant"
        raise UserError("a tension needs torque constant and spool radius", f"identify.{missing}", "both, or neither")
    return None if torque is None or radius is None else torque / radius


def driven_robot(
    logs: Sequence[OpenLog], wrist: WristParameters, settings: IdentifySettings
) -> tuple[DrivenRobot, list[ArcRecording], list[str]]:
    """The robot that logs are of, its recordings, and what is to be said of them.

    The search begins at directions, gains and stiffness by linear regression. Of four or more trials half are
    predicted, of fewer half of the parts of each. Raises UserError for logs that are not alike, and where nothing
    moves.
    """
    first = logs[0]
    drive = drive_of_log(first, settings)
    assert drive is not None
    quantity: Drive = "tension" if first.tendons_of("tension") else "current"
    scale = 1.0 if quantity == drive else _newtons(settings) or 1.0
    numbers = first.tendons_of(quantity)
    for log in logs:
        _check_alike(log, first, quantity, numbers)
    trials = [(log, name, trial) for log in logs for name, trial in log.trials().items()]
    masses = {round(mass, 4) for _, _, trial in trials if (mass := mass_of_log(trial)) is not None}
    if len(masses) > 1:
        raise UserError("trials with several masses", str(first.file), "logs of one mass at a time")
    flipped = [number for number in numbers if _counts_backwards(logs, f"{quantity}_{number}")]
    signs = tuple(-scale if number in flipped else scale for number in numbers)
    raw = [_recording(log, name, trial, quantity, numbers, signs, len(trials)) for log, name, trial in trials]
    recordings = in_parts(raw)
    _check_motion(recordings, first, quantity)
    robot = _robot(recordings, drive, wrist, settings, quantity, numbers, signs)
    if any(log.two_clocks for log in logs):
        robot = replace(robot, untold=(*robot.untold, "delay"))
    remarks = [_counts_told(flipped, quantity)] * bool(flipped)
    if quantity != drive:
        remarks.append(f"One ampere is taken as {scale:.3g} N, by identify.torque_constant and identify.spool_radius.")
    if first.tendons_of("current") and quantity == "tension":
        remarks.append("Currents take no part, as the log has tensions.")
    return robot, [without_begin(one, SETTLE) for one in recordings], remarks


def recordings_of(logs: Sequence[OpenLog], robot: DrivenRobot) -> list[ArcRecording]:
    """Trials of other logs of a robot, of which nothing is fitted or predicted yet."""
    trials = [(log, name, trial) for log in logs for name, trial in log.trials().items()]
    return [
        _recording(log, name, trial, robot.quantity, robot.numbers, robot.signs, len(trials))
        for log, name, trial in trials
    ]


def _check_alike(log: OpenLog, first: OpenLog, quantity: str, numbers: Sequence[int]) -> None:
    where = log.header or str(log.file)
    if log.tendons_of(quantity) != numbers or log.tendons_of("spool"):
        raise UserError("other columns of tendons than in the first log", where, "logs of one robot, recorded alike")
    if "time" not in log.columns:
        raise UserError(f"no column time, and {quantity}s move a wrist in time", where, "a column time [s]")
    if log.bends() is None and not {"tip_x", "tip_y"} <= set(log.columns):
        fix = "columns bend_y [deg], quat_w, quat_x, quat_y, quat_z, or gravity_x, gravity_y, gravity_z"
        raise UserError("neither a bend nor the tip is in the log", where, fix)
    if (log.bends() is None) != (first.bends() is None):
        raise UserError("measures something else than the first log", where, "logs that measure the same")


def _counts_backwards(logs: Sequence[OpenLog], name: str) -> bool:
    """Whether a column is mostly negative where it is large: a tendon pulls, so its sign is that of the wiring."""
    column = np.concatenate([log.columns[name] for log in logs])
    column = column[np.isfinite(column)]
    return bool(column.size) and float(np.sum(column * np.abs(column))) < 0.0


def _counts_told(flipped: Sequence[int], quantity: str) -> str:
    names = ", ".join(f"{quantity}_{number}" for number in flipped)
    return f"{names}: mostly negative, so that its other sign is taken as a pull."


def _motion(log: OpenLog) -> Array:
    """Bends (T, 2) [rad] of a log; of one arc by the chord to its tip where there is no bend."""
    bends = log.bends()
    if bends is not None:
        return bends
    x, y = log.columns["tip_x"], log.columns["tip_y"]
    z = log.columns.get("tip_z", 0.0 * y)
    across = np.hypot(y, z)
    share = np.divide(2.0 * np.arctan2(across, x), across, out=np.zeros_like(across), where=across > 0.0)
    return np.stack([share * y, share * z], axis=1)


def _recording(
    log: OpenLog, name: str, trial: OpenLog, quantity: str, numbers: Sequence[int], signs: Sequence[float], trials: int
) -> ArcRecording:
    file, clock, motion = Path(log.file).stem, trial.columns["time"], _motion(trial)
    driven = np.stack([trial.columns[f"{quantity}_{number}"] for number in numbers], axis=1)
    seen, told = np.isfinite(motion).all(axis=1), np.isfinite(driven).all(axis=1)
    within = seen.copy()
    if told.any():
        within &= (clock >= clock[told][0]) & (clock <= clock[told][-1])
    if min(within.sum(), told.sum()) < _FEWEST:
        problem = f"{int(min(within.sum(), told.sum()))} samples of trial {name or file} have {quantity}s and motion"
        raise UserError(problem, str(log.file), f"{_FEWEST} or more")
    kept = np.flatnonzero(within)
    kept = kept[:: max(1, math.ceil(len(kept) * trials / _MOST))]
    begin, end = clock[told][0], clock[told][-1]
    grid = np.arange(begin, end + STEP, STEP)
    course = np.stack([signs[k] * _at(grid + 0.5 * STEP, clock[told], driven[told, k]) for k in range(len(numbers))], 1)
    rates = np.stack([trial.columns.get(f"rate_{axis}", np.full(len(clock), math.nan)) for axis in "yz"], axis=1)[kept]
    nothing, at_samples = np.zeros(len(kept), bool), lines_at(clock[kept], clock[told], driven[told])
    return ArcRecording(
        f"{file}, {name}" if name else file, file, clock[kept], np.array(signs) * at_samples,
        motion[kept], np.diff(clock[kept], prepend=math.nan), nothing, nothing, nothing, np.zeros(len(kept), np.int64),
        mass_of_log(trial) or 0.0, rates if np.isfinite(rates).any() else None, (grid, course),
    )  # fmt: skip


def _at(time: Array, clock: Array, column: Array) -> Array:
    """A column at other times: held between its changes where it is a command, else by a cubic spline."""
    clock, first = np.unique(clock, return_index=True)
    column = column[first]
    time = np.clip(time, clock[0], clock[-1])
    steps = np.diff(column)
    if np.mean(steps == 0.0) > _HELD and steps.any():
        return np.asarray(column[np.searchsorted(clock, time, side="right") - 1])
    return np.asarray(CubicSpline(clock, column)(time))


def _check_motion(recordings: Sequence[ArcRecording], log: OpenLog, quantity: str) -> None:
    """UserError where the wrist, or no tendon, moves."""
    where = log.header or str(log.file)
    motion = max(float(np.std(one.measured, axis=0).max()) for one in recordings)
    if motion < max(_MOVES * max(_noise(one.measured) for one in recordings), _LEAST):
        problem = f"the bend moves {math.degrees(motion):.2g} deg: nothing can be identified from a log without motion"
        raise UserError(problem, where, "a log in which the tendons bend the wrist to several sides")
    if not moving_tendons(recordings).any():
        raise UserError(f"no {quantity} changes", where, "a log in which each tendon pulls more and less")


def _noise(bends: Array) -> float:
    """Noise of bends (T, 2) [rad]: third differences leave little of a motion."""
    return float(np.sqrt(np.mean(np.diff(bends, 3, axis=0) ** 2, axis=0).max() / 20.0))


def _regression(recordings: Sequence[ArcRecording]) -> tuple[Array, float]:
    """Bend of each tendon's unit (M, 2) [rad], and the delay [s] with which a line through all is best."""
    best: tuple[float, Array, float] = (math.inf, np.empty(0), 0.0)
    for delay in _DELAYS:
        rows, bends = list[Array](), list[Array]()
        for one in recordings:
            assert one.course is not None
            clock, driven = one.course
            at = lines_at(one.time - delay, clock, driven)
            rows.append(at - at.mean(axis=0))
            bends.append(one.measured - one.measured.mean(axis=0))
        made, motion = np.concatenate(rows), np.concatenate(bends)
        found = np.asarray(np.linalg.lstsq(made, motion, rcond=1e-3)[0], np.float64)
        left = float(np.sum((made @ found - motion) ** 2))
        if left < best[0]:
            best = left, found, float(delay)
    return best[1], best[2]


def _robot(
    recordings: Sequence[ArcRecording], drive: Drive, wrist: WristParameters, settings: IdentifySettings,
    quantity: Drive, numbers: Sequence[int], signs: tuple[float, ...],
) -> DrivenRobot:  # fmt: skip
    bends, delay = _regression(recordings)
    sizes = np.hypot(*bends.T)
    plane, planar = _plane(bends)
    angles = np.arctan2(bends[:, 1], bends[:, 0])
    if planar:
        toward = bends @ np.array([math.cos(plane), math.sin(plane)])
        angles = np.where(toward >= 0.0, plane, plane + math.pi)
    moving = moving_tendons(recordings) & (sizes > _IDLE * sizes.max())
    nominal = _nominal(len(numbers), wrist)
    angles = np.where(moving, angles, nominal)
    radius = TendonLayout.of(wrist).offset if planar else wrist.tendon_radius
    per_unit = float(sizes[moving].mean())
    begin = {"stiffness": (radius if drive == "tension" else 1.0) / per_unit, "delay": max(delay, 0.01)}
    gains = sizes / per_unit
    still = tuple(number for number, moves in zip(numbers, moving, strict=True) if not moves)
    of_others = zip(numbers, np.clip(gains, 0.1, max(1.0, len(gains) - 0.1)), strict=True)
    begin |= {f"gain_{number}": float(gain) for number, gain in of_others if number not in still}
    begin["inertia"] = min(0.5, inertia_of_arc(wrist) / wrist.stiffness)
    known_to = {}
    if drive == "tension":
        begin["arm"], known_to["arm"] = 1.0, settings.radius_error
    weighs = "gravity" not in wrist.model_fields_set or any(wrist.gravity)
    if weighs:
        begin["weight"], known_to["weight"] = 0.0, _WEIGHT
    untold = _untold(recordings, angles, gains, planar, numbers, moving)
    return DrivenRobot(
        (wrist.length,), tuple(angles.tolist()), radius, (1,) * len(angles), "bend", (), begin, known_to,
        spans=wrist.discs - 1, weighed=True, drive=drive, wrist=wrist, planar=planar, quantity=quantity,
        numbers=tuple(numbers), signs=signs, still=still, untold=untold, widest=settings.widest, weighs=weighs,
    )  # fmt: skip


def _untold(
    recordings: Sequence[ArcRecording],
    angles: Array,
    gains: Array,
    planar: bool,
    numbers: Sequence[int],
    moving: NDArray[np.bool_],
) -> tuple[str, ...]:
    """Unknowns of which a wrist that bends in proportion to all pulls tells nothing.

    What only the arc's small departures from a line would tell stands and falls with these, and is not taken as told.
    """
    pulls = np.concatenate([one.spools - one.spools.mean(axis=0) for one in recordings])
    toward = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    aside = np.stack([-np.sin(angles), np.cos(angles)], axis=1)
    motion = np.einsum("tm,m,mp->tp", pulls, gains, toward)
    slopes = {"stiffness": -motion}
    first, *_ = indices = np.flatnonzero(moving).tolist()
    for k in indices:
        number = numbers[k]
        if k != first:
            slopes[f"gain_{number}"] = pulls[:, k, None] * toward[k] - pulls[:, first, None] * toward[first]
        if not planar:
            slopes[f"direction_{number}"] = gains[k] * pulls[:, k, None] * aside[k]
    matrix = np.stack([slope.ravel() for slope in slopes.values()], axis=1) / math.sqrt(len(pulls))
    size, axes = np.linalg.eigh(matrix.T @ matrix)
    error = _ERROR * float(np.sqrt(np.mean(np.sum(motion**2, axis=1))))
    deviations = error * np.sqrt(axes**2 @ (1.0 / np.maximum(size, 1e-12 * size[-1])))
    widest = [_ASIDE if name.startswith("direction") else _WIDEST for name in slopes]
    return tuple(name for name, one, most in zip(slopes, deviations, widest, strict=True) if one > most)


def _plane(bends: Array) -> tuple[float, bool]:
    """Direction of the line that pulls (M, 2) are nearest to [rad], and whether all are along it."""
    sizes, axes = np.linalg.eigh(bends.T @ bends)
    return math.atan2(axes[1, 1], axes[0, 1]) if axes[0, 1] >= 0.0 else math.atan2(-axes[1, 1], -axes[0, 1]), bool(
        sizes[0] <= _ONE_PLANE**2 * sizes[1]
    )


def _nominal(count: int, wrist: WristParameters) -> Array:
    """Directions of tendons that do not pull, by the wrist or evenly around [rad]."""
    places = [place.angle for place in TendonLayout.of(wrist).places if place.radius > 0.0]
    return np.array(places if len(places) == count else [math.tau * k / count for k in range(count)])


MOTIONS = {
    "tendon": "pull each tendon by itself, or change what antagonists pull together",
    "direction": "pull each tendon by itself, the others slack or held",
    "gain": "pull each tendon by itself, or change what antagonists pull together",
    "stiffness": "slow circles of several sizes, each tendon pulling in turn",
    "arm": "nothing in a log: measure the tendons' distance from the axis",
    "damping": "quick steps, logged at 50 Hz or more",
    "inertia": "quick steps that swing, logged at 100 Hz or more",
    "delay": "quick steps, logged at 50 Hz or more",
    "weight": "slow circles of up to 40 deg and more",
    "friction": "slow strokes to and fro of several sizes at several co-contractions",
    "sheath": "slow strokes to and fro of several sizes at several co-contractions",
    "presliding": "slow strokes to and fro that turn round after a few degrees",
    "inner": "slow strokes to and fro that turn round after a few degrees",
    "creep": "bends that are held for a minute",
}
"""Motions that tell an unknown, by the first word of its name."""


def motions_for(names: Iterable[str]) -> list[str]:
    """The motions that would tell unknowns, each once; none for what no motion tells."""
    words = [MOTIONS.get(name.partition("_")[0]) for name in names]
    return list(dict.fromkeys(filter(None, words)))


def wanted_motion() -> Phrase:
    """What to record where a model does not predict the motion."""
    return (
        "record slow circles of several sizes, then each tendon pulled by itself, with all tendons in the log and "
        "nothing else that pushes; or take it as it is: ",
        Setting("misfit=tell", "identify"),
    )


def moving_tendons(recordings: Sequence[ArcRecording]) -> NDArray[np.bool_]:
    """Which tendons pull more and less in any recording (M,)."""
    largest = max(float(np.abs(one.spools).max()) for one in recordings)
    moved: NDArray[np.bool_] = np.max([np.ptp(one.spools, axis=0) for one in recordings], axis=0) > _DRIVES * largest
    return moved
