"""Statics of the n-segment wrist: equilibria under tendons and gravity, stiffness and buckling."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wristctl.config.errors import UserError
from wristctl.config.wrist import WristParameters
from wristctl.wrist.allocation import TENDONS_PER_SIDE
from wristctl.wrist.model import linearised
from wristctl.wrist.segments import segments

Array = NDArray[np.float64]


def stiffness(wrist: WristParameters, n: int, theta: Array, tensions: tuple[float, float]) -> Array:
    """Stiffness matrix (n, n) [N m/rad] at segment angles (n,), with gravity and tensions [N per tendon, + and -]."""
    still = np.zeros(n)
    pulls = TENDONS_PER_SIDE * np.asarray(tensions)
    return linearised(segments(wrist, n), theta, still, still, pulls)[1]


def least_stiffness(wrist: WristParameters, n: int) -> float:
    """Smallest eigenvalue of the straight wrist's stiffness at pretension, as a torque per tip angle [N m/rad].

    An eigenvector of n segment angles with unit norm bends the tip by up to sqrt(n); the eigenvalue over n is the
    stiffness of the whole wrist. Negative: the wrist buckles.
    """
    tangent = stiffness(wrist, n, np.zeros(n), (wrist.pretension, wrist.pretension))
    return float(np.linalg.eigvalsh(0.5 * (tangent + tangent.T))[0] / n)


def equilibrium(wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
    """Segment angles (n,) [rad] at rest under tensions [N per tendon, + and - side], by Newton's method.

    UserError where the wrist buckles, so that no stable equilibrium is found.
    """
    still, theta = np.zeros(n), np.zeros(n)
    pulls = TENDONS_PER_SIDE * np.asarray(tensions)
    for _ in range(100):
        r, tangent, _ = linearised(segments(wrist, n), theta, still, still, pulls)
        change = np.linalg.solve(tangent, -r)
        theta = theta + change * min(1.0, 0.3 / max(1e-300, float(np.abs(change).max())))
        if np.abs(change).max() < 1e-13:
            break
    tangent = 0.5 * (tangent + tangent.T)
    if not np.all(np.isfinite(theta)) or np.linalg.eigvalsh(tangent)[0] <= 0.0 or np.abs(r).max() > 1e-9:
        raise UserError(
            f"the wrist buckles: no stable equilibrium under {tensions[0]:g} N and {tensions[1]:g} N",
            where="wrist",
            fix="lower wrist.hand_mass, hand_offset or the tensions, or raise wrist.stiffness",
        )
    return theta
