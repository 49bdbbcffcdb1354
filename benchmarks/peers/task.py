"""The task that every side gets: one wrist, one law, one reference, one grid. Read from a file; needs NumPy only."""

from __future__ import annotations

from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np


@dataclass(frozen=True)
class Task:
    """A closed loop; SI units. `plant` and `model` are values of wristctl.wrist.segments.Segments."""

    segments: int
    period: float
    low: float
    """Least pull of one side [N]."""
    high: float
    plant: np.ndarray
    model: np.ndarray
    gains: np.ndarray
    reference: np.ndarray
    """Angle, rate and acceleration at each tick, (ticks, 3)."""
    rest: float
    """Time at which the reference rests [s]."""

    @property
    def ticks(self) -> int:
        """Control periods of the horizon."""
        return len(self.reference)

    def save(self, path: Path) -> None:
        """Write to an npz file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})


def load(path: str | Path) -> Task:
    """Read what `save` wrote."""
    with np.load(path) as found:
        values = {field.name: found[field.name] for field in fields(Task)}
    scalars = ("segments", "period", "low", "high", "rest")
    return Task(**{name: value.item() if name in scalars else value for name, value in values.items()})
