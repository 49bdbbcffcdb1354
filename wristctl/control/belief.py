"""What a controller's side knows of its wrist: one segment with its tendons, in one plane or in two.

Rows of bends have P entries, one for each plane, rows of pulls T, one for each place of tendons, and rows of moment
arms P T, a plane's after the other's. In one plane the places are two opposed sides, + and -. Sums over tendons run
from the last to the first: so of two products it is the first that fuses with its sum (docs/lanes.md).
"""

from typing import Any, NamedTuple

from wristctl.control.model import one_segment
from wristctl.lanes.compiled import by_type, compiled, implements, nothing
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import planar, where, zero_like
from wristctl.lanes.rows import lanes_like, part, planes_like, rows_at, rows_of, square_like
from wristctl.wrist.allocation import allocate
from wristctl.wrist.segments import Segments, load_segments
from wristctl.wrist.spatial.posture import bend_segments, posture_like
from wristctl.wrist.spatial.spatial_dynamics import momenta_like, spatial_bias, spatial_mass_matrix
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialWrist, load_spatial_segments
from wristctl.wrist.spatial.spatial_tendons import arms_about_bend, lengths_along
from wristctl.wrist.spatial.spooled_tendons import straight_length
from wristctl.wrist.tendons import lengths, moment_arms

# Torque that counts as missed, as a share of what a plane reaches: less is rounding.
_ROUNDING = 1e-9


class Ignored(NamedTuple):
    """What the planes do to each other is a disturbance to both; one plane has no other."""


class Compensated(NamedTuple):
    """What the planes do to each other is known by the one-segment model in two planes."""


class Belief(NamedTuple):
    """A belief in lanes.

    The one-segment wrist (Segments in one plane, SpatialWrist in two), arrays of each plane's Segments, the number of
    tendons alike at each place, and Ignored or Compensated.
    """

    wrist: Any
    models: Any
    alike: Any
    coupling: Any


class Sides(NamedTuple):
    """One block's belief in one plane: its Segments (1, ...), and the tendons of both sides (2, ...)."""

    models: Any
    alike: Any


class Places(NamedTuple):
    """One block's belief in two planes: Segments of each (2, ...), tendons at each place (T, ...), the wrist in space.

    `tendons` and `pulls` are tuples with an entry, of no meaning, for each value of the tendons and for each place.
    """

    models: Any
    alike: Any
    wrist: Any
    tendons: Any
    pulls: Any
    coupling: Any


@by_type
def belief_in_lanes(belief: Any) -> Any:
    """A Belief in lanes from one block's arrays."""


@implements(belief_in_lanes, Sides)
def _sides_in_lanes(belief: Any) -> Any:
    return Belief(load_segments(rows_at(belief.models, 0)), belief.models, rows_of(belief.alike), Ignored())


@implements(belief_in_lanes, Places)
def _places_in_lanes(belief: Any) -> Any:
    rows = rows_of(belief.wrist)
    wrist = SpatialWrist(load_spatial_segments(rows), part(rows, FIELDS, belief.tendons))
    return Belief(wrist, belief.models, part(rows_of(belief.alike), 0, belief.pulls), belief.coupling)


@by_type
def moment_arms_at(wrist: Any, bend: Any, arms: Any) -> None:
    """Write the moment arms [m] of a wrist of one segment that is bent like this [rad]."""


@implements(moment_arms_at, Segments)
def _arms_of_sides(wrist: Any, bend: Any, arms: Any) -> None:
    arms[0], arms[1] = moment_arms(wrist, bend[0])


@implements(moment_arms_at, SpatialWrist)
def _arms_of_places(wrist: Any, bend: Any, arms: Any) -> None:
    arms_about_bend(wrist, bend, arms)


@by_type
def lengths_at(wrist: Any, bend: Any, out: Any) -> None:
    """Write the lengths of the tendons' paths [m] through a wrist of one segment that is bent like this [rad]."""


@implements(lengths_at, Segments)
def _lengths_of_sides(wrist: Any, bend: Any, out: Any) -> None:
    out[0], out[1] = lengths(wrist, bend[0])


@implements(lengths_at, SpatialWrist)
def _lengths_of_places(wrist: Any, bend: Any, out: Any) -> None:
    lengths_along(wrist, bend, out)


@by_type
def straight_at(wrist: Any, t: int) -> Any:
    """Length of a tendon's path through the straight wrist [m]."""


@implements(straight_at, Segments)
def _straight_side(wrist: Any, t: int) -> Any:
    return wrist.length


@implements(straight_at, SpatialWrist)
def _straight_place(wrist: Any, t: int) -> Any:
    return straight_length(wrist, t)


@by_type
def coupling(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    """Write the torques [N m] that the planes do to each other at these bends, rates and accelerations.

    It is what the one-segment model in two planes asks for beyond each plane's own.
    """


@implements(coupling, Ignored)
def _ignored(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    for p in range(len(extra)):
        extra[p] = zero_like(bend[p])


@implements(coupling, Compensated)
def _compensated(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    segment, zero = known.wrist.segment, zero_like(bend[0])
    posture, momenta, mass, free = posture_like(bend), momenta_like(bend), square_like(bend), lanes_like(bend)
    free[0], free[1] = zero, zero
    tangent, _, _ = bend_segments(segment, bend, posture)
    spatial_mass_matrix(segment, posture, tangent, mass, momenta)
    spatial_bias(segment, bend, rate, posture, tangent, free, extra)
    inertia_y, load_y = one_segment(load_segments(rows_at(known.models, 0)), bend[0], rate[0])
    inertia_z, load_z = one_segment(load_segments(rows_at(known.models, 1)), bend[1], rate[1])
    a_y, a_z = acceleration[0], acceleration[1]
    extra[0] = extra[0] - load_y + (mass[0, 0] - inertia_y) * a_y + mass[0, 1] * a_z
    extra[1] = extra[1] - load_z + (mass[1, 1] - inertia_z) * a_z + mass[1, 0] * a_y


@by_type
def coupled(kind: Any, torque: Any, extra: Any) -> Any:
    """A law's torque with what the planes do to each other [N m]; where that is ignored, the torque to the last bit."""


@implements(coupled, Ignored)
def _alone(kind: Any, torque: Any, extra: Any) -> Any:
    return torque


@implements(coupled, Compensated)
def _together(kind: Any, torque: Any, extra: Any) -> Any:
    return torque + extra


class Limits(NamedTuple):
    """Least and greatest pull at each place [N], T rows each."""

    least: Any
    greatest: Any


@compiled
def reach(arms: Any, limits: Any, extra: Any, low: Any, high: Any) -> None:
    """Write each plane's least and largest torque [N m], with the other plane free, beside the torque `extra`."""
    least, greatest = limits
    count = len(least)
    for p in range(len(low)):
        lowest, highest = -extra[p], -extra[p]
        for back in range(count):
            t = count - 1 - back
            arm = arms[count * p + t]
            lowest = lowest + arm * where(arm > 0.0, least[t], greatest[t])
            highest = highest + arm * where(arm > 0.0, greatest[t], least[t])
        low[p] = lowest
        high[p] = highest


@compiled
def torque_of(arms: Any, pulls: Any, torque: Any) -> None:
    """Write the torque [N m] of pulls [N] in each plane."""
    count = len(pulls)
    for p in range(len(torque)):
        total = zero_like(pulls[0])
        for back in range(count):
            t = count - 1 - back
            total = total + arms[count * p + t] * pulls[t]
        torque[p] = total


class Reached(NamedTuple):
    """What allocation may do and what each plane reaches: the torque `extra` [N m] beside the law's, the least and the
    largest torque of a law, P rows each, and the Limits of pulls."""

    extra: Any
    low: Any
    high: Any
    limits: Any


@by_type
def share_out(wrist: Any, arms: Any, wanted: Any, reached: Any, pulls: Any) -> Any:
    """Write the pulls [N] within limits that give the wanted torque [N m], and return the share of it that they give.

    In one plane that is 1, or 0 where the torque is out of reach.
    """


@implements(share_out, Segments)
def _share_out_to_sides(wrist: Any, arms: Any, wanted: Any, reached: Any, pulls: Any) -> Any:
    plus, minus, torque, low, high = arms[0], arms[1], wanted[0], reached.limits.least[0], reached.limits.greatest[0]
    forward = torque > (plus + minus) * low
    needed = clip((torque - where(forward, minus, plus) * low) / where(forward, plus, minus), low, high)
    pulls[0] = where(forward, needed, low)
    pulls[1] = where(forward, low, needed)
    return where((torque > reached.high[0]) | (torque < reached.low[0]), 0.0, 1.0 + zero_like(torque))


@implements(share_out, SpatialWrist)
def _share_out_to_places(wrist: Any, arms: Any, wanted: Any, reached: Any, pulls: Any) -> Any:
    vectors, count = planes_like(pulls), len(pulls)
    for t in range(count):
        vectors[t] = planar(arms[t], arms[count + t])
    return allocate(vectors, planar(wanted[0], wanted[1]), reached.limits.least, reached.limits.greatest, pulls)


@by_type
def miss(wrist: Any, wanted: Any, torque: Any, reached: Any, missed: Any) -> None:
    """Write what each plane misses [N m] of a torque that it could have alone, as the other plane wants its part.

    One plane has no other, and misses nothing.
    """


implements(miss, Segments)(nothing)


@implements(miss, SpatialWrist)
def _miss_a_part(wrist: Any, wanted: Any, torque: Any, reached: Any, missed: Any) -> None:
    for p in range(len(wanted)):
        low, high = reached.low[p] + reached.extra[p], reached.high[p] + reached.extra[p]
        less = clip(wanted[p], low, high) - torque[p]
        missed[p] = where(abs(less) > _ROUNDING * (high - low), less, 0.0)
