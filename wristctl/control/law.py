"""What a controller is: a law, its gains with units and search boxes, and presets.

A law is a function of lanes, written once: `law(now, wrist, gains, memory) -> torque`. It runs in rollouts, in
batches for tuning and on hardware. `now` has the fields of NOW, `wrist` the Segments of the controller's
one-segment model, `gains` and `memory` are indexed rows; the law may write its memory.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from typing import Any

import numba

from wristctl.lanes.blocks import width
from wristctl.lanes.compiled import cache_folder
from wristctl.lanes.rows import rows_named
from wristctl.lanes.types import LaneType, RowsType
from wristctl.wrist.segments import Segments

NOW = ("theta", "rate", "theta_ref", "rate_ref", "acceleration_ref", "torque_low", "torque_high", "period")
"""What a law sees: measured angle and rate, the reference with two derivatives, the torques that the tendons can
reach now [N m], and the control period [s]."""

now_of = rows_named(NOW)
wrist_of = rows_named(Segments._fields)

Law = Callable[[Any, Any, Any, Any], Any]


@dataclass(frozen=True)
class Gain:
    """One gain: its unit, meaning, and the box in which a search looks for it (log10)."""

    unit: str
    meaning: str
    low: float
    high: float


@dataclass(frozen=True)
class Controller:
    """A named law with its gains; `memory` is the number of values it carries from tick to tick."""

    name: str
    law: Any
    source: str
    gains: Mapping[str, Gain]
    presets: Mapping[str, tuple[float, ...]]
    memory: int = 0
    notes: Mapping[str, str] = field(default_factory=dict)
    """What a reader should know about a preset."""

    def compiled(self, count: int = 1) -> Any:
        """The law as native code that every kernel of as many rollouts can call."""
        return _native(self.law, width(count))


@cache
def _native(law: Law, lanes: int) -> Any:
    number = LaneType(lanes)
    rows = RowsType(number, None)
    now, wrist = (RowsType(number, None, fields=fields) for fields in (NOW, Segments._fields))
    return numba.cfunc(number(now, wrist, rows, rows), cache=cache_folder() is not None)(law)
