"""A square marker's outline to a small part of a pixel: a line through each of its sides, corners where lines meet.

Refining corners one by one (`cv2.cornerSubPix`) looks through windows that do not turn with the marker, and is off by
up to 0.1 deg of the marker's angle, as sin(4 angle). A side has a hundred times a corner's pixels and no such window.
"""

from __future__ import annotations

from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array

_ROUNDS = 2
"""Each looks along the lines of the one before; a rough corner may be off by 2 px."""
_FINE, _PLACES = 0.5, 32
"""Distance of samples across a side [px]; places along a side at which it is looked for, at most."""


def outlined(image: NDArray[Any], corners: Array, cells: int) -> Array:
    """Corners (4, 2) [px], clockwise, of a black square of `cells` cells a side, found from rough ones.

    White is expected beyond the square, and looked for up to half a cell to either side of its rough outline; half a
    cell at either end of a side is left out, since corners are rounded by blur.
    """
    at = corners[:, 0] + 1j * corners[:, 1]
    for _ in range(_ROUNDS):
        at = _meeting(*_lines(image, at, 0.5 / cells))
    return np.stack([at.real, at.imag], axis=1)


def _lines(image: NDArray[Any], at: NDArray[np.complex128], margin: float) -> tuple[Any, Any]:
    """A point on, and the direction of, each side (4,) of the square of corners `at`.

    Across each of many places along a side, the edge is the centre of the rise to white, wherever it lies between
    pixels; a place counts by how much rise there is.
    """
    side = np.roll(at, -1) - at
    length = float(np.abs(side).mean())
    out, reach = -1j * side / np.abs(side), margin * length
    along = np.linspace(margin, 1.0 - margin, min(_PLACES, max(8, round(length))))
    across = np.linspace(-reach, reach, int(np.ceil(2.0 * reach / _FINE)) + 1)
    places = (at[:, None] + side[:, None] * along)[..., None] + across * out[:, None, None]
    flat = places.reshape(-1, len(across)).astype(np.complex64)
    grey = cv2.remap(image, flat.real, flat.imag, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    rise = np.diff(grey.reshape(places.shape).astype(float), axis=2).clip(0.0)
    weight = rise.sum(axis=2) + 1e-9
    edge = rise @ (0.5 * (across[1:] + across[:-1])) / weight
    middle, off = (np.average(np.broadcast_to(each, edge.shape), 1, weight)[:, None] for each in (along, edge))
    from_middle = along - middle
    slope = (weight * from_middle * (edge - off)).sum(axis=1) / (weight * from_middle**2).sum(axis=1)
    return at + side * middle[:, 0] + out * off[:, 0], side + out * slope


def _meeting(point: NDArray[np.complex128], along: NDArray[np.complex128]) -> NDArray[np.complex128]:
    """Where each line meets the one before."""
    before, ahead = np.roll(point, 1), np.roll(along, 1)
    share = ((point - before).conj() * along).imag / (ahead.conj() * along).imag
    met: NDArray[np.complex128] = before + share * ahead
    return met
