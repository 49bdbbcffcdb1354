"""Statics of the wrist in two planes: rest under tensions and loads, stiffness and buckling."""

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.spatial.spatial_model import spatial_linearised, spatial_terms
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialSegments, spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

_STEPS = 100
# Largest change of a coordinate in one step of Newton's method [rad].
_STRIDE = 0.3


def spatial_stiffness(parameters: ArrayLike, q: ArrayLike, pulls: ArrayLike) -> Array:
    """Stiffness (2n, 2n) [N m/rad] at rest at coordinates (2n,), with gravity, load and held pulls (T,) [N]."""
    still = np.zeros(np.shape(q))
    return spatial_linearised(parameters, q, still, still, pulls)[1]


def least_spatial_stiffness(parameters: ArrayLike, n: int, pulls: ArrayLike) -> float:
    """Smallest eigenvalue of the straight wrist's stiffness under pulls (T,) [N], as a torque per tip bend [N m/rad].

    As in the plane it is that of n segments over n. Negative: the wrist buckles.
    """
    tangent = spatial_stiffness(parameters, np.zeros(2 * n), pulls)
    return float(np.linalg.eigvalsh(0.5 * (tangent + tangent.T))[0] / n)


def least_stiffness_at_pretension(wrist: WristParameters, n: int) -> float:
    """`least_spatial_stiffness` of a wrist of n segments whose tendons all pull at pretension [N m/rad]."""
    layout = TendonLayout.of(wrist)
    values = spatial_values(wrist, layout, n, axis=np.radians(wrist.stiffness_axis_deg))
    return least_spatial_stiffness(values, n, layout.multiplicity * wrist.pretension)


def spatial_equilibrium(parameters: ArrayLike, n: int, pulls: ArrayLike, guess: ArrayLike | None = None) -> Array:
    """Coordinates (2n,) [rad] at stable rest under pulls (T,) [N] and the load in the parameters.

    By Newton's method from a guess, the straight wrist where none is given. UserError where the wrist buckles, so that
    no stable rest is met.
    """
    q, still = np.zeros(2 * n) if guess is None else np.array(guess, float), np.zeros(2 * n)
    for _ in range(_STEPS):
        r, tangent, _ = spatial_linearised(parameters, q, still, still, pulls)
        change = np.linalg.solve(tangent, -r)
        q = q + change * min(1.0, _STRIDE / max(1e-300, float(np.abs(change).max())))
        if np.abs(change).max() < 1e-13:
            break
    least = np.linalg.eigvalsh(0.5 * (tangent + tangent.T))[0]
    if not np.isfinite(q).all() or least <= 0.0 or np.abs(r).max() > 1e-9:
        raise UserError(
            f"the wrist buckles: no stable equilibrium under pulls of {np.max(pulls):g} N at most",
            where="wrist",
            fix="lower wrist.hand_mass, hand_offset or the tensions, or raise wrist.stiffness",
        )
    return q


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
