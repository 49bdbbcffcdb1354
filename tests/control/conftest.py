"""A closed loop that keeps what a law remembers, which rollouts do not record."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.control.law import NOW, signals_of
from wristctl.control.table import controller
from wristctl.control.vetting import call_in_one_plane
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import part, rows_of
from wristctl.wrist.integrator import step
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.tendon_mechanics import NoTendons
from wristctl.wrist.tendons import allocate, reach


@dataclass(frozen=True)
class Course:
    """Angle, rate, wanted torque (T,) and memory before each tick (T, memory)."""

    theta: np.ndarray
    rate: np.ndarray
    torque: np.ndarray
    memory: np.ndarray


_FIRST_AHEAD = len(NOW)

ClosedLoop = Callable[..., Course]
Sine = Callable[..., np.ndarray]


@kernel
def _run(
    law: Any, plant: Any, model: Any, limits: Any, gains: Any, reference: Any, now: Any, memory: Any, state: Any,
    out: Any, period: float, segments: tuple[int, ...], wanted: Any,
) -> None:  # fmt: skip
    wrist, known, bound = load_segments(rows_of(plant)), load_segments(rows_of(model)), rows_of(limits)
    signals, kept = rows_of(now), rows_of(memory)
    n, preview = len(segments), (now.shape[0] - _FIRST_AHEAD) // 3
    theta, omega = part(rows_of(state), 0, segments), part(rows_of(state), n, segments)
    for tick in range(reference.shape[0]):
        row, target = rows_of(out[tick]), rows_of(reference[tick])
        angle, rate = 0.0 * bound[0], 0.0 * bound[0]
        for i in range(n):
            angle = angle + theta[i]
            rate = rate + omega[i]
        signals[0], signals[1] = angle, rate
        for i in range(3):
            signals[2 + i] = target[i]
        signals[5], signals[6] = reach(angle, known, bound[0], bound[1])
        signals[7] = period + 0.0 * angle
        for ahead in range(1, preview + 1):
            to_come = rows_of(reference[min(tick + ahead, reference.shape[0] - 1)])
            for i in range(3):
                signals[_FIRST_AHEAD + 3 * (ahead - 1) + i] = to_come[i]
        for i in range(memory.shape[0]):
            row[3 + i] = kept[i]
        call_in_one_plane(law, now, model, gains, memory, wanted, 1)
        torque = rows_of(wanted)[0]
        row[0], row[1], row[2] = angle, rate, torque
        plus, minus = allocate(angle, known, torque, bound[0], bound[1])
        step(wrist, theta, omega, (plus, minus), NoTendons(), period + zero_like(angle))


def _closed_loop(
    name: str, gains: tuple[float, ...], reference: np.ndarray, plant: WristParameters, model: WristParameters,
    segments_: int = 1, period: float = 1e-3, limit: float = 1e6,
) -> Course:  # fmt: skip
    """Follow a reference (T, 3) of angle, rate and acceleration from rest, one row per control period."""
    law, ticks = controller(name), len(reference)
    wrist, known, values = segments(plant, segments_), segments(model, 1), np.array([*gains, 0.0])
    memory, state = np.zeros(max(1, law.memory)), np.zeros(2 * segments_)
    out = np.zeros((ticks, 3 + len(memory)))
    now, followed = np.zeros(signals_of(law.preview)), np.ascontiguousarray(reference)
    _run(
        law.compiled(), wrist, known, np.array([4.0, limit]), values, followed, now, memory, state, out, period,
        (0,) * segments_, np.zeros(1),
    )  # fmt: skip
    return Course(out[:, 0], out[:, 1], out[:, 2], out[:, 3:])


@pytest.fixture(scope="session")
def closed_loop() -> ClosedLoop:
    return _closed_loop


@pytest.fixture(scope="session")
def sine() -> Sine:
    """amplitude (1 - cos(2 pi f t)) / 2 with two derivatives, (T, 3): from rest, exciting on and on."""

    def made(amplitude: float, frequency: float, duration: float, period: float = 1e-3) -> np.ndarray:
        w, t = 2.0 * np.pi * frequency, np.arange(round(duration / period)) * period
        waves = 1.0 - np.cos(w * t), w * np.sin(w * t), w * w * np.cos(w * t)
        return 0.5 * amplitude * np.stack(waves, axis=1)

    return made
