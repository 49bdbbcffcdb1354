"""Stick and slip: a wrist that rests while its reference moves, and then jumps.

Friction holds a wrist until what pulls at it is enough; what was stored meanwhile is let go at once.
"""

import math

import numpy as np
from numpy.typing import NDArray

from wristctl.simulation.trajectory import Trajectory, size_of

# Rate [rad/s] above which a reference moves, and share of its rate below which the wrist rests.
MOVING, RESTING = math.radians(1.0), 0.1
# Shortest rest [s] behind which a motion can be a jump, and time [s] in which a jump is over.
SHORTEST, SUDDEN = 0.05, 0.1


def plateau(course: Trajectory) -> float:
    """Longest time [s] at rest while the reference moves; nan where the wrist has failed."""
    if course.failed:
        return math.nan
    return max((last - first for first, last in _rests(course)), default=0) * _step(course)


def jump(course: Trajectory) -> float:
    """Largest sudden motion after a rest [rad]: by how much more than its reference the wrist moves within SUDDEN.

    nan where the wrist has failed; 0 without such a rest.
    """
    if course.failed:
        return math.nan
    window, shortest = max(1, round(SUDDEN / _step(course))), SHORTEST / _step(course) * (1.0 - 1e-9)
    ends = np.array([last for first, last in _rests(course) if last - first >= shortest], np.int64)
    if not len(ends):
        return 0.0
    after = np.minimum(ends + window, len(course.time) - 1)
    own, wanted = (size_of(path[after] - path[ends]) for path in (course.bend, course.bend_ref))
    return float(np.maximum(own - wanted, 0.0).max())


def _rests(course: Trajectory) -> NDArray[np.int64]:
    """First and last sample of each stretch at rest while the reference moves, (stretches, 2)."""
    step = _step(course)
    rate, wanted = (size_of(np.diff(path, axis=0)) / step for path in (course.bend, course.bend_ref))
    at_rest = (wanted > MOVING) & (rate < RESTING * wanted)
    edges = np.diff(np.concatenate([[False], at_rest, [False]]).astype(np.int8))
    return np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1)])


def _step(course: Trajectory) -> float:
    return float(course.time[1] - course.time[0])
