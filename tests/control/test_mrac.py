"""What adaptive control promises: a Lyapunov function that falls, parameters in bounds, a reference model followed."""

from __future__ import annotations

import numpy as np
import pytest

from tests.control.conftest import ClosedLoop, Sine
from wristctl.config.wrist import WristParameters
from wristctl.control.mrac import HIGHEST, LOWEST, MODEL_ANGLE, MODEL_RATE, PARAMETERS
from wristctl.control.table import controller, gains_of
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments

MODEL = WristParameters()
PLANT = MODEL.model_copy(update={"stiffness": 0.8 * 0.615, "damping": 1.3 * 0.105})
TRUE = np.array([0.0, 0.3, -0.2, 0.0, 0.0])
"""PLANT's parameters as deviations from MODEL's."""


def test_lyapunov_function_does_not_grow_under_excitation(closed_loop: ClosedLoop, sine: Sine) -> None:
    period, slope, gamma = 1e-4, 20.0, 20.0
    course = closed_loop(
        "mrac", (50.0, slope, 0.05, gamma, 1e-9), sine(0.8, 1.0, 2.0, period), PLANT, MODEL, period=period
    )
    model_angle, model_rate = course.memory[1:, MODEL_ANGLE], course.memory[1:, MODEL_RATE]
    s = course.rate[1:] - model_rate + slope * (course.theta[1:] - model_angle)
    mass = terms(segments(PLANT, 1), course.theta[1:, None], course.rate[1:, None]).mass[:, 0, 0]
    distance = course.memory[1:, PARAMETERS:] - TRUE
    lyapunov = 0.5 * mass * s**2 + 0.5 / gamma * (distance**2).sum(axis=1)
    assert np.diff(lyapunov).max() < 1e-5 * lyapunov[0]
    assert lyapunov[-1] < 0.98 * lyapunov[0]


@pytest.mark.slow
def test_parameters_stay_in_bounds_on_a_wrist_of_another_form(closed_loop: ClosedLoop, sine: Sine) -> None:
    plant = MODEL.model_copy(update={"hand_mass": 0.6, "stiffness": 0.4})
    wild = (80.0, 80.0, 0.5, 1e4, 1e-6)
    course = closed_loop("mrac", wild, sine(1.4, 2.0, 3.0), plant, MODEL, segments_=4, limit=120.0)
    deviations = course.memory[:, PARAMETERS:]
    assert (deviations >= np.array(LOWEST)).all() and (deviations <= np.array(HIGHEST)).all()
    assert ((deviations == np.array(LOWEST)) | (deviations == np.array(HIGHEST))).any()


def test_the_reference_model_smooths_a_step_by_its_double_pole(closed_loop: ClosedLoop) -> None:
    w, period = 10.0, 1e-4
    step = np.tile([0.5, 0.0, 0.0], (6000, 1))
    course = closed_loop("mrac", (w, 20.0, 0.05, 1.0, 1e-6), step, MODEL, MODEL, period=period)
    time = np.arange(6000) * period
    expected = 0.5 * (1.0 - (1.0 + w * time) * np.exp(-w * time))
    assert np.abs(course.memory[1:, MODEL_ANGLE] - expected[1:]).max() < 1e-3
    assert np.abs(course.theta - expected).max() < 2e-3


def test_adaptation_removes_most_of_the_error_of_a_wrong_model(closed_loop: ClosedLoop, sine: Sine) -> None:
    gains, reference = gains_of(controller("mrac"), "default"), sine(0.8, 1.0, 4.0)
    fixed, adapting = (
        closed_loop("mrac", (*gains[:3], gamma, 1e-6), reference, PLANT, MODEL, segments_=4)
        for gamma in (1e-2, gains[3])
    )
    last = slice(3000, None)
    error = [np.sqrt(np.mean((c.theta - reference[:, 0])[last] ** 2)) for c in (fixed, adapting)]
    assert error[1] < 0.1 * error[0]
