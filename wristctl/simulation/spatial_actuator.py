"""Motors of a wrist in two planes: one for each place of tendons, from commanded to delivered pulls or reeled lengths.

The same motors as in one plane (`wristctl.simulation.actuator`), whose two sides are here as many places as there are.
A row of `motors` and one of its speed belong to each; a row for the torque that all withhold in each plane follows.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.lane import rounded, zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import lanes_like, rows_of
from wristctl.simulation.actuator import (
    IdealDrive,
    LaggedDrive,
    Motor,
    SpoolDrive,
    lag_pull,
    reel_in,
    spool_target,
)
from wristctl.wrist.spatial.spatial_tendons import arms_about_bend, lengths_along
from wristctl.wrist.spatial.spooled_tendons import RubbingTendons, straight_length, travel_of
from wristctl.wrist.tendon_mechanics import ElasticTendons, NoTendons


class NoFriction(NamedTuple):
    """Elastic tendons that slide freely."""


class Friction(NamedTuple):
    """Friction of tendons: coefficient, sheath's angle [rad], and one over the path in which it turns round [1/m]."""

    friction: Any
    sheath: Any
    slope: Any


class FrictionRows(NamedTuple):
    """Friction as rows of a block."""

    rows: Any


_read_friction = tuple_of(Friction)


@by_type
def friction_in_lanes(friction: Any) -> Any:
    """Friction of lanes from one block's array of its values."""
    raise NotImplementedError("compiled code only")


@implements(friction_in_lanes, NoFriction)
def _no_friction(friction: Any) -> Any:
    return friction


@implements(friction_in_lanes, FrictionRows)
def _friction(friction: Any) -> Any:
    return _read_friction(rows_of(friction.rows))


@compiled
def motor_at(motor: Any, alike: Any) -> Any:
    """The motor of a place with so many tendons alike, of that of one tendon."""
    return Motor(motor.lag, alike * motor.stiffness, motor.step, motor.speed, motor.acceleration)


@by_type
def drive_tendons(drive: Any, motors: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    """Host's counts over a period of commanded pulls [N], into `counts`: pulls, or lengths on spools in its middle [m].

    `known` is Knowledge, `aim` of two rows each. The two rows of `motors` behind those of the places become the torque
    that the motors withhold in each plane [N m], as in one plane.
    """
    raise NotImplementedError("compiled code only")


@implements(drive_tendons, IdealDrive)
def _as_commanded(drive: Any, motors: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    for t in range(len(pulls)):
        counts[t] = pulls[t]


@implements(drive_tendons, LaggedDrive)
def _lagging(drive: Any, motors: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    arms_y, arms_z, last = lanes_like(pulls), lanes_like(pulls), 2 * len(pulls)
    withheld_y, withheld_z = zero_like(aim.angle[0]), zero_like(aim.angle[0])
    arms_about_bend(known.wrist, aim.angle, arms_y, arms_z)
    for t in range(len(pulls)):
        counts[t], less = lag_pull(motor_at(drive.motor, known.alike[t]), motors, 2 * t, pulls[t], h)
        withheld_y, withheld_z = withheld_y + less * arms_y[t], withheld_z + less * arms_z[t]
    motors[last], motors[last + 1] = withheld_y, withheld_z


@implements(drive_tendons, SpoolDrive)
def _reeling(drive: Any, motors: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    arms_y, arms_z, last = lanes_like(pulls), lanes_like(pulls), 2 * len(pulls)
    withheld_y, withheld_z = zero_like(aim.angle[0]), zero_like(aim.angle[0])
    lengths_along(known.wrist, aim.angle, counts)
    arms_about_bend(known.wrist, aim.angle, arms_y, arms_z)
    for t in range(len(pulls)):
        motor = motor_at(drive.motor, known.alike[t])
        moving = rounded(arms_y[t] * aim.rate[0]) + rounded(arms_z[t] * aim.rate[1])
        target = spool_target(pulls[t], motor.stiffness, straight_length(known.wrist, t), counts[t])
        counts[t], less = reel_in(motor, motors, 2 * t, target, moving, h)
        withheld_y, withheld_z = withheld_y + less * arms_y[t], withheld_z + less * arms_z[t]
    motors[last], motors[last + 1] = withheld_y, withheld_z


@by_type
def deliver(drive: Any, winding: Any, backlash: Any, counts: Any, delivered: Any) -> None:
    """Pulls [N] or lengths [m] that the motors deliver for what their host counts, into `delivered`.

    `winding` has the scale of the counts, then the offset of each place [m]; a tendon lags within the backlash [m].
    """
    raise NotImplementedError("compiled code only")


@implements(deliver, IdealDrive)
def _as_counted(drive: Any, winding: Any, backlash: Any, counts: Any, delivered: Any) -> None:
    for t in range(len(counts)):
        delivered[t] = counts[t]


@implements(deliver, LaggedDrive)
def _scaled(drive: Any, winding: Any, backlash: Any, counts: Any, delivered: Any) -> None:
    for t in range(len(counts)):
        delivered[t] = winding[0] * counts[t] + winding[1 + t]


@implements(deliver, SpoolDrive)
def _wound(drive: Any, winding: Any, backlash: Any, counts: Any, delivered: Any) -> None:
    for t in range(len(counts)):
        on_spool = winding[0] * counts[t] + winding[1 + t]
        delivered[t] = clip(delivered[t], on_spool, on_spool + backlash)


@by_type
def tendons_on(drive: Any, friction: Any, stiffness: Any, state: Any) -> Any:
    """The tendons as the integration step takes them: of this stiffness [N/m], T rows, and this state."""
    raise NotImplementedError("compiled code only")


@implements(tendons_on, IdealDrive, LaggedDrive)
def _held(drive: Any, friction: Any, stiffness: Any, state: Any) -> Any:
    return NoTendons()


@implements(tendons_on, SpoolDrive)
def _elastic(drive: Any, friction: Any, stiffness: Any, state: Any) -> Any:
    return spooled(friction, stiffness, state)


@by_type
def spooled(friction: Any, stiffness: Any, state: Any) -> Any:
    """Elastic tendons with this friction."""
    raise NotImplementedError("compiled code only")


@implements(spooled, NoFriction)
def _sliding(friction: Any, stiffness: Any, state: Any) -> Any:
    return ElasticTendons(stiffness)


@implements(spooled, Friction)
def _rubbing(friction: Any, stiffness: Any, state: Any) -> Any:
    return RubbingTendons(stiffness, friction.friction, friction.sheath, friction.slope, state)


@by_type
def lose(drive: Any, left: Any, delivered: Any, spool_input: Any) -> None:
    """Input of a step where a share of each tendon is left: less pull, or the same reeled length."""
    raise NotImplementedError("compiled code only")


@implements(lose, IdealDrive, LaggedDrive)
def _less_pull(drive: Any, left: Any, delivered: Any, spool_input: Any) -> None:
    for t in range(len(delivered)):
        spool_input[t] = left[t] * delivered[t]


@implements(lose, SpoolDrive)
def _same_length(drive: Any, left: Any, delivered: Any, spool_input: Any) -> None:
    for t in range(len(delivered)):
        spool_input[t] = delivered[t]


@by_type
def believed_pulls(drive: Any, believed: Any, alike: Any, bend: Any, counts: Any, pulls: Any) -> None:
    """Pulls [N] of tendons that slide freely on a wrist bent like this (2 rows), of what their host counts."""
    raise NotImplementedError("compiled code only")


@implements(believed_pulls, IdealDrive, LaggedDrive)
def _counted_pulls(drive: Any, believed: Any, alike: Any, bend: Any, counts: Any, pulls: Any) -> None:
    for t in range(len(pulls)):
        pulls[t] = counts[t]


@implements(believed_pulls, SpoolDrive)
def _stretched(drive: Any, believed: Any, alike: Any, bend: Any, counts: Any, pulls: Any) -> None:
    lengths_along(believed, bend, pulls)
    for t in range(len(pulls)):
        stretch = counts[t] - travel_of(believed, t, pulls[t])
        pulls[t] = alike[t] * drive.motor.stiffness * maximum(0.0, stretch)


@by_type
def held_stiffness(drive: Any, alike: Any) -> Any:
    """Stiffness [N/m] of a place's tendons on held spools; 0 without them."""
    raise NotImplementedError("compiled code only")


@implements(held_stiffness, IdealDrive, LaggedDrive)
def _none(drive: Any, alike: Any) -> Any:
    return zero_like(alike)


@implements(held_stiffness, SpoolDrive)
def _of_spools(drive: Any, alike: Any) -> Any:
    return alike * drive.motor.stiffness
