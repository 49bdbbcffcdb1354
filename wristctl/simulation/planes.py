"""Planes that a loop bends in, and its motion in them."""

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.motion import Motion
from wristctl.simulation.recording import recorded_bends
from wristctl.simulation.reference import REFERENCES, course_of, motion, toward
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.tendon_layout import TendonLayout, off_both_sides


def planes_of(loop: Loop, reference: Reference, wrist: WristParameters) -> int:
    """Planes that a loop bends in: two where the reference does, or where no tendons of the wrist pull in one alone.

    Raises UserError where these are more than the loop has, and for places of tendons that are no layout.
    """
    two = f"{reference.kind} bends" * (REFERENCES[reference.kind].planes == 2)
    if off_both_sides(wrist) is not None and TendonLayout.of(wrist).planes == 2:
        two = two or "these tendons bend the wrist"
    if two and loop.planes == 1:
        raise UserError(f"{two} in two planes, and the loop in one", "loop.planes", "loop.planes: null, or 2")
    return loop.planes or (2 if two else 1)


def motion_in(
    planes: int,
    reference: Reference,
    direction: DirectionName,
    wrist: WristParameters,
    horizon: float,
    period: float,
    network: Inverse | None = None,
) -> Motion:
    """The motion of a reference in so many planes, on the grid of `period` [s] over the horizon [s].

    In one plane the wrist is as this direction's plane sees it. Raises UserError for one out of reach.
    """
    if planes == 1:
        return motion(toward(reference, direction), wrist, horizon, period, network)
    return Motion.of_bends(bends_of(reference, direction, wrist, horizon, period), period, wrist.length)


def bends_of(
    reference: Reference, direction: DirectionName, wrist: WristParameters, horizon: float, period: float
) -> Array:
    """Wanted bends with two derivatives, (2, 3, T), on the grid of `period` [s] over the horizon [s].

    A reference in one plane bends toward the direction; of a recording both planes are taken.
    """
    if reference.inverse == "network":
        fix = "inverse: closed-form, or loop.planes: 1"
        raise UserError("no network gives bends in two planes", "reference.inverse", fix)
    kind = REFERENCES[reference.kind]
    time = np.arange(round(horizon / period), dtype=np.float64) * period
    if kind.planes == 2:
        return _within(course_of(reference, kind, time), wrist)
    if reference.file:
        return _within(recorded_bends(reference, wrist, time), wrist)
    aim = DIRECTIONS[direction]
    references = np.zeros((2, 3, len(time)))
    facing = in_plane(wrist, direction)
    references[int(aim.plane == "flexion")] = motion(toward(reference, direction), facing, horizon, period).angles.rows
    return references


def _within(bends: Array, wrist: WristParameters) -> Array:
    most = float(np.rad2deg(np.hypot(*bends[:, 0]).max()))
    if most > wrist.range_deg * (1.0 + 1e-12):
        problem = f"a bend of {most:.3g} deg is beyond the wrist's range of {wrist.range_deg:g} deg"
        raise UserError(problem, "reference.angle_deg", "ask for less, or widen wrist.range_deg")
    return bends
