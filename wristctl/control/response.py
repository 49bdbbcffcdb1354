"""One control tick, in simulation and on hardware: what the law sees, its torque, and the pulls that give it."""

from typing import Any, NamedTuple

from wristctl.control.law import NOW, REFERENCE, now_of, wrist_of
from wristctl.lanes.compiled import compiled, spelled_out
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import rows_of
from wristctl.wrist.tendons import allocate, reach

_THETA, _RATE, _THETA_REF, _RATE_REF, _ACCELERATION_REF, _LOW, _HIGH, _PERIOD, _LOAD, _WITHHELD = range(len(NOW))


class Estimate(NamedTuple):
    """The wrist's angle [rad], rate [rad/s] and load torque [N m] as measured or as the observer makes them out."""

    theta: Any
    rate: Any
    load: Any


class Controlled(NamedTuple):
    """A law with the arrays that it works on: what it sees (NOW and the preview), the controller's one-segment wrist
    (Segments), its gains, its memory, and the reference (angle, rate, acceleration)."""

    law: Any
    signals: Any
    model: Any
    gains: Any
    memory: Any
    reference: Any


@compiled
def look_ahead(control: Any, periods: int, since: float) -> None:
    """Put the reference that is `periods` from now into the preview, `since` seconds after what it was then."""
    _continued(control, len(NOW) + len(REFERENCE) * (periods - 1), since)


@compiled
def _continued(control: Any, first: int, since: float) -> None:
    """The reference as what a law sees from `first` on, continued by its own derivatives."""
    signals, target = rows_of(control.signals), rows_of(control.reference)
    signals[first] = target[0] + since * (target[1] + 0.5 * since * target[2])
    signals[first + 1] = target[1] + since * target[2]
    signals[first + 2] = target[2]


@compiled
def perceive(
    control: Any, believed: Any, estimate: Any, withheld: Any, bounds: Any, since: float, period: float
) -> Any:
    """Put what a law sees into its signals; the least and the largest torque [N m] in reach. Arguments as `respond`."""
    low, high = bounds
    torque_low, torque_high = reach(estimate.theta, believed, low, high)
    perceive_within(control, estimate, withheld, (torque_low, torque_high), since, period)
    return torque_low, torque_high


@compiled
def perceive_within(control: Any, estimate: Any, withheld: Any, within: Any, since: float, period: float) -> None:
    """Put what a law sees into its signals, where the torques `within` reach [N m] are known."""
    signals, (torque_low, torque_high) = rows_of(control.signals), within
    signals[_THETA] = estimate.theta
    signals[_RATE] = estimate.rate
    signals[_LOAD] = estimate.load
    signals[_WITHHELD] = withheld
    _continued(control, _THETA_REF, since)
    signals[_LOW] = torque_low
    signals[_HIGH] = torque_high
    signals[_PERIOD] = period + zero_like(torque_low)


@spelled_out
def wanted_torque(control: Any) -> Any:
    """Torque [N m] that the law wants, by its signals."""
    gains, memory = rows_of(control.gains), rows_of(control.memory)
    return control.law(now_of(control.signals), wrist_of(control.model), gains, memory)


@compiled
def respond(control: Any, believed: Any, estimate: Any, withheld: Any, bounds: Any, since: float, period: float) -> Any:
    """Torque that the law wants [N m], the least and largest in reach, and pulls of the + and the - side [N].

    `believed` is the controller's wrist as Segments, `estimate` an Estimate, `withheld` the torque of the last command
    that the motors were too slow for [N m]; `bounds` are the least and largest pull of a side [N]. The reference is
    what it was `since` seconds ago, continued by its own derivatives.
    """
    low, high = bounds
    torque_low, torque_high = perceive(control, believed, estimate, withheld, bounds, since, period)
    wanted = wanted_torque(control)
    plus, minus = allocate(estimate.theta, believed, wanted, low, high)
    return wanted, torque_low, torque_high, plus, minus
