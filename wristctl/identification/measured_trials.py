"""Trials as identification sees them: what the spools did, and what the camera saw of it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.spool_paths import answered, spool_paths
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, in_plane, tendons_of

if TYPE_CHECKING:
    import pandas as pd


# Frames that a trial must have to be of use.
_FEWEST = 20

LEAST_NOISE = math.radians(5e-3)
"""Noise that readings of a rig have at least [rad].

Of simulated readings without noise the integration step, the search's end and the spools' microsteps are left over.
"""

# Instants of an exposure whose mean stands for it.
_INSTANTS = 5


@dataclass(frozen=True)
class MeasuredTrial:
    """One motion of a wrist in one bending plane: T instants on a grid, F frames."""

    label: str
    run: str
    direction: str
    wrist: WristParameters
    """As known, gravity in the bending plane."""
    time: Array
    """(T,) [s]"""
    reeled: Array
    """Length reeled in by the spools' count, (T, 4) [m]: two tendons of the + side, two of the - side."""
    captured: Array
    """Time stamps of the frames, (F,) [s]."""
    angle: Array
    """Angle in every frame, (F,) [rad]."""
    exposure: float
    """Exposure time, about the time stamp [s]; the picture shows the mean of that time."""

    @property
    def plane(self) -> str:
        """The bending plane."""
        return DIRECTIONS[self.direction].plane

    @property
    def tendons(self) -> tuple[int, ...]:
        """The tendons in the order of `reeled`."""
        return tendons_of(self.plane)

    def shown(self, course: Array, delay: float) -> Array:
        """Angles that the frames (F,) show of a course (T,) on the grid, `delay` [s] before their time stamps."""
        return self.seen(self.captured, course, delay)

    def seen(self, captured: Array, course: Array, delay: float) -> Array:
        """Angles that frames with these time stamps (F,) [s] show of a course (T,), `delay` [s] before them."""
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
