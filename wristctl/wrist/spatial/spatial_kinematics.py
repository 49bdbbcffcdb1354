"""Where a wrist that bends in two planes is, along its backbone; NumPy, any batch shape."""

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array


def spatial_tips(q: ArrayLike, length: ArrayLike) -> Array:
    """Tips (..., 3) [m] of wrists at coordinates (..., 2n) [rad].

    `length` is that of the whole wrist, whose segments are equal, or of each segment (n,) [m].
    """
    return spatial_backbone(q, length, 1)[..., -1, :]


def spatial_backbone(q: ArrayLike, length: ArrayLike, points: int) -> Array:
    """Points (..., n points + 1, 3) [m] along the backbone from the base, so many to a segment; length as for tips.

    A segment bent by u ends at l S(|u|) along its chord, which leans by u/2; S(x) = sin(x)/x.
    """
    bends = np.asarray(q, float)
    bends = bends.reshape(*bends.shape[:-1], -1, 2)
    n = bends.shape[-2]
    lengths = np.broadcast_to(np.asarray(length, float) / (1 if np.ndim(length) else n), n)
    place = np.zeros((*bends.shape[:-2], 3))
    frame = np.broadcast_to(np.eye(3), (*bends.shape[:-2], 3, 3))
    line = [place]
    for k in range(n):
        for i in range(1, points + 1):
            u = bends[..., k, :] * (i / points)
            size = np.hypot(u[..., 0], u[..., 1])
            chord = lengths[k] * (i / points) * np.sinc(0.5 * size / np.pi)
            across = 0.5 * np.sinc(0.5 * size / np.pi)[..., None] * u
            along = np.concatenate([np.cos(0.5 * size)[..., None], across], axis=-1)
            line.append(place + np.einsum("...ij,...j->...i", frame, chord[..., None] * along))
        place = line[-1]
        frame = frame @ turned_by(bends[..., k, :])
    return np.stack(line, axis=-2)


def turned_by(u: Array) -> Array:
    """Rotations (..., 3, 3) of bends (..., 2)."""
    size = np.hypot(u[..., 0], u[..., 1])
    sinc, half = np.sinc(size / np.pi), np.sinc(0.5 * size / np.pi)
    w = np.zeros((*u.shape[:-1], 3, 3))
    w[..., 0, 1], w[..., 0, 2] = -u[..., 0], -u[..., 1]
    w[..., 1, 0], w[..., 2, 0] = u[..., 0], u[..., 1]
    turned: Array = np.eye(3) + sinc[..., None, None] * w + (0.5 * half**2)[..., None, None] * (w @ w)
    return turned
