"""How the linearised closed loop answers a step of its reference."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from wristctl.arrays import Array
from wristctl.stability.margins import NEUTRAL
from wristctl.stability.sampled_loop import SampledLoop

_DECAYED, _LONGEST, _SAMPLES = 1e-5, 60.0, 20_000
_SLOW = 30.0 * NEUTRAL
"""Decay [1/s] of what does not end within the longest time [s]: it is left out of how long to look."""


@dataclass(frozen=True)
class StepResponse:
    """The angle after a step of 1 of its reference at 0, (T,) at times [s], and what is told of it.

    Rise from 10 to 90 %, overshoot, and the time until it stays within 2 %, all of where it ends; `final` is that, as a
    share of the step. nan where the loop is unstable.
    """

    time: Array
    angle: Array
    rise: float
    overshoot: float
    settling: float
    final: float


def step_response(loop: SampledLoop) -> StepResponse:
    """The step response of a loop until it has settled, sampled at its ticks (every so many in a long one)."""
    rates = [mode.growth for mode in loop.modes()]
    if max(rates) > NEUTRAL:
        return StepResponse(np.zeros(0), np.zeros(0), *(4 * [math.nan]))
    slowest = min((-rate for rate in rates if rate < -_SLOW), default=1.0)
    lasts = min(-math.log(_DECAYED) / slowest, _LONGEST)
    time, angle = _course(loop, lasts)
    return StepResponse(time, angle, *step_info(time, angle))


def step_info(time: Array, angle: Array) -> tuple[float, float, float, float]:
    """Rise [s], overshoot (share), settling [s] and final value of a response (T,), which ends at its last sample."""
    final = float(angle[-1])
    share = angle / final
    rise = float(time[np.argmax(share >= 0.9)] - time[np.argmax(share >= 0.1)])
    outside = np.flatnonzero(np.abs(share - 1.0) >= 0.02)
    settling = float(time[outside[-1] + 1]) if len(outside) else 0.0
    return rise, max(float(share.max()) - 1.0, 0.0), settling, final


def _course(loop: SampledLoop, lasts: float) -> tuple[Array, Array]:
    """Every tick, or, where that were too many, every so many cycles; from one to the next they are one map."""
    count, cycle = math.ceil(lasts / loop.period), len(loop.ticks)
    whole, forced = np.eye(len(loop.ticks[0].into)), np.zeros(len(loop.ticks[0].into))
    rows, pushes = [], []
    for tick in loop.ticks:
        rows.append(tick.outputs["theta"] @ whole)
        pushes.append(tick.outputs["theta"] @ forced)
        whole, forced = tick.transition @ whole, tick.transition @ forced + tick.reference
    stride = max(1, count // (_SAMPLES * cycle))
    if stride > 1:
        rows, pushes = rows[:1], pushes[:1]
        one, push = whole, forced
        for _ in range(stride - 1):
            whole, forced = one @ whole, one @ forced + push
    state, found = np.zeros(len(forced)), []
    for _ in range(math.ceil(count / (cycle * stride)) + 1):
        found.append(np.array(rows) @ state + pushes)
        state = whole @ state + forced
    angle = np.concatenate(found)
    each = loop.period * (cycle * stride if stride > 1 else 1)
    return each * np.arange(len(angle), dtype=np.float64), angle
