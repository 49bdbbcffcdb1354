"""Trials of an open log in two planes: what the spools of all tendons did, and what was read of bends and tensions."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.log_model import mass_of_log, spools_of_log
from wristctl.identification.measured_trials import MeasuredTrial, frame_noise
from wristctl.records.open_log import OpenLog
from wristctl.wrist.directions import TENDONS
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

# Readings that a bend must have in a trial to be of use.
_FEWEST = 20
PLANES = ("ulnar", "flexion")
"""Planes of the two bends, in their order."""


@dataclass(frozen=True)
class BendTrial(MeasuredTrial):
    """One motion of a wrist in two planes: T instants on a grid, R readings of bends and of the tendons' tensions.

    `captured` and `angle` are of each reading (R,); `reeled` (T, M) is of M tendons; of a tension `angle` is the
    tension times `per_newton`, so that readings of either kind are as noisy.
    """

    numbers: tuple[int, ...]
    """Numbers of the tendons in the log."""
    channel: NDArray[np.int64]
    """What each reading is of (R,): 0 and 1 the bend toward ulnar and flexion, then the tensions."""
    per_newton: float

    @property
    def plane(self) -> str:
        """Both."""
        return "both"

    @property
    def tendons(self) -> tuple[int, ...]:
        """The tendons in the order of `reeled`."""
        return self.numbers

    def shown(self, course: Array, delay: float) -> Array:
        """Readings (R,) of a course (T, 2 + M): bends `delay` [s] before their time stamps, tensions at theirs."""
        readings = np.empty(len(self.captured))
        for channel, column in enumerate(course.T):
            own = self.channel == channel
            if channel < len(PLANES):
                readings[own] = self.seen(self.captured[own], column, delay)
            else:
                readings[own] = self.per_newton * np.interp(self.captured[own], self.time, column)
        return readings


def places_of_log(log: OpenLog, wrist: WristParameters) -> dict[int, TendonPlace]:
    """Places of a log's tendons by their numbers: 1, 2, 4, 5 of the square wrist, else those of `wrist.tendons`.

    Raises UserError where log and wrist have not as many.
    """
    numbers, layout = spools_of_log(log), TendonLayout.of(wrist)
    places = [place for place in layout.places if place.radius > 0.0]
    if not numbers:
        fix = "columns spool_1 [mm], ...; model: arcs takes tensions or currents alone"
        raise UserError("model: wrist is driven by spools, and the log has none", log.header or str(log.file), fix)
    if set(numbers) == {number for number, corner in TENDONS.items() if any(corner)} and len(places) == len(numbers):
        numbers = sorted(numbers)
    elif numbers != list(range(1, len(places) + 1)):
        problem = f"spools of tendons {', '.join(map(str, numbers))}, and the wrist has {len(places)} places"
        raise UserError(problem, log.header or str(log.file), "wrist.tendons as the log has them")
    return dict(zip(numbers, places, strict=True))


def bend_trials(logs: Sequence[OpenLog], wrist: WristParameters, grid: float, exposure: float = 0.0) -> list[BendTrial]:
    """The trials of logs of one wrist, each log a run that was homed once, on a grid [s].

    `exposure` is how long the shutter is open [s]. Raises UserError for a log without times, without both bends, or of
    another wrist.
    """
    numbers = spools_of_log(logs[0])
    trials = []
    for log in logs:
        if spools_of_log(log) != numbers:
            raise UserError("tendons of other numbers than in the first log", str(log.file), "logs of one robot")
        for name in ("time", "bend_y", "bend_z"):
            if name not in log.columns:
                fix = "a column of it; model: arcs takes logs with less"
                raise UserError(f"{name} is not in the log", log.header or str(log.file), fix)
        for name, trial in log.trials().items():
            run = Path(log.file).stem
            trials.append(_trial(trial, f"{run}, {name}" if name else run, run, wrist, grid, exposure))
    return trials


def _trial(log: OpenLog, label: str, run: str, wrist: WristParameters, grid: float, exposure: float) -> BendTrial:
    from scipy.interpolate import CubicSpline

    numbers, clock = spools_of_log(log), log.whole("time")
    spools = np.stack([log.columns[f"spool_{number}"] for number in numbers], axis=1)
    counted = np.isfinite(spools).all(axis=1)
    if counted.sum() < _FEWEST:
        raise UserError(f"{int(counted.sum())} samples with all spools", label, f"{_FEWEST} or more")
    ticks = clock[counted]
    time = np.arange(ticks[0], ticks[-1], grid)
    if (mass := mass_of_log(log)) is not None:
        wrist = wrist.model_copy(update={"hand_mass": mass})
    names = ["bend_y", "bend_z", *(f"tension_{number}" for number in numbers)]
    within = (clock >= time[0]) & (clock <= time[-1])
    readings = list[tuple[Array, Array]]()
    for name in names:
        column = log.columns.get(name, np.full(len(clock), math.nan))
        there = np.isfinite(column) & within
        if name.startswith("bend") and there.sum() < _FEWEST:
            raise UserError(f"{int(there.sum())} readings of {name}", label, f"{_FEWEST} or more")
        readings.append((clock[there], column[there]))
    per_newton = 1.0
    if tensions := [values for _, values in readings[2:] if len(values) >= _FEWEST]:
        per_newton = frame_noise([values for _, values in readings[:2]]) / max(frame_noise(tensions), 1e-9)
    scales = [1.0, 1.0] + [per_newton] * len(numbers)
    return BendTrial(
        label, run, "both", wrist, time, CubicSpline(ticks, spools[counted])(time + 0.5 * grid),
        np.concatenate([times for times, _ in readings]),
        np.concatenate([scale * values for scale, (_, values) in zip(scales, readings, strict=True)]),
        exposure, tuple(numbers), np.repeat(np.arange(len(names)), [len(times) for times, _ in readings]), per_newton,
    )  # fmt: skip
