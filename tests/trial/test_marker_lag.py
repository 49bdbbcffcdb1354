"""How long the marker comes after its motors is told from a motion, whatever the springs, and not from rest."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.simulation.references import minimum_jerk
from wristctl.trial.camera_record import CameraRecord, MarkerLag
from wristctl.vision.marker import Sighting, SightingVerdict

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


def test_a_cameras_record_knows_how_late_its_frames_show_the_motion() -> None:
    """Frames that are dated 40 ms after what they show; the second prediction, with softer tendons, has no say."""
    record, late, nowhere = CameraRecord(math.nan), 0.04, np.zeros((2, 4, 2))
    time = np.arange(0.0, 2.0, 1.0 / RATE)
    for number, (captured, angle, rate) in enumerate(zip(time, *minimum_jerk(time, 1.0)[:2], strict=True)):
        shown = float(minimum_jerk(np.array([captured - late]), 1.0)[0, 0])
        sighting = Sighting(captured, number, 0.5 * shown, SightingVerdict.OK, nowhere)
        frame = record.saw(sighting, captured, 0.5 * angle * np.array([1.0, 0.8]), 0.5 * rate, captured)
        assert frame.seen == 0.5 * shown
    assert late - 0.003 < record.lag.least() <= late + 0.001
