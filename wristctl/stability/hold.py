"""The law that holds a torque, whatever happens: behind it stands the wrist with its motors alone."""

from __future__ import annotations

from typing import Any

from wristctl.control.law import Controller, Gain


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque that it is given."""
    return gains.torque


HOLD = Controller(
    name="hold",
    law=law,
    source="the plant alone",
    gains={"torque": Gain("N m", "held", 1e-3, 1e1)},
    presets={},
)
