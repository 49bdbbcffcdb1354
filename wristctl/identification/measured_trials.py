"""Trials as identification sees them: what the spools did, and what was read of bends and tensions.

Those of a run of hw-run in one plane come from its tables, those in two planes from open logs.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.log_model import mass_of_log, spools_of_log
from wristctl.identification.spool_paths import answered, spool_paths
from wristctl.records.open_log import OpenLog
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, TENDONS, in_plane, tendons_of
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

if TYPE_CHECKING:
    import pandas as pd

PLANES, BOTH = ("ulnar", "flexion"), "both"
"""Planes of two bends, in their order, and the direction of a trial in both."""
# Frames, or readings of a bend, that a trial must have to be of use.
_FEWEST = 20

LEAST_NOISE = math.radians(5e-3)
"""Noise that readings of a rig have at least [rad].

Of simulated readings without noise the integration step, the search's end and the spools' microsteps are left over.
"""

# Instants of an exposure whose mean stands for it.
_INSTANTS = 5


@dataclass(frozen=True)
class MeasuredTrial:
    """One motion of a wrist in P planes: T instants on a grid, R readings of its bends and its tendons' tensions."""

    label: str
    run: str
    direction: str
    """In one plane; BOTH of two."""
    wrist: WristParameters
    """As known, in one plane gravity in it."""
    time: Array
    """(T,) [s]"""
    reeled: Array
    """Length reeled in by the spools' count, (T, M) [m]: in one plane two tendons of the + side, two of the - side."""
    captured: Array
    """Time stamps of the readings, (R,) [s]."""
    angle: Array
    """The readings, (R,) [rad]; of a tension it times `per_newton`, so that readings of either kind are as noisy."""
    exposure: float
    """Exposure time, about the time stamp [s]; the picture shows the mean of that time."""
    numbers: tuple[int, ...] = ()
    """Numbers of the tendons in two planes."""
    channel: NDArray[np.int64] = field(default_factory=lambda: np.zeros((), np.int64))
    """What each reading is of (R,), or all: the bend of each plane, then the tension of each tendon."""
    per_newton: float = 1.0
    by_cameras: bool = True
    """Whether the bends were seen at times of their own; else they stand beside the counts, as one instrument's."""

    @property
    def planes(self) -> tuple[str, ...]:
        """The bending planes."""
        return PLANES if self.direction == BOTH else (DIRECTIONS[self.direction].plane,)

    @property
    def tendons(self) -> tuple[int, ...]:
        """The tendons in the order of `reeled`."""
        return self.numbers or tendons_of(self.planes[0])

    def of(self, channel: int) -> NDArray[np.bool_]:
        """Which readings (R,) are of a channel."""
        return np.broadcast_to(np.equal(self.channel, channel), self.captured.shape)

    def named_channels(self) -> Iterator[tuple[str, NDArray[np.bool_]]]:
        """Channels by name, one plane's by its direction, all tensions' by one, and which readings (R,) are theirs."""
        for channel in np.unique(self.channel):
            names = self.planes if self.direction == BOTH else (self.direction,)
            yield names[channel] if channel < len(names) else "tensions", self.of(channel)

    def shown(self, course: Array, delay: float) -> Array:
        """Readings (R,) of a course (T, P + M): bends `delay` [s] before their time stamps, tensions at theirs."""
        readings = np.empty(len(self.captured))
        for channel, column in enumerate(course.T):
            own = self.of(channel)
            if channel < len(self.planes):
                readings[own] = self._seen(self.captured[own], column, delay)
            else:
                readings[own] = self.per_newton * np.interp(self.captured[own], self.time, column)
        return readings

    def _seen(self, captured: Array, course: Array, delay: float) -> Array:
        since = self.exposure * ((np.arange(_INSTANTS) + 0.5) / _INSTANTS - 0.5)
        angle: Array = np.interp(captured - delay + since[:, None], self.time, course).mean(axis=0)
        return angle

    def faster(self, factor: float) -> MeasuredTrial:
        """Motion in a fraction of the time, then at rest, as often seen."""
        earlier = np.minimum(self.time[0] + factor * (self.time - self.time[0]), self.time[-1])
        reeled = np.stack([np.interp(earlier, self.time, travel) for travel in self.reeled.T], axis=1)
        return replace(self, reeled=reeled)


def measured_trials(
    label: str, wrist: WristParameters, motors: Actuator, grid: float, log: pd.DataFrame, frames: pd.DataFrame,
    kinds: pd.DataFrame, exposure: float = 0.0,
) -> list[MeasuredTrial]:  # fmt: skip
    """The trials of a run's tables log, frames and trials, without a person's push, on a grid [s].

    `motors` are as believed, `exposure` is how long the shutter is open [s]. UserError where no trial is of use.
    """
    trials = []
    for row in kinds.itertuples():
        number, direction = int(row.trial), str(row.direction)  # type: ignore[arg-type]
        own, sightings = log[log.trial == number], frames[frames.trial == number]
        if float(row.push) != 0.0 or len(answered(own)) < _FEWEST:  # type: ignore[arg-type]
            continue
        clock, captured, angle = (column.to_numpy(float) for column in (own.time, sightings.captured, sightings.theta))
        time = np.arange(clock[0], clock[-1], grid)
        usable = (sightings.verdict == "ok").to_numpy() & np.isfinite(angle)
        usable &= (captured >= time[0]) & (captured <= time[-1])
        if usable.sum() < _FEWEST:
            continue
        trial = MeasuredTrial(
            f"{label}, trial {number}: {direction}", label, direction, in_plane(wrist, direction),
            time, np.empty((len(time), 4)), captured[usable], angle[usable], exposure,
        )  # fmt: skip
        # what is held over a step is what its middle has
        steps = spool_paths(own, motors)(time + 0.5 * grid)[:, [ACTIVE.index(tendon) for tendon in trial.tendons]]
        trials.append(replace(trial, reeled=motors.step_length * steps))
    if not trials:
        raise UserError(
            f"no trial without a push has {_FEWEST} usable frames", label, "name an hw-run run with trials that ended"
        )
    return trials


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


def trials_of_logs(
    logs: Sequence[OpenLog], wrist: WristParameters, grid: float, exposure: float = 0.0
) -> list[MeasuredTrial]:
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
            trials.append(_trial_of_log(trial, f"{run}, {name}" if name else run, run, wrist, grid, exposure))
    return trials


def _trial_of_log(
    log: OpenLog, label: str, run: str, wrist: WristParameters, grid: float, exposure: float
) -> MeasuredTrial:
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
    beside = counted & within & np.isfinite([log.columns[name] for name in ("bend_y", "bend_z")]).all(axis=0)
    per_newton = 1.0
    if tensions := [values for _, values in readings[2:] if len(values) >= _FEWEST]:
        per_newton = frame_noise([values for _, values in readings[:2]]) / max(frame_noise(tensions), 1e-9)
    scales = [1.0, 1.0] + [per_newton] * len(numbers)
    return MeasuredTrial(
        label, run, BOTH, wrist, time, CubicSpline(ticks, spools[counted])(time + 0.5 * grid),
        np.concatenate([times for times, _ in readings]),
        np.concatenate([scale * values for scale, (_, values) in zip(scales, readings, strict=True)]),
        exposure, tuple(numbers), np.repeat(np.arange(len(names)), [len(times) for times, _ in readings]), per_newton,
        not beside.any(),
    )  # fmt: skip


def frame_noise(courses: Sequence[Array]) -> float:
    """Standard deviation of what differs from frame to frame in courses (F,), by their second differences.

    Neither a trend nor what lasts longer than a few frames counts. Medians: quick moves do not either.
    """
    second = np.concatenate([np.diff(course, 2) for course in courses])
    return float(np.median(np.abs(second)) / (0.6745 * np.sqrt(6.0)))


# Frames of delay that a simulated camera may have.
MOST_DELAYED = 20.0


def camera_parameters(frames: pd.DataFrame, delay: float, noise: float) -> dict[str, float]:
    """Frame rate [1/s], delay in frames from exposure to use, noise [deg], dropped share: as `loop.sensor` has them.

    `frames` has a row for each frame: run, trial, the time stamp `captured` and the time `used` [s], and the verdict.
    `delay` is how much older a picture is than its time stamp [s], `noise` the standard deviation of an angle [rad].
    """
    rate = 1.0 / float(frames.groupby(["run", "trial"]).captured.diff().median())
    used = float((frames.used - frames.captured).mean())
    return {
        "frame_rate": rate,
        "delay_frames": float(np.clip((used + delay) * rate, 0.0, MOST_DELAYED)),
        "noise_deg": float(np.degrees(noise)),
        "dropped": float((frames.verdict != "ok").mean()),
    }
