"""What the wrist follows: the motion of a trial, the way back to zero, and rest there."""

from __future__ import annotations

import numpy as np

from wristctl.arrays import Array
from wristctl.config.errors import UserError
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import DirectionName
from wristctl.config.wrist import WristParameters
from wristctl.simulation.minimum_jerk import minimum_jerk
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.reference import motion
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse


def motion_of(
    settings: HwRunSettings, wrist: WristParameters, direction: DirectionName, network: Inverse | None = None
) -> Motion:
    """A trial's motion in this direction, sampled at the control period, and worked out before any motor turns.

    Raises UserError for one out of reach.
    """
    reference = settings.reference if DIRECTIONS[direction].sign > 0 else settings.reference.mirrored()
    found = motion(reference, in_plane(wrist, direction), settings.horizon, settings.control_period, network)
    if not np.isfinite(found.angles.rows).all():
        raise UserError(
            "the reference has samples that are no number", "reference", "a course that is finite everywhere"
        )
    return found


def back(theta: float, duration: float, rest: float, period: float) -> Motion:
    """From theta [rad] to straight in `duration` [s], and rest there."""
    time: Array = np.arange(round((duration + rest) / period), dtype=np.float64) * period
    course = -theta * minimum_jerk(time, duration)
    course[0] += theta
    angles = Angles.of(course)
    return Motion(
        time, angles, np.zeros((len(time), 2)),
        turn=-theta, begin=0.0, rest=duration, horizon=duration + rest,
    )  # fmt: skip


def at_rest(duration: float, period: float) -> Motion:
    """Straight for so long [s]."""
    return back(0.0, duration, 0.0, period)
