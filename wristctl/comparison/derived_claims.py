"""Consequences of the paper's own equations and tables: evidence that asks for no rollout.

What they take from print is rounded to its last digit, so that each comes to a range.
"""

import math
import operator
from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from wristctl.comparison.paper import T2, Ends, rounded
from wristctl.config.wrist import WristParameters
from wristctl.control.pid import PID
from wristctl.control.smc import SMC

# Time constants until 2 % are left.
_TWO_PERCENT = math.log(50.0)
_STEP = math.radians(30.0)
# The longest horizon that is granted to T2 [s]: the longer, the less its bound asks for.
_HORIZON = 10.0
# The narrowest usual settling band, likewise.
_BAND = 0.01


def chain_difference() -> float:
    """Largest distance [m] between the tip of the DH chain (E2, turned by C2's quarter) and E1's arc, within 90 deg."""
    from wristctl.wrist.augmented import frames, joints
    from wristctl.wrist.kinematics import chain_tip

    length, largest_error = 0.08, 0.0
    for theta in np.radians(np.linspace(-90.0, 90.0, 37)):
        mu, _, _ = joints([theta], length)
        largest_error = max(
            largest_error, float(np.abs(frames(mu)[-1][:2, 2] - chain_tip(np.array([[theta]]), length)[0]).max())
        )
    return largest_error


def time_to_settle(slow: float, fast: float) -> float:
    """Settling time [s] to 2 % of what decays with the time constant slow / fast [s]."""
    return _TWO_PERCENT * slow / fast


def growth_as_printed(kp: float, ki: float, kd: float) -> float:
    """Largest real part [1/s] of the poles of the wrist under E22 as it is printed: u = +(Kp e + Ki int e + Kd de/dt).

    About straight, weightless, with the assumed masses: a positive one grows whatever the masses.
    """
    wrist = WristParameters()
    inertia = wrist.hand_mass * (0.5 * wrist.length + wrist.hand_offset) ** 2
    poles = np.roots([inertia, wrist.damping - kd, wrist.stiffness - kp, -ki])
    return float(poles.real.max())


def least_rmse(settling: float) -> float:
    """Least RMSE [rad] of an error that begins at a step of 30 deg, decays and leaves the band at a settling time [s].

    Until then it is at least the band, so that RMSE^2 H >= (band 30 deg)^2 t_s; band and horizon are those that ask
    for least. Where the printed RMSE is below, both cannot be read from one answer to a step.
    """
    return _BAND * _STEP * math.sqrt(settling / _HORIZON)


class Equation(NamedTuple):
    """A function of printed numbers, monotone in each of them, and these numbers."""

    of: Callable[..., float]
    printed: tuple[float, ...] = ()

    def ends(self) -> Ends:
        """Between which it comes out, over all that the printed digits may stand for."""
        corners = [self.of(*corner) for corner in product(*(rounded(number) for number in self.printed))]
        return Ends(min(corners), max(corners))


_SMC, _PID = SMC.presets["printed"], PID.presets["printed"]

# By the name that a claim's `metric` gives.
EQUATIONS: dict[str, Equation] = {
    "chain_difference": Equation(chain_difference),
    # C1: the springs and dampers alone, by words and by units
    "settling_by_words": Equation(time_to_settle, (0.615, 0.105)),
    "settling_by_units": Equation(time_to_settle, (0.105, 0.615)),
    # E17: on sigma = 0, where P1 e + P2 de/dt = 0
    "settling_on_surface": Equation(time_to_settle, (_SMC["P2"], _SMC["P1"])),
    "growth_as_printed": Equation(growth_as_printed, (_PID["Kp"], _PID["Ki"], _PID["Kd"])),
    **{f"least_rmse_{name}": Equation(least_rmse, (row.settling,)) for name, row in T2.items()},
    # below 1 the error grows with time, or the two are of other signals
    **{
        f"rmse_over_steady_{name}": Equation(operator.truediv, (row.rmse, row.steady_state)) for name, row in T2.items()
    },
}
