"""What the paper's own equations and tables come to, worked out: evidence that asks for no rollout."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial

import numpy as np

from wristctl.comparison.paper import T2
from wristctl.config.wrist import WristParameters
from wristctl.control.pid import PID
from wristctl.control.smc import SMC

_TWO_PERCENT = math.log(50.0)
"""Time constants until 2 % are left."""
_STEP = math.radians(30.0)
_HORIZON = 10.0
"""The longest horizon that is granted to T2 [s]: the longer, the less its bound asks for."""
_BAND = 0.01
"""The narrowest usual settling band, likewise."""


def chain_difference() -> float:
    """Largest distance [m] between the tip of the DH chain (E2, turned by C2's quarter) and E1's arc, within 90 deg."""
    from wristctl.wrist.augmented import frames, joints
    from wristctl.wrist.kinematics import chain_tip

    length, found = 0.08, 0.0
    for theta in np.radians(np.linspace(-90.0, 90.0, 37)):
        mu, _, _ = joints([theta], length)
        found = max(found, float(np.abs(frames(mu)[-1][:2, 2] - chain_tip(np.array([[theta]]), length)[0]).max()))
    return found


def settling_by_words() -> float:
    """Settling time [s] of the springs and dampers alone by C1's words, damping 0.615 over stiffness 0.105."""
    return _TWO_PERCENT * 0.615 / 0.105


def settling_by_units() -> float:
    """The same by the units."""
    return _TWO_PERCENT * 0.105 / 0.615


def settling_on_surface() -> float:
    """Settling time [s] on sigma = 0 with the printed gains (E17), where P1 e + P2 de/dt = 0."""
    gains = SMC.presets["printed"]
    return _TWO_PERCENT * gains["P2"] / gains["P1"]


def growth_as_printed() -> float:
    """Largest real part [1/s] of the poles of the wrist under E22 as it is printed: u = +(Kp e + Ki int e + Kd de/dt).

    About straight, weightless, with the assumed masses: a positive one grows whatever the masses.
    """
    wrist, gains = WristParameters(), PID.presets["printed"]
    inertia = wrist.hand_mass * (0.5 * wrist.length + wrist.hand_offset) ** 2
    poles = np.roots([inertia, wrist.damping - gains["Kd"], wrist.stiffness - gains["Kp"], -gains["Ki"]])
    return float(poles.real.max())


def least_rmse(controller: str) -> float:
    """Least RMSE [rad] of an error that begins at a step of 30 deg, decays and leaves the band at T2's settling time.

    Until then it is at least the band, so that RMSE^2 H >= (band 30 deg)^2 t_s; band and horizon are those that ask
    for least. Where the printed RMSE is below, both cannot be read from one answer to a step.
    """
    return _BAND * _STEP * math.sqrt(T2[controller].settling / _HORIZON)


def rmse_over_steady(controller: str) -> float:
    """T2's RMSE over its steady-state error: below 1, the error grows with time or the two are of other signals."""
    return T2[controller].rmse / T2[controller].steady_state


EQUATIONS: dict[str, Callable[[], float]] = {
    "chain_difference": chain_difference,
    "settling_by_words": settling_by_words,
    "settling_by_units": settling_by_units,
    "settling_on_surface": settling_on_surface,
    "growth_as_printed": growth_as_printed,
    **{f"least_rmse_{name}": partial(least_rmse, name) for name in T2},
    **{f"rmse_over_steady_{name}": partial(rmse_over_steady, name) for name in T2},
}
"""By the name that a claim's `metric` gives."""
