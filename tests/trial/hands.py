"""Somebody's hand on an emulated wrist, or the edge of a table: forces that the bend itself makes, period by period."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.bench.motors import PERIOD
from wristctl.bench.virtual_bench import VirtualBench
from wristctl.config.plant import Disturbances

# Force [N] on the last disc by plane (P,), from the bend [rad] and its rate [rad/s] there, (P,) each.
Grip = Callable[[Array, Array], Array]

_STRONGEST = 80.0
"""Largest force of a hand [N]."""


def holding(stiffness: float, damping: float = 0.08) -> Grip:
    """Hold the wrist where it is first found, by a spring [N/rad] and a damper [N s/rad]."""
    found: list[Array] = []

    def grip(bend: Array, rate: Array) -> Array:
        found[:] = found or [bend]
        return np.clip(-stiffness * (bend - found[0]) - damping * rate, -_STRONGEST, _STRONGEST)

    return grip


def edge(further: float, stiffness: float) -> Grip:
    """An edge against which the wrist bends, so much further [rad] than where it is first found: it pushes one way."""
    found: list[Array] = []

    def grip(bend: Array, rate: Array) -> Array:
        found[:] = found or [bend, bend / max(1e-6, float(np.linalg.norm(bend)))]
        deep = max(0.0, float((bend - found[0]) @ found[1]) - further)
        return -stiffness * deep * found[1]

    return grip


def lay_hand_on(bench: VirtualBench, grip: Grip, since: float, duration: float = math.inf) -> None:
    """Let this act from so long after the first trial began [s], in trials that nobody pushes."""
    load, starts = bench.wrist._load, bench.faults._starts
    follow, n = load.follow, load.coordinates

    def held(
        spools: Any, stepper: Any, acting: tuple[Any, Array], edges: Any, first: int, begun: float, out: Array
    ) -> int:
        disturbances, times = acting
        heard = 0
        for k in range(len(out)):
            within = (first + k) * PERIOD - starts["first trial"] - since
            if 0.0 <= within < duration:
                bend, rate = (np.atleast_1d(load.bend(part)) for part in np.split(load._state, [n]))
                here = _with_force(disturbances, grip(bend, rate))
            else:
                here = disturbances
            one = slice(k, k + 1)
            heard += follow(spools, stepper, (here, times[one]), edges[heard:], first + k, begun, out[one])
        return heard

    load.follow = held  # type: ignore[method-assign]


def _with_force(disturbances: Disturbances, force: Array) -> Disturbances:
    """These with so much more force on the last disc, by plane (P,) [N]."""
    assert disturbances.push.force == 0.0, "in two planes a push has the direction of the force"
    if len(force) == 1:
        return disturbances.model_copy(update={"load": disturbances.load + float(force[0])})
    toward = math.radians(disturbances.toward_deg)
    ulnar, flexion = force + disturbances.load * np.array([math.cos(toward), math.sin(toward)])
    changed = {"load": math.hypot(ulnar, flexion), "toward_deg": math.degrees(math.atan2(flexion, ulnar))}
    return disturbances.model_copy(update=changed)
