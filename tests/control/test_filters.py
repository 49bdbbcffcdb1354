"""Filters for laws against SciPy's, tick by tick, from a start at rest."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import signal

from wristctl.control import filters
from wristctl.control.filters import biquad, derivative, low_pass, low_pass_both_ways, notch, rate_limited
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.lanes.types import LANES

SECTION = tuple(float(value) for value in signal.butter(2, 40.0, fs=1000.0, output="sos")[0][[0, 1, 2, 4, 5]])
INTEGRATOR = (0.5, 0.5, 0.0, -1.0, 0.0)
LOW_PASS, DERIVATIVE, NOTCH, BIQUAD, RATE_LIMITED, SUM = range(6)


@kernel
def _tick(given: Any, memory: Any, out: Any) -> None:
    row, kept, result = rows_of(given), rows_of(memory), rows_of(out)
    x, frequency, other, period = row[0], row[1], row[2], row[3]
    result[0] = low_pass(x, frequency, period, kept, 0)
    result[1] = derivative(x, frequency, period, kept, 3)
    result[2] = notch(x, frequency, other, period, kept, 6)
    result[3] = biquad(x, SECTION, kept, 9)
    result[4] = rate_limited(x, other, period, kept, 12)
    result[5] = biquad(x, INTEGRATOR, kept, 14)


@pytest.mark.slow
def test_each_filter_states_the_memory_that_it_takes() -> None:
    sizes = filters.LOW_PASS, filters.DERIVATIVE, filters.NOTCH, filters.BIQUAD, filters.RATE_LIMIT
    assert sizes == (3, 3, 3, 3, 2), "the places that _tick gives them"
    memory = np.full(17, 0.0)
    _tick(np.array([1.0, 50.0, 0.3, 1e-3]), memory, np.empty(6))
    assert memory[[2, 5, 8, 11, 13, 16]].tolist() == [1.0] * 6, "the last value of each says that it has begun"


def filtered(x: np.ndarray, frequency: float, other: float, period: float) -> np.ndarray:
    """Outputs (ticks, filters) of each filter to x (ticks,): alone, and with the same bits in a block of lanes."""
    memory, wide_memory = np.zeros(17), np.zeros((17, LANES))
    outputs, wide = np.empty((len(x), 6)), np.empty((6, LANES))
    for tick, value in enumerate(x):
        row = np.array([value, frequency, other, period])
        _tick(row, memory, outputs[tick])
        _tick(np.repeat(row[:, None], LANES, axis=1), wide_memory, wide)
        np.testing.assert_array_equal(wide, np.repeat(outputs[tick][:, None], LANES, axis=1))
    return outputs


def from_rest(numerator: Any, denominator: Any, x: np.ndarray) -> np.ndarray:
    """SciPy's filter, settled at the first input before it begins."""
    settled = signal.lfilter_zi(numerator, denominator) * x[0]
    return np.asarray(signal.lfilter(numerator, denominator, x, zi=settled)[0])


def drawn(seed: int, ticks: int = 120) -> np.ndarray:
    return 0.7 + np.cumsum(np.random.default_rng(seed).normal(size=ticks))


FREQUENCIES = st.floats(0.5, 5000.0)
PERIODS = st.floats(2e-4, 2e-2)


@given(FREQUENCIES, PERIODS, st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
@pytest.mark.slow
def test_low_pass_and_derivative_are_scipys_first_order_hold_at_any_frequency(
    w: float, period: float, seed: int
) -> None:
    x = drawn(seed)
    found = filtered(x, w, 0.3, period)
    systems: dict[int, Any] = {LOW_PASS: ([w], [1.0, w]), DERIVATIVE: ([w, 0.0], [1.0, w])}
    for column, continuous in systems.items():
        numerator, denominator, _ = signal.cont2discrete(continuous, period, method="foh")
        expected = from_rest(numerator.ravel(), denominator, x)
        scale = np.abs(expected).max()
        np.testing.assert_allclose(found[:, column], expected, rtol=0.0, atol=2e-9 * scale)


@given(st.floats(1.0, 450.0), st.floats(0.01, 2.0), st.integers(0, 1000))
@settings(max_examples=40, deadline=None)
def test_a_notch_is_scipys_prewarped_bilinear_one(hertz: float, damping: float, seed: int) -> None:
    x, period = drawn(seed), 1e-3
    warped = 2.0 / period * np.tan(np.pi * hertz * period)
    continuous = [1.0, 0.0, warped**2], [1.0, 2.0 * damping * warped, warped**2]
    numerator, denominator = signal.bilinear(*continuous, fs=1.0 / period)
    found = filtered(x, 2.0 * np.pi * hertz, damping, period)
    np.testing.assert_allclose(found[:, NOTCH], from_rest(numerator, denominator, x), rtol=1e-9, atol=1e-9)


def test_a_notch_takes_out_its_frequency_and_leaves_what_rests() -> None:
    time = np.arange(3000) * 1e-3
    at, beside = (0.4 + np.sin(2.0 * np.pi * hertz * time) for hertz in (30.0, 3.0))
    left, passed = (filtered(x, 2.0 * np.pi * 30.0, 0.3, 1e-3)[2000:, NOTCH] for x in (at, beside))
    np.testing.assert_allclose(left, 0.4, atol=1e-9)
    assert np.ptp(passed) == pytest.approx(2.0, rel=0.01)


@pytest.mark.parametrize("frequency", [3000.0, 1e5, 1e8])
def test_beyond_nyquists_frequency_filters_stay_stable(frequency: float) -> None:
    x = np.where(np.arange(400) < 200, 1.0, -1.0)
    found = filtered(x, frequency, 0.3, 1e-3)
    assert np.abs(found[:, [LOW_PASS, NOTCH]]).max() < 3.0
    np.testing.assert_allclose(found[-1, [LOW_PASS, DERIVATIVE, NOTCH]], [-1.0, 0.0, -1.0], atol=1e-4)


def test_a_biquad_is_a_section_of_scipys() -> None:
    x = drawn(3)
    expected = from_rest(SECTION[:3], [1.0, *SECTION[3:]], x)
    np.testing.assert_allclose(filtered(x, 10.0, 1.0, 1e-3)[:, BIQUAD], expected, rtol=1e-12, atol=1e-12)


def test_a_biquad_without_a_gain_at_rest_begins_empty() -> None:
    x = drawn(4)
    expected = signal.lfilter(INTEGRATOR[:3], [1.0, *INTEGRATOR[3:]], x)
    np.testing.assert_allclose(filtered(x, 10.0, 1.0, 1e-3)[:, SUM], expected, rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize("start", [0.0, 0.9, -2.0])
def test_what_rests_from_the_first_tick_on_is_passed_without_a_kick(start: float) -> None:
    found = filtered(np.full(5, start), 80.0, 0.4, 5e-3)
    expected = {LOW_PASS: start, DERIVATIVE: 0.0, NOTCH: start, BIQUAD: start, RATE_LIMITED: start}
    for column, value in expected.items():
        np.testing.assert_allclose(found[:, column], value, atol=1e-14)


def test_the_derivative_of_a_ramp_is_its_slope_and_its_delay_is_one_over_the_bandwidth() -> None:
    time = np.arange(1000) * 1e-3
    rising = filtered(-3.0 * time, 50.0, 1.0, 1e-3)
    assert rising[-1, DERIVATIVE] == pytest.approx(-3.0, rel=1e-12)
    assert -3.0 * time[-1] - rising[-1, LOW_PASS] == pytest.approx(-3.0 / 50.0, rel=1e-9)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_the_rate_limiter_takes_as_long_as_its_limit_says_and_then_follows(sign: float) -> None:
    x = sign * np.concatenate([[0.0], np.ones(60), np.full(20, 0.99)])
    found = filtered(x, 10.0, 20.0, 1e-3)[:, RATE_LIMITED]
    np.testing.assert_allclose(np.abs(np.diff(found)).max(), 0.02, rtol=1e-12)
    np.testing.assert_allclose(found[:51], sign * 0.02 * np.arange(51), atol=1e-12)
    np.testing.assert_array_equal(found[51:], x[51:])


@kernel
def _both_ways(values: Any, given: Any, memory: Any) -> None:
    row = rows_of(given)
    low_pass_both_ways(rows_of(values), len(values), row[0], row[1], rows_of(memory), 0)


@pytest.mark.parametrize("hertz", [0.5, 8.0, 30.0])
def test_a_low_pass_both_ways_is_scipys_butterworth_forward_and_back(hertz: float) -> None:
    x, period = drawn(5), 0.01
    section = signal.butter(2, hertz, fs=1.0 / period)
    forward = from_rest(*section, x)
    expected = from_rest(*section, forward[::-1])[::-1]
    values = x.copy()
    _both_ways(values, np.array([2.0 * np.pi * hertz, period]), np.full(3, 0.7))
    np.testing.assert_allclose(values, expected, rtol=1e-9, atol=1e-9)


def test_a_low_pass_both_ways_is_not_late() -> None:
    time = np.arange(401) * 0.01
    bump = np.exp(-(((time - 2.0) / 0.3) ** 2))
    values = bump.copy()
    _both_ways(values, np.array([20.0, 0.01]), np.zeros(3))
    assert values.argmax() == bump.argmax() and np.abs(values - values[::-1]).max() == pytest.approx(0.0, abs=1e-9)
