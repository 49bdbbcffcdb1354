"""Boxes of positive gains as a unit cube, in which an optimiser searches by factors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.control.law import Gain


@dataclass(frozen=True)
class GainSpace:
    """Boxes of g positive gains; a coordinate u in [0, 1] is the gain low * (high / low)^u."""

    names: tuple[str, ...]
    low: Array
    """(g,)"""
    high: Array
    """(g,)"""

    @classmethod
    def of(cls, gains: Mapping[str, Gain]) -> GainSpace:
        """The search boxes of a controller's gains, in their order."""
        low, high = (np.array([getattr(gain, side) for gain in gains.values()]) for side in ("low", "high"))
        return cls(tuple(gains), low, high)

    @property
    def decades(self) -> Array:
        """Width of each box in powers of ten, (g,)."""
        return np.log10(self.high / self.low)

    def gains(self, unit: Array) -> Array:
        """Gains (..., g) at points (..., g) of the unit cube; never outside the box by rounding."""
        return np.clip(self.low * 10.0 ** (self.decades * unit), self.low, self.high)

    def unit(self, gains: Array) -> Array:
        """Points (..., g) of the unit cube of gains (..., g); UserError for a gain outside its box."""
        outside = ~((gains >= self.low) & (gains <= self.high))
        if outside.any():
            column = int(np.argmax(outside.reshape(-1, len(self.names)).any(axis=0)))
            box = f"{self.low[column]:g} to {self.high[column]:g}"
            raise UserError(f"gain {self.names[column]} outside its search box", fix=f"start within {box}")
        return np.log10(gains / self.low) / self.decades
