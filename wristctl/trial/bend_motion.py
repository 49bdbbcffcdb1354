"""Motions of a rig in two planes: bends with two derivatives at every tick, worked out before any motor turns."""

from dataclasses import dataclass

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.planes import bends_of, within
from wristctl.simulation.reference import REFERENCES, motion
from wristctl.simulation.references import minimum_jerk
from wristctl.trial.spatial_belief import TOWARD, unit_toward
from wristctl.wrist.directions import in_plane
from wristctl.wrist.kinematics import Inverse


@dataclass(frozen=True)
class BendMotion:
    """A motion in two planes on the grid of ticks, T samples from t = 0; SI units."""

    time: Array
    references: Array
    """Bend toward ulnar and flexion with two derivatives, (2, 3, T)."""
    rest: float
    """When it rests; the horizon if it never does."""
    horizon: float

    @property
    def bend_ref(self) -> Array:
        """Wanted bend (T, 2) [rad]."""
        bend: Array = self.references[:, 0].T
        return bend

    @property
    def final(self) -> Array:
        """Last wanted bend (2,) [rad]."""
        final: Array = self.references[:, 0, -1]
        return final

    @property
    def size(self) -> float:
        """Largest wanted bend [rad]."""
        return float(np.hypot(*self.references[:, 0]).max())

    def bend_at(self, time: float) -> Array:
        """Wanted bend (2,) [rad] at a time [s]."""
        return np.array([np.interp(time, self.time, plane) for plane in self.references[:, 0]])


def has_path(settings: HwRunSettings) -> bool:
    """Whether the reference is a path in two planes of its own, and no motion toward a direction."""
    return REFERENCES[settings.reference.kind].planes == 2 or settings.reference.file is not None


def bend_motion_of(
    settings: HwRunSettings, wrist: WristParameters, direction: str, network: Inverse | None = None
) -> BendMotion:
    """A trial's motion in this direction, or along the reference's own path. Raises UserError for one out of reach."""
    reference, horizon, period = settings.reference, settings.horizon, settings.control_period
    if has_path(settings):
        if reference.inverse == "network":
            problem, fix = "no network stands behind a path of trials", "inverse: closed-form"
            raise UserError(problem, "reference.inverse", fix)
        references = bends_of(reference, "ulnar", wrist, horizon, period)
        time = period * np.arange(references.shape[2], dtype=np.float64)
        moving = np.flatnonzero(references[:, 1:].any(axis=(0, 1)))
        rest = min(horizon, float(time[moving[-1]]) + period) if len(moving) else 0.0
    else:
        of_plane = REFERENCES[reference.kind].plane
        if of_plane and of_plane != direction:
            problem = f"{reference.kind} is a motion of the {of_plane} plane, and {direction} is not its direction"
            raise UserError(problem, "directions", f"directions: [{of_plane}]")
        course = motion(reference, in_plane(wrist, "ulnar"), horizon, period, network)
        references = unit_toward(TOWARD[direction])[:, None, None] * course.angles.rows
        time, rest = course.time, course.rest
    if not np.isfinite(references).all():
        raise UserError(
            "the reference has samples that are no number", "reference", "a course that is finite everywhere"
        )
    return BendMotion(time, within(references, wrist, "reference"), rest, horizon)


def bend_back(bend: Array, duration: float, rest: float, period: float) -> BendMotion:
    """From a bend (2,) [rad] straight to zero in `duration` [s], and rest there."""
    time: Array = period * np.arange(round((duration + rest) / period), dtype=np.float64)
    references = -np.asarray(bend, float)[:, None, None] * minimum_jerk(time, duration)
    references[:, 0] += np.asarray(bend, float)[:, None]
    return BendMotion(time, references, duration, duration + rest)
