"""Tendons at any places c = (c_y, c_z) of the cross-section, straight between neighbouring discs.

A segment's g spans each bend by u/g over l/g: along it a tendon is (l - c.u) S(|u|/2g) long, S(x) = sin(x)/x, and its
moment arm is minus the derivative of that by u. A tendon that ends at an inner disc runs along a part of the segments,
of the last one perhaps along some of its spans only. So it is of arcs; other parts have functions of their own.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements, spelled_out
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like
from wristctl.lanes.space import first_half
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON, SpatialWrist
from wristctl.wrist.spatial.stumpff import stumpff


class TendonTorques(NamedTuple):
    """Rows: torque on each coordinate, its derivative by that one, and by the segment's other one (a row a segment)."""

    torque: Any
    slope: Any
    slope_across: Any


@spelled_out
def torques_like(q: Any) -> Any:
    """Memory for TendonTorques on coordinates q."""
    return TendonTorques(lanes_like(q), lanes_like(q), lanes_like(first_half(q)))


@compiled
def place_y(tendons: Any, t: int) -> Any:
    """c_y of a tendon [m]."""
    return tendons[OF_A_TENDON * t]


@compiled
def place_z(tendons: Any, t: int) -> Any:
    """c_z of a tendon [m]."""
    return tendons[OF_A_TENDON * t + 1]


@compiled
def share_of(tendons: Any, t: int, k: int) -> Any:
    """Share of the segment k that a tendon runs along, 0 to 1."""
    return clip(tendons[OF_A_TENDON * t + 2] - k, 0.0, 1.0)


@by_type
def lengths_along(wrist: Any, q: Any, lengths: Any) -> None:
    """Length of each tendon from the base to where it ends [m]; T rows."""


@by_type
def moment_arms_of(wrist: Any, q: Any, t: int, arms: Any) -> None:
    """Moment arms of a tendon, minus the derivatives of its length by each coordinate [m]; 2n rows."""


@by_type
def tendons_torques(wrist: Any, q: Any, pulls: Any, torques: Any) -> None:
    """Torque of the tendons' pulls [N] (T rows) on each coordinate with its derivatives, into TendonTorques."""


@compiled
def _spans(segment: Any, y: Any, z: Any) -> Any:
    """S at half a span's bend; minus its derivative by u_a over u_a, and minus that one's again."""
    per_span = 0.25 / (segment.spans * segment.spans)
    c = stumpff(per_span * (y * y + z * z))
    return c.c1, per_span * (c.c2 - c.c3), per_span * per_span * (c.c3 - 3.0 * c.c4 + 3.0 * c.c5)


@implements(lengths_along, SpatialWrist)
def _lengths_along_arcs(wrist: Any, q: Any, lengths: Any) -> None:
    segment, tendons = wrist.segment, wrist.tendons
    for t in range(len(lengths)):
        lengths[t] = zero_like(segment.length)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        sinc, _, _ = _spans(segment, y, z)
        for t in range(len(lengths)):
            straight = segment.length - place_y(tendons, t) * y - place_z(tendons, t) * z
            lengths[t] = lengths[t] + share_of(tendons, t, k) * straight * sinc


@compiled
def _arm(wrist: Any, t: int, k: int, y: Any, z: Any, spans: Any) -> Any:
    """Moment arms of a tendon about the segment k that is bent by (y, z) [m]."""
    sinc, fall, _ = spans
    c_y, c_z, share = place_y(wrist.tendons, t), place_z(wrist.tendons, t), share_of(wrist.tendons, t, k)
    squeeze = fall * (wrist.segment.length - c_y * y - c_z * z)
    return share * (c_y * sinc + squeeze * y), share * (c_z * sinc + squeeze * z)


@implements(moment_arms_of, SpatialWrist)
def _moment_arms_about_arcs(wrist: Any, q: Any, t: int, arms: Any) -> None:
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        arms[2 * k], arms[2 * k + 1] = _arm(wrist, t, k, y, z, _spans(wrist.segment, y, z))


@compiled
def arms_about_bend(wrist: Any, bend: Any, arms: Any) -> None:
    """Moment arms [m] of all T tendons of a wrist of one segment bent like this (2 rows): T rows toward y, then z."""
    y, z, count = bend[0], bend[1], len(arms) // 2
    spans = _spans(wrist.segment, y, z)
    for t in range(count):
        arms[t], arms[count + t] = _arm(wrist, t, 0, y, z, spans)


@implements(tendons_torques, SpatialWrist)
def _torques_on_arcs(wrist: Any, q: Any, pulls: Any, torques: Any) -> None:
    segment, tendons = wrist.segment, wrist.tendons
    zero = zero_like(segment.length)
    for k in range(len(q) // 2):
        y, z = q[2 * k], q[2 * k + 1]
        sinc, fall, fall_by = _spans(segment, y, z)
        pull, pull_y, pull_z = zero, zero, zero
        for t in range(len(pulls)):
            along = share_of(tendons, t, k) * pulls[t]
            pull = pull + along
            pull_y = pull_y + along * place_y(tendons, t)
            pull_z = pull_z + along * place_z(tendons, t)
        straight = segment.length * pull - pull_y * y - pull_z * z
        squeeze, bent = fall * straight, fall_by * straight
        torques.torque[2 * k] = sinc * pull_y + squeeze * y
        torques.torque[2 * k + 1] = sinc * pull_z + squeeze * z
        torques.slope[2 * k] = squeeze - 2.0 * fall * pull_y * y - bent * y * y
        torques.slope[2 * k + 1] = squeeze - 2.0 * fall * pull_z * z - bent * z * z
        torques.slope_across[k] = -fall * (pull_y * z + pull_z * y) - bent * y * z
