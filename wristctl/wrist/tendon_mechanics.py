"""Tendons between spools and wrist, as the integration step evaluates them.

What there is follows from a type. NoTendons and PulledTendons hold pulls [N] over a step, ElasticTendons and
RealTendons the lengths [m] that spools have reeled in. Either is the step's `spool_input`, a row for each place of
tendons: in one plane (plus, minus) of one tendon a side, or twice that of two alike.

Where a path is shorter by x a tendon of stiffness k that has reeled in l is stretched by e = l - x, pulls
k max(e - f psi, 0) at its spool, never pushes, and pulls less at the wrist by its friction. psi is
the creep of one Maxwell branch: it follows e with a time constant, so that the share f of the stiffness relaxes.
Springs creep alike.
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import by_type, compiled, implements, itself, nothing
from wristctl.lanes.functions import exp, maximum
from wristctl.lanes.lane import rounded, where, zero_like
from wristctl.lanes.named_tuples import tuple_of
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.wrist.chain import lengths, moment_arms
from wristctl.wrist.dahl import bristle, bristle_slope, inner_in_lanes, remember_bend


@compiled
def capstan(friction: Any, wrapped: Any, z: Any) -> Any:
    """Pull at the wrist over pull at the spool."""
    return exp(-friction * wrapped * z)


class Nonideal(NamedTuple):
    """Imperfections of a real wrist; lanes, SI units. All of it at 0 (`stop` inf) gives the ideal's bits."""

    friction: Any
    sheath: Any
    bristle: Any
    """1/s: what the state of a bristle turns by in a path [1/m]."""
    tendon_creep: Any
    """Share of a tendon's stiffness that relaxes."""
    tendon_keep: Any
    """exp(-step / time constant)"""
    spring_creep: Any
    spring_keep: Any
    stop: Any
    """Bending angle of the whole wrist at its end stops [rad]."""
    stop_stiffness: Any
    stop_dissipation: Any
    backlash: Any
    broken_at: Any
    """Time [s] from which the + side's first tendon does not pull."""
    left: Any
    """Share of it that is left then: of one tendon none, of two that are one here a half."""
    slips_at: Any
    slip: Any
    torque: Any
    """Pull [N] at which a standing motor falls out of step."""
    corner_speed: Any
    """Speed [m/s] up to which it pulls as hard as standing."""
    top_speed: Any
    """Speed [m/s] at which it cannot pull at all."""
    turn: Any
    """Length of an electrical turn, four full steps [m]."""


class Fault(NamedTuple):
    """When a place's tendons break and slip [s], what share of them a break leaves, and the pull [N] at which their
    standing motor falls out of step; a row for each place."""

    broken_at: Any
    left: Any
    slips_at: Any
    holds: Any


# A Nonideal of lanes from rows of lanes, in compiled code.
read_nonideal = tuple_of(Nonideal)

# Rows of a tendon's state: the bristle's state, psi [m], the share of it that is not broken, where its spool is in the
# backlash [m], what its motor has lost and it has slipped [m], and before the step the shortening of its path [m] and
# the bend that it is wrapped by [rad]. After all tendons' rows comes the springs' psi [rad] of each coordinate.
OF_A_TENDON = ("z", "crept", "share", "play", "lost", "slipped", "x", "wrapped")
_OWN = len(OF_A_TENDON)
Z, CREPT, SHARE, PLAY, LOST, SLIPPED, X, WRAPPED = range(_OWN)


class NoTendons(NamedTuple):
    """Held pulls act on the wrist as they are, and all else of it is ideal."""


class PulledTendons(NamedTuple):
    """Held pulls on a wrist with end stops, creeping springs and tendons that break; of the state all that friction and
    creep of tendons need stays as it is."""

    nonideal: Any
    faults: Any
    """Fault of each place; in one block's arrays rows."""
    state: Any
    inner: Any
    """InnerFriction of the wrist, or NoInnerFriction."""
    pulls: Any
    """In one block's arrays a tuple with an entry for each place."""


class ElasticTendons(NamedTuple):
    """Tendons that only stretch: the stiffness of all of each place [N/m], T rows; `pulls` as of PulledTendons."""

    stiffness: Any
    pulls: Any


class RealTendons(NamedTuple):
    """Tendons with friction, creep and faults: the stiffness of all of each place [N/m], T rows, as long as they are
    whole, Nonideal, and the rest as of PulledTendons; `path` is a tuple with an entry for each value of their path."""

    stiffness: Any
    nonideal: Any
    faults: Any
    state: Any
    inner: Any
    pulls: Any
    path: Any


Tendons = NoTendons | PulledTendons | ElasticTendons | RealTendons


@by_type
def tendons_in_lanes(tendons: Any) -> Any:
    """Tendons of lanes from tendons of one block's arrays."""


implements(tendons_in_lanes, NoTendons)(itself)


@compiled
def read_faults(rows: Any, pulls: Any) -> Any:
    """Fault with rows for each place, of rows one after the other."""
    count = len(pulls)
    return Fault(
        part(rows, 0, pulls), part(rows, count, pulls), part(rows, 2 * count, pulls), part(rows, 3 * count, pulls)
    )


@implements(tendons_in_lanes, PulledTendons)
def _pulled(tendons: Any) -> Any:
    return PulledTendons(
        read_nonideal(rows_of(tendons.nonideal)), read_faults(rows_of(tendons.faults), tendons.pulls),
        rows_of(tendons.state), inner_in_lanes(tendons.inner), tendons.pulls,
    )  # fmt: skip


@implements(tendons_in_lanes, ElasticTendons)
def _elastic(tendons: Any) -> Any:
    return ElasticTendons(part(rows_of(tendons.stiffness), 0, tendons.pulls), tendons.pulls)


@implements(tendons_in_lanes, RealTendons)
def _real(tendons: Any) -> Any:
    return RealTendons(
        part(rows_of(tendons.stiffness), 0, tendons.pulls), read_nonideal(rows_of(tendons.nonideal)),
        read_faults(rows_of(tendons.faults), tendons.pulls), rows_of(tendons.state), inner_in_lanes(tendons.inner),
        tendons.pulls, tendons.path,
    )  # fmt: skip


def state_rows(tendons: int, coordinates: int) -> int:
    """Rows of the state of so many tendons and of a wrist with so many coordinates."""
    return _OWN * tendons + coordinates


@compiled
def row_of(t: int, which: int) -> int:
    """Row of one of a tendon's values, as X or SHARE; of as many as there are tendons the springs' first."""
    return _OWN * t + which


@compiled
def paths_of(path: Any) -> int:
    """How many tendons have a path of their own: of (plus, minus, bend) 2, of T paths and T bends T."""
    return (len(path) + 1) // 2


@compiled
def shortening(path: Any, t: int) -> Any:
    """Shortening of a tendon's path from the straight wrist [m]; tendons of one side have one path."""
    return path[t % paths_of(path)]


@compiled
def wrapped_by(path: Any, t: int) -> Any:
    """Bend that a tendon is wrapped by [rad]: its own, or that of all."""
    return path[paths_of(path) + t % (len(path) - paths_of(path))]


@compiled
def travel(segment: Any, theta: Any) -> Any:
    """Shortening of both sides' paths from the straight wrist [m], and the bend [rad]."""
    zero = zero_like(segment.length)
    plus, minus, bend = zero, zero, zero
    for k in range(len(theta)):
        path_plus, path_minus = lengths(segment, theta[k])
        plus = plus + segment.length - path_plus
        minus = minus + segment.length - path_minus
        bend = bend + abs(theta[k])
    return plus, minus, bend


@compiled
def _slid(tendons: Any, t: int, x: Any) -> Any:
    return bristle(tendons.state[row_of(t, Z)], x - tendons.state[row_of(t, X)], tendons.nonideal.bristle)


@compiled
def spool_pull(tendons: Any, length: Any, t: int, x: Any) -> Any:
    """Pull [N] at its spool of one real tendon that has reeled in a length [m]."""
    state = tendons.state
    elongation = (length - x) - tendons.nonideal.tendon_creep * state[row_of(t, CREPT)]
    return rounded(state[row_of(t, SHARE)] * tendons.stiffness[t] * maximum(0.0, elongation))


@compiled
def _at_wrist(tendons: Any, length: Any, t: int, path: Any, z: Any) -> Any:
    """Pull [N] of one tendon whose bristle is in this state."""
    left = capstan(tendons.nonideal.friction, tendons.nonideal.sheath + wrapped_by(path, t), z)
    return rounded(spool_pull(tendons, length, t, shortening(path, t)) * left)


@by_type
def pull_along(tendons: Any, spool_input: Any, t: int, path: Any) -> Any:
    """Pull [N] of one tendon at the wrist, at a path within a step."""


@by_type
def pull_at_start(tendons: Any, spool_input: Any, t: int, path: Any) -> Any:
    """Pull [N] of one tendon at the wrist at the start of a step, where it has not slid yet."""


@implements(pull_at_start, NoTendons, PulledTendons)
@implements(pull_along, NoTendons, PulledTendons)
def _held_pull(tendons: Any, pulls: Any, t: int, path: Any) -> Any:
    return pulls[t]


@implements(pull_at_start, ElasticTendons)
@implements(pull_along, ElasticTendons)
def _stretch_pull(tendons: Any, reeled: Any, t: int, path: Any) -> Any:
    return rounded(tendons.stiffness[t] * maximum(0.0, reeled[t] - shortening(path, t)))


@implements(pull_along, RealTendons)
def _slid_pull(tendons: Any, reeled: Any, t: int, path: Any) -> Any:
    return _at_wrist(tendons, reeled[t], t, path, _slid(tendons, t, shortening(path, t)))


@implements(pull_at_start, RealTendons)
def _stuck_pull(tendons: Any, reeled: Any, t: int, path: Any) -> Any:
    return _at_wrist(tendons, reeled[t], t, path, tendons.state[row_of(t, Z)])


@compiled
def acting_pulls(tendons: Any, spool_input: Any, path: Any, acts: Any) -> None:
    """Write the pulls [N] at the wrist at the start of a step, a row for each place of tendons."""
    for t in range(len(acts)):
        acts[t] = pull_at_start(tendons, spool_input, t, path)


@compiled
def pulls_along(tendons: Any, spool_input: Any, path: Any) -> Any:
    """Pulls [N] of both sides at the wrist, at a path (plus, minus, bend) within a step."""
    plus, minus = zero_like(path[0]), zero_like(path[0])
    for t in range(0, len(spool_input), 2):
        plus = plus + pull_along(tendons, spool_input, t, path)
        minus = minus + pull_along(tendons, spool_input, t + 1, path)
    return plus, minus


@compiled
def pulls_at_start(tendons: Any, spool_input: Any, path: Any) -> Any:
    """Pulls [N] of both sides at the wrist at the start of a step, where no tendon has slid yet."""
    plus, minus = zero_like(path[0]), zero_like(path[0])
    for t in range(0, len(spool_input), 2):
        plus = plus + pull_at_start(tendons, spool_input, t, path)
        minus = minus + pull_at_start(tendons, spool_input, t + 1, path)
    return plus, minus


@by_type
def pull_slope(tendons: Any, length: Any, t: int, path: Any, speed: Any) -> Any:
    """Fall of one tendon's pull with its path's shortening at the start of a step [N/m]."""


@implements(pull_slope, ElasticTendons)
def _stretch_slope(tendons: Any, length: Any, t: int, path: Any, speed: Any) -> Any:
    """Of a tendon that only stretches its stiffness, while it is taut."""
    return where(length - shortening(path, t) > 0.0, tendons.stiffness[t], 0.0)


@implements(pull_slope, RealTendons)
def _slid_slope(tendons: Any, length: Any, t: int, path: Any, speed: Any) -> Any:
    """Of a real tendon also the slope of its friction."""
    nonideal, state = tendons.nonideal, tendons.state
    z, wrapped = state[row_of(t, Z)], nonideal.friction * (nonideal.sheath + wrapped_by(path, t))
    pull = spool_pull(tendons, length, t, shortening(path, t))
    taut = where(pull > 0.0, state[row_of(t, SHARE)] * tendons.stiffness[t], 0.0)
    sliding = pull * wrapped * bristle_slope(z, speed, nonideal.bristle)
    return (taut + sliding) * capstan(wrapped, 1.0, z)


@by_type
def stiffen(tendons: Any, segment: Any, theta: Any, omega: Any, spool_input: Any, path: Any, by_theta: Any) -> None:
    """Add to dr/d(theta) (n, n) what tendons on held spools add: arm_i (-dT/dx) arm_j of each."""


implements(stiffen, NoTendons, PulledTendons)(nothing)


@implements(stiffen, ElasticTendons, RealTendons)
def _stiffen(tendons: Any, segment: Any, theta: Any, omega: Any, reeled: Any, path: Any, by_theta: Any) -> None:
    n, ahead, behind = len(theta), lanes_like(theta), lanes_like(theta)
    zero = zero_like(segment.length)
    speed_plus, speed_minus = zero, zero
    for k in range(n):
        arm_plus, arm_minus = moment_arms(segment, theta[k])
        ahead[k] = arm_plus
        behind[k] = arm_minus
        speed_plus = speed_plus + arm_plus * omega[k]
        speed_minus = speed_minus + arm_minus * omega[k]
    plus, minus = zero, zero
    for t in range(0, len(reeled), 2):
        plus = plus + pull_slope(tendons, reeled[t], t, path, speed_plus)
        minus = minus + pull_slope(tendons, reeled[t + 1], t + 1, path, speed_minus)
    for i in range(n):
        for j in range(n):
            by_theta[i, j] = by_theta[i, j] + plus * ahead[i] * ahead[j] + minus * behind[i] * behind[j]


@by_type
def update_memory(tendons: Any, theta: Any, spool_input: Any, path: Any) -> None:
    """Take the state over to the end of a step, at coordinates theta with this path."""


implements(update_memory, NoTendons, ElasticTendons)(nothing)


@implements(update_memory, PulledTendons)
@compiled
def _update_wrist(tendons: Any, theta: Any, spool_input: Any, path: Any) -> None:
    """Springs creep, and the bristles of inner friction turn."""
    state = tendons.state
    for k in range(len(theta)):
        row = row_of(len(spool_input), 0) + k
        state[row] = theta[k] + tendons.nonideal.spring_keep * (state[row] - theta[k])
    remember_bend(tendons.inner, theta)


@implements(update_memory, RealTendons)
@compiled
def _update_tendons(tendons: Any, theta: Any, reeled: Any, path: Any) -> None:
    """Tendons have slid and creep, beside the wrist's own."""
    nonideal, state = tendons.nonideal, tendons.state
    for t in range(len(reeled)):
        x = shortening(path, t)
        state[row_of(t, Z)] = _slid(tendons, t, x)
        stretch, crept = maximum(0.0, reeled[t] - x), row_of(t, CREPT)
        state[crept] = stretch + nonideal.tendon_keep * (state[crept] - stretch)
        state[row_of(t, X)] = x
        state[row_of(t, WRAPPED)] = wrapped_by(path, t)
    _update_wrist(tendons, theta, reeled, path)
