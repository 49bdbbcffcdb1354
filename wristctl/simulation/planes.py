"""Planes that a loop bends in, and its motion in them."""

import math
from collections.abc import Iterable
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import LIVE, DirectionName, Loop, Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.live_reference import followed_bends
from wristctl.simulation.motion import Angles, Motion
from wristctl.simulation.recording import recorded_bends, recorded_tips
from wristctl.simulation.reference import REFERENCES, by_angles, course_of, estimated, grid_of, motion, toward
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.kinematics import Inverse, TipPath
from wristctl.wrist.spatial.spatial_kinematics import tips_along
from wristctl.wrist.tendon_layout import TendonLayout, off_both_sides


class Asked(NamedTuple):
    """A motion that a loop is asked for."""

    loop: Loop
    reference: Reference
    direction: DirectionName | None = None
    """None: as it is, toward ulnar where it has no plane of its own."""


def planes_of(wrist: WristParameters, asked: Iterable[Asked]) -> int:
    """Planes that loops bend in, one number for all that are compared: two where any of them leaves its plane.

    Raises UserError where a loop is to have one plane, and its reference or the tendons bend in two; and for places of
    tendons that are no layout.
    """
    return 2 if why_two(wrist, asked) else 1


def why_two(wrist: WristParameters, asked: Iterable[Asked]) -> str:
    """Why loops bend in two planes, a clause; empty where all stay in one. Raises UserError as `planes_of`."""
    found = ""
    for each in dict.fromkeys(asked):
        must, may = _must(wrist, each), _leaves(wrist, each)
        if must and each.loop.planes == 1:
            raise UserError(f"{must} in two planes, and the loop in one", "loop.planes", "loop.planes: null, or 2")
        wanted = "loop.planes is 2" if each.loop.planes == 2 else ""
        found = found or (must and f"{must} in both") or wanted or (may if each.loop.planes is None else "")
    return found


def left_out(wrist: WristParameters, asked: Iterable[Asked]) -> str:
    """What leaves the plane of loops that are to bend in one all the same, in words; empty where nothing does."""
    return next((may for each in asked if each.loop.planes == 1 and (may := _leaves(wrist, each))), "")


def _must(wrist: WristParameters, asked: Asked) -> str:
    """What bends in two planes and can be simulated in no one."""
    if REFERENCES[asked.reference.kind].planes == 2:
        return f"{asked.reference.kind} bends"
    if off_both_sides(wrist) is not None and TendonLayout.of(wrist).planes == 2:
        return "these tendons bend the wrist"
    return ""


def _leaves(wrist: WristParameters, asked: Asked) -> str:
    """What takes the wrist, as it is believed or as it is, out of the plane of its motion, and one plane leaves out."""
    plant, tendons, acting = asked.loop.plant, asked.loop.plant.actuator, asked.loop.disturbances
    flexes = DIRECTIONS[_direction(asked.reference, asked.direction)].plane == "flexion"
    for one in (wrist, plant_of(wrist, plant)):
        if one.gravity[1] if flexes else one.gravity_flexion:
            return "gravity bends the wrist out of the motion's plane"
        if one.stiffness_axis_deg % 90.0 and one.flexion_ratio != 1.0:
            return "springs that are softer along an oblique axis bend the wrist out of the motion's plane"
    across = math.radians(acting.toward_deg - (90.0 if flexes else 0.0)) if acting.toward_deg else 0.0
    if abs(math.sin(across)) > 1e-9 and any((acting.push.force, acting.load, acting.grasp.mass)):
        return "a force from aside bends the wrist out of the motion's plane"
    if any(tendons.slack) or tendons.broken_at is not None:
        return "a tendon that is lost or slack bends the wrist out of the motion's plane"
    return ""


def motion_in(
    planes: int,
    reference: Reference,
    direction: DirectionName | None,
    wrist: WristParameters,
    horizon: float,
    period: float,
    network: Inverse | None = None,
    later: bool = False,
) -> Motion:
    """The motion of a reference in so many planes, on the grid of `period` [s] over the horizon [s].

    In one plane the wrist is as this direction's plane sees it, and `later` works the course out when it is asked for.
    Without a direction the reference is taken as it is, in two planes toward ulnar where it has no plane of its own.
    Raises UserError for one out of reach.
    """
    if planes == 1:
        directed = reference if direction is None else toward(reference, direction)
        return motion(directed, wrist, horizon, period, network, later)
    if reference.inverse == "network" and reference.kind == "recording":
        tips = recorded_tips(reference, grid_of(horizon, period))
        if tips is not None:  # of a wrist that need be no arc
            rows, outside = _through(network, tips)
            through = Motion.of_bends(within(rows, wrist, "reference.file"), period, wrist.length)
            return replace(through, tips=tips.position, outside=outside)
    way = _direction(reference, direction)
    bends = bends_of(reference, way, wrist, horizon, period)
    wanted = Motion.of_bends(bends, period, wrist.length)
    if reference.inverse != "network":
        return wanted
    rows, outside = _through(network, tips_along(bends, wrist.length))
    reached = Angles.of(np.ascontiguousarray(rows).reshape(-1, bends.shape[2]))
    return replace(wanted, angles=reached, turn=bends[:, 0, -1], outside=outside, wanted=wanted.angles)


def _through(network: Inverse | None, tips: TipPath) -> tuple[Array, float]:
    """The network's bends with two derivatives (2, 3, T), and the share of tips that it has not learned."""
    estimate = estimated(network, tips)
    rows = np.stack([estimate.theta, estimate.rate, estimate.acceleration]).transpose(2, 0, 1)
    return np.ascontiguousarray(rows), float(np.mean(estimate.outside))


def _direction(reference: Reference, direction: DirectionName | None) -> DirectionName:
    return direction or REFERENCES[reference.kind].plane or "ulnar"


def bends_of(
    reference: Reference, direction: DirectionName, wrist: WristParameters, horizon: float, period: float
) -> Array:
    """Wanted bends with two derivatives, (2, 3, T), on the grid of `period` [s] over the horizon [s].

    A reference in one plane bends toward the direction; of a recording both planes are taken. A network behind it is
    left out: these are the bends that are wanted.
    """
    reference = by_angles(reference)
    kind = REFERENCES[reference.kind]
    time = grid_of(horizon, period)
    if kind.planes == 2:
        return within(course_of(reference, kind, time), wrist)
    if reference.kind == LIVE:
        return within(followed_bends(reference, 2, time), wrist)
    if reference.file:
        return within(recorded_bends(reference, wrist, time), wrist)
    aim = DIRECTIONS[direction]
    references = np.zeros((2, 3, len(time)))
    facing = in_plane(wrist, direction)
    references[int(aim.plane == "flexion")] = motion(toward(reference, direction), facing, horizon, period).angles.rows
    return references


def within(bends: Array, wrist: WristParameters, where: str = "reference.angle_deg") -> Array:
    """Bends (2, 3, T) [rad] as they are. Raises UserError where one is beyond the wrist's range."""
    most = float(np.rad2deg(np.hypot(*bends[:, 0]).max()))
    if most > wrist.range_deg * (1.0 + 1e-12):
        problem = f"a bend of {most:.3g} deg is beyond the wrist's range of {wrist.range_deg:g} deg"
        raise UserError(problem, where, "ask for less, or widen wrist.range_deg")
    return bends
