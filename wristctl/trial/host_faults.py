"""Faults of the host itself, injected to see how a trial ends: a broken law, a NaN, a full disk."""

from __future__ import annotations

import math
from collections.abc import Sequence

from wristctl.bench.fault_injection import Faults
from wristctl.config.injected import InjectedFault
from wristctl.trial.steering import Answer


class HostFaults:
    """Those of the bench's faults that happen in the control loop; times count from the trial's motion."""

    def __init__(self, faults: Sequence[InjectedFault]) -> None:
        self._faults = Faults(faults)
        self._faults.begin(0.0)

    def answer(self, answer: Answer, time: float) -> Answer:
        """The law's answer; NaN under model-nan. Raises ArithmeticError under controller-exception."""
        if self._faults.on("controller-exception", time):
            raise ArithmeticError("injected fault")
        return answer._replace(torque_wanted=math.nan) if self._faults.on("model-nan", time) else answer

    def disk(self, time: float) -> bool:
        """Whether the disk is full."""
        return self._faults.on("disk-full", time)
