"""Constant-curvature arcs (E1) as chord vectors with their derivatives, written for lanes."""

import math
from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import bessel
from wristctl.lanes.lane import planar, zero_like

# Largest bending angle of one segment [rad]: beyond a full turn the arc closes on itself and the series end.
ARC_LIMIT = 2.0 * math.pi


class Chords(NamedTuple):
    """Rows of planar vectors: each segment's chord in base axes, and its first three derivatives by its own angle."""

    z: Any
    dz: Any
    d2z: Any
    d3z: Any


@compiled
def chords(theta: Any, length: Any, arc: Any) -> Any:
    """Chord z_k of each segment in base axes and its first three derivatives by theta_k, into Chords; exp(i Phi_n).

    z_k = exp(i Phi_{k-1}) c(theta_k) exp(i theta_k / 2) with the chord's length c = l sin(x)/x, x = theta_k / 2 (E2).
    """
    tangent = planar(1.0 + zero_like(length), 0.0)
    for k in range(len(theta)):
        x = 0.5 * theta[k]
        e0, e1, e2, e3 = bessel(x)
        s = x * x
        half_turn = planar(e0 - s * e1, x * e0)
        direction = tangent * half_turn
        c = length * e0
        c1 = -0.5 * length * x * e1
        c2 = 0.25 * length * (s * e2 - e1)
        c3 = 0.125 * length * x * (3.0 * e2 - s * e3)
        arc.z[k] = c * direction
        arc.dz[k] = planar(c1, 0.5 * c) * direction
        arc.d2z[k] = planar(c2 - 0.25 * c, c1) * direction
        arc.d3z[k] = planar(c3 - 0.75 * c1, 1.5 * c2 - 0.125 * c) * direction
        tangent = direction * half_turn
    return tangent


@compiled
def tip(theta: Any, length: Any) -> Any:
    """Centre of the last disc, as a planar vector from the base, and the last tangent exp(i Phi_n) (E1)."""
    position = planar(zero_like(length), 0.0)
    tangent = planar(1.0 + zero_like(length), 0.0)
    for k in range(len(theta)):
        x = 0.5 * theta[k]
        e0, e1, _, _ = bessel(x)
        half_turn = planar(e0 - x * x * e1, x * e0)
        direction = tangent * half_turn
        position = position + length * e0 * direction
        tangent = direction * half_turn
    return position, tangent
