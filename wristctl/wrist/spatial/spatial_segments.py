"""The n-segment wrist in two planes as the compiled model sees it: one row of lanes per parameter, then its tendons."""

import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.named_tuples import replacing, tuple_of
from wristctl.wrist.tendon_layout import TendonLayout


class SpatialSegments(NamedTuple):
    """Parameters of a wrist of n equal segments that bend in two planes; SI units, in this order in memory.

    Axes: x along the base's tangent, y toward ulnar, z toward flexion. Stiffness and damping of a segment are
    symmetric matrices over its bend (u_y, u_z).
    """

    length: Any
    mass: Any
    hand_mass: Any
    hand_offset: Any
    spans: Any
    stiffness_yy: Any
    stiffness_yz: Any
    stiffness_zz: Any
    damping_yy: Any
    damping_yz: Any
    damping_zz: Any
    gravity_x: Any
    gravity_y: Any
    gravity_z: Any
    force_x: Any
    force_y: Any
    force_z: Any


class SpatialWrist(NamedTuple):
    """A wrist in compiled code: its segments, and three rows for each tendon.

    These are its place (y, z) in the cross-section [m], and the number of segments, whole or not, that it runs along.
    """

    segment: Any
    tendons: Any


# Values of one tendon in memory, and where they begin.
OF_A_TENDON = 3
FIELDS = len(SpatialSegments._fields)

# Segments of lanes from rows of lanes, in compiled code.
load_spatial_segments = tuple_of(SpatialSegments)

# Segments with another force on the tip and other stiffnesses.
load_tip = replacing("force_x", "force_y", "force_z", "stiffness_yy", "stiffness_yz", "stiffness_zz")


def ellipse(along: float, across: float, axis: float) -> Array:
    """Symmetric matrix (3,), [yy, yz, zz], with the value `along` about bends toward `axis` [rad from y to z] and
    `across` about bends at a right angle to it."""
    c, s = math.cos(axis), math.sin(axis)
    return np.array([along * c * c + across * s * s, (along - across) * c * s, along * s * s + across * c * c])


def rows_of_tendons(cross_section: ArrayLike, segments_along: ArrayLike) -> Array:
    """Values (3 T,) of tendons at places (T, 2) [m] that run along so many segments (T,)."""
    places = np.asarray(cross_section, float).reshape(-1, 2)
    along = np.broadcast_to(np.asarray(segments_along, float), len(places))
    return np.column_stack([places, along]).ravel()


def spatial_values(
    wrist: WristParameters,
    layout: TendonLayout,
    n: int,
    force: tuple[float, float, float] = (0.0, 0.0, 0.0),
    axis: float = 0.0,
    damping_ratio: float = 1.0,
) -> Array:
    """Values of a wrist with tendons like these, cut into n equal segments: SpatialSegments, then its tendons.

    Springs are in series, so each segment has n times the stiffness and damping. A place of several tendons alike is
    one, pulled by their sum.

    Parameters
    ----------
    force
        External force on the last disc's centre in base axes [N].
    axis
        Direction [rad from ulnar toward flexion] of the bends that meet `wrist.stiffness` and `wrist.damping`; bends at
        a right angle to it meet these times `wrist.flexion_ratio` and `damping_ratio`.
    """
    stiffness = n * ellipse(wrist.stiffness, wrist.stiffness * wrist.flexion_ratio, axis)
    damping = n * ellipse(wrist.damping, wrist.damping * damping_ratio, axis)
    of_segments = [
        wrist.length / n, wrist.mass / n, wrist.hand_mass, wrist.hand_offset, (wrist.discs - 1) / n,
        *stiffness, *damping, *wrist.gravity, wrist.gravity_flexion, *force,
    ]  # fmt: skip
    return np.concatenate(
        [SpatialSegments(*of_segments), rows_of_tendons(layout.cross_section, n * layout.shares(wrist.discs))]
    )


def own_values(wrist: WristParameters, n: int, layout: TendonLayout | None = None) -> Array:
    """`spatial_values` of a wrist with springs along its own axis, and its own tendons or those of a layout."""
    tendons = TendonLayout.of(wrist) if layout is None else layout
    return spatial_values(wrist, tendons, n, axis=math.radians(wrist.stiffness_axis_deg))
