"""Small bends of a slack wrist by one tendon alone: what homing measures of springs and tendons together."""

import math

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.directions import ACTIVE, in_plane
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.spatial.spatial_segments import ellipse
from wristctl.wrist.tendon_layout import TendonLayout

# Names of the planes of both bends, in their order.
_PLANES = ("ulnar", "flexion")


def bends_alone(wrist: WristParameters, places: Array) -> tuple[Array, Array, Array]:
    """A small bend of a slack wrist by one tendon alone, of each at its place c (T, 2) [m].

    It bends the wrist by K^-1 c T for a pull T, which takes c.K^-1 c T off its path. Returns where to, unit vectors
    (T, 2); what a radian takes off the path (T,) [m/rad]; and the bend by a newton (T,) [rad/N].
    """
    along, across = wrist.stiffness, wrist.stiffness * wrist.flexion_ratio
    yy, yz, zz = ellipse(along, across, math.radians(wrist.stiffness_axis_deg))
    sinking = [across_of(in_plane(wrist, plane), (0,) * len(ACTIVE)).stiffness for plane in _PLANES]
    springs = np.array([[yy, yz], [yz, zz]])
    springs[np.diag_indices(2)] += np.array(sinking) - [in_plane(wrist, plane).stiffness for plane in _PLANES]
    bends = np.linalg.solve(springs, places.T).T
    sizes = np.hypot(*bends.T)
    toward = bends / sizes[:, None]
    return toward, (places * toward).sum(axis=1), sizes


def length_per_radian(wrist: WristParameters) -> tuple[float, float]:
    """Length of a rigid tendon that a radian of a small bend takes [m/rad], and the pull that it takes [N/rad].

    Means over the tendons off the axis, each alone on the slack wrist; the pull of one that buckles is negative.
    """
    places = TendonLayout.of(wrist).cross_section
    _, path, sizes = bends_alone(wrist, places[np.hypot(*places.T) > 0.0])
    return float(np.abs(path).mean()), float((np.sign(path) / sizes).mean())


def stiffness_by_length(believed: float, pull: float, stretch: float) -> float:
    """Stiffness [N/m] of a tendon that a pull [N] stretches by so much [m], between 0.8 and twice the believed one.

    A controller's gain goes with it, and of a soft wrist stretch is a small part of the path that is measured.
    """
    return min(2.0 * believed, max(0.8 * believed, pull / stretch)) if stretch > 0.0 else 2.0 * believed
