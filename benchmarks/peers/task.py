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


@dataclass(frozen=True)
class BendTask:
    """A closed loop in two planes; SI units. `plant` and `believed` are values of wristctl's `spatial_values`, the
    models those of `Segments` in each plane."""

    segments: int
    period: float
    low: float
    """Least pull of a tendon [N]."""
    high: float
    reach: float
    """Bend beyond which a wrist has failed [rad]."""
    plant: np.ndarray
    believed: np.ndarray
    model_y: np.ndarray
    model_z: np.ndarray
    gains: np.ndarray
    reference: np.ndarray
    """Bends with two derivatives at each tick, (2, 3, ticks)."""

    @property
    def ticks(self) -> int:
        """Control periods of the horizon."""
        return int(self.reference.shape[2])

    def save(self, path: Path) -> None:
        """Write to an npz file."""
        np.savez(path, **{field.name: getattr(self, field.name) for field in fields(self)})


def load(path: str | Path) -> Task | BendTask:
    """Read what `save` wrote."""
    with np.load(path) as found:
        values = {name: value.item() if value.ndim == 0 else value for name, value in found.items()}
    return BendTask(**values) if "believed" in values else Task(**values)
