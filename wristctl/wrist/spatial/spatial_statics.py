"""Statics of the wrist in two planes: rest under tensions and loads or on held spools, stiffness and buckling."""

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.allocation import allocated
from wristctl.wrist.spatial.spatial_model import spatial_linearised, spatial_terms
from wristctl.wrist.spatial.spatial_segments import own_values
from wristctl.wrist.statics import HeldTendons, at_rest_where, settled
from wristctl.wrist.tendon_layout import TendonLayout

_STEPS = 100
# Largest change of a coordinate in one step of Newton's method [rad].
_STRIDE = 0.3
# Residual [N m, rad] of a rest.
_AT_REST = 1e-9
# Share of a tendon's largest moment arm below which it does not move along a motion.
_STILL = 1e-6
# Step of difference quotients [N m, rad]: pulls are piecewise linear in a torque.
_SMALL = 1e-6


class SpatialEquilibria(NamedTuple):
    """Wrists at rest with wanted bends."""

    q: Array
    """(B, 2n) coordinates [rad]"""
    pulls: Array
    """(B, T) of all tendons alike at each place [N]"""
    found: NDArray[np.bool_]
    """(B,) whether there is such a rest"""
    stable: NDArray[np.bool_]
    """(B,) whether the wrist stays there under held pulls"""


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
    values = own_values(wrist, n)
    return least_spatial_stiffness(values, n, layout.multiplicity * wrist.pretension)


def spatial_equilibrium(parameters: ArrayLike, n: int, pulls: ArrayLike, guess: ArrayLike | None = None) -> Array:
    """Coordinates (2n,) [rad] at stable rest under pulls (T,) [N] and the load in the parameters.

    By Newton's method from a guess, the straight wrist where none is given. UserError where the wrist buckles, so that
    no stable rest is met.
    """
    begin, still = np.zeros(2 * n) if guess is None else np.array(guess, float), np.zeros(2 * n)

    def balance(q: Array) -> tuple[Array, Array]:
        return spatial_linearised(parameters, q, still, still, pulls)[:2]

    return settled(balance, begin, f"pulls of {np.max(pulls):g} N at most")


def spatial_equilibria_at(parameters: Array, n: int, bends: Array, arms: Array, least: Array) -> SpatialEquilibria:
    """Equilibria with the last disc at bends (B, 2) [rad], held by the pulls with the least sum.

    Newton's method on the coordinates and the torque that the pulls have on the straight wrist, for all wrists at once;
    the wanted bend as a side condition keeps it regular where a load buckles.

    Parameters
    ----------
    parameters
        Rows of `spatial_values` (B, V).
    arms
        Moment arms (T, 2), or (B, T, 2) of each bend [m], by which pulls are shared out.
    least
        Least pull of each place of tendons (T,) [N].
    """
    count, m = len(bends), 2 * n
    q, torque, still = np.tile(bends / n, n), np.zeros((count, 2)), np.zeros((count, m))
    bordered = np.zeros((count, m + 2, m + 2))
    for _ in range(_STEPS):
        pulls = allocated(arms, torque, least, np.inf).pulls
        r, tangent, _ = spatial_linearised(parameters, q, still, still, pulls)
        at = spatial_terms(parameters, q, still)
        for plane in range(2):
            more = allocated(arms, torque + _SMALL * np.eye(2)[plane], least, np.inf).pulls
            bordered[:, :m, m + plane] = -np.einsum("bt,bti->bi", (more - pulls) / _SMALL, at.moment_arms)
        for i in range(m):
            bordered[:, m:, i] = spatial_terms(parameters, q, still + np.eye(m)[i]).bend[:, 2:]
        bordered[:, :m, :m] = tangent
        residual = np.concatenate([r, at.bend[:, :2] - bends], axis=1)
        change = np.linalg.solve(bordered, -residual[..., None])[..., 0]
        largest = np.abs(change[:, :m]).max(axis=1, keepdims=True)
        change = change * np.minimum(1.0, _STRIDE / np.maximum(largest, 1e-300))
        q, torque = q + change[:, :m], torque + change[:, m:]
        if np.abs(change).max() < 1e-12:
            break
    pulls = allocated(arms, torque, least, np.inf).pulls
    r, tangent, _ = spatial_linearised(parameters, q, still, still, pulls)
    off = np.abs(spatial_terms(parameters, q, still).bend[:, :2] - bends).max(axis=1)
    smallest = np.linalg.eigvalsh(0.5 * (tangent + tangent.transpose(0, 2, 1)))[:, 0]
    found = (np.abs(r).max(axis=1) < _AT_REST) & (off < _AT_REST)
    return SpatialEquilibria(q, pulls, found, found & (smallest > 0.0))


def at_rest_along(wrist: WristParameters, n: int, held: HeldTendons, motion: Array, guess: Array) -> Array:
    """Coordinates (B, 2n) [rad] at rest on held tendons whose bristles a motion (B, 2n) there has bent fully.

    By Newton's method from a guess (B, 2n). Raises UserError where there is no such rest.
    """
    values, layout = own_values(wrist, n), TendonLayout.of(wrist)
    spanned = np.clip(n * layout.shares(wrist.discs)[:, None] - np.arange(n), 0.0, 1.0)
    straight, still = layout.shares(wrist.discs) * wrist.length, 0.0 * guess
    travel = np.einsum("btq,bq->bt", spatial_terms(values, guess, still).moment_arms, motion)
    z = np.sign(np.where(np.abs(travel) > _STILL * np.abs(travel).max(axis=1, keepdims=True), travel, 0.0))

    def residual(q: Array) -> Array:
        wrapped = np.hypot(q[:, ::2], q[:, 1::2]) @ spanned.T
        pulls = held.pulls(straight - spatial_terms(values, q, still).lengths, wrapped, z)
        return spatial_linearised(values, q, still, still, pulls)[0]

    return at_rest_where(residual, guess)
