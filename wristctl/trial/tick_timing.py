"""When the ticks of a loop began, against when they were due, and who made them late."""

import math
from collections import Counter
from dataclasses import dataclass, field

import numpy as np

from wristctl.trial.camera_pace import CameraPaces

SCHEDULING, WORK = "the computer woke the loop late", "the loop's own work took long"
# Who makes ticks late, and what to do about it.
FIX = {
    SCHEDULING: "close other programs, or give the loop priority: hw-run --priority",
    WORK: "a longer control_period, or a faster computer",
}


@dataclass
class TickTiming:
    """Timing of a run's ticks and of the camera's pictures beside them."""

    period: float
    late: list[float] = field(default_factory=list)
    """Lateness of the ticks [s]."""
    overruns: int = 0
    """Ticks that were skipped because one before took too long."""
    culprits: Counter[str] = field(default_factory=Counter)
    """Who made how many ticks end after the next was due."""
    camera: CameraPaces = field(default_factory=CameraPaces)

    def jitter(self, share: float) -> float:
        """This quantile of lateness [s]."""
        return float(np.quantile(self.late, share)) if self.late else math.nan

    def tick(self, late: float, woken: float, took: float, skipped: int) -> str:
        """A tick has ended: it began `late`, of which the computer slept on for `woken` seconds; it took so long; and
        so many after it are skipped. Who was slower."""
        culprit = SCHEDULING if woken >= took else WORK
        if late + took > self.period:
            self.culprits[culprit] += 1
        self.late.append(late)
        self.overruns += skipped
        return culprit

    def said(self) -> str:
        """In words."""
        median, late, most = (f"{1e3 * self.jitter(share):.2f} ms" for share in (0.5, 0.99, 1.0))
        blamed = "; ".join(f"{who} ({count} ticks)" for who, count in self.culprits.most_common())
        return (
            f"{len(self.late)} ticks of {1e3 * self.period:g} ms, late by {median} (p50), {late} (p99), {most} at "
            f"most; {self.overruns} overruns" + (f"; {blamed}" if blamed else "")
        )
