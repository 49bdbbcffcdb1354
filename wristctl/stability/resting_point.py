"""Where a loop rests: a state that no tick changes."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.kernel import RECORDED
from wristctl.stability.loop_ticks import LoopTicks, TickSlopes

_STILL = 1e-8
"""Change in one tick, in typical sizes, that is none."""
_TRIES = 60
_FURTHEST = 0.3
"""Of one step of Newton's method, in typical sizes."""
_FREE = 1e-10
"""Directions in which the state may drift, in typical sizes: an integrator's that nothing drives."""
_TURNS = 5
"""Of finding the path that belongs to where the wrist is."""
_THETA = RECORDED.index("theta")


class RestingPoint(NamedTuple):
    """A state (x,) that no tick changes, and the ticks about it."""

    state: Array
    ticks: list[TickSlopes]

    def recorded(self, name: str) -> float:
        """What the kernel records there, by its name in RECORDED."""
        return float(self.ticks[0].recorded[RECORDED.index(name)])


def resting_point(loop: LoopTicks) -> RestingPoint | None:
    """Newton's method on all ticks of a cycle at once, stable or not; None where nothing rests nearby.

    All of them must leave the same state, so that a loop which grows fast within its cycle is found as well as another.
    """
    tried = [RestingPoint(each, loop.slopes(each)) for each in loop.guesses()]
    for point in sorted(tried, key=lambda each: change_in(loop, each)):
        found = _newton(loop, point)
        if change_in(loop, found) < _STILL:
            return found
    return None


def with_relaxed_bristles(loop: LoopTicks, sliding: LoopTicks, point: RestingPoint) -> RestingPoint:
    """Where a loop with friction rests whose bristles are relaxed, which is where the same one rests without friction.

    `point` is that one's, in the state of its own loop, `sliding`.
    """
    state = np.zeros(len(loop.sizes))
    own, known = np.array(loop.names), np.array(sliding.names)
    for name in dict.fromkeys(sliding.names):
        state[own == name] = point.state[known == name]
    path = own == "path"
    for _ in range(_TURNS):
        state[path] = loop.slopes(state)[0].after[path]
    return _newton(loop, RestingPoint(state, loop.slopes(state)))


def change_in(loop: LoopTicks, point: RestingPoint) -> float:
    """The largest change of any variable in any tick, in typical sizes; inf where the wrist is not where it can be."""
    if not all(math.isfinite(each.recorded[_THETA]) for each in point.ticks):
        return math.inf
    change = max(float(np.abs((each.after - point.state) / loop.sizes).max()) for each in point.ticks)
    return change if math.isfinite(change) else math.inf


def _newton(loop: LoopTicks, point: RestingPoint) -> RestingPoint:
    sizes, own = loop.sizes, np.eye(len(loop.sizes))
    best = point
    for _ in range(_TRIES):
        now = change_in(loop, point)
        if now < change_in(loop, best):
            best = point
        if not math.isfinite(now) or now < 1e-3 * _STILL:
            break
        ticks = list({id(each): each for each in point.ticks}.values())
        change = np.concatenate([(each.after - point.state) / sizes for each in ticks])
        slopes = np.concatenate([each.transition * sizes / sizes[:, None] - own for each in ticks])
        step = np.linalg.lstsq(slopes, change, rcond=_FREE)[0]
        state = point.state - min(1.0, _FURTHEST / max(float(np.abs(step).max()), 1e-300)) * sizes * step
        if np.array_equal(state, point.state):
            break
        point = RestingPoint(state, loop.slopes(state))
    return best
