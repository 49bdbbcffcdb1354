"""The error of every side, and the step with which it reaches wristctl's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import truth
from running import Failed, Running
from say import say
from table import OURS, Side

SLACK = 1.05
"""An error this much larger counts as equal: the same method in another order of additions."""

BLOWN_UP = 0.1
"""Error [rad] beyond which a step is no solution."""


def errors(sides: tuple[Side, ...], file: Path, segments: int, implicit: np.ndarray) -> dict[str, dict[str, Any]]:
    """Of each side, largest error of its motion [rad] by steps a tick, up to the first that is at most wristctl's.

    It is held against its own trajectory with `fine` steps where it solves other equations, else against `implicit`.
    `steps` is the number of steps that reaches wristctl's error, `reached` whether any does (else it is the finest
    tried), `model_difference` how far the two reference trajectories are apart.
    """
    found: dict[str, dict[str, Any]] = {}
    wanted = np.inf
    for side in sides:
        say(f"error of {side.name}, n = {segments}")
        try:
            own = trajectory(side, file, side.fine[segments]) if side.fine else implicit
            tried: dict[int, float] = {}
            steps = 1
            while steps <= side.most_steps:
                tried[steps] = _far(trajectory(side, file, steps), own)
                if tried[steps] <= SLACK * wanted:
                    break
                steps *= 2
        except Failed as failure:
            say(f"  left out: {failure}")
            found[side.name] = {"failed": str(failure)}
            continue
        if side.name == OURS:
            wanted = tried[1]
        steps = max(tried)
        found[side.name] = {
            "errors": tried, "steps": steps, "reached": bool(tried[steps] <= SLACK * wanted),
            "model_difference": _far(own, implicit),
        }  # fmt: skip
    return found


def trajectory(side: Side, file: Path, steps: int) -> np.ndarray:
    """What a side answers of its motion over the first ticks, alone on one core."""
    with Running(side, file, 1, steps) as running:
        return np.array(running.ask(1, truth.COMPARED, theta=True)["theta"])


def _far(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference; infinite where a side blew up."""
    with np.errstate(all="ignore"):
        apart = float(np.max(np.abs(a - b)))
    return apart if np.isfinite(apart) else float("inf")


def variants(sides: tuple[Side, ...], found: dict[str, Any]) -> list[tuple[Side, int]]:
    """Each side with one step a tick, unless that blows up, and with the steps that reach wristctl's error."""
    pairs = []
    for side in sides:
        if "errors" in found[side.name]:
            errors_by_steps = found[side.name]["errors"]
            steps = {1, found[side.name]["steps"]}
            pairs += [(side, count) for count in sorted(steps) if errors_by_steps[count] < BLOWN_UP]
    return pairs
