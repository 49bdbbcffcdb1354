"""The compiled model in two planes for arrays: states in, terms out; coordinates (..., 2n) as (u_y, u_z) by segment.

`parameters` is one row of values, or a row for each state: SpatialSegments, then three for each tendon, as
`spatial_values` makes them.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.lanes.blocks import spread, to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of, square_like
from wristctl.wrist.compiled_model import linearised_by
from wristctl.wrist.spatial.posture import bend_segments, posture_like, tip_bend
from wristctl.wrist.spatial.spatial_dynamics import bent_wrist, momenta_like, spatial_bias, spatial_mass_matrix
from wristctl.wrist.spatial.spatial_jacobian import spatial_jacobians
from wristctl.wrist.spatial.spatial_segments import FIELDS, OF_A_TENDON, SpatialWrist, load_spatial_segments
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of


class SpatialTerms(NamedTuple):
    """Terms of M q'' + r = 0 at a state; batch shape (...) before the shapes given here."""

    tip: Array
    """Centre of the last disc (..., 3) [m]."""
    frame: Array
    """Rotation of the last disc: tangent, n_y and n_z as columns, (..., 3, 3)."""
    bend: Array
    """Bend of the last disc's tangent and its rate: (..., 4) [rad, rad/s]."""
    mass: Array
    """M, (..., 2n, 2n) [kg m^2]."""
    bias: Array
    """Coriolis, centrifugal and gravity terms less external force's, without springs, dampers, tendons: (..., 2n)."""
    lengths: Array
    """Of each tendon, (..., T) [m]."""
    moment_arms: Array
    """Of each tendon, minus the derivative of its length, (..., T, 2n) [m]."""


@kernel
def _terms(parameters: Any, states: Any, out: Any, cut: Any, of_tendons: Any, of_pulls: Any) -> None:
    for block in range(states.shape[0]):
        values, state, result = rows_of(parameters[block]), rows_of(states[block]), rows_of(out[block])
        m, count = len(cut), len(of_pulls)
        wrist = SpatialWrist(load_spatial_segments(values), part(values, FIELDS, of_tendons))
        segment = wrist.segment
        q, rate = part(state, 0, cut), part(state, m, cut)
        posture, momenta = posture_like(q), momenta_like(q)
        r, mass, nothing = lanes_like(q), square_like(q), lanes_like(q)
        zero = zero_like(segment.length)
        for i in range(m):
            nothing[i] = zero
        tangent, across_y, across_z = bend_segments(segment, q, posture)
        spatial_mass_matrix(segment, posture, tangent, mass, momenta)
        spatial_bias(segment, q, rate, posture, tangent, nothing, r)
        for i, v in enumerate((posture.end[m // 2 - 1], tangent, across_y, across_z)):
            result[3 * i] = v.x
            result[3 * i + 1] = v.y
            result[3 * i + 2] = v.z
        bend_y, bend_z, rate_y, rate_z, _ = tip_bend(segment, q, rate)
        result[12] = bend_y
        result[13] = bend_z
        result[14] = rate_y
        result[15] = rate_z
        lengths_along(wrist, q, part(result, 16, of_pulls))
        arms = lanes_like(q)
        for t in range(count):
            moment_arms_of(wrist, q, t, arms)
            for i in range(m):
                result[16 + count + m * t + i] = arms[i]
        first = 16 + count + m * count
        for k in range(m // 2):
            y, z = 2 * k, 2 * k + 1
            spring_y = segment.stiffness_yy * q[y] + segment.stiffness_yz * q[z]
            spring_z = segment.stiffness_yz * q[y] + segment.stiffness_zz * q[z]
            result[first + y] = r[y] - spring_y - segment.damping_yy * rate[y] - segment.damping_yz * rate[z]
            result[first + z] = r[z] - spring_z - segment.damping_yz * rate[y] - segment.damping_zz * rate[z]
        for i in range(m):
            for j in range(m):
                result[first + m + m * i + j] = mass[i, j]


Shape = tuple[int, ...]


def _shapes(parameters: ArrayLike, q: Array) -> tuple[Array, tuple[Shape, Shape, Shape]]:
    """Rows of parameters, and tuples with an entry for each coordinate, each value of tendons and each tendon."""
    values = np.atleast_2d(np.asarray(parameters, float))
    of_tendons = values.shape[-1] - FIELDS
    return values.reshape(-1, values.shape[-1]), (
        (0,) * q.shape[-1],
        (0,) * of_tendons,
        (0,) * (of_tendons // OF_A_TENDON),
    )


def spatial_terms(parameters: ArrayLike, q: ArrayLike, rate: ArrayLike) -> SpatialTerms:
    """Terms of the equation of motion at coordinates and rates of shape (..., 2n)."""
    q, rate = np.broadcast_arrays(np.asarray(q, float), np.asarray(rate, float))
    *batch, m = q.shape
    states = np.concatenate([q, rate], axis=-1).reshape(-1, 2 * m)
    values, shapes = _shapes(parameters, q)
    count = len(shapes[2])
    blocks = to_blocks(states)
    out = np.empty((len(blocks), 16 + count + m * count + m + m * m, *blocks.shape[2:]))
    _terms(spread(values, len(states)), blocks, out, *shapes)
    rows = to_rows(out, len(states)).reshape(*batch, -1)
    widths = np.cumsum([3, 9, 4, count, count * m, m])
    tip, frame, bend, lengths, arms, bias, mass = np.split(rows, widths, axis=-1)
    return SpatialTerms(
        tip=tip,
        frame=np.swapaxes(frame.reshape(*batch, 3, 3), -1, -2),
        bend=bend,
        mass=mass.reshape(*batch, m, m),
        bias=bias,
        lengths=lengths,
        moment_arms=arms.reshape(*batch, count, m),
    )


@kernel
def _linearised(parameters: Any, states: Any, out: Any, cut: Any, of_tendons: Any, of_pulls: Any) -> None:
    for block in range(states.shape[0]):
        values, state, result = rows_of(parameters[block]), rows_of(states[block]), rows_of(out[block])
        m = len(cut)
        wrist = SpatialWrist(load_spatial_segments(values), part(values, FIELDS, of_tendons))
        q, rate, acceleration = part(state, 0, cut), part(state, m, cut), part(state, 2 * m, cut)
        pulls = part(state, 3 * m, of_pulls)
        r, mass, by_q, by_rate = lanes_like(q), square_like(q), square_like(q), square_like(q)
        bent = bent_wrist(wrist, q, pulls, mass)
        spatial_bias(wrist.segment, q, rate, bent.posture, bent.tangent, bent.torques.torque, r)
        spatial_jacobians(wrist.segment, q, rate, acceleration, bent, by_q, by_rate)
        for i in range(m):
            result[i] = r[i]
            for j in range(m):
                result[i] = result[i] + mass[i, j] * acceleration[j]
                result[m + m * i + j] = by_q[i, j]
                result[m + m * m + m * i + j] = by_rate[i, j]


def spatial_linearised(
    parameters: ArrayLike, q: ArrayLike, rate: ArrayLike, acceleration: ArrayLike, pulls: ArrayLike
) -> tuple[Array, Array, Array]:
    """Residual M q'' + r (..., 2n) and its derivatives by q and by the rate (..., 2n, 2n), under pulls (..., T) [N]."""
    values, (_, of_tendons, of_pulls) = _shapes(parameters, np.asarray(q))
    motion = q, rate, acceleration
    return linearised_by(_linearised, values, motion, pulls, len(of_pulls), of_tendons, of_pulls)
