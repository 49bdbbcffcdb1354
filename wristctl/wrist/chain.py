"""What a wrist is a chain of: its parts' shape, tendons and springs, which the dynamics take from the parts' type.

A part is bent by a coordinate of its own: its chord, from one disc's centre to the next one's, depends on that and on
the tangent before it, as an arc's and as two links' with a hinge between them. Masses are at the chords' middles.
"""

from typing import Any, NamedTuple

import numba
from numba.extending import overload

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import turn
from wristctl.lanes.rows import planes_like
from wristctl.wrist import arcs, tendons
from wristctl.wrist.segments import Segments


class Chain(NamedTuple):
    """A kind of chain; the compiled functions have the arguments of this module's of the same name."""

    chords: Any
    lengths: Any
    moment_arms: Any
    tendon_torques: Any
    spring: Any


CHAINS: dict[Any, Chain] = {}
"""By the NamedTuple class of the parts' parameters."""


def chords(segment: Any, theta: Any, arc: Any) -> Any:
    """Chord of each part in base axes and its first three derivatives by its own coordinate, into Chords; the last
    tangent."""
    raise NotImplementedError("compiled code only")


def lengths(segment: Any, theta: Any) -> Any:
    """Lengths of the + and the - side's tendons along one part [m]."""
    raise NotImplementedError("compiled code only")


def moment_arms(segment: Any, theta: Any) -> Any:
    """Minus their derivatives by its coordinate [m]."""
    raise NotImplementedError("compiled code only")


def tendon_torques(segment: Any, theta: Any, plus: Any, minus: Any, torque: Any, slope: Any) -> None:
    """Torque of both sides' pulls [N] on each part and its derivative by that part's coordinate, into two rows."""
    raise NotImplementedError("compiled code only")


def spring(segment: Any, k: int) -> Any:
    """Stiffness of the part k from the base [N m/rad]."""
    raise NotImplementedError("compiled code only")


def _by_chain(function: Any) -> None:
    @overload(function, strict=False, jit_options={"error_model": "numpy", "nogil": True, "forceinline": True})
    def own(segment: Any, *others: Any) -> Any:
        chain = CHAINS.get(segment.instance_class) if isinstance(segment, numba.types.BaseNamedTuple) else None
        return None if chain is None else getattr(chain, function.__name__).py_func


for _function in (chords, lengths, moment_arms, tendon_torques, spring):
    _by_chain(_function)


@compiled
def _chords(segment: Any, theta: Any, arc: Any) -> Any:
    return arcs.chords(theta, segment.length, arc)


@compiled
def _lengths(segment: Any, theta: Any) -> Any:
    return tendons.lengths(theta, segment)


@compiled
def _moment_arms(segment: Any, theta: Any) -> Any:
    return tendons.moment_arms(theta, segment)


@compiled
def _tendon_torques(segment: Any, theta: Any, plus: Any, minus: Any, torque: Any, slope: Any) -> None:
    tendons.tendon_torques(theta, segment, plus, minus, torque, slope)


@compiled
def _spring(segment: Any, k: int) -> Any:
    return segment.stiffness


CHAINS[Segments] = Chain(_chords, _lengths, _moment_arms, _tendon_torques, _spring)


@compiled
def angle_along(segment: Any, q: Any, rate: Any) -> Any:
    """Bending angle of the last disc [rad] and its rate [rad/s]: the sums of the parts'."""
    zero = 0.0 * segment.length
    angle, turning = zero, zero
    for k in range(len(q)):
        angle = angle + q[k]
        turning = turning + rate[k]
    return angle, turning


@compiled
def tip_derivatives(segment: Any, q: Any, place: Any, angle: Any) -> None:
    """Part k turns all that lies beyond it: d(tip)/d(theta_k) = dz_k + i (tip - end of part k)."""
    arc = arcs.Chords(planes_like(q), planes_like(q), planes_like(q), planes_like(q))
    chords(segment, q, arc)
    beyond = 0.0 * segment.length * arc.z[0]
    for k in range(len(q) - 1, -1, -1):
        place[k] = arc.dz[k] + turn(beyond)
        angle[k] = 1.0 + 0.0 * segment.length
        beyond = beyond + arc.z[k]
