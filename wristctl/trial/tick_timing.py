"""How punctual a loop's ticks are."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np


@dataclass
class TickTiming:
    """When ticks began, against when they were due."""

    period: float
    late: list[float] = field(default_factory=list)
    """Of each tick [s]."""
    overruns: int = 0
    """Ticks that were skipped because one before took too long."""

    def jitter(self, share: float) -> float:
        """This quantile of lateness [s]."""
        return float(np.quantile(self.late, share)) if self.late else math.nan
