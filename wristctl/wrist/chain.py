"""Parts of a wrist as a chain: their shape, tendons and springs, which the dynamics take from the parts' type.

A part is bent by a coordinate of its own: its chord, from one disc's centre to the next one's, depends on that and on
the tangent before it, as an arc's and as two links' with a hinge between them. Masses are at the chords' middles.
"""

from typing import Any

from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import replacing
from wristctl.wrist import arcs, tendons
from wristctl.wrist.segments import Segments


@by_type
def chords(segment: Any, theta: Any, arc: Any) -> Any:
    """Chord of each part in base axes and its first three derivatives by its own coordinate, into Chords; the last
    tangent."""


@by_type
def lengths(segment: Any, theta: Any) -> Any:
    """Lengths of the + and the - side's tendons along one part [m]."""


@by_type
def moment_arms(segment: Any, theta: Any) -> Any:
    """Moment arms of the + and the - side along one part: minus the lengths' derivatives by its coordinate [m]."""


@by_type
def tendon_torques(segment: Any, theta: Any, plus: Any, minus: Any, torque: Any, slope: Any) -> None:
    """Torque of both sides' pulls [N] on each part and its derivative by that part's coordinate, into two rows."""


@by_type
def spring(segment: Any, k: int) -> Any:
    """Stiffness of the part k from the base [N m/rad]."""


@implements(chords, Segments)
def _chords(segment: Any, theta: Any, arc: Any) -> Any:
    return arcs.chords(theta, segment.length, arc)


implements(lengths, Segments)(tendons.lengths)


implements(moment_arms, Segments)(tendons.moment_arms)


implements(tendon_torques, Segments)(tendons.tendon_torques)


@implements(spring, Segments)
def _spring(segment: Any, k: int) -> Any:
    return segment.stiffness


@compiled
def bend_along(segment: Any, q: Any, rate: Any, bend: Any, speed: Any) -> None:
    """Write the bend of the last disc [rad] and its rate [rad/s], one row each: the sums of the parts'."""
    zero = zero_like(segment.length)
    angle, turning = zero, zero
    for k in range(len(q)):
        angle = angle + q[k]
        turning = turning + rate[k]
    bend[0], speed[0] = angle, turning


_load = replacing("stiffness", "force_y")


@compiled
def disturbed_chain(segment: Any, force: Any, scale: Any) -> Any:
    """The wrist with a force (3) more on the last disc [N], which it feels across alone, and stiffness scaled."""
    return _load(segment, (scale * segment.stiffness, force[1] + segment.force_y))
