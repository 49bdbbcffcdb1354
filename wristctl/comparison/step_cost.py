"""Cost of a control step on this machine: the law and its allocation, for one wrist."""

import time
from typing import Any, NamedTuple

import numpy as np

from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, Controller, now_of, signals_of, wrist_of
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE, allocate, moment_arms


class StepTime(NamedTuple):
    """Microseconds of one control step over chunks of steps: median and 99th percentile."""

    median: float
    p99: float


# Chunks that are timed, and the steps of each: enough to hide the call.
_CHUNKS, _STEPS = 400, 500
# Repetitions for plain Python, where the call costs little beside the step.
_PLAIN_CHUNKS, _PLAIN_STEPS = 50, 2


@kernel
def _steps(law: Any, count: int, now: Any, wrist: Any, limits: Any, gains: Any, memory: Any) -> None:
    segment_rows, view, signals, bound = load_segments(rows_of(wrist)), now_of(now), rows_of(now), rows_of(limits)
    torque = lanes_like(part(bound, 0, (0,)))
    arms = lanes_like(part(bound, 0, (0, 0)))
    for _ in range(count):
        arms[0], arms[1] = moment_arms(segment_rows, view.theta)
        law(
            view, wrist_of(wrist), rows_of(gains), rows_of(memory), beyond(arms, 0), bound, beyond(bound, 2),
            beyond(torque, 0),
        )  # fmt: skip
        plus, minus = allocate(view.theta, segment_rows, torque[0], bound[0], bound[2])
        signals[0] = view.theta + 0.0 * (plus - minus)  # the next step waits for this one, as in a loop


def step_time(controller: Controller, gains: tuple[float, ...], wrist: WristParameters) -> StepTime:
    """Time law and allocation over 400 chunks of 500 steps (plain Python: 50 of 2), after one that compiles them."""
    now, model, rows = np.zeros(signals_of(controller.preview)), segments(wrist, 1), np.array([*gains, 0.0])
    now[NOW.index("period")] = Loop().control_period
    limits = TENDONS_PER_SIDE * np.repeat([wrist.pretension, wrist.tension_limit], 2)
    memory, law, times = np.zeros(controller.memory + 1), controller.compiled(), []
    chunks, steps = (_PLAIN_CHUNKS, _PLAIN_STEPS) if controller.plain else (_CHUNKS, _STEPS)
    for _ in range(chunks + 1):
        start = time.perf_counter()
        _steps(law, steps, now, model, limits, rows, memory)
        times.append((time.perf_counter() - start) / steps * 1e6)
    law.check()
    return StepTime(float(np.median(times[1:])), float(np.percentile(times[1:], 99)))
