"""Where a wrist that bends in two planes is, along its backbone, and which arc ends at a tip; NumPy."""

import math

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.wrist.kinematics import TipPath, exact_arc


def spatial_tips(q: ArrayLike, length: ArrayLike) -> Array:
    """Tips (..., 3) [m] of wrists at coordinates (..., 2n) [rad].

    `length` is that of the whole wrist, whose segments are equal, or of each segment (n,) [m].
    """
    return spatial_backbone(q, length, 1)[..., -1, :]


def spatial_backbone(q: ArrayLike, length: ArrayLike, points: int) -> Array:
    """Points (..., n points + 1, 3) [m] along the backbone from the base, so many to a segment; length as for tips."""
    bends = np.asarray(q, float)
    bends = bends.reshape(*bends.shape[:-1], -1, 2)
    n = bends.shape[-2]
    lengths = np.broadcast_to(np.asarray(length, float) / (1 if np.ndim(length) else n), n)
    place = np.zeros((*bends.shape[:-2], 3))
    frame = np.broadcast_to(np.eye(3), (*bends.shape[:-2], 3, 3))
    line = [place]
    for k in range(n):
        for i in range(1, points + 1):
            chord = _chord(bends[..., k, :] * (i / points), lengths[k] * (i / points))
            line.append(place + np.einsum("...ij,...j->...i", frame, chord))
        place = line[-1]
        frame = frame @ turned_by(bends[..., k, :])
    return np.stack(line, axis=-2)


def spatial_frames(q: ArrayLike, length: float, shares: ArrayLike) -> tuple[Array, Array]:
    """Centres (m, 3) [m] and frames (m, 3, 3) of cross-sections of a wrist of equal segments.

    Parameters
    ----------
    q
        Coordinates (2n,) [rad].
    length
        Length of the whole wrist [m].
    shares
        Where the cross-sections are (m,), from 0 at the base to 1 at the tip.

    Columns of a frame: along the backbone, and what points toward ulnar and toward flexion on the straight wrist.
    """
    bends, at = np.asarray(q, float).reshape(-1, 2), np.asarray(shares, float)
    n = len(bends)
    places, frames = np.zeros((n, 3)), np.broadcast_to(np.eye(3), (n, 3, 3)).copy()
    for k in range(1, n):
        places[k] = places[k - 1] + frames[k - 1] @ _chord(bends[k - 1], length / n)
        frames[k] = frames[k - 1] @ turned_by(bends[k - 1])
    segment = np.clip((at * n).astype(np.int64), 0, n - 1)
    along: Array = at * n - segment
    bent: Array = bends[segment] * along[:, None]
    centres = places[segment] + np.einsum("mij,mj->mi", frames[segment], _chord(bent, length / n * along))
    return centres, frames[segment] @ turned_by(bent)


def _chord(u: Array, length: ArrayLike) -> Array:
    """From the beginning of an arc to its end (..., 3) [m]: l S(|u|/2) long, S(x) = sin(x)/x, and leaning by u/2."""
    half = 0.5 * np.hypot(u[..., 0], u[..., 1])
    sinc = np.sinc(half / np.pi)
    along = np.concatenate([np.cos(half)[..., None], (0.5 * sinc)[..., None] * u], axis=-1)
    chord: Array = (np.asarray(length) * sinc)[..., None] * along
    return chord


def turned_by(u: Array) -> Array:
    """Rotations (..., 3, 3) of bends (..., 2)."""
    size = np.hypot(u[..., 0], u[..., 1])
    sinc, half = np.sinc(size / np.pi), np.sinc(0.5 * size / np.pi)
    w = np.zeros((*u.shape[:-1], 3, 3))
    w[..., 0, 1], w[..., 0, 2] = -u[..., 0], -u[..., 1]
    w[..., 1, 0], w[..., 2, 0] = u[..., 0], u[..., 1]
    turned: Array = np.eye(3) + sinc[..., None, None] * w + (0.5 * half**2)[..., None, None] * (w @ w)
    return turned


def tip_bends(q: ArrayLike) -> Array:
    """Bends (..., 2) [rad] of the last disc's tangent from the base's, at coordinates (..., 2n) [rad]."""
    bends = np.asarray(q, float)
    bends = bends.reshape(*bends.shape[:-1], -1, 2)
    tangent = np.broadcast_to(np.array([1.0, 0.0, 0.0]), (*bends.shape[:-2], 3))
    for k in reversed(range(bends.shape[-2])):
        tangent = np.einsum("...ij,...j->...i", turned_by(bends[..., k, :]), tangent)
    size = np.arctan2(np.hypot(tangent[..., 1], tangent[..., 2]), tangent[..., 0])
    bend: Array = tangent[..., 1:] / np.sinc(size / np.pi)[..., None]
    return bend


# Terms of Stumpff's functions: rounding for bends up to a full turn.
_TERMS = 30


def _stumpff(s: Array, k: int) -> Array:
    """Stumpff's function c_k(s), the sum of (-s)^j/(2j + k)!, of s = |u|^2."""
    total = np.zeros_like(s)
    for j in reversed(range(_TERMS)):
        total = 1.0 / math.factorial(2 * j + k) - s * total
    return total


def tips_along(bends: Array, length: float) -> TipPath:
    """Tips of an arc of this length [m] whose bend moves: bend, rate and acceleration (2, 3, T) [rad].

    The tip is l (c_1, c_2 u) of Stumpff's functions c_k of s = |u|^2, whose derivative is (k c_{k+2} - c_{k+1})/2.
    """
    u, du, ddu = bends.transpose(1, 2, 0)
    s, ds = (u * u).sum(axis=1), 2.0 * (u * du).sum(axis=1)
    dds = 2.0 * (du * du + u * ddu).sum(axis=1)
    c = [_stumpff(s, k) for k in range(7)]

    def moved(k: int) -> list[Array]:
        """c_k with two derivatives by time, (T, 1) each."""
        first, next_1, next_2 = (0.5 * (j * c[j + 2] - c[j + 1]) for j in (k, k + 1, k + 2))
        second = 0.5 * (k * next_2 - next_1)
        return [c[k][:, None], (first * ds)[:, None], (second * ds * ds + first * dds)[:, None]]

    (along, rate, acceleration), (lean, lean_rate, lean_acceleration) = moved(1), moved(2)
    return TipPath(
        length * np.hstack([along, lean * u]),
        length * np.hstack([rate, lean_rate * u + lean * du]),
        length * np.hstack([acceleration, lean_acceleration * u + 2.0 * lean_rate * du + lean * ddu]),
    )


def exact_bend(tip: Array) -> tuple[Array, Array]:
    """Bend (..., 2) [rad] and length (...) [m] of the one arc from the base to each tip (..., 3) [m].

    It is `exact_arc` in the plane of the tip and the base's tangent.
    """
    across = np.hypot(tip[..., 1], tip[..., 2])
    angle, length = exact_arc(np.stack([tip[..., 0], across], axis=-1))
    toward = np.arctan2(tip[..., 2], tip[..., 1])
    return angle[..., None] * np.stack([np.cos(toward), np.sin(toward)], axis=-1), length
