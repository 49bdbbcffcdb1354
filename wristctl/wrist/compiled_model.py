"""The compiled model for arrays: states in, terms of E6 out; shapes (..., n), SI units.

`parameters` is one value per field of Segments, shape (p,) or (..., p), as `segments` makes it.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.lanes.blocks import spread, to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import dot, planar, zero_like
from wristctl.lanes.rows import beyond, lanes_like, part, planes_like, rows_of, square_like
from wristctl.wrist import tendons
from wristctl.wrist.arcs import Chords, chords, tip
from wristctl.wrist.dynamics import bias, equation_of_motion, mass_matrix
from wristctl.wrist.jacobian import residual_jacobians
from wristctl.wrist.segments import Segments, load_segments


class Terms(NamedTuple):
    """Terms of E6 at a state, and the tendons of each segment; batch shape (...) before the shapes given here."""

    tip: Array
    """x, y [m] of the last disc and its angle [rad]: (..., 3)."""
    mass: Array
    """M, (..., n, n) [kg m^2]."""
    bias: Array
    """Coriolis, centrifugal and gravity terms less external force's, without springs, dampers, tendons: (..., n)."""
    tendon_lengths: Array
    """+ and - side, (..., n, 2) [m]."""
    moment_arms: Array
    """+ and - side, minus the derivative of the length, (..., n, 2) [m]."""


@kernel
def _terms(parameters: Any, states: Any, out: Any, segments: Any) -> None:
    for block in range(states.shape[0]):
        segment = load_segments(rows_of(parameters[block]))
        state, result = rows_of(states[block]), rows_of(out[block])
        n = len(segments)
        theta, omega = part(state, 0, segments), part(state, n, segments)
        r, mass = lanes_like(theta), square_like(theta)
        zero = zero_like(theta[0])
        equation_of_motion(segment, theta, omega, zero, zero, mass, r)
        position, _ = tip(theta, segment.length)
        result[0] = dot(position, planar(1.0 + zero, zero))
        result[1] = dot(position, planar(zero, 1.0 + zero))
        angle = zero
        for i in range(n):
            angle = angle + theta[i]
            result[3 + i] = r[i] - segment.stiffness * theta[i] - segment.damping * omega[i]
            length_plus, length_minus = tendons.lengths(segment, theta[i])
            arm_plus, arm_minus = tendons.moment_arms(segment, theta[i])
            result[3 + n + 4 * i] = length_plus
            result[4 + n + 4 * i] = length_minus
            result[5 + n + 4 * i] = arm_plus
            result[6 + n + 4 * i] = arm_minus
            for j in range(n):
                result[3 + 5 * n + n * i + j] = mass[i, j]
        result[2] = angle


def terms(parameters: ArrayLike, theta: ArrayLike, omega: ArrayLike) -> Terms:
    """Terms of E6 at angles and rates of shape (..., n)."""
    theta, omega = np.broadcast_arrays(np.asarray(theta, float), np.asarray(omega, float))
    *batch, n = theta.shape
    states = np.concatenate([theta, omega], axis=-1).reshape(-1, 2 * n)
    blocks, values = to_blocks(states), spread(np.reshape(parameters, (-1, len(Segments._fields))), len(states))
    out = np.empty((len(blocks), 3 + 5 * n + n * n, *blocks.shape[2:]))
    _terms(values, blocks, out, (0,) * n)
    rows = to_rows(out, len(states)).reshape(*batch, -1)
    tendon = rows[..., 3 + n : 3 + 5 * n].reshape(*batch, n, 2, 2)
    mass = rows[..., 3 + 5 * n :].reshape(*batch, n, n)
    return Terms(rows[..., :3], mass, rows[..., 3 : 3 + n], tendon[..., 0, :], tendon[..., 1, :])


@kernel
def _linearised(parameters: Any, states: Any, out: Any, segments: Any) -> None:
    for block in range(states.shape[0]):
        segment = load_segments(rows_of(parameters[block]))
        state, result = rows_of(states[block]), rows_of(out[block])
        n = len(segments)
        theta, omega = part(state, 0, segments), part(state, n, segments)
        acceleration, pulls = part(state, 2 * n, segments), beyond(state, 3 * n)
        arc = Chords(planes_like(theta), planes_like(theta), planes_like(theta), planes_like(theta))
        mass, by_theta, by_rate = square_like(theta), square_like(theta), square_like(theta)
        r, pull, slope = lanes_like(theta), lanes_like(theta), lanes_like(theta)
        tangent = chords(theta, segment.length, arc)
        tendons.tendon_torques(segment, theta, pulls[0], pulls[1], pull, slope)
        mass_matrix(segment, arc, tangent, mass)
        bias(segment, theta, omega, arc, tangent, pull, r)
        residual_jacobians(segment, omega, acceleration, arc, tangent, slope, by_theta, by_rate)
        for i in range(n):
            result[i] = r[i]
            for j in range(n):
                result[i] = result[i] + mass[i, j] * acceleration[j]
                result[n + n * i + j] = by_theta[i, j]
                result[n + n * n + n * i + j] = by_rate[i, j]


def linearised(
    parameters: ArrayLike, theta: ArrayLike, omega: ArrayLike, acceleration: ArrayLike, pulls: ArrayLike
) -> tuple[Array, Array, Array]:
    """Residual r of the equation of motion (..., n) and its derivatives by theta and by rate (..., n, n).

    `pulls` are the two sides' total tensions [N], shape (..., 2).
    """
    values = np.reshape(parameters, (-1, len(Segments._fields)))
    return linearised_by(_linearised, values, (theta, omega, acceleration), pulls, 2)


def linearised_by(
    function: Any, values: Array, motion: tuple[ArrayLike, ...], pulls: ArrayLike, places: int, *shapes: tuple[int, ...]
) -> tuple[Array, Array, Array]:
    """Residual (..., m) and its derivatives (..., m, m) by a kernel of rows of values, at coordinates, rates and
    accelerations (..., m) under pulls (..., places) [N]; `shapes` are the kernel's further arguments."""
    states_of = np.broadcast_arrays(*motion)
    *batch, m = states_of[0].shape
    states = np.concatenate([*states_of, np.broadcast_to(np.asarray(pulls, float), (*batch, places))], axis=-1)
    states = states.astype(float).reshape(-1, 3 * m + places)
    blocks = to_blocks(states)
    out = np.empty((len(blocks), m + 2 * m * m, *blocks.shape[2:]))
    function(spread(values, len(states)), blocks, out, (0,) * m, *shapes)
    r, by_q, by_rate = np.split(to_rows(out, len(states)).reshape(*batch, -1), [m, m + m * m], axis=-1)
    return r, by_q.reshape(*batch, m, m), by_rate.reshape(*batch, m, m)
