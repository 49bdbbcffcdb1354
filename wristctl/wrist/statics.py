"""Statics of the n-segment wrist: equilibria under tendons and gravity, stiffness and buckling."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.compiled_model import linearised
from wristctl.wrist.segments import segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE


class Equilibria(NamedTuple):
    """Wrists at rest with wanted tip angles."""

    theta: Array
    """(B, n) segment angles [rad]"""
    pulls: Array
    """(B, 2) total tensions of the + and the - side [N]"""
    stable: NDArray[np.bool_]
    """(B,) whether it was found and stays there under held tensions"""


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
    """Segment angles (n,) [rad] at rest under tensions [N per tendon, + and - side].

    UserError where the wrist buckles, so that no stable equilibrium is found.
    """
    still, pulls = np.zeros(n), TENDONS_PER_SIDE * np.asarray(tensions)
    return settled(lambda theta: linearised(segments(wrist, n), theta, still, still, pulls)[:2], n, tensions)


def settled(balance: Callable[[Array], tuple[Array, Array]], n: int, tensions: tuple[float, float]) -> Array:
    """Where a balance of n torques, which gives itself and its derivative, is none and stable, by Newton's method."""
    theta = np.zeros(n)
    for _ in range(100):
        r, tangent = balance(theta)
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


def equilibria_at(parameters: Array, n: int, angle: Array, pretension: float) -> Equilibria:
    """Equilibria with the last disc at `angle` (B,) [rad], one side at `pretension` (of all its tendons) [N].

    `parameters` are rows of Segments, (B, 12). Newton's method on the segments' angles and the difference of the two
    sides' pulls, for all wrists at once; the wanted angle as a side condition keeps it regular where a load buckles.
    """
    count, still = len(angle), np.zeros((len(angle), n))
    theta, difference = np.repeat(angle[:, None] / n, n, axis=1), np.zeros(count)
    bordered = np.zeros((count, n + 1, n + 1))
    bordered[:, n, :n] = 1.0
    for _ in range(60):
        r, tangent, _ = linearised(parameters, theta, still, still, _pulls(difference, pretension))
        side = np.where(difference >= 0.0, 1.0, -1.0)  # the pull that grows: r is linear in it
        more = linearised(parameters, theta, still, still, _pulls(difference + side, pretension))[0]
        bordered[:, :n, :n], bordered[:, :n, n] = tangent, (more - r) * side[:, None]
        rest = np.concatenate([r, theta.sum(axis=1, keepdims=True) - angle[:, None]], axis=1)
        change = np.linalg.solve(bordered, -rest[..., None])[..., 0]
        theta, difference = theta + change[:, :n], difference + change[:, n]
        if np.abs(change[:, :n]).max() < 1e-12 and np.abs(change[:, n]).max() < 1e-9:
            break
    pulls = _pulls(difference, pretension)
    r, tangent, _ = linearised(parameters, theta, still, still, pulls)
    least = np.linalg.eigvalsh(0.5 * (tangent + tangent.transpose(0, 2, 1)))[:, 0]
    return Equilibria(theta, pulls, (np.abs(r).max(axis=1) < 1e-9) & (least > 0.0))


def _pulls(difference: Array, pretension: float) -> Array:
    """(B, 2) pulls whose difference is the given one, the lesser at pretension [N]."""
    return pretension + np.stack([difference.clip(0.0), (-difference).clip(0.0)], axis=-1)
