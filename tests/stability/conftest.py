"""Loops whose margins others can tell too: as matrices, and as configured."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np
import pytest
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.stability.linearise import LinearLoop
from wristctl.stability.loop_analysis import AnalysedRow
from wristctl.stability.sampled_loop import LinearTick, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading


@pytest.fixture(autouse=True, scope="session")
def one_thread() -> Iterator[None]:
    """Small matrices: more threads are slower."""
    with threadpool_limits(limits=1):
        yield


LAGGED, TENDON = Actuator(level="lagged"), Actuator(level="tendon")
CAMERA = Sensor(level="camera", noise_deg=0.0, dropped=0.0)
PID = {"Kp": 10.0, "Ki": 20.0, "Kd": 0.5}


def closed(transition: Array, into: Array, back: Array, period: float) -> SampledLoop:
    """The loop of the open one C (zI - A)^-1 B, fed back negatively."""
    outputs = {"theta": back}
    return SampledLoop(period, [LinearTick(transition - np.outer(into, back), into, -back, into, True, outputs)])


def periodic(ticks: Sequence[tuple[Array, Array, Array, bool]], period: float) -> SampledLoop:
    """A loop of open ticks (A, B, C), each cut or not."""
    made = [LinearTick(a - cut * np.outer(b, c), b * cut, -c, b, cut, {"theta": c}) for a, b, c, cut in ticks]
    return SampledLoop(period, made)


def row(law: str, gains: str | dict[str, float], loop: Loop, friction: FrictionReading = "slipping") -> AnalysedRow:
    """A row of the default wrist."""
    chosen = controller(law)
    values = gains_of(chosen, gains)
    return AnalysedRow(chosen, dict(zip(chosen.gains, values, strict=True)), loop, WristParameters(), friction)


def linear(law: str, gains: str | dict[str, float], loop: Loop, degrees: float = 0.0) -> LinearLoop:
    """It, linearised at an angle."""
    found = row(law, gains, loop).linear(np.radians(degrees))
    assert found is not None
    return found
