"""The two-plane part of a run: errors, agreement with the plain C loop, and speeds on one core."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from bend_truth import make_bend_task
from errors import errors, trajectory, variants
from measure import speeds
from say import say
from table import OURS, Side
from venvs import CACHE

LANES = [1, 64]
"""One, and full blocks."""
FINE = 16
"""Steps a tick of wristctl's own motion, which it and sides with the same equations are held against."""
SAME = 1e-7
"""Largest difference [rad] between coordinates of wristctl and of the C loop, which take the same steps."""


def two_planes(
    sides: tuple[Side, ...], missing: dict[str, str], counts: list[int], budget: float, rounds: int
) -> dict[str, Any]:
    """Measurements for these numbers of segments, as `run.py` has them of one plane.

    Ends the run where the C loop's coordinates are not wristctl's at every tick of the first second.
    """
    raw: dict[str, Any] = {
        "sides": {side.name: {"peer": side.peer, "problem": side.problem} for side in sides},
        "missing": missing, "errors": {}, "speeds": [], "apart": {},
    }  # fmt: skip
    ours = next(side for side in sides if side.name == OURS)
    for n in counts:
        file = CACHE / f"bends-{n}.npz"
        make_bend_task(n).save(file)
        present = tuple(side for side in sides if n in side.segments)
        say(f"two planes: fine steps, n = {n}")
        known = errors(present, file, n, trajectory(ours, file, FINE))
        raw["errors"][str(n)] = known
        for side in present:
            if side.peer == "C" and "errors" in known[side.name]:
                raw["apart"][str(n)] = _same(ours, side, file)
        raw["speeds"] += speeds(variants(present, known), file, n, 1, LANES, budget, rounds)
    return raw


def _same(ours: Side, other: Side, file: Path) -> float:
    apart = float(np.abs(trajectory(ours, file, 1) - trajectory(other, file, 1)).max())
    if not apart <= SAME:
        raise SystemExit(f"{other.name} bends otherwise than wristctl in two planes, by {apart:.1e} rad")
    return apart
