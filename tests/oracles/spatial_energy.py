"""Energy of a wrist in two planes, which damping alone takes from."""

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialSegments


def spatial_energy(parameters: ArrayLike, q: ArrayLike, rate: ArrayLike, pulls: ArrayLike) -> Array:
    """Energy (...) [J] of motion, springs, gravity, the tip force and held pulls (T,) [N]; damping alone takes from it.

    At coordinates and rates (..., 2n); gravity's and the force's are counted from the base.
    """
    values = np.asarray(parameters, float)
    segment = SpatialSegments(*values[:FIELDS])
    q, rate = np.broadcast_arrays(np.asarray(q, float), np.asarray(rate, float))
    at = spatial_terms(values, q, rate)
    moving = 0.5 * np.einsum("...i,...ij,...j->...", rate, at.mass, rate)
    stiffness = np.array([[segment.stiffness_yy, segment.stiffness_yz], [segment.stiffness_yz, segment.stiffness_zz]])
    bends = q.reshape(*q.shape[:-1], -1, 2)
    springs = 0.5 * np.einsum("...ka,ab,...kb->...", bends, stiffness, bends)
    gravity = np.array([segment.gravity_x, segment.gravity_y, segment.gravity_z])
    ends = _ends(values, q)
    middles = 0.5 * (ends[..., 1:, :] + ends[..., :-1, :])
    hand = at.tip + segment.hand_offset * at.frame[..., 0]
    weight = -(segment.mass * middles.sum(axis=-2) + segment.hand_mass * hand) @ gravity
    load = -at.tip @ np.array([segment.force_x, segment.force_y, segment.force_z])
    energy: Array = moving + springs + weight + load + at.lengths @ np.asarray(pulls, float)
    return energy


def _ends(values: Array, q: Array) -> Array:
    """Ends of the segments from the base, (..., n + 1, 3) [m]: tips of the wrists cut off there."""
    ends = [np.zeros((*q.shape[:-1], 3))]
    for k in range(1, q.shape[-1] // 2):
        bent = q.copy()
        bent[..., 2 * k :] = 0.0
        at = spatial_terms(values, bent, 0.0 * bent)
        rest = (q.shape[-1] // 2 - k) * values[SpatialSegments._fields.index("length")]
        ends.append(at.tip - rest * at.frame[..., 0])
    return np.stack([*ends, spatial_terms(values, q, 0.0 * q).tip], axis=-2)
