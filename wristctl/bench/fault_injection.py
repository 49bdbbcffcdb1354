"""Faults to inject, timed from the start of each trial's motion."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wristctl.config.bench import FaultKind, InjectedFault


class Faults:
    """Which faults are on at a time of the board's clock [s]; none before a trial begins."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        self._faults = tuple(faults)
        self._start = math.inf

    def begin(self, start: float) -> None:
        """The trial's motion starts at this time."""
        self._start = start

    def on(self, kind: FaultKind, time: float) -> bool:
        """Whether such a fault is on."""
        return self.since(kind, time) is not None

    def since(self, kind: FaultKind, time: float) -> float | None:
        """When the earliest fault of this kind that is on began; None where none is."""
        began = [self._start + fault.at for fault in self._faults if fault.kind == kind and self._is_on(fault, time)]
        return min(began, default=None)

    def next(self, kind: FaultKind, after: float) -> float:
        """When the next fault of this kind begins after a time; infinite where none does."""
        begins = (self._start + fault.at for fault in self._faults if fault.kind == kind)
        return min((time for time in begins if time > after), default=math.inf)

    def _is_on(self, fault: InjectedFault, time: float) -> bool:
        return 0.0 <= time - self._start - fault.at < (fault.duration or math.inf)
