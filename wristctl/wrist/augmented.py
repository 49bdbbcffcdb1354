"""The paper's augmented form: each segment as an RPPR rigid chain (E2-E11), the readable reference in NumPy.

A segment's four joints are mu = (theta/2, d, d, theta/2) with d = l sin(theta/2)/theta: turn, slide, slide, turn, a
point mass between the slides. n segments stack to 4n joints; J_mu = d(mu)/d(theta) reduces them to n (E7-E11).
Rows of the paper's DH table, conjugated by the quarter turn that points the straight wrist along +x (C2), are the
transforms of `_joint`. All angles in rad, one state at a time: theta, rate of shape (n,).
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.wrist.segments import Segments

_TURNS = (True, False, False, True)


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
    if _TURNS[index % 4]:
        c, s = np.cos(value), np.sin(value)
        return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    return np.array([[1.0, 0.0, value], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def frames(mu: Sequence[float] | Array) -> list[Array]:
    """Transforms from base to after each joint, the base's own first: 4n + 1 of shape (3, 3)."""
    chain = [np.eye(3)]
    for index, value in enumerate(mu):
        chain.append(chain[-1] @ _joint(index, float(value)))
    return chain


def _point_jacobian(chain: list[Array], point: Array, count: int) -> Array:
    """d(point)/d(mu), (2, 4n), of a point that the first `count` joints move."""
    jacobian = np.zeros((2, len(chain) - 1))
    for index in range(count):
        frame = chain[index]
        if _TURNS[index % 4]:
            arm = point - frame[:2, 2]
            jacobian[:, index] = -arm[1], arm[0]
        else:
            jacobian[:, index] = frame[:2, 0]
    return jacobian


def _point_jacobian_rate(chain: list[Array], point: Array, count: int, mu_rate: Array) -> Array:
    """Time derivative (2, 4n) of `_point_jacobian` at joint rates (4n,)."""
    rate = np.zeros((2, len(chain) - 1))
    velocity = _point_jacobian(chain, point, count) @ mu_rate
    turning = 0.0
    for index in range(count):
        frame = chain[index]
        origin_velocity = _point_jacobian(chain, frame[:2, 2], index) @ mu_rate
        if _TURNS[index % 4]:
            arm_rate = velocity - origin_velocity
            rate[:, index] = -arm_rate[1], arm_rate[0]
            turning += mu_rate[index]
        else:
            rate[:, index] = turning * np.array([-frame[1, 0], frame[0, 0]])
    return rate


def _masses(chain: list[Array], segment: Segments) -> list[tuple[float, Array, int]]:
    """Point masses [kg] with their places and the number of joints that move each."""
    n = (len(chain) - 1) // 4
    points = [(segment.mass, chain[4 * k + 2][:2, 2], 4 * k + 2) for k in range(n)]
    hand = chain[-1] @ np.array([segment.hand_offset, 0.0, 1.0])
    return [*points, (segment.hand_mass, hand[:2], 4 * n)]


def equation_of_motion(
    segment: Segments, theta: ArrayLike, rate: ArrayLike
) -> tuple[Array, Array, Array, Array, Array]:
    """M (n, n) by E7, C (n, n) by E8 with C_b (C3), G (n,) by E9, tip Jacobian J (2, n) by E11, tip pose (3,)."""
    theta, rate = np.asarray(theta, float), np.asarray(rate, float)
    mu, j_mu, curvature = joints(theta, segment.length)
    mu_rate = j_mu @ rate
    j_mu_rate = np.zeros_like(j_mu)
    for k in range(len(theta)):
        rows = slice(4 * k, 4 * k + 4)
        j_mu_rate[rows, k] = curvature[rows] * rate[k]
    chain = frames(mu)
    size = len(mu)
    m_b, c_b, g_b = np.zeros((size, size)), np.zeros((size, size)), np.zeros(size)
    gravity = np.array([segment.gravity_x, segment.gravity_y])
    for mass, point, count in _masses(chain, segment):
        j = _point_jacobian(chain, point, count)
        m_b += mass * j.T @ j
        c_b += mass * j.T @ _point_jacobian_rate(chain, point, count, mu_rate)
        g_b -= mass * j.T @ gravity
    mass_matrix = j_mu.T @ m_b @ j_mu
    coriolis = j_mu.T @ m_b @ j_mu_rate + j_mu.T @ c_b @ j_mu
    tip = chain[-1]
    jacobian = _point_jacobian(chain, tip[:2, 2], size) @ j_mu
    pose = np.array([tip[0, 2], tip[1, 2], float(theta.sum())])
    return mass_matrix, coriolis, j_mu.T @ g_b, jacobian, pose


def tendon_columns(mu: ArrayLike, offset: float) -> Array:
    """A_b (4, 2) of one segment, columns of the + and - side: minus d(length)/d(mu) ("force", E10)."""
    mu = np.asarray(mu, float)
    bend, end = offset * np.cos(mu[0]), offset * np.cos(mu[3])
    return np.array([[bend, -bend], [-1.0, -1.0], [-1.0, -1.0], [end, -end]])
