"""Actuators: from commanded pulls to the pulls that act on the wrist. A place's pull is that of its tendons alike.

lagged: T' = (command - T)/lag, no faster than the motor can stretch the tendon, in whole microsteps of it.
tendon: a stepper reels tendon in; what its elastic tendons then pull is `wristctl.wrist.tendon_mechanics`'s.
servo: a motor that follows targets reels it in (`wristctl.simulation.target_following`).
The spool's target is command/k + the shortening at theta_ref: at the measured angle, delayed, it would feed back
positively with a gain near 1. A stepper moves at the speed of the reference's shortening, and closes its gap on top.
A stepper's rates take effect when the board has them, and ramp (`wristctl.simulation.spool_timing`).

A host sends steps and believes what they are: it counts in lengths and pulls of its own belief, and what the motors
deliver for that count is the world's (`Winding`).

There is a motor for each of T places of tendons; in one plane these are the + and the - side. The state of the motors
has two rows for each, its count, a pull or a reeled length, and its speed; a row for the torque [N m] that all of them
withhold in each of P planes follows, and one for what each plane missed of its last torque. A spool's count and speed
are those of when a rate took effect in the last tick; the rates that its host has sent, the newest first, come last.
A motor that follows targets has its place when the tick began, and the place where its host believes it to be; its
targets come last.
"""

from typing import Any, NamedTuple

from wristctl.control.belief import lengths_at, moment_arms_at, straight_at
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.lane import floor, rounded, sqrt, where, zero_like
from wristctl.lanes.rows import part
from wristctl.simulation.simulated_drives import IdealDrive, LaggedDrive, ServoDrive, SpoolDrive
from wristctl.simulation.spool_timing import foreseen, reached, reckoned, remember, spool_at
from wristctl.simulation.target_following import motor_at, target_sent

# Length of tendon [m] that is none, however fine the microsteps.
_ROUNDING = 1e-9


@compiled
def lag_pull(motor: Any, stiffness: Any, state: Any, t: int, command: Any, h: float) -> Any:
    """Let the pull of a place of this stiffness [N/m] follow its command.

    Returns it in whole microsteps, and the pull that the motor's speed withholds.
    """
    fastest = stiffness * motor.speed * h
    wanted = rounded((command - state[2 * t]) * (h / (motor.lag + h)))
    change = clip(wanted, -fastest, fastest)
    state[2 * t] = state[2 * t] + change
    quantum = rounded(stiffness * motor.step)
    return quantum * floor(state[2 * t] / quantum + 0.5), wanted - change


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
def _sent_to(remembered: Any, state: Any, places: int, planes: int, t: int) -> Any:
    """Rates or targets that the host has sent to the motor of a place, the newest first."""
    return part(state, 2 * (places + planes) + len(remembered) * t, remembered)


@by_type
def wind(drive: Any, state: Any, sent: Any, t: int, target: Any, moving: Any, h: float) -> Any:
    """Lead the motor of a place to its moving target, by what was `sent` to it, the newest first.

    Returns the place where its host believes it to be in the middle of the period, or its mean over it, and the pull
    that is withheld.
    """


@implements(wind, SpoolDrive)
@compiled
def reel_in(drive: Any, state: Any, sent: Any, t: int, target: Any, moving: Any, h: float) -> Any:
    """Send a rate, of bounded speed and acceleration, that leads the spool of a place to its moving target.

    Returns the place where its host believes it to be in the middle of the period, and its withheld pull: of the length
    from where it can stop to its target, where that is more than a microstep.
    """
    motor, believed = drive.motor, drive.believed
    state[2 * t], state[2 * t + 1] = reached(motor, state[2 * t], state[2 * t + 1], sent, h)
    gap = target + rounded(moving * believed.delay) - foreseen(believed, state[2 * t], sent, h)
    speed = spool_speed(motor.speed, motor.acceleration, gap, moving, sent[0], h)
    remember(sent, speed)
    behind = left_behind(motor.acceleration, gap, speed - moving, h)
    withheld = where(abs(behind) > motor.step + _ROUNDING, drive.stiffness[t] * behind, 0.0)
    return reckoned(believed, state[2 * t], sent, 0.5 * h + zero_like(gap), h), withheld


@implements(wind, ServoDrive)
@compiled
def lead_on(drive: Any, state: Any, sent: Any, t: int, target: Any, moving: Any, h: float) -> Any:
    """Send a target that leads the motor of a place to its moving target, ahead of it by delay, lag and half a period.

    Returns the mean of the place over the period by its host's belief, which steps within it, and the pull that is
    withheld: of the length from the target that was sent to the one that is wanted.
    """
    motor, believed = drive.motor, drive.believed
    tick = h + zero_like(target)
    state[2 * t], _, _ = motor_at(motor, state[2 * t], sent, tick, h)
    state[2 * t + 1], _, _ = motor_at(believed, state[2 * t + 1], sent, tick, h)
    wanted = target + rounded(moving * (believed.delay + believed.lag + 0.5 * h))
    newest = target_sent(believed, believed.step, wanted, sent[0], h)
    remember(sent, newest)
    behind = wanted - newest
    withheld = where(abs(behind) > believed.step + _ROUNDING, drive.stiffness[t] * behind, 0.0)
    _, _, summed = motor_at(believed, state[2 * t + 1], sent, tick, h)
    return summed / h, withheld


@compiled
def spool_target(pull: Any, stiffness: Any, length: Any, path: Any) -> Any:
    """Length that a spool has to reel in [m] for a pull [N]: its tendons' stretch, and the shortening of their path."""
    return pull / stiffness + length - path


class Aim(NamedTuple):
    """The reference that spools are paid out by: bend [rad] and the rate [rad/s] that they move with, P rows each, and
    rows for the moment arms there."""

    bend: Any
    rate: Any
    arms: Any


@by_type
def actuate(drive: Any, state: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    """Write the host's counts (T rows) over a period of commanded pulls [N]: pulls, or where it believes spools to be
    in its middle [m].

    `known` is the Belief; at a rate of 0 in `aim` spools only close their gap. The rows of the state that are for it
    become the torque [N m] that the motors withhold, by this belief: what of the command their speed and acceleration
    keep from the wrist over this period.
    """


@implements(actuate, IdealDrive)
def _as_commanded(drive: Any, state: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    for t in range(len(pulls)):
        counts[t] = pulls[t]


@compiled
def _begin_withholding(state: Any, pulls: Any, bend: Any) -> None:
    for p in range(len(bend)):
        state[2 * len(pulls) + p] = zero_like(bend[p])


@compiled
def _withhold(state: Any, pulls: Any, aim: Any, t: int, less: Any) -> None:
    """Add a place's withheld pull [N] to the torque that all of them withhold."""
    count = len(pulls)
    for p in range(len(aim.bend)):
        state[2 * count + p] = state[2 * count + p] + less * aim.arms[count * p + t]


@implements(actuate, LaggedDrive)
def _lagged(drive: Any, state: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    moment_arms_at(known.wrist, aim.bend, aim.arms)
    _begin_withholding(state, pulls, aim.bend)
    for back in range(len(pulls)):
        t = len(pulls) - 1 - back
        counts[t], less = lag_pull(drive.motor, drive.stiffness[t], state, t, pulls[t], h)
        _withhold(state, pulls, aim, t, less)


@implements(actuate, SpoolDrive, ServoDrive)
def _reeled(drive: Any, state: Any, known: Any, aim: Any, pulls: Any, h: float, counts: Any) -> None:
    count = len(pulls)
    lengths_at(known.wrist, aim.bend, counts)
    moment_arms_at(known.wrist, aim.bend, aim.arms)
    _begin_withholding(state, pulls, aim.bend)
    for back in range(count):
        t = count - 1 - back
        moving = rounded(aim.arms[t] * aim.rate[0])
        for p in range(1, len(aim.bend)):
            moving = moving + rounded(aim.arms[count * p + t] * aim.rate[p])
        target = spool_target(pulls[t], drive.stiffness[t], straight_at(known.wrist, t), counts[t])
        sent = _sent_to(drive.sent, state, count, len(aim.bend), t)
        counts[t], less = wind(drive, state, sent, t, target, moving, h)
        _withhold(state, pulls, aim, t, less)


@by_type
def deliver(drive: Any, told: Any, time: Any, motion: Any) -> None:
    """Write the pulls [N], or the lengths on spools in whole microsteps [m], that the motors deliver at a time in the
    tick [s], and the speeds of spools [m/s]: `motion`, T rows each.

    `told` are the state of the motors, the winding (the scale of counts, then the offset of each place [m]), the host's
    counts (T rows), rows as long as those of bends, and the tick [s].
    """


@implements(deliver, IdealDrive)
def _as_counted(drive: Any, told: Any, time: Any, motion: Any) -> None:
    _, _, counts, _, _ = told
    delivered, _ = motion
    for t in range(len(counts)):
        delivered[t] = counts[t]


@implements(deliver, LaggedDrive)
def _scaled(drive: Any, told: Any, time: Any, motion: Any) -> None:
    _, winding, counts, _, _ = told
    delivered, _ = motion
    for t in range(len(counts)):
        delivered[t] = winding[0] * counts[t] + winding[1 + t]


@implements(deliver, SpoolDrive)
def _wound(drive: Any, told: Any, time: Any, motion: Any) -> None:
    state, winding, counts, bend, h = told
    delivered, speeds = motion
    for t in range(len(counts)):
        rates = _sent_to(drive.sent, state, len(counts), len(bend), t)
        place, rate = spool_at(drive.motor, state[2 * t], state[2 * t + 1], rates, time, h)
        delivered[t] = winding[0] * (drive.motor.step * floor(place / drive.motor.step + 0.5)) + winding[1 + t]
        speeds[t] = winding[0] * rate


@implements(deliver, ServoDrive)
def _followed(drive: Any, told: Any, time: Any, motion: Any) -> None:
    state, winding, counts, bend, h = told
    delivered, speeds = motion
    for t in range(len(counts)):
        targets = _sent_to(drive.sent, state, len(counts), len(bend), t)
        place, speed, _ = motor_at(drive.motor, state[2 * t], targets, time, h)
        delivered[t] = winding[0] * place + winding[1 + t]
        speeds[t] = winding[0] * speed


@by_type
def frictionless_pulls(drive: Any, known: Any, bend: Any, counts: Any, pulls: Any) -> None:
    """Write the pulls [N] on a wrist bent like this [rad] of what the host counts, of tendons that slide freely."""


@implements(frictionless_pulls, IdealDrive, LaggedDrive)
def _delivered_pulls(drive: Any, known: Any, bend: Any, counts: Any, pulls: Any) -> None:
    for t in range(len(pulls)):
        pulls[t] = counts[t]


@implements(frictionless_pulls, SpoolDrive, ServoDrive)
def _stretched(drive: Any, known: Any, bend: Any, counts: Any, pulls: Any) -> None:
    lengths_at(known.wrist, bend, pulls)
    for t in range(len(pulls)):
        stretch = counts[t] - (straight_at(known.wrist, t) - pulls[t])
        pulls[t] = drive.stiffness[t] * maximum(0.0, stretch)


@by_type
def held_stiffness(drive: Any, zero: Any) -> Any:
    """Stiffness [N/m] of one elastic tendon on a held spool; 0 without them."""


@implements(held_stiffness, IdealDrive, LaggedDrive)
def _none(drive: Any, zero: Any) -> Any:
    return zero


@implements(held_stiffness, SpoolDrive, ServoDrive)
def _on_spools(drive: Any, zero: Any) -> Any:
    return drive.motor.stiffness
