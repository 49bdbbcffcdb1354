"""Elastic tendons and what else of a real wrist its ideal model leaves out, evaluated inside an integration step.

Each side has one tendon or two alike; `given` holds what they have reeled in [m], (plus, minus) or twice that. Where
a path is shorter by x a tendon of stiffness k is stretched by e = given - x, pulls k max(e - f psi, 0) at its spool,
never pushes, and pulls less at the wrist by its friction (tendon_friction). psi is the creep of one Maxwell branch: it
follows e with a time constant, so that the share f of the stiffness relaxes. Springs creep alike (yielding).
"""

from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum
from wristctl.lanes.lane import rounded, where
from wristctl.lanes.parts import tuple_of
from wristctl.lanes.rows import lanes_like
from wristctl.wrist.chain import lengths, moment_arms
from wristctl.wrist.tendon_friction import bristle, bristle_slope, capstan


class Nonideal(NamedTuple):
    """What a real wrist has; lanes, SI units. All of it at 0 (`stop` inf) gives the ideal's bits."""

    held: Any
    """1 where `given` are pulls [N], held during a step, instead of lengths."""
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
    """Time [s] from which one of the + side's two tendons does not pull."""
    slips_at: Any
    slip: Any
    torque: Any
    """Pull [N] at which a standing motor falls out of step."""
    top_speed: Any
    """Speed [m/s] at which it cannot pull at all."""
    turn: Any
    """Length of an electrical turn, four full steps [m]."""


read_nonideal = tuple_of(Nonideal)
"""A Nonideal of lanes from rows of lanes, in compiled code."""

OF_A_TENDON = ("z", "crept", "share", "play", "lost", "slipped")
"""Rows of a tendon's state: the bristle's state, psi [m], the share of it that is not broken, where its spool is in the
backlash [m], what its motor has lost and it has slipped [m]. Before all tendons' rows comes the path, x of both sides
[m] and the bend [rad], after them the springs' psi [rad]."""
_OWN, PATH = len(OF_A_TENDON), 3
Z, _CREPT, SHARE, PLAY, LOST, SLIPPED = range(PATH, PATH + _OWN)


class Tendons(NamedTuple):
    """Elastic tendons: the stiffness of each in `given` [N/m]; where they are not ideal, how, and their state."""

    stiffness: Any
    nonideal: Any
    state: Any


def state_rows(tendons: int, coordinates: int) -> int:
    """Rows of the state of so many tendons in `given` and of a wrist with so many coordinates."""
    return PATH + _OWN * tendons + coordinates


@compiled
def row_of(t: int, which: int) -> int:
    """Row of one of a tendon's values: SHARE, PLAY, LOST or SLIPPED."""
    return _OWN * t + which


@compiled
def travel(segment: Any, theta: Any) -> Any:
    """By how much both sides' paths are shorter than on the straight wrist [m], and the bend [rad]."""
    zero = 0.0 * segment.length
    plus, minus, bend = zero, zero, zero
    for k in range(len(theta)):
        path_plus, path_minus = lengths(segment, theta[k])
        plus = plus + segment.length - path_plus
        minus = minus + segment.length - path_minus
        bend = bend + abs(theta[k])
    return plus, minus, bend


@compiled
def _slid(nonideal: Any, state: Any, t: int, x: Any) -> Any:
    return bristle(state[row_of(t, Z)], x - state[t % 2], nonideal.bristle)


@compiled
def spool_pull(tendons: Any, given: Any, t: int, x: Any) -> Any:
    """Pull [N] at its spool of one tendon that is not ideal and has reeled in `given` [m]."""
    state = tendons.state
    elongation = (given - x) - tendons.nonideal.tendon_creep * state[row_of(t, _CREPT)]
    return rounded(state[row_of(t, SHARE)] * tendons.stiffness * maximum(elongation, 0.0 * x))


@compiled
def _at_wrist(tendons: Any, nonideal: Any, given: Any, t: int, path: Any, z: Any) -> Any:
    """Pull [N] of one tendon whose bristle is in this state."""
    left = capstan(nonideal.friction, nonideal.sheath + path[2], z)
    pull = rounded(spool_pull(tendons, given[t], t, path[t % 2]) * left)
    return where(nonideal.held > 0.0, given[t], pull)


@compiled
def _as_it_was(nonideal: Any, state: Any, t: int, x: Any) -> Any:
    return state[row_of(t, Z)]


@compiled
def _pull(tendons: Any, nonideal: Any, given: Any, t: int, path: Any, bristle_of: Any) -> Any:
    x = path[t % 2]
    if nonideal is None:
        return rounded(tendons.stiffness * maximum(given[t] - x, 0.0 * x))
    return _at_wrist(tendons, nonideal, given, t, path, bristle_of(nonideal, tendons.state, t, x))


@compiled
def _pulls(tendons: Any, given: Any, path: Any, bristle_of: Any) -> Any:
    if tendons is None:
        return given[0], given[1]
    plus, minus = 0.0 * path[0], 0.0 * path[0]
    for t in range(0, len(given), 2):
        plus = plus + _pull(tendons, tendons.nonideal, given, t, path, bristle_of)
        minus = minus + _pull(tendons, tendons.nonideal, given, t + 1, path, bristle_of)
    return plus, minus


@compiled
def pulls_along(tendons: Any, given: Any, path: Any) -> Any:
    """Pulls [N] of both sides at the wrist at a path (plus, minus, bend); those given where `tendons` is None."""
    return _pulls(tendons, given, path, _slid)


@compiled
def pulls_at_start(tendons: Any, given: Any, path: Any) -> Any:
    """The same at the start of a step, where no tendon has slid yet."""
    return _pulls(tendons, given, path, _as_it_was)


@compiled
def _slope(tendons: Any, nonideal: Any, given: Any, t: int, path: Any, speed: Any) -> Any:
    """By how much the pull falls with travel at the start of a step [N/m]."""
    x = path[t % 2]
    if nonideal is None:
        return where(given[t] - x > 0.0, tendons.stiffness, 0.0 * x)
    z, wrapped = tendons.state[row_of(t, Z)], nonideal.friction * (nonideal.sheath + path[2])
    pull = spool_pull(tendons, given[t], t, x)
    taut = where(pull > 0.0, tendons.state[row_of(t, SHARE)] * tendons.stiffness, 0.0 * x)
    slope = (taut + pull * wrapped * bristle_slope(z, speed, nonideal.bristle)) * capstan(wrapped, 1.0 + 0.0 * x, z)
    return where(nonideal.held > 0.0, 0.0 * x, slope)


@compiled
def stiffen(tendons: Any, segment: Any, theta: Any, omega: Any, given: Any, path: Any, by_theta: Any) -> None:
    """Add to dr/d(theta) (n, n) what tendons on held spools add: arm_i (-dT/dx) arm_j of each."""
    if tendons is not None:
        n, ahead, behind = len(theta), lanes_like(theta), lanes_like(theta)
        zero = 0.0 * segment.length
        speed_plus, speed_minus = zero, zero
        for k in range(n):
            arm_plus, arm_minus = moment_arms(segment, theta[k])
            ahead[k] = arm_plus
            behind[k] = arm_minus
            speed_plus = speed_plus + arm_plus * omega[k]
            speed_minus = speed_minus + arm_minus * omega[k]
        plus, minus = zero, zero
        for t in range(0, len(given), 2):
            plus = plus + _slope(tendons, tendons.nonideal, given, t, path, speed_plus)
            minus = minus + _slope(tendons, tendons.nonideal, given, t + 1, path, speed_minus)
        for i in range(n):
            for j in range(n):
                by_theta[i, j] = by_theta[i, j] + plus * ahead[i] * ahead[j] + minus * behind[i] * behind[j]


@compiled
def settle(tendons: Any, theta: Any, given: Any, path: Any) -> None:
    """Take the state over to the end of a step, at coordinates theta with this path."""
    if tendons is not None:
        _settle(tendons.nonideal, tendons.state, theta, given, path)


@compiled
def _settle(nonideal: Any, state: Any, theta: Any, given: Any, path: Any) -> None:
    if nonideal is not None:
        for t in range(len(given)):
            state[row_of(t, Z)] = _slid(nonideal, state, t, path[t % 2])
            stretch, at = maximum(given[t] - path[t % 2], 0.0 * path[2]), row_of(t, _CREPT)
            state[at] = stretch + nonideal.tendon_keep * (state[at] - stretch)
        state[0] = path[0]
        state[1] = path[1]
        state[2] = path[2]
        for k in range(len(theta)):
            at = row_of(len(given), PATH) + k
            state[at] = theta[k] + nonideal.spring_keep * (state[at] - theta[k])
