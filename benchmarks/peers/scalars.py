"""NumPy's names for plain Python numbers, so that one rollout's law costs a peer no more than it must."""

from __future__ import annotations

from math import tanh

__all__ = ["clip", "tanh", "where"]


def where(condition: bool, yes: float, no: float) -> float:
    """`yes` if the condition holds, else `no`."""
    return yes if condition else no


def clip(x: float, low: float, high: float) -> float:
    """x held between low and high."""
    return min(max(x, low), high)
