"""The observer's stationary covariance is the solution that another library finds of its Riccati equation."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.linalg import solve_discrete_are

from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.simulation.stationary_filter import (
    Belief,
    _goes_by,
    _predicted,
    _stationary,
    _ticks_of_a_frame,
    stationary_gains,
)


@given(
    st.floats(1e-3, 10e-3), st.floats(10.0, 200.0), st.floats(1e-3, 1.0), st.floats(1e-5, 1e-2), st.floats(1e-3, 0.3)
)
@pytest.mark.slow
def test_it_solves_the_riccati_equation_of_a_frame(
    period: float, rate: float, noise_deg: float, torque_noise: float, load_drift: float
) -> None:
    sensor = Sensor(
        level="camera", frame_rate=rate, noise_deg=noise_deg, torque_noise=torque_noise, load_drift=load_drift
    )
    (gain,), _, (tick,), (noise,) = _stationary((_goes_by(Belief(sensor, Actuator(), WristParameters(), period)),))
    frame, between = np.eye(3), np.zeros((3, 3))
    for _ in range(_ticks_of_a_frame(sensor, period)):
        frame, between = tick @ frame, tick @ between @ tick.T + noise
    variance = np.deg2rad(noise_deg) ** 2
    seen = np.array([[1.0], [0.0], [0.0]])
    size = np.sqrt(np.diag(between).clip(1e-18))  # scaled, or the library loses the smallest entries
    known = solve_discrete_are(
        (frame * size / size[:, None]).T, seen * size[0], between / np.outer(size, size), [[variance]]
    ) * np.outer(size, size)
    (ours,) = _predicted(frame[None], between[None], np.array([variance]))
    scale = np.sqrt(np.outer(np.diag(known), np.diag(known)))
    assert np.abs(ours - known).max() == pytest.approx(0.0, abs=1e-6 * np.abs(known).max())
    assert (np.abs(ours - known) <= 1e-6 * scale).all()
    assert gain == pytest.approx(known[:, 0] / (known[0, 0] + variance), rel=1e-5, abs=1e-9)


def test_each_of_many_observers_has_the_gain_that_it_has_alone() -> None:
    """Each differs from the first in one thing alone."""
    base = Belief(Sensor(level="camera"), Actuator(level="tendon"), WristParameters(), 5e-3)
    sensors: list[dict[str, float]] = [
        {"frame_rate": 25.0}, {"noise_deg": 0.2}, {"torque_noise": 2e-3}, {"load_drift": 0.2}, {"delay_frames": 3.0},
    ]  # fmt: skip
    beliefs = [base, *(base._replace(sensor=base.sensor.model_copy(update=each)) for each in sensors)]
    beliefs += [
        base._replace(actuator=Actuator(level="tendon", tendon_stiffness=9e3)),
        base._replace(wrist=WristParameters(stiffness=0.7)),
        base._replace(period=2e-3),
        base,
    ]
    together = stationary_gains(beliefs)
    alone = np.array([stationary_gains([each])[0] for each in beliefs])
    assert np.array_equal(together, alone)
    assert len(np.unique(together[:, 1])) == len(beliefs) - 2, "all but the delay changes the gain"
