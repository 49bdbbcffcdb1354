"""Where motors are that follow targets by themselves: after a delay, with a first-order lag, at no more than a speed.

A target is held from when it takes effect until the next one does. Meanwhile a motor moves by

    x' = clip((target - x)/lag, -speed, speed),

a ramp until it is speed lag away from the target, and an exponential from there; without a lag a ramp to the target.
This is the one law of it: the simulated drive, its host, the observer, and a host in front of a rig reckon by it. A
`motor` is any tuple with `delay` [s], `lag` [s] and `speed`; places are in metres, or in the unit of its speed.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import exp, maximum, minimum
from wristctl.lanes.lane import floor, rounded, where, zero_like
from wristctl.simulation.spool_timing import in_effect

# Lag [s] that is none, and resolution [m] that is finer than matters.
_AT_ONCE, _FINEST = 1e-12, 1e-15


@compiled
def followed(motor: Any, place: Any, target: Any, time: Any) -> Any:
    """Place and speed of a motor after a time of following a target that is held, and its place summed over that time.

    The last is the integral of the place, by which its mean is known.
    """
    gap, none = target - place, zero_like(target)
    lag, distance = maximum(motor.lag, none + _AT_ONCE), abs(gap)
    ramp = minimum(time, maximum(distance / motor.speed - motor.lag, none))
    there = maximum(distance - motor.speed * ramp, none)
    left = there * exp(-(time - ramp) / lag)
    moving = minimum(left / lag, motor.speed)
    short = 0.5 * (distance + there) * ramp + lag * (there - left)
    side = where(gap < 0.0, -1.0, 1.0)
    return target - side * left, side * moving, target * time - side * short


@compiled
def motor_at(motor: Any, place: Any, targets: Any, time: Any, h: float) -> Any:
    """Place and speed of a motor at a time in this tick [s] of h [s], which was at `place` when the tick began, and its
    place summed up to then.

    The newest of `targets` is this tick's.
    """
    since = motor.delay - h * floor(motor.delay / h)
    before, after = in_effect(motor, targets, 1, h), in_effect(motor, targets, 0, h)
    there, was, first = followed(motor, place, before, minimum(time, since))
    then, moving, second = followed(motor, there, after, maximum(time - since, zero_like(since)))
    return then, where(time < since, was, moving), first + second


@compiled
def target_sent(motor: Any, resolution: Any, wanted: Any, before: Any, h: float) -> Any:
    """Target that a host sends who wants a place: no further from the one before than the motor can go in a tick."""
    furthest, finest = rounded(motor.speed * h), maximum(resolution, zero_like(before) + _FINEST)
    sent = minimum(maximum(wanted, before - furthest), before + furthest)
    return finest * floor(sent / finest + 0.5)
