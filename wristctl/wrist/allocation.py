"""Allocation: pulls within limits that give a wanted torque in two planes with the least sum of pulls.

A linear program with two equations: at its optimum two tendons, the basis, carry what the others leave, each of which
pulls least or greatest. Which of the two follows from the basis: with the vector m that has m.a = 1 for both its arms,
another tendon pulls greatest where m.a > 1. So each pair of tendons is the basis of those torques that it can carry
within its limits, and the regions of all pairs tile the reachable torques. All pairs are tried without a branch, and
the one that exceeds its limits least is taken. Where no limit is met it is the pair of neighbours around the torque.

The reachable torques are a zonotope, whose edges are parallel to the arms. A torque beyond it keeps its direction and
becomes the largest reachable one. Where nothing of its direction can be reached, as after the loss of a tendon, it is
the last reachable torque on the way from that of the least pulls to the wanted one.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.lanes.blocks import to_blocks
from wristctl.lanes.compiled import compiled, kernel
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import dot, planar, turn, where, zero_like
from wristctl.lanes.rows import lanes_like, part, planes_like, rows_of, square_like
from wristctl.lanes.types import LANES

# A pull [N] that is no limit: larger ones are taken for it, and arithmetic stays finite.
_NO_LIMIT = 1e9
# Pull k costs 1 + this times k^2. Of tendons whose arms end on one line no two bases are then equally good.
_TIE = 1e-12
# What is 0 but for rounding: areas of two arms, squares of an arm, both over the square of the longest; torques.
_PARALLEL, _NO_ARM, _ROUNDING = 1e-10, 1e-20, 1e-13
_TINY, _HUGE = 1e-300, 1e300
_FULL = 1.0 - 1e-12
# Pulls that Python's calls are filled up to, or to a multiple, with some that bend nothing: few numbers are compiled.
_TOGETHER = 6


@compiled
def allocate(arms: Any, torque: Any, least: Any, greatest: Any, pulls: Any) -> Any:
    """Write the pulls with the least sum that give a torque, and return the share of the torque that is reached.

    The share is 1 where the torque is reached and less where it is scaled. Pulls keep their limits in any case.

    Parameters
    ----------
    arms
        Moment arms of T pulls [m], planar vectors.
    torque
        Wanted torque [N m], a planar vector.
    least, greatest
        Limits of T pulls [N], lanes; the least is not negative, and an infinite one is no limit.
    pulls
        T lanes to write to [N].
    """
    zero = zero_like(least[0])
    room, cross = lanes_like(pulls), square_like(pulls)
    square, resting = zero, planar(zero, zero)
    for k in range(len(pulls)):
        room[k] = minimum(greatest[k] - least[k], _NO_LIMIT)
        square = maximum(square, dot(arms[k], arms[k]))
        resting = resting + least[k] * arms[k]
        cross[k, k] = zero
        for i in range(k):
            area = dot(turn(arms[i]), arms[k])
            cross[i, k] = area
            cross[k, i] = -area
    more, share = _reachable_part(arms, torque, resting, room, cross, square)
    _cheapest(arms, more, room, cross, square, pulls)
    for k in range(len(pulls)):
        pulls[k] = minimum(least[k] + pulls[k], greatest[k])
    return share


@compiled
def _distance(to_edge: Any, blur: Any) -> Any:
    """A distance that is not 0 but for rounding: where it is too small to tell, an edge is a little further."""
    return where(abs(to_edge) < blur, blur, to_edge)


@compiled
def _not_zero(size: Any) -> Any:
    return maximum(abs(size), _TINY)


@compiled
def _reachable_part(arms: Any, torque: Any, resting: Any, room: Any, cross: Any, square: Any) -> Any:
    """What of a torque is reached, less the torque of the least pulls, and its share of the wanted one.

    Across each arm, reachable torques lie between two edges: from `minus` below to `plus` above that of no pull. On
    the ray of the torque they have shares from `low` to `high`, on the way from the least pulls up to `way`.
    """
    one = 1.0 + zero_like(square)
    increment = torque - resting
    low, high, way = zero_like(square), one, one
    for i in range(len(room)):
        above, below = zero_like(square), zero_like(square)
        for k in range(len(room)):
            moment = room[k] * cross[i, k]
            above = above + maximum(moment, 0.0)
            below = below + maximum(-moment, 0.0)
        across = turn(arms[i])
        base, along, further = dot(across, resting), dot(across, torque), dot(across, increment)
        blur = _ROUNDING * (above + below + abs(base))
        plus, minus = _distance(base + above, blur), _distance(below - base, blur)
        is_arm = dot(across, across) > _NO_ARM * square
        inverse = 1.0 / _not_zero(along)
        high = where(is_arm, minimum(high, where(along > 0.0, plus, minus) * inverse), high)
        low = where(is_arm, maximum(low, where(along > 0.0, -minus, -plus) * inverse), low)
        ahead = _distance(where(further > 0.0, above, below), blur)
        way = where(is_arm, minimum(way, ahead / _not_zero(further)), way)
    on_ray = where(low <= high, one, zero_like(square))
    share = where(low <= high, high, way)
    return share * ((on_ray * torque) + ((one - on_ray) * increment)) - on_ray * resting, share


@compiled
def _cheapest(arms: Any, torque: Any, room: Any, cross: Any, square: Any, pulls: Any) -> None:
    """Write the pulls between 0 and `room` with the least sum that give a reachable torque."""
    count, carried = len(pulls), lanes_like(pulls)
    least_excess = _HUGE + zero_like(square)
    for k in range(count):
        pulls[k] = zero_like(square)
    for j in range(count):
        for i in range(j):
            area, rest = cross[i, j], torque
            for k in range(count):
                if k != i and k != j:
                    price = (1.0 + _TIE * i * i) * cross[j, k] + (1.0 + _TIE * j * j) * cross[k, i]
                    pays = (price + (1.0 + _TIE * k * k) * area) * area < 0.0
                    carried[k] = where(pays, room[k], 0.0)
                    rest = rest - carried[k] * arms[k]
            is_basis = abs(area) > _PARALLEL * square
            inverse = 1.0 / where(is_basis, area, 1.0)
            first, second = dot(turn(rest), arms[j]) * inverse, dot(turn(arms[i]), rest) * inverse
            excess = maximum(maximum(-first, first - room[i]), maximum(-second, second - room[j]))
            excess = maximum(excess, 0.0)
            carried[i], carried[j] = clip(first, 0.0, room[i]), clip(second, 0.0, room[j])
            is_better = is_basis & (excess < least_excess)
            least_excess = where(is_better, excess, least_excess)
            for k in range(count):
                pulls[k] = where(is_better, carried[k], pulls[k])


@kernel
def _allocate_blocks(arms: Any, torques: Any, limits: Any, out: Any, tendons: Any) -> None:
    count = len(tendons)
    for block in range(arms.shape[0]):
        rows, torque, bounds = rows_of(arms[block]), rows_of(torques[block]), rows_of(limits[block])
        result = rows_of(out[block])
        pulls = part(result, 0, tendons)
        vectors = planes_like(pulls)
        for k in range(count):
            vectors[k] = planar(rows[2 * k], rows[2 * k + 1])
        least, greatest = part(bounds, 0, tendons), part(bounds, count, tendons)
        result[count] = allocate(vectors, planar(torque[0], torque[1]), least, greatest, pulls)


class Allocation(NamedTuple):
    """Pulls for P wanted torques."""

    pulls: Array
    """(P, T) [N]"""
    share: Array
    """Share of each torque that is reached (P,), 1 where all of it is."""

    @property
    def saturated(self) -> NDArray[np.bool_]:
        """Whether each torque is out of reach (P,)."""
        return self.share < _FULL


def allocated(arms: ArrayLike, torque: ArrayLike, least: ArrayLike, greatest: ArrayLike) -> Allocation:
    """Pulls with the least sum for many torques.

    Parameters
    ----------
    arms
        Moment arms (P, T, 2) [m] at each pose, or (T, 2) at one.
    torque
        Wanted torques (P, 2) [N m].
    least, greatest
        Limits of each pull (T,), or one for all [N].

    Raises UserError for limits that are negative, not in order or not numbers.
    """
    wanted = np.atleast_2d(np.asarray(torque, float))
    poses, tendons = len(wanted), np.shape(arms)[-2]
    count = -(-tendons // _TOGETHER) * _TOGETHER
    levers, limits = np.zeros((poses, count, 2)), np.zeros((2, count))
    levers[:, :tendons] = arms
    limits[:, :tendons] = _limits(least, greatest, tendons)
    blocks = _full_blocks(levers.reshape(poses, 2 * count))
    out = np.zeros((len(blocks), count + 1, LANES))
    rows = np.broadcast_to(limits.reshape(-1), (poses, 2 * count))
    _allocate_blocks(blocks, _full_blocks(wanted), _full_blocks(rows), out, (0,) * count)
    result = out.transpose(0, 2, 1).reshape(-1, count + 1)[:poses]
    return Allocation(result[:, :tendons], result[:, count])


def _full_blocks(rows: Array) -> Array:
    """`to_blocks`, but a row alone fills a block too: one width is compiled."""
    return to_blocks(np.repeat(rows, 2, axis=0) if len(rows) == 1 else rows)


def _limits(least: ArrayLike, greatest: ArrayLike, tendons: int) -> tuple[Array, Array]:
    low, high = (np.array(np.broadcast_to(limit, tendons), float) for limit in (least, greatest))
    for number, (smallest, largest) in enumerate(zip(low, high, strict=True), 1):
        if not 0.0 <= smallest <= largest:
            what = f"pull {number} cannot be between {smallest:g} and {largest:g} N"
            raise UserError(what, f"pull {number}", "0 <= least <= greatest")
    return low, high
