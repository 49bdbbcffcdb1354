"""What a control step costs on this machine: the law and its allocation, for one wrist."""

from __future__ import annotations

import time
from typing import Any, NamedTuple

import numpy as np

from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller, now_of, wrist_of
from wristctl.lanes.blocks import to_blocks
from wristctl.lanes.compiled import compiled
from wristctl.lanes.rows import rows_of
from wristctl.wrist.allocation import TENDONS_PER_SIDE, allocate
from wristctl.wrist.segments import load_segments, segments


class StepTime(NamedTuple):
    """Microseconds of one control step over chunks of steps: median and 99th percentile."""

    median: float
    p99: float


@compiled
def _steps(law: Any, count: int, now: Any, wrist: Any, limits: Any, gains: Any, memory: Any, out: Any) -> None:
    known, view, pull = load_segments(rows_of(wrist)), now_of(now), rows_of(out)
    signals = rows_of(now)
    low, high = rows_of(limits)[0], rows_of(limits)[1]
    for _ in range(count):
        torque = law(view, wrist_of(wrist), rows_of(gains), rows_of(memory))
        plus, minus = allocate(view.theta, known, torque, low, high)
        signals[0] = view.theta + 1e-9 * (plus - minus)  # the next step waits for this one, as in a loop
        pull[0] = plus
        pull[1] = minus


def step_time(controller: Controller, gains: tuple[float, ...], wrist: WristParameters) -> StepTime:
    """Time law and allocation over 400 chunks of 500 steps."""
    row = np.zeros((1, len(NOW)))
    row[0, NOW.index("period")] = 1e-3
    now, model = to_blocks(row)[0], to_blocks(segments(wrist, 1)[None])[0]
    rows = to_blocks(np.array([[*gains, 0.0]]))[0]
    limits = to_blocks(TENDONS_PER_SIDE * np.array([[wrist.pretension, wrist.tension_limit]]))[0]
    memory, out = np.zeros((max(1, controller.memory), now.shape[1])), np.zeros((2, now.shape[1]))
    _steps(controller.compiled, 10, now, model, limits, rows, memory, out)
    times = []
    for _ in range(400):
        start = time.perf_counter()
        _steps(controller.compiled, 500, now, model, limits, rows, memory, out)
        times.append((time.perf_counter() - start) / 500 * 1e6)
    return StepTime(float(np.median(times)), float(np.percentile(times, 99)))
