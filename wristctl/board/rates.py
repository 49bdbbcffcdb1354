"""What is said of all four axes: step rates that the board can follow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from wristctl.board.messages import MAX_RATE, TOTAL_RATE, Rate

LEAST_LIFE: float = Rate._field_defaults["life"]
"""Seconds for which a step rate lives where nobody says otherwise."""

Axes = tuple[float, float, float, float]


def within_reach(rates: Sequence[float]) -> Axes:
    """Rates (steps/s) with each within MAX_RATE, and all scaled down together where they exceed TOTAL_RATE."""
    single = [max(-MAX_RATE, min(MAX_RATE, float(rate))) for rate in rates]
    total = sum(map(abs, single))
    return four([rate * min(1.0, TOTAL_RATE / total) if total else 0.0 for rate in single], float)


def four(values: Sequence[float], kind: Callable[[float], Any]) -> tuple[Any, Any, Any, Any]:
    """Four values as the messages have them. ValueError for another number."""
    first, second, third, fourth = (kind(value) for value in values)
    return first, second, third, fourth
