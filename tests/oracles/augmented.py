"""The equation of motion in the paper's augmented form (E7-E11), by the chain of `wristctl.wrist.augmented`.

A point mass is between a segment's slides. All angles in rad, one state at a time: theta, rate of shape (n,).
"""

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.wrist.augmented import TURNS, frames, joints
from wristctl.wrist.segments import Segments


def _point_jacobian(chain: list[Array], point: Array, count: int) -> Array:
    """d(point)/d(mu), (2, 4n), of a point that the first `count` joints move."""
    jacobian = np.zeros((2, len(chain) - 1))
    for index in range(count):
        frame = chain[index]
        if TURNS[index % 4]:
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
        if TURNS[index % 4]:
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
