"""Where the parts of a bent wrist lie in its bending plane (E1), as complex positions x + iy in m."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.kinematics import arc_tip

Planar = NDArray[np.complex128]
Backbone = Callable[[WristParameters, Array, Array], tuple[Planar, Planar]]
"""A plant's points and unit tangents, (m,) each, at its coordinates (q,) and the arc lengths (m,) [m]."""


def arcs_backbone(wrist: WristParameters, segment_theta: Array, at: Array) -> tuple[Planar, Planar]:
    """Points and unit tangents of a chain of equal arcs at the arc lengths `at` (m,) [m]; each (m,)."""
    each = wrist.length / len(segment_theta)
    along = np.clip(at[:, None] - each * np.arange(len(segment_theta)), 0.0, each)
    bent = segment_theta * along / each
    before = np.cumsum(segment_theta) - segment_theta
    arcs = arc_tip(bent, along)
    points = ((arcs[..., 0] + 1j * arcs[..., 1]) * np.exp(1j * before)).sum(axis=1)
    return points, np.exp(1j * bent.sum(axis=1))


def discs(line: Backbone, q: Array, wrist: WristParameters) -> tuple[Planar, Planar]:
    """Centres and unit normals (along the backbone) of a wrist's discs, the first at the base, the last at the tip."""
    return line(wrist, q, np.linspace(0.0, wrist.length, wrist.discs))


def offset_points(frames: tuple[Planar, Planar], offset: float) -> Planar:
    """Points of the discs at `offset` [m] from the backbone, toward +y on the straight wrist."""
    centres, normals = frames
    return centres + 1j * offset * normals
