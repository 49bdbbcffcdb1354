"""Motions of a rig in P planes: bends with two derivatives at every tick, worked out before any motor turns."""

from typing import cast

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import LIVE, DirectionName
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.motion import DERIVATIVES, Angles, Motion, resting
from wristctl.simulation.planes import motion_in, within
from wristctl.simulation.reference import REFERENCES, motion
from wristctl.simulation.references import minimum_jerk
from wristctl.trial.rig_belief import TOWARD, unit_toward
from wristctl.wrist.directions import in_plane
from wristctl.wrist.kinematics import Inverse


def has_path(settings: HwRunSettings) -> bool:
    """Whether the reference is a path in two planes of its own, and no motion toward a direction."""
    reference = settings.reference
    return REFERENCES[reference.kind].planes == 2 or reference.file is not None or reference.kind == LIVE


def motion_of(
    settings: HwRunSettings, wrist: WristParameters, direction: str, network: Inverse | None = None
) -> Motion:
    """A trial's motion in this direction, or along the reference's own path in two planes, at every tick.

    A live reference rests until it comes. Raises UserError for one out of reach.
    """
    reference, horizon, period = settings.reference, settings.horizon, settings.control_period
    if reference.is_live:
        return resting(np.zeros(settings.planes), round(horizon / period), period)
    if settings.planes == 1:
        way = cast(DirectionName, direction)
        found = motion_in(1, reference, way, in_plane(wrist, way), horizon, period, network)
    elif has_path(settings):
        found = motion_in(2, reference, None, wrist, horizon, period, network)
    else:
        of_plane = REFERENCES[reference.kind].plane
        if of_plane and of_plane != direction:
            problem = f"{reference.kind} is a motion of the {of_plane} plane, and {direction} is not its direction"
            raise UserError(problem, "directions", f"directions: [{of_plane}]")
        course = motion(reference, in_plane(wrist, "ulnar"), horizon, period, network)
        bends = unit_toward(TOWARD[direction])[:, None, None] * course.angles.rows
        found = Motion.of_bends(within(bends, wrist, "reference"), period, wrist.length)
    if not np.isfinite(found.angles.rows).all():
        raise UserError(
            "the reference has samples that are no number", "reference", "a course that is finite everywhere"
        )
    return found


def back(bend: float | Array, duration: float, rest: float, period: float, planes: int = 1) -> Motion:
    """From a bend (P,) [rad] straight to zero in `duration` [s], and rest there."""
    start = np.broadcast_to(bend, planes)
    time: Array = period * np.arange(round((duration + rest) / period), dtype=np.float64)
    rows = -start[:, None, None] * minimum_jerk(time, duration)
    rows[:, 0] += start[:, None]
    angles, tips = Angles.of(rows.reshape(DERIVATIVES * planes, len(time))), np.zeros((len(time), planes + 1))
    return Motion(time, angles, tips, turn=-start, begin=0.0, rest=duration, horizon=duration + rest)
