"""Force to motion: from tendon tension to the spool's position, and to the step rate that takes it there.

A stepper is a position source. Tension T [N] asks of the motor the torque T r_p [N m] at the pulley, and gets it from
the tendon's stretch T/k_t [m]. So the spool has to hold stretch + taut [m] of tendon, where `taut` is what a tendon
without tension must be reeled in by at the reference angle: the path's shortening there. In microsteps of length s [m]

    target = (T/k_t + taut)/s,   T = k_t (s position - taut),

counted positive reeling in and zero where the tendon of the straight wrist is just taut. Taken at the measured angle,
delayed, `taut` would feed back positively with a gain near 1.
"""

import math
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import left_behind, spool_speed, spool_target
from wristctl.simulation.simulated_drives import read_timing
from wristctl.simulation.spool_timing import Timing, foreseen, reckoned, timing_of
from wristctl.simulation.target_following import motor_at
from wristctl.wrist.directions import ACTIVE, tendons_of


def on_plus_side(plane: str) -> NDArray[np.bool_]:
    """Mask (4,) of the axes that wind a tendon of the + side of this bending plane (ulnar or flexion)."""
    return np.isin(ACTIVE, tendons_of(plane)[:2])


@dataclass(frozen=True)
class Spools:
    """Four equal motors with their pulleys and tendons; SI units, microsteps counted positive reeling in."""

    step: float
    """Tendon moved by one microstep [m]."""
    stiffness: float
    """Stiffness of one tendon [N/m]."""
    speed: float
    """Largest step rate [1/s]."""
    acceleration: float
    """Largest change of it by the host [1/s^2]."""
    timing: Timing
    """Of the board, as believed; lengths in steps."""

    def target(self, tension: Array, taut: Array) -> Array:
        """Positions [steps] at which tendons that are taut when reeled in by `taut` [m] have these tensions [N]."""
        reeled = np.empty(len(tension))
        _targets(tension, self.stiffness, taut, reeled)
        return reeled / self.step

    def tension(self, position: Array, taut: Array) -> Array:
        """Tensions [N] at these positions [steps]; negative by how much a tendon is slack, times its stiffness."""
        return self.stiffness * (self.step * position - taut)

    def rate(self, gap: Array, moving: Array, before: Array, period: float) -> Array:
        """Step rates [1/s] for one period that close the gap [steps] to targets moving at a known rate [1/s].

        They are those of `wristctl.simulation.actuator.spool_speed`, from `before` [1/s].
        """
        rates = np.empty(len(gap))
        _rates((self.speed, self.acceleration), gap, moving, before, period, rates)
        return rates

    def behind(self, gap: Array, moving: Array, sent: Array, period: float) -> Array:
        """Distances [steps] from where spools can stop to their targets, after a period at the step rates `sent`.

        `gap` and `moving` are those of `rate`. Less than a step is none, and so it is at the speeds that close the gap.
        """
        left = np.empty(len(gap))
        _behind(self.acceleration, gap, sent - moving, period, left)
        return np.where(np.abs(left) > 1.0, left, 0.0)

    def foreseen(self, place: Array, rates: Array, period: float) -> Array:
        """Positions (4,) [steps] when the rates that are to be sent in this tick take effect.

        They were at `place` when rates took effect in the last tick, of which the newest of `rates` (4, n) [1/s] are.
        """
        return self.reckoned(place, rates, math.nan, period)

    def reckoned(self, place: Array, rates: Array, time: float, period: float) -> Array:
        """Positions (4,) [steps] at a time [s] in this tick, of which the newest of `rates` are."""
        places: Array = np.empty(len(place))
        sent = (0,) * rates.shape[1]
        _places(np.array(self.timing), place, np.ascontiguousarray(rates), sent, time, period, places)
        return places


def spools_of(actuator: Actuator) -> Spools:
    """The spools of an actuator section."""
    return Spools(
        actuator.step_length,
        actuator.tendon_stiffness,
        actuator.step_rate,
        actuator.step_acceleration,
        timing_of(actuator),
    )


@kernel
def _targets(tension: Any, stiffness: float, taut: Any, reeled: Any) -> None:
    pulls, shorter, out = rows_of(tension), rows_of(taut), rows_of(reeled)
    for axis in range(len(tension)):
        out[axis] = spool_target(pulls[axis], stiffness, shorter[axis], 0.0)


@kernel
def _rates(motor: Any, gap: Any, moving: Any, before: Any, period: float, rates: Any) -> None:
    speed, acceleration = motor
    gaps, speeds, last, out = rows_of(gap), rows_of(moving), rows_of(before), rows_of(rates)
    for axis in range(len(gap)):
        most = acceleration + zero_like(gaps[axis])
        out[axis] = spool_speed(speed, most, gaps[axis], speeds[axis], last[axis], period)


@kernel
def _behind(acceleration: float, gap: Any, closing: Any, period: float, left: Any) -> None:
    gaps, speeds, out = rows_of(gap), rows_of(closing), rows_of(left)
    for axis in range(len(gap)):
        out[axis] = left_behind(acceleration, gaps[axis], speeds[axis], period)


class Follower(NamedTuple):
    """Motors that follow targets; lengths in any one unit."""

    delay: float
    """From when a target is sent until the motors begin to follow it [s]."""
    lag: float
    """Time constant of the motors behind it [s]."""
    speed: float

    def over(self, place: Array, targets: Array, period: float) -> tuple[Array, Array]:
        """Places (T,) of the motors at the end of a tick [s], at whose begin they were at `place`, and their means over
        it.

        The newest of `targets` (T, n) are those of this tick.
        """
        ends, means = np.empty(len(place)), np.empty(len(place))
        targets = np.ascontiguousarray(targets)
        _followed(np.array(self), place, targets, (0,) * targets.shape[1], period, ends, means)
        return ends, means


# A Follower of lanes from rows of lanes, in compiled code.
_read_follower = tuple_of(Follower)


@kernel
def _followed(motor: Any, place: Any, targets: Any, sent: Any, period: float, ends: Any, means: Any) -> None:
    follower, before, out, mean = _read_follower(rows_of(motor)), rows_of(place), rows_of(ends), rows_of(means)
    for axis in range(len(place)):
        own = part(rows_of(targets[axis]), 0, sent)
        out[axis], _, summed = motor_at(follower, before[axis], own, period + zero_like(before[axis]), period)
        mean[axis] = summed / period


@kernel
def _places(timing: Any, place: Any, rates: Any, sent: Any, time: float, period: float, places: Any) -> None:
    """Where spools are at a time in this tick [s]; nan: when what is sent in it takes effect."""
    board, before, out = read_timing(rows_of(timing)), rows_of(place), rows_of(places)
    for axis in range(len(place)):
        own = part(rows_of(rates[axis]), 0, sent)
        if math.isnan(time):
            out[axis] = foreseen(board, before[axis], own, period)
        else:
            out[axis] = reckoned(board, before[axis], own, time + zero_like(before[axis]), period)
