"""One control tick, in simulation and on hardware: a law once for each plane, and one allocation for all planes.

Rows have P entries for planes, T for places of tendons (`wristctl.control.belief`).
"""

from typing import Any, NamedTuple

from wristctl.control.belief import Reached, coupled, coupling, miss, moment_arms_at, reach, share_out, torque_of
from wristctl.control.law import NOW, REFERENCE, now_at, wrist_at
from wristctl.lanes.compiled import by_type, compiled, implements, spelled_out
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import beyond, lanes_like, rows_at, rows_of

_THETA, _RATE, _THETA_REF, _RATE_REF, _ACCELERATION_REF, _LOW, _HIGH, _PERIOD, _LOAD, _WITHHELD = range(len(NOW))

# Rows of what is seen of one plane: bend [rad], rate [rad/s] and load torque [N m].
OF_A_PLANE = 3
# Share of a wanted torque below which it was out of the tendons' reach.
FULL = 1.0 - 1e-9


class Controlled(NamedTuple):
    """A law with the arrays that it works on, those of P planes beside each other.

    They are what it sees (NOW and the preview), each plane's one-segment wrist (Segments), its gains, its memory, and
    each plane's reference (angle, rate, acceleration).
    """

    law: Any
    signals: Any
    models: Any
    gains: Any
    memory: Any
    reference: Any


class Estimate(NamedTuple):
    """Bend [rad], rate [rad/s] and load torque [N m] as measured or as the observer makes them out."""

    theta: Any
    rate: Any
    load: Any


class Seen(NamedTuple):
    """What the law sees: bend, rate and load of each plane, as measured or as the observer makes them out (3 P rows),
    and the torque [N m] withheld in each (P rows).

    `withheld` is what motors are too slow for, `missed` what the tendons could not give beside the other plane's.
    """

    rows: Any
    withheld: Any
    missed: Any


class Room(NamedTuple):
    """Rows to work on, one for each plane, and the moment arms [m] at the bend that the law has seen.

    Behind a tick `wanted` is what the law wants, `torque` what the pulls give by its belief [N m].
    """

    bend: Any
    speed: Any
    acceleration: Any
    extra: Any
    low: Any
    high: Any
    wanted: Any
    torque: Any
    arms: Any


@spelled_out
def room_like(bend: Any, arms: Any) -> Any:
    """A Room as long as rows of bends and of moment arms; it lives as long as its caller."""
    return Room(
        lanes_like(bend), lanes_like(bend), lanes_like(bend), lanes_like(bend), lanes_like(bend), lanes_like(bend),
        lanes_like(bend), lanes_like(bend), lanes_like(arms),
    )  # fmt: skip


@compiled
def look_ahead(control: Any, bend: Any, periods: int, since: float) -> None:
    """Put the reference that is `periods` from now into the preview, `since` seconds after what it was then.

    `bend` is a row for each plane.
    """
    for p in range(len(bend)):
        _continued(control, p, len(NOW) + len(REFERENCE) * (periods - 1), since)


@compiled
def _continued(control: Any, p: int, first: int, since: float) -> None:
    """The reference as what a law sees from `first` on, continued by its own derivatives."""
    signals, target = rows_at(control.signals, p), rows_at(control.reference, p)
    signals[first] = target[0] + since * (target[1] + 0.5 * since * target[2])
    signals[first + 1] = target[1] + since * target[2]
    signals[first + 2] = target[2]


@compiled
def perceive(control: Any, known: Any, seen: Any, limits: Any, room: Any, since: float, period: float) -> None:
    """Put what the law sees into its signals, and what each plane reaches into `room`. Arguments as `respond`."""
    for p in range(len(room.bend)):
        room.bend[p] = seen.rows[OF_A_PLANE * p]
        room.speed[p] = seen.rows[OF_A_PLANE * p + 1]
        room.acceleration[p] = rows_at(control.reference, p)[2]
    coupling(known.coupling, known, room.bend, room.speed, room.acceleration, room.extra)
    moment_arms_at(known.wrist, room.bend, room.arms)
    reach(room.arms, limits, room.extra, room.low, room.high)
    for p in range(len(room.bend)):
        signals = rows_at(control.signals, p)
        signals[_THETA] = room.bend[p]
        signals[_RATE] = room.speed[p]
        signals[_LOAD] = seen.rows[OF_A_PLANE * p + 2]
        signals[_WITHHELD] = seen.withheld[p] + seen.missed[p]
        _continued(control, p, _THETA_REF, since)
        signals[_LOW] = room.low[p]
        signals[_HIGH] = room.high[p]
        signals[_PERIOD] = period + zero_like(room.low[p])


@spelled_out
def wanted_torques(control: Any, arms: Any, limits: Any, wanted: Any) -> None:
    """Write the torques [N m] that the law wants in all planes, by its signals."""
    control.law(
        now_at(control.signals, 0), wrist_at(control.models, 0), rows_of(control.gains), rows_at(control.memory, 0),
        beyond(arms, 0), beyond(limits.least, 0), beyond(limits.greatest, 0), beyond(wanted, 0),
    )  # fmt: skip


@compiled
def respond(
    control: Any, known: Any, seen: Any, limits: Any, room: Any, since: float, period: float, pulls: Any
) -> Any:
    """Write the pulls (T rows) [N] of a tick, and return the share of the wanted torque that they give.

    `known` is the Belief of the controller's side. The reference is what it was `since` seconds ago, continued by its
    own derivatives. A law is told what its plane alone reaches; what it misses within that since the other plane wants
    its part, it is told at the next tick, by `seen.missed`.
    """
    perceive(control, known, seen, limits, room, since, period)
    return answer(control.law, control, known, limits, room, pulls, seen.missed)


class GivenTorques(NamedTuple):
    """In the place of a law: the torque that is wanted in each plane [N m] stands in the place of its gains."""


class GivenTensions(NamedTuple):
    """In the place of a law: the tension of one tendon at each place [N] stands in the place of its gains."""


@by_type
def answer(law: Any, control: Any, known: Any, limits: Any, room: Any, pulls: Any, missed: Any) -> Any:
    """Write the pulls (T rows) [N] that answer what has been perceived, and return the share that `respond` does."""


@implements(answer, None)
def _by_law(law: Any, control: Any, known: Any, limits: Any, room: Any, pulls: Any, missed: Any) -> Any:
    wanted_torques(control, room.arms, limits, room.wanted)
    for p in range(len(room.bend)):
        room.wanted[p] = coupled(known.coupling, room.wanted[p], room.extra[p])
    return _allocated(known, limits, room, pulls, missed)


@implements(answer, GivenTorques)
def _by_torques(law: Any, control: Any, known: Any, limits: Any, room: Any, pulls: Any, missed: Any) -> Any:
    torques = rows_of(control.gains)
    for p in range(len(room.bend)):
        room.wanted[p] = coupled(known.coupling, torques[p], room.extra[p])
    return _allocated(known, limits, room, pulls, missed)


@implements(answer, GivenTensions)
def _by_tensions(law: Any, control: Any, known: Any, limits: Any, room: Any, pulls: Any, missed: Any) -> Any:
    tensions, share = rows_of(control.gains), 1.0 + zero_like(limits.least[0])
    for t in range(len(pulls)):
        pull, least, greatest = known.alike[t] * tensions[t], limits.least[t], limits.greatest[t]
        pulls[t] = clip(pull, least, greatest)
        share = where((pull < least) | (pull > greatest), 0.0, share)
    torque_of(room.arms, pulls, room.torque)
    for p in range(len(room.bend)):
        room.wanted[p] = room.torque[p]
    return share


@compiled
def _allocated(known: Any, limits: Any, room: Any, pulls: Any, missed: Any) -> Any:
    """Write the pulls that give the wanted torques, and what is missed of these; return the share that they give."""
    reached = Reached(room.extra, room.low, room.high, limits)
    share = share_out(known.wrist, room.arms, room.wanted, reached, pulls)
    torque_of(room.arms, pulls, room.torque)
    miss(known.wrist, room.wanted, room.torque, reached, missed)
    return share
