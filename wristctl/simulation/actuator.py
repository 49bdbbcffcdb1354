"""Actuators: from commanded pulls to the pulls that act on the wrist. A side's pull is that of its two tendons.

lagged: T' = (command - T)/lag, no faster than the motor can stretch the tendon, in whole microsteps of it.
tendon: a stepper reels tendon in; what its elastic tendons then pull is `wristctl.wrist.tendon_mechanics`'s.
The spool's target is command/k + the shortening at theta_ref: at the measured angle, delayed, it would feed back
positively with a gain near 1. A spool moves at the speed of the reference's shortening, and closes its gap on top.
It turns evenly over a control period; what is held over the period is where it is in the middle.

A host sends steps and believes what they are: it counts in lengths and pulls of its own belief, and what the motors
deliver for that count is the world's (`Winding`).
"""

from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.lane import floor, rounded, sqrt, where, zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import rows_of
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.tendon_mechanics import travel
from wristctl.wrist.tendons import TENDONS_PER_SIDE, lengths, moment_arms, torque_of

# Place of the torque that both sides' motors withhold [N m] in their state, after each side's count and speed.
WITHHELD = 4
# Length of tendon [m] that is none, however fine the microsteps.
_ROUNDING = 1e-9


class Motor(NamedTuple):
    """One side's motor and tendons, SI units; `stiffness` is that of both tendons together."""

    lag: Any
    stiffness: Any
    step: Any
    speed: Any
    acceleration: Any


class IdealDrive(NamedTuple):
    """Pulls are as commanded; nothing of a motor is simulated."""


class LaggedDrive(NamedTuple):
    """Motors whose pulls lag behind their commands."""

    motor: Any


class SpoolDrive(NamedTuple):
    """Motors that reel elastic tendons onto spools."""

    motor: Any


Drive = IdealDrive | LaggedDrive | SpoolDrive

# A Motor of lanes from rows of lanes, in compiled code.
read_motor = tuple_of(Motor)


class Winding(NamedTuple):
    """Winding error: the motors deliver `scale` times the count of their host, and `offset` [m]."""

    scale: Any
    offset: Any


# A Winding of lanes from rows of lanes, in compiled code.
read_winding = tuple_of(Winding)


def motor_of(actuator: Actuator) -> Motor:
    """The values of an actuator section."""
    step = actuator.step_length
    return Motor(
        lag=actuator.lag,
        stiffness=TENDONS_PER_SIDE * actuator.tendon_stiffness,
        step=step,
        speed=step * actuator.step_rate,
        acceleration=step * actuator.step_acceleration,
    )


def drive_with(level: str, motor: Any) -> Drive:
    """The drive of a level with this Motor, or with its rows of a batch; an ideal drive has none."""
    if level == "ideal":
        return IdealDrive()
    return LaggedDrive(motor) if level == "lagged" else SpoolDrive(motor)


def drive_of(actuator: Actuator) -> Drive:
    """The drive of an actuator section."""
    return drive_with(actuator.level, motor_of(actuator))


@by_type
def drive_in_lanes(drive: Any) -> Any:
    """A drive of lanes from a drive whose motor is one block's array."""
    raise NotImplementedError("compiled code only")


@implements(drive_in_lanes, IdealDrive)
def _ideal_in_lanes(drive: Any) -> Any:
    return drive


@implements(drive_in_lanes, LaggedDrive)
def _lagged_in_lanes(drive: Any) -> Any:
    return LaggedDrive(read_motor(rows_of(drive.motor)))


@implements(drive_in_lanes, SpoolDrive)
def _spools_in_lanes(drive: Any) -> Any:
    return SpoolDrive(read_motor(rows_of(drive.motor)))


def counted_motor(believed: Actuator, actual: Actuator) -> Motor:
    """The motor as its host counts: lengths and pulls are what it believes, only how fast it is, it is in truth."""
    step = believed.step_length
    limits = {"lag": actual.lag, "speed": step * actual.step_rate, "acceleration": step * actual.step_acceleration}
    return motor_of(believed)._replace(**limits)


def winding_of(believed: Actuator, actual: Actuator, pull: float, creep: float = 0.0) -> Winding:
    """Meaning of a count: both sides were homed at this pull [N] on the straight wrist, where the counts are right.

    `creep` is the share of the tendons' stiffness that had relaxed by then.
    """
    counts, does = motor_of(believed), motor_of(actual)
    if believed.level == "lagged":
        return Winding(does.stiffness * does.step / (counts.stiffness * counts.step), 0.0)
    scale = does.step / counts.step
    return Winding(scale, pull / (does.stiffness * (1.0 - creep)) - scale * (pull / counts.stiffness))


def at_rest(drive: Drive, wrist: WristParameters, model: PlantModel, q: Array, scale: float = 1.0) -> Array:
    """State of the motors at pretension with the plant at q: of each side its count, a pull or a reeled length, and its
    speed, then the torque that both withhold, none; (5,).

    `wrist` is the one that is wound, `drive` as its host counts, `scale` that of the winding.
    """
    pull = TENDONS_PER_SIDE * wrist.pretension
    if not isinstance(drive, SpoolDrive):
        return np.array([pull, 0.0, pull, 0.0, 0.0])
    plus, minus = pull / drive.motor.stiffness + wrist.length / scale - model.taut(wrist, q) / scale
    return np.array([plus, 0.0, minus, 0.0, 0.0])


@compiled
def lag_pull(motor: Any, state: Any, side: int, command: Any, h: float) -> Any:
    """Let a pull follow its command; returns it in whole microsteps, and the pull that the motor's speed withholds."""
    fastest = motor.stiffness * motor.speed * h
    wanted = rounded((command - state[side]) * (h / (motor.lag + h)))
    change = clip(wanted, -fastest, fastest)
    state[side] = state[side] + change
    quantum = rounded(motor.stiffness * motor.step)
    return quantum * floor(state[side] / quantum + 0.5), wanted - change


@compiled
def spool_speed(fastest: Any, acceleration: Any, gap: Any, moving: Any, before: Any, h: float) -> Any:
    """Speed for one period that closes the gap to a target moving at a known speed; it was `before`.

    On top of `moving` it is the speed v from which one more period and then braking stay within the gap,
    v^2/(2 a) + h v = |gap|: for a small gap v = gap/h. It is no more than `fastest`, and changes by no more than a h.
    """
    change = rounded(acceleration * h)
    closing = sqrt(2.0 * acceleration * abs(gap) + rounded(change * change)) - change
    wanted = clip(moving + where(gap < 0.0, -closing, closing), -fastest, fastest)
    return clip(wanted, before - change, before + change)


@compiled
def left_behind(acceleration: Any, gap: Any, closing: Any, h: float) -> Any:
    """Gap that is left from where a spool can stop, after a period of closing it at this speed."""
    return gap - h * closing - 0.5 * closing * abs(closing) / acceleration


@compiled
def reel_in(motor: Any, state: Any, side: int, target: Any, moving: Any, h: float) -> Any:
    """Move a stepper towards its moving target with bounded speed and acceleration, evenly over a period.

    Returns the length on its spool in the middle of the period, in whole microsteps, and its withheld pull: of the
    length from where it can stop to its target, where that is more than a microstep.
    """
    gap = target - state[side]
    speed = spool_speed(motor.speed, motor.acceleration, gap, moving, state[side + 1], h)
    closing = speed - moving
    state[side + 1] = speed
    state[side] = state[side] + h * speed
    behind = left_behind(motor.acceleration, gap, closing, h)
    withheld = where(abs(behind) > motor.step + _ROUNDING, motor.stiffness * behind, 0.0)
    middle = state[side] - rounded(0.5 * rounded(h * speed))
    return motor.step * floor(middle / motor.step + 0.5), withheld


@compiled
def spool_target(pull: Any, stiffness: Any, length: Any, path: Any) -> Any:
    """Length that a spool has to reel in [m] for a pull [N]: its tendons' stretch, and the shortening of their path."""
    return pull / stiffness + length - path


class Aim(NamedTuple):
    """The reference that spools are paid out by: angle [rad], and the rate [rad/s] that they move with; in two planes
    both are rows."""

    angle: Any
    rate: Any


@by_type
def actuate(drive: Any, state: Any, believed: Any, aim: Any, plus: Any, minus: Any, h: float) -> Any:
    """Host's counts of both sides over a period of commanded pulls [N]: pulls, or lengths on spools in its middle [m].

    `believed` is the controller's wrist as Segments; at a rate of 0 in `aim` spools only close their gap. The state's
    last value becomes the torque [N m] that the motors withhold, by this belief: what of the command their speed and
    acceleration keep from the wrist over this period.
    """
    raise NotImplementedError("compiled code only")


@implements(actuate, IdealDrive)
def _as_commanded(drive: Any, state: Any, believed: Any, aim: Any, plus: Any, minus: Any, h: float) -> Any:
    return plus, minus


@implements(actuate, LaggedDrive)
def _lagged(drive: Any, state: Any, believed: Any, aim: Any, plus: Any, minus: Any, h: float) -> Any:
    pull_plus, less_plus = lag_pull(drive.motor, state, 0, plus, h)
    pull_minus, less_minus = lag_pull(drive.motor, state, 2, minus, h)
    state[WITHHELD] = torque_of(aim.angle, believed, less_plus, less_minus)
    return pull_plus, pull_minus


@implements(actuate, SpoolDrive)
def _reeled(drive: Any, state: Any, believed: Any, aim: Any, plus: Any, minus: Any, h: float) -> Any:
    motor, (path_plus, path_minus) = drive.motor, lengths(aim.angle, believed)
    arm_plus, arm_minus = moment_arms(aim.angle, believed)
    target_plus = spool_target(plus, motor.stiffness, believed.length, path_plus)
    target_minus = spool_target(minus, motor.stiffness, believed.length, path_minus)
    reeled_plus, less_plus = reel_in(motor, state, 0, target_plus, rounded(arm_plus * aim.rate), h)
    reeled_minus, less_minus = reel_in(motor, state, 2, target_minus, rounded(arm_minus * aim.rate), h)
    state[WITHHELD] = torque_of(aim.angle, believed, less_plus, less_minus)
    return reeled_plus, reeled_minus


@by_type
def wound(drive: Any, winding: Any, plus: Any, minus: Any) -> Any:
    """Pulls [N] or lengths [m] that the motors of both sides deliver for what their host counts."""
    raise NotImplementedError("compiled code only")


@implements(wound, IdealDrive)
def _as_counted(drive: Any, winding: Any, plus: Any, minus: Any) -> Any:
    return plus, minus


@implements(wound, LaggedDrive, SpoolDrive)
def _scaled(drive: Any, winding: Any, plus: Any, minus: Any) -> Any:
    return winding.scale * plus + winding.offset, winding.scale * minus + winding.offset


@by_type
def frictionless_pulls(drive: Any, believed: Any, theta: Any, plus: Any, minus: Any) -> Any:
    """Pulls [N] of both sides on segments at theta from what their motors deliver, of tendons that slide freely."""
    raise NotImplementedError("compiled code only")


@implements(frictionless_pulls, IdealDrive, LaggedDrive)
def _delivered_pulls(drive: Any, believed: Any, theta: Any, plus: Any, minus: Any) -> Any:
    return plus, minus


@implements(frictionless_pulls, SpoolDrive)
def _stretched(drive: Any, believed: Any, theta: Any, plus: Any, minus: Any) -> Any:
    path_plus, path_minus, _ = travel(believed, theta)
    stiffness = drive.motor.stiffness
    return stiffness * maximum(0.0, plus - path_plus), stiffness * maximum(0.0, minus - path_minus)


@by_type
def tendon_stiffness(drive: Any, segment: Any, theta: Any) -> Any:
    """Stiffness [N m/rad] that elastic tendons on held spools add to one segment at theta; 0 without them."""
    raise NotImplementedError("compiled code only")


@implements(tendon_stiffness, IdealDrive, LaggedDrive)
def _none(drive: Any, segment: Any, theta: Any) -> Any:
    return zero_like(theta)


@implements(tendon_stiffness, SpoolDrive)
def _on_spools(drive: Any, segment: Any, theta: Any) -> Any:
    arm_plus, arm_minus = moment_arms(theta, segment)
    return drive.motor.stiffness * (arm_plus * arm_plus + arm_minus * arm_minus)
