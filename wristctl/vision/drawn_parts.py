"""Outlines for pictures of the wrist: springs and a hand, as complex positions x + iy."""

from __future__ import annotations

from typing import Any

import numpy as np

from wristctl.wrist.shape import Planar

_FINGERTIPS = ((1.7, -0.35), (1.82, -0.12), (1.75, 0.12), (1.5, 0.35))


def coil(start: Any, end: Any, radius: float, turns: int = 4) -> Planar:
    """A spring from start to end (complex), seen from the side; of several, (k, 1), one in each row."""
    share = np.linspace(0.0, 1.0, 16 * turns + 1)
    across = 1j * (end - start) / abs(end - start)
    points: Planar = start + share * (end - start) + radius * np.sin(2.0 * np.pi * turns * share) * across
    return points


def capsule(start: complex, end: complex, radius: float) -> Planar:
    """Outline of everything within `radius` of the line from start to end."""
    half = radius * np.exp(1j * np.linspace(-0.5 * np.pi, 0.5 * np.pi, 16))
    along = (end - start) / abs(end - start)
    return np.concatenate([end + along * half, start - along * half])


def hand(size: float, edge_on: bool) -> list[Planar]:
    """Outlines of a hand's parts beyond a disc at 0 facing +x; it is about twice `size` [m] long.

    Seen on the palm with the little finger toward +y, or `edge_on` with the palm toward +y.
    """
    if edge_on:
        parts = [((0.15, 0.0), (0.95, 0.0), 0.15), ((1.0, 0.0), (1.85, 0.12), 0.1), ((0.45, 0.12), (0.95, 0.38), 0.09)]
    else:
        fingers = [((0.9, 0.85 * end), (tip, end), 0.09) for tip, end in _FINGERTIPS]
        parts = [((0.36, 0.0), (0.72, 0.0), 0.36), *fingers, ((0.45, -0.28), (0.95, -0.68), 0.1)]
    return [size * capsule(complex(*start), complex(*end), radius) for start, end, radius in parts]
