"""Faults to inject, timed from a trial's motion or from power-on."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wristctl.config.injected import FaultKind, InjectedFault


class Faults:
    """Which faults are on at a time of the board's clock [s]; those of trials only once one begins."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        self._faults = tuple(faults)
        self._starts = {"power-on": 0.0, "first trial": math.inf, "trial": math.inf}

    def begin(self, start: float) -> None:
        """A trial's motion starts at this time."""
        self._starts["trial"] = start
        self._starts["first trial"] = min(start, self._starts["first trial"])

    def on(self, kind: FaultKind, time: float) -> bool:
        """Whether such a fault is on."""
        return self.since(kind, time) is not None

    def since(self, kind: FaultKind, time: float) -> float | None:
        """When the earliest fault of this kind that is on began; None where none is."""
        return min((self.begun(fault) for fault in self.active((kind,), time)), default=None)

    def next(self, kind: FaultKind, after: float) -> float:
        """When the next fault of this kind begins after a time; infinite where none does."""
        return min((time for fault in self.of((kind,)) if (time := self.begun(fault)) > after), default=math.inf)

    def of(self, kinds: Sequence[FaultKind]) -> list[InjectedFault]:
        """Those of these kinds, on or not."""
        return [fault for fault in self._faults if fault.kind in kinds]

    def active(self, kinds: Sequence[FaultKind], time: float) -> list[InjectedFault]:
        """Those of these kinds that are on."""
        return [fault for fault in self.of(kinds) if 0.0 <= time - self.begun(fault) < (fault.duration or math.inf)]

    def begun(self, fault: InjectedFault) -> float:
        """When a fault begins; infinite where what it counts from has not come."""
        return self._starts[fault.since] + fault.at
