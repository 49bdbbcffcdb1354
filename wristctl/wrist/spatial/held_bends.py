"""Which bends in two planes tendons within their limits hold at rest, of the wrist as one segment."""

import math

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.allocation import allocated
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import ellipse, own_values
from wristctl.wrist.tendon_layout import TendonLayout


def reach_of_bends(wrist: WristParameters, layout: TendonLayout, directions: int = 72) -> Array:
    """The largest bend (directions + 1, 2) [rad] that tendons within their limits hold at rest, all around.

    Of the wrist as one segment, to half a degree, up to its range; the last direction is the first again.
    """
    around = np.linspace(0.0, 2.0 * np.pi, directions + 1)
    sizes = np.deg2rad(np.arange(0.0, wrist.range_deg + 0.25, 0.5))
    bends = sizes[:, None, None] * np.stack([np.cos(around), np.sin(around)], axis=-1)
    held = _holds(wrist, layout, bends.reshape(-1, 2)).reshape(len(sizes), -1)
    last = np.cumprod(held, axis=0).sum(axis=0) - 1
    reach: Array = bends[last.clip(0), np.arange(directions + 1)]
    return reach


def held_all_around(wrist: WristParameters, layout: TendonLayout, force: float, largest_deg: float) -> float:
    """The whole angle [deg], at most `largest_deg`, to which tendons within their limits hold the wrist at rest.

    Toward every side, and against a force [N] on the last disc of an unbent wrist from any side.
    """
    around = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)
    sides = np.stack([np.cos(around), np.sin(around)], axis=-1)
    sizes = np.arange(0.0, math.floor(largest_deg) + 1.0)
    bends = (np.deg2rad(sizes)[:, None, None] * sides).reshape(-1, 2)
    forces = force * wrist.length * sides[::3] if force else np.zeros((1, 2))
    held = np.logical_and.reduce([_holds(wrist, layout, bends, torque) for torque in forces])
    whole = held.reshape(len(sizes), -1).all(axis=1)
    return float(np.cumprod(whole).sum() - 1)


def _holds(wrist: WristParameters, layout: TendonLayout, bends: Array, load: Array | float = 0.0) -> NDArray[np.bool_]:
    """Whether tendons within their limits hold bends (P, 2) [rad] at rest, against a torque (2,) [N m], (P,)."""
    values = own_values(wrist, 1, layout)
    at_rest = spatial_terms(values, bends, 0.0 * bends)
    yy, yz, zz = ellipse(wrist.stiffness, wrist.stiffness * wrist.flexion_ratio, np.radians(wrist.stiffness_axis_deg))
    torque = load + at_rest.bias + bends @ np.array([[yy, yz], [yz, zz]])
    limits = wrist.pretension * layout.multiplicity, wrist.tension_limit * layout.multiplicity
    arms = at_rest.moment_arms.reshape(-1, len(layout.places), 2)
    saturated: NDArray[np.bool_] = allocated(arms, torque, *limits).saturated
    return ~saturated


def share_held(wrist: WristParameters, layout: TendonLayout, bends: Array) -> float:
    """The share of bends (T, 2) [rad] to which tendons within their limits hold them at rest: 1 where they hold all.

    Smaller motions of the same shape are held; nan where not even the straight wrist is.
    """
    few = bends[np.linspace(0, len(bends) - 1, min(len(bends), 400)).astype(np.int64)]

    def held(share: float) -> bool:
        return bool(_holds(wrist, layout, share * few).all())

    if held(1.0):
        return 1.0
    shares = np.linspace(0.0, 1.0, 17)
    beyond = next(k for k, share in enumerate(shares) if not held(share))
    if beyond == 0:
        return math.nan
    low, high = shares[beyond - 1], shares[beyond]
    for _ in range(8):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if held(middle) else (low, middle)
    return float(low)
