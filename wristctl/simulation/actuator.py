"""Actuators: from commanded pulls to the pulls that act on the wrist. A side's pull is that of its two tendons.

lagged: T' = (command - T)/lag, no faster than the motor can stretch the tendon, in whole microsteps of it.
tendon: a stepper reels tendon in; k (reeled in - path's shortening) pulls, never pushes, less friction at the discs.
The spool's target is command/k + the shortening at theta_ref: at the measured angle, delayed, it would feed back
positively with a gain near 1.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, maximum, minimum, tanh
from wristctl.lanes.lane import floor, sqrt, where
from wristctl.wrist.allocation import TENDONS_PER_SIDE
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.tendons import lengths, moment_arms

Array = NDArray[np.float64]

LAGGED, TENDON = 1, 2

_SLIDING = 5e-3
"""Speed [m/s] at which friction is fully developed."""


class Drive(NamedTuple):
    """Both sides' motors and tendons as the kernel sees them; SI units, stiffness of a side's two tendons together."""

    level: int
    lag: float
    stiffness: float
    friction: float
    step: float
    speed: float
    acceleration: float


def drive_of(actuator: Actuator) -> Drive | None:
    """The kernel's view of an actuator section; None where tensions are as commanded, and nothing is compiled in."""
    if actuator.level == "ideal":
        return None
    step = actuator.step_length
    return Drive(
        level={"lagged": LAGGED, "tendon": TENDON}[actuator.level],
        lag=actuator.lag,
        stiffness=TENDONS_PER_SIDE * actuator.tendon_stiffness,
        friction=actuator.friction,
        step=step,
        speed=step * actuator.step_rate,
        acceleration=step * actuator.step_acceleration,
    )


def at_rest(drive: Drive | None, wrist: WristParameters, theta: Array) -> Array:
    """State of both sides at pretension with segments at theta (n,): pull or reeled length, then speed; (4,)."""
    pull, n = TENDONS_PER_SIDE * wrist.pretension, len(theta)
    if drive is None or drive.level != TENDON:
        return np.array([pull, 0.0, pull, 0.0])
    taut = terms(segments(wrist, n), theta, 0.0 * theta).tendon_lengths.sum(axis=0)
    plus, minus = pull / drive.stiffness + wrist.length - taut
    return np.array([plus, 0.0, minus, 0.0])


@compiled
def _lag(drive: Any, state: Any, side: int, command: Any, h: float) -> Any:
    fastest = drive.stiffness * drive.speed * h + 0.0 * command
    change = clip((command - state[side]) * (h / (drive.lag + h)), -fastest, fastest)
    state[side] = state[side] + change
    quantum = drive.stiffness * drive.step
    return quantum * floor(state[side] / quantum + 0.5)


@compiled
def _reel(drive: Any, state: Any, side: int, target: Any, h: float) -> Any:
    """Move a stepper towards its target with bounded speed and acceleration; returns whole microsteps."""
    gap = target - state[side]
    change = drive.acceleration * h
    # the speed v from which one more period and then braking stay within the gap: v^2/(2 a) + h v = |gap|
    stopping = sqrt(change * change + 2.0 * drive.acceleration * abs(gap)) - change
    wanted = minimum(stopping, drive.speed + 0.0 * gap)
    wanted = where(gap < 0.0, -wanted, wanted)
    speed = clip(wanted, state[side + 1] - change, state[side + 1] + change)
    state[side + 1] = speed
    state[side] = state[side] + h * speed
    return drive.step * floor(state[side] / drive.step + 0.5)


@compiled
def actuate(drive: Any, state: Any, known: Any, theta_ref: Any, plus: Any, minus: Any, h: float) -> Any:
    """What both sides deliver over one control period to commanded pulls [N]: pulls, or reeled lengths [m] (tendon)."""
    if drive is None:
        return plus, minus
    if drive.level == LAGGED:
        return _lag(drive, state, 0, plus, h), _lag(drive, state, 2, minus, h)
    path_plus, path_minus = lengths(theta_ref, known)
    reeled_plus = _reel(drive, state, 0, plus / drive.stiffness + known.length - path_plus, h)
    reeled_minus = _reel(drive, state, 2, minus / drive.stiffness + known.length - path_minus, h)
    return reeled_plus, reeled_minus


@compiled
def pulls(drive: Any, segment: Any, theta: Any, omega: Any, rubbing: float, plus: Any, minus: Any) -> Any:
    """Pulls [N] of both sides on a wrist at theta, omega from what they deliver, with this share of the friction."""
    if drive is None:
        return plus, minus
    if drive.level != TENDON:
        return plus, minus
    zero = 0.0 * plus
    bend, slide_plus, slide_minus = zero, zero, zero
    for k in range(len(theta)):
        path_plus, path_minus = lengths(theta[k], segment)
        arm_plus, arm_minus = moment_arms(theta[k], segment)
        plus = plus - segment.length + path_plus
        minus = minus - segment.length + path_minus
        bend = bend + abs(theta[k])
        slide_plus = slide_plus + arm_plus * omega[k]
        slide_minus = slide_minus + arm_minus * omega[k]
    wrapped = 0.5 * rubbing * drive.friction * bend
    x_plus, x_minus = wrapped * tanh(slide_plus / _SLIDING), wrapped * tanh(slide_minus / _SLIDING)
    # (1 - x/2)/(1 + x/2) is the capstan's exp(-x) to x^3/12
    plus = drive.stiffness * maximum(plus, zero) * (1.0 - x_plus) / (1.0 + x_plus)
    minus = drive.stiffness * maximum(minus, zero) * (1.0 - x_minus) / (1.0 + x_minus)
    return plus, minus


@compiled
def tendon_stiffness(drive: Any, segment: Any, theta: Any) -> Any:
    """Stiffness [N m/rad] that elastic tendons on held spools add to one segment at theta; 0 without them."""
    if drive is None:
        return 0.0 * theta
    arm_plus, arm_minus = moment_arms(theta, segment)
    held = drive.stiffness if drive.level == TENDON else 0.0
    return held * (arm_plus * arm_plus + arm_minus * arm_minus)
