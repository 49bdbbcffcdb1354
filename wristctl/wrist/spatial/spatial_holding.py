"""Wrists in two planes at rest: the pulls that hold a bend, and where tendons with friction on held spools leave it."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.allocation import allocated
from wristctl.wrist.spatial.spatial_kinematics import tip_bends
from wristctl.wrist.spatial.spatial_model import spatial_linearised, spatial_terms
from wristctl.wrist.spatial.spatial_segments import spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

# Step of difference quotients, largest step of Newton's method, and change that ends it.
_SMALL, _STRIDE, _EXACT = 1e-6, 0.3, 1e-12
# Residual [N m, rad] of a rest.
_AT_REST = 1e-9
# Pull [N] that is no limit.
_NO_LIMIT = 1e6
# Share of a tendon's largest moment arm below which it does not move along a motion.
_STILL = 1e-6


class HeldBends(NamedTuple):
    """Wrists at rest with wanted tip bends, (B, ...)."""

    q: Array
    """Coordinates (B, 2n) [rad]."""
    pulls: Array
    """Pulls (B, T) of all tendons of each place with the least sum [N]."""
    stable: NDArray[np.bool_]
    """Whether each stays there under held pulls (B,)."""


def values_of(wrist: WristParameters, n: int) -> Array:
    """The parameters' values of a wrist with its own tendons, cut into n equal segments."""
    return spatial_values(wrist, TendonLayout.of(wrist), n, axis=np.radians(wrist.stiffness_axis_deg))


def held_at(wrist: WristParameters, n: int, bends: Array, least: Array) -> HeldBends:
    """Wrists of n segments at rest with their tips bent like this (B, 2) [rad], no pull (T,) [N] below the least.

    Raises UserError where there is no such rest.
    """
    values = values_of(wrist, n)
    one = values_of(wrist, 1)
    arms = spatial_terms(one, bends, 0.0 * bends).moment_arms.reshape(len(bends), len(least), 2)

    def pulls_for(torque: Array) -> Array:
        return allocated(arms, torque, least, _NO_LIMIT).pulls

    def residual(x: Array) -> Array:
        q, torque = x[:, : 2 * n], x[:, 2 * n :]
        r = spatial_linearised(values, q, 0.0 * q, 0.0 * q, pulls_for(torque))[0]
        return np.concatenate([r, tip_bends(q) - bends], axis=1)

    x = _newton(residual, np.concatenate([np.tile(bends / n, n), wrist.stiffness * bends], axis=1))
    q, pulls = x[:, : 2 * n], pulls_for(x[:, 2 * n :])
    tangent = spatial_linearised(values, q, 0.0 * q, 0.0 * q, pulls)[1]
    softest = np.linalg.eigvalsh(0.5 * (tangent + tangent.transpose(0, 2, 1)))[:, 0]
    return HeldBends(q, pulls, softest > 0.0)


class FrictionOnHeld(NamedTuple):
    """Tendons of B wrists on what holds them, as `wristctl.wrist.statics.HeldTendons` in one plane.

    `given` (B, T) is what each place has reeled in [m], or its pull at the spool [N]; `stiffness` (T,) that of all
    tendons of a place [N/m], or None where pulls are held; friction and sheath [rad] are (B,).
    """

    given: Array
    stiffness: Array | None
    friction: Array
    sheath: Array


def at_rest_along(wrist: WristParameters, n: int, held: FrictionOnHeld, motion: Array, guess: Array) -> Array:
    """Coordinates (B, 2n) [rad] at rest on held tendons whose bristles a motion (B, 2n) there has bent fully.

    By Newton's method from a guess (B, 2n). Raises UserError where there is no such rest.
    """
    values, layout = values_of(wrist, n), TendonLayout.of(wrist)
    spanned = np.clip(n * layout.shares(wrist.discs)[:, None] - np.arange(n), 0.0, 1.0)
    straight = layout.shares(wrist.discs) * wrist.length
    travel = np.einsum("btq,bq->bt", spatial_terms(values, guess, 0.0 * guess).moment_arms, motion)
    z = np.sign(np.where(np.abs(travel) > _STILL * np.abs(travel).max(axis=1, keepdims=True), travel, 0.0))

    def residual(q: Array) -> Array:
        stretch = held.given - (straight - spatial_terms(values, q, 0.0 * q).lengths)
        at_spool = held.given if held.stiffness is None else held.stiffness * stretch.clip(0.0)
        wrapped = np.hypot(q[:, ::2], q[:, 1::2]) @ spanned.T
        left = np.exp(-held.friction[:, None] * (held.sheath[:, None] + wrapped) * z)
        r: Array = spatial_linearised(values, q, 0.0 * q, 0.0 * q, at_spool * left)[0]
        return r

    return _newton(residual, guess)


def _newton(residual: Callable[[Array], Array], guess: Array) -> Array:
    """Zeros (B, m) of functions of B points at once, from a guess (B, m)."""
    x, steps = np.array(guess, float), _SMALL * np.eye(guess.shape[1])
    for _ in range(100):
        r = residual(x)
        columns = [(residual(x + step) - residual(x - step)) / (2.0 * _SMALL) for step in steps]
        change = np.linalg.solve(np.stack(columns, axis=2), -r[..., None])[..., 0]
        largest = np.abs(change).max(axis=1, initial=1e-300)
        x = x + change * np.minimum(1.0, _STRIDE / largest)[:, None]
        if largest.max() < _EXACT:
            break
    if not np.abs(residual(x)).max() < _AT_REST:
        fix = "less friction, sheath or bend, or more pull"
        raise UserError("no rest was found on held tendons in two planes", "wrist", fix)
    return x
