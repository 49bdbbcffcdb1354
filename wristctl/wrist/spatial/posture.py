"""Shape of a wrist whose segments bend by vectors u = (u_y, u_z), in the ground's axes.

A segment bends by the angle |u| about the axis e_x x u, without twist: its chord lies in the plane of the tangent t
before it and of nu = u_y n_y + u_z n_z in the frame (t, n_y, n_z) before it (`spatial_chain`; an arc's is
l (c_1 t + c_2 nu) with Stumpff's c_k(|u|^2)), and its frame turns by R = 1 + c_1 W + c_2 W^2, W = hat(0, -u_z, u_y).
Bends of segments do not add as vectors; the frames' product does.

Turning one coordinate moves all that lies beyond its segment by one screw: a point x moves by v + w x x. The angular
part w is the column of the rotation vector's left Jacobian c_1 + c_2 hat(rho) + c_3 rho rho^T, rho = u_y n_z - u_z n_y.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled, spelled_out
from wristctl.lanes.functions import atan2
from wristctl.lanes.lane import sqrt, where, zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.lanes.space import cross, first_half, space, spaces_like
from wristctl.wrist.spatial.spatial_chain import chord_of, chord_unit
from wristctl.wrist.spatial.stumpff import Stumpff, stumpff


class Posture(NamedTuple):
    """Rows of vectors: one for each segment, or, of the last six, one for each coordinate (two a segment)."""

    tangent: Any
    """Unit tangent before the segment."""
    bend: Any
    """nu = u_y n_y + u_z n_z."""
    chord: Any
    end: Any
    """Centre of the segment's last disc."""
    series: Any
    """Stumpff's functions of |u|^2: rows of lanes."""
    turned: Any
    """-u_z and u_y: lanes."""
    normal: Any
    """n_y and n_z before the segment."""
    axis: Any
    """Axes about which u_y and u_z bend a straight segment: n_z and -n_y."""
    chord_by: Any
    """Derivatives of the chord."""
    spin: Any
    """w: angular part of the screw by which all beyond the segment moves."""
    move: Any
    """v: the screw's velocity at the origin."""


@spelled_out
def posture_like(q: Any) -> Any:
    """Memory for the posture of a wrist with coordinates q (2n): u_y and u_z of each segment in turn.

    It is spelled out where it is called, and lives as long as its caller, as scratch rows do.
    """
    k = first_half(q)
    series = Stumpff(
        lanes_like(k), lanes_like(k), lanes_like(k), lanes_like(k), lanes_like(k), lanes_like(k), lanes_like(k),
        lanes_like(k), lanes_like(k),
    )  # fmt: skip
    return Posture(
        spaces_like(k), spaces_like(k), spaces_like(k), spaces_like(k), series,
        lanes_like(q), spaces_like(q), spaces_like(q), spaces_like(q), spaces_like(q), spaces_like(q),
    )  # fmt: skip


@compiled
def turn_pairs(pairs: Any, k: int, out: Any) -> None:
    """The segment's pair (y, z) turned by a right angle, (-z, y), into `out`."""
    out[2 * k] = -pairs[2 * k + 1]
    out[2 * k + 1] = pairs[2 * k]


@compiled
def series_of(posture: Any, k: int) -> Any:
    """Stumpff's functions of one segment."""
    c = posture.series
    return Stumpff(c.c0[k], c.c1[k], c.c2[k], c.c3[k], c.c4[k], c.c5[k], c.c6[k], c.c7[k], c.c8[k])


@compiled
def _keep(series: Any, k: int, c: Any) -> None:
    series.c0[k] = c.c0
    series.c1[k] = c.c1
    series.c2[k] = c.c2
    series.c3[k] = c.c3
    series.c4[k] = c.c4
    series.c5[k] = c.c5
    series.c6[k] = c.c6
    series.c7[k] = c.c7
    series.c8[k] = c.c8


@compiled
def bend_segments(segment: Any, q: Any, posture: Any) -> Any:
    """The posture at coordinates q; the last tangent, and the normals (n_y, n_z) there."""
    zero = zero_like(segment.length)
    tangent, end = space(1.0 + zero, zero, zero), space(zero, zero, zero)
    across_y, across_z = space(zero, 1.0 + zero, zero), space(zero, zero, 1.0 + zero)
    length = chord_unit(segment)
    for k in range(len(posture.chord)):
        y, z = 2 * k, 2 * k + 1
        bend_y, bend_z = q[y], q[z]
        c = stumpff(bend_y * bend_y + bend_z * bend_z)
        _keep(posture.series, k, c)
        part = chord_of(segment, c)
        nu = bend_y * across_y + bend_z * across_z
        chord = (length * part.along) * tangent + (length * part.lean) * nu
        end = end + chord
        posture.tangent[k] = tangent
        posture.bend[k] = nu
        posture.chord[k] = chord
        posture.end[k] = end
        posture.normal[y] = across_y
        posture.normal[z] = across_z
        posture.axis[y] = across_z
        posture.axis[z] = -1.0 * across_y
        stretched = (length * part.along_1) * tangent + (length * part.lean_1) * nu
        rotation = bend_y * across_z - bend_z * across_y
        turn_pairs(q, k, posture.turned)
        for i in range(2 * k, 2 * k + 2):
            chord_by = q[i] * stretched + (length * part.lean) * posture.normal[i]
            spin = (c.c2 * posture.turned[i]) * tangent + c.c1 * posture.axis[i] + (c.c3 * q[i]) * rotation
            posture.chord_by[i] = chord_by
            posture.spin[i] = spin
            posture.move[i] = chord_by - cross(spin, end)
        both = c.c1 * tangent + c.c2 * nu
        tangent = c.c0 * tangent + c.c1 * nu
        across_y = across_y - bend_y * both
        across_z = across_z - bend_z * both
    return tangent, across_y, across_z


# Square of the tangent's part across below which the bend's slope is that of the straight wrist.
_STRAIGHT = 1e-14


@compiled
def tip_bend(segment: Any, q: Any, rate: Any) -> Any:
    """Bend of the last disc's tangent from the base (y, z) [rad], its rates (y, z) [rad/s], and the disc's centre [m].

    The bend is the vector of the angle between the tangents, along the part of the last one across the base's. Of one
    segment it is u; of several it is not their sum.
    """
    zero = zero_like(segment.length)
    tangent, spin, end = space(1.0 + zero, zero, zero), space(zero, zero, zero), space(zero, zero, zero)
    across_y, across_z = space(zero, 1.0 + zero, zero), space(zero, zero, 1.0 + zero)
    for k in range(len(q) // 2):
        bend_y, bend_z, rate_y, rate_z = q[2 * k], q[2 * k + 1], rate[2 * k], rate[2 * k + 1]
        c = stumpff(bend_y * bend_y + bend_z * bend_z)
        nu = bend_y * across_y + bend_z * across_z
        twist = c.c2 * (bend_y * rate_z - bend_z * rate_y)
        along = c.c3 * (bend_y * rate_y + bend_z * rate_z)
        spin = spin + twist * tangent
        spin = spin + (c.c1 * rate_y + along * bend_y) * across_z
        spin = spin - (c.c1 * rate_z + along * bend_z) * across_y
        part = chord_of(segment, c)
        both = c.c1 * tangent + c.c2 * nu
        end = end + chord_unit(segment) * (part.along * tangent + part.lean * nu)
        tangent = c.c0 * tangent + c.c1 * nu
        across_y = across_y - bend_y * both
        across_z = across_z - bend_z * both
    moving = cross(spin, tangent)
    across = tangent.y * tangent.y + tangent.z * tangent.z
    straight = across < _STRAIGHT
    sine = sqrt(across)
    angle = atan2(sine, tangent.x)
    per_sine = where(straight, 1.0, angle / where(straight, 1.0, sine))
    slope = where(straight, -1.0 / 3.0, (tangent.x * per_sine - 1.0) / where(straight, 1.0, across))
    growing = slope * moving.x
    rate_y = per_sine * moving.y + growing * tangent.y
    rate_z = per_sine * moving.z + growing * tangent.z
    return per_sine * tangent.y, per_sine * tangent.z, rate_y, rate_z, end
