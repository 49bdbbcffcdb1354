"""The paper's augmented form: each segment as an RPPR rigid chain (E2-E11), readable and in NumPy.

A segment's four joints are mu = (theta/2, d, d, theta/2) with d = l sin(theta/2)/theta: turn, slide, slide, turn.
n segments stack to 4n joints; J_mu = d(mu)/d(theta) reduces them to n. Rows of the paper's DH table, conjugated by the
quarter turn that points the straight wrist along +x (C2), are the transforms of `_joint`. One state at a time: theta
(n,) [rad]. The tests' `tests/oracles/augmented.py` has the equation of motion in this form.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array

# Which of a segment's joints turn.
TURNS = (True, False, False, True)


def joints(theta: ArrayLike, length: float) -> tuple[Array, Array, Array]:
    """mu of shape (4n,) with J_mu = d(mu)/d(theta) (4n, n) and d2(mu_4k..)/d(theta_k)^2 (4n,) (E2, E3)."""
    theta = np.asarray(theta, float)
    n = len(theta)
    mu, jacobian, curvature = np.zeros(4 * n), np.zeros((4 * n, n)), np.zeros(4 * n)
    for k, angle in enumerate(theta):
        slide, slope, bend = _half_chord(float(angle), length)
        mu[4 * k : 4 * k + 4] = angle / 2.0, slide, slide, angle / 2.0
        jacobian[4 * k : 4 * k + 4, k] = 0.5, slope, slope, 0.5
        curvature[4 * k : 4 * k + 4] = 0.0, bend, bend, 0.0
    return mu, jacobian, curvature


def _half_chord(theta: float, length: float) -> tuple[float, float, float]:
    """d = l sin(theta/2)/theta and two derivatives: l/2 times the mean of cos(theta s/2) over s in [0, 1]."""
    nodes, weights = np.polynomial.legendre.leggauss(24)
    s, w = 0.25 * (nodes + 1.0), 0.25 * length * weights
    return (
        float(w @ np.cos(theta * s)),
        float(-(w * s) @ np.sin(theta * s)),
        float(-(w * s * s) @ np.cos(theta * s)),
    )


def _joint(index: int, value: float) -> Array:
    """Homogeneous transform (3, 3) of one joint: a turn about the base of its frame or a slide along its x axis."""
    if TURNS[index % 4]:
        c, s = np.cos(value), np.sin(value)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([[1.0, 0.0, value], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def frames(mu: Sequence[float] | Array) -> list[Array]:
    """Transforms from base to after each joint, the base's own first: 4n + 1 of shape (3, 3)."""
    chain = [np.eye(3)]
    for index, value in enumerate(mu):
        chain.append(chain[-1] @ _joint(index, float(value)))
    return chain
