"""How long the marker comes after its motors is told from a motion, whatever the springs, and not from rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.simulation.references import minimum_jerk
from wristctl.trial.marker_lag import MarkerLag

RATE, NOISE = 60.0, 1e-3
"""Frames a second; standard deviation of an angle [rad]."""


def lag_of(late: float, scale: float = 1.0, angle: float = 0.5, noise: float = NOISE, seconds: float = 2.0) -> float:
    """Of a minimum-jerk move of one second, seen `late` seconds late."""
    time = np.arange(0.0, seconds, 1.0 / RATE)
    predicted, rate, _ = minimum_jerk(time, 1.0)
    shown = angle * scale * minimum_jerk(time - late, 1.0)[0] + np.random.default_rng(5).normal(0.0, noise, len(time))
    lag = MarkerLag()
    for each in zip(shown, angle * predicted, angle * rate, strict=True):
        lag.add(*map(float, each))
    return lag.least()


@given(st.floats(0.0, 0.03), st.floats(0.8, 1.25))
@pytest.mark.slow
def test_a_late_marker_is_told_from_stiff_or_soft_springs(late: float, scale: float) -> None:
    assert late - 0.003 < lag_of(late, scale) <= late + 0.001


def test_noise_makes_it_say_less_and_never_more() -> None:
    assert lag_of(0.03, noise=5e-3) < lag_of(0.03) < 0.0305
    assert lag_of(0.0, noise=5e-3) < 0.0


@pytest.mark.parametrize("given_", [{"angle": 0.0}, {"seconds": 0.2}])
def test_a_wrist_that_did_not_move_and_too_few_frames_tell_nothing(given_: dict[str, float]) -> None:
    assert math.isnan(lag_of(0.03, **given_))
