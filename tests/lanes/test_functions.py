"""Elementary functions of lanes against 40-digit arithmetic and NumPy."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.functions import atan2, bessel, clip, cos, exp, expm1_of_negative, log, power, sin, tan, tanh
from wristctl.lanes.lane import dot, planar, sqrt, turn
from wristctl.lanes.rows import rows_of
from wristctl.lanes.types import LANES


@kernel
def _functions(x: Any, out: Any) -> None:
    row, result = rows_of(x), rows_of(out)
    result[0] = tanh(row[0])
    e0, e1, e2, e3 = bessel(row[0])
    result[1] = e0
    result[2] = e1
    result[3] = e2
    result[4] = e3
    result[5] = clip(row[0], -1.0, 2.0)
    p = planar(row[0], 2.0)
    result[6] = dot(turn(p) * p + 2.0 * p, p)
    result[7] = sqrt(abs(row[0]))
    result[8] = exp(row[0])
    result[9] = expm1_of_negative(-abs(row[0]))


@kernel
def _of_controllers(pairs: Any, out: Any) -> None:
    row, result = rows_of(pairs), rows_of(out)
    x, y = row[0], row[1]
    result[0] = sin(x)
    result[1] = cos(x)
    result[2] = tan(x)
    result[3] = log(x)
    result[4] = atan2(x, y)
    result[5] = power(x, y)
    result[6] = x**y
    result[7] = pow(2.0, y)
    result[8] = x**3
    result[9] = x**0
    result[10] = abs(x) ** 0.5
    result[11] = x**-2
    result[12] = 2**y


SINE, COSINE, TANGENT, LOG, ANGLE, POWER, OPERATOR, OF_TWO, CUBE, ONE, ROOT, INVERSE_SQUARE, OF_WHOLE = range(13)


def of_pairs(x: Any, y: Any = 1.0) -> np.ndarray:
    """All functions that controllers may call, (count, functions): in blocks, and the same bits of each pair alone."""
    pairs = np.stack(np.broadcast_arrays(np.atleast_1d(np.asarray(x, float)), y), axis=1)
    blocks = to_blocks(np.concatenate([pairs, pairs[:1]]))
    out = np.empty((len(blocks), 13, *blocks.shape[2:]))
    for block, result in zip(blocks, out, strict=True):
        _of_controllers(block, result)
    together = to_rows(out, len(pairs))
    for pair, row in list(zip(pairs, together, strict=True))[:: max(1, len(pairs) // 200)]:
        alone = np.empty(13)
        _of_controllers(pair.copy(), alone)
        np.testing.assert_array_equal(alone, row)
    return together


def values(x: np.ndarray) -> np.ndarray:
    blocks = to_blocks(x[:, None])
    out = np.empty((len(blocks), 10, *blocks.shape[2:]))
    for block, result in zip(blocks, out, strict=True):
        _functions(block, result)
    return to_rows(out, len(x))


def in_ulp(value: np.ndarray, exact: list[mpmath.mpf]) -> float:
    pairs = zip(value, exact, strict=True)
    return max(float(abs(mpmath.mpf(float(v)) - e)) / np.spacing(abs(float(e))) for v, e in pairs)


def test_tanh_is_within_three_ulp() -> None:
    small, large = np.geomspace(1e-300, 1.0, 400), np.linspace(1.0, 30.0, 400)
    x = np.concatenate([-large, -small, small, large])
    with mpmath.workdps(40):
        assert in_ulp(values(x)[:, 0], [mpmath.tanh(mpmath.mpf(float(v))) for v in x]) <= 3.0
    assert values(np.array([0.0, 1e300, -1e300]))[:, 0].tolist() == [0.0, 1.0, -1.0]


EXPONENTS = np.concatenate(
    [np.linspace(-44.0, 44.0, 3001), np.linspace(-1.05, 1.05, 3001), -np.geomspace(1e-300, 1.0, 1001)]
)


def test_exp_is_within_one_ulp_from_the_least_number_to_the_largest() -> None:
    x = np.concatenate([EXPONENTS, np.linspace(-708.0, 709.7, 1001)])
    with mpmath.workdps(40):
        assert in_ulp(values(x)[:, 8], [mpmath.exp(mpmath.mpf(float(v))) for v in x]) <= 1.0
    x = np.array([0.0, 709.8, 1e300, np.inf, -745.2, -1e300, -np.inf, np.nan])
    np.testing.assert_array_equal(values(x)[:, 8], [1.0, np.inf, np.inf, np.inf, 0.0, 0.0, 0.0, np.nan])
    assert values(np.array([-744.0, -720.0]))[:, 8] == pytest.approx(np.exp([-744.0, -720.0]), abs=5e-324)


def test_expm1_of_what_is_negative_is_within_one_and_a_half_ulp_however_small_it_is() -> None:
    x = -abs(EXPONENTS[EXPONENTS != 0.0])
    with mpmath.workdps(40):
        assert in_ulp(values(x)[:, 9], [mpmath.expm1(mpmath.mpf(float(v))) for v in x]) <= 1.5
    assert values(np.array([0.0, -40.0, -1e300]))[:, 9].tolist() == [0.0, -1.0, -1.0]


ANGLES = st.floats(-1e9, 1e9)
SIZES = st.floats(5e-324, 1e300)


@pytest.mark.parametrize(
    ("column", "exact", "bound"),
    [(SINE, mpmath.sin, 2.0), (COSINE, mpmath.cos, 2.0), (TANGENT, mpmath.tan, 3.0)],
    ids=["sin", "cos", "tan"],
)
@pytest.mark.slow
def test_circular_functions_are_within_their_ulp_up_to_a_billion(
    column: int, exact: Callable[..., Any], bound: float
) -> None:
    rng = np.random.default_rng(0)
    drawn = [rng.uniform(-reach, reach, 600) for reach in (1e-8, 1.0, 10.0, 1e4, 1e9)]
    x = np.concatenate([*drawn, np.arange(1.0, 600.0) * np.pi / 2, np.arange(1.0, 300.0) * 3e6 * np.pi / 4])
    with mpmath.workdps(50):
        assert in_ulp(of_pairs(x)[:, column], [exact(mpmath.mpf(float(v))) for v in x]) <= bound
    np.testing.assert_array_equal(of_pairs([np.nan, np.inf, -np.inf, 1.1e9])[:, column], np.nan)
    assert of_pairs([0.0])[0, column] == float(exact(0))


@given(ANGLES)
@settings(max_examples=300, deadline=None)
@pytest.mark.slow
def test_circular_functions_are_numpys(x: float) -> None:
    found = of_pairs(x)[0]
    np.testing.assert_allclose(found[:3], [np.sin(x), np.cos(x), np.tan(x)], rtol=1e-15, atol=0.0)
    assert found[SINE] ** 2 + found[COSINE] ** 2 == pytest.approx(1.0, abs=2.0**-51)  # two units in the last place
    np.testing.assert_array_equal(of_pairs(-x)[0, :3], found[:3] * [-1.0, 1.0, -1.0])


@given(SIZES)
@example(2.0**-1022)
@example(math.sqrt(2.0))
@settings(max_examples=300, deadline=None)
def test_the_logarithm_is_numpys_of_every_size(x: float) -> None:
    assert of_pairs(x)[0, LOG] == pytest.approx(np.log(x), rel=3e-16, abs=0.0)
    with mpmath.workdps(40):
        assert in_ulp(of_pairs(x)[:, LOG], [mpmath.log(mpmath.mpf(x))]) <= 1.0


def test_the_logarithm_near_one_and_where_there_is_none() -> None:
    x = 1.0 + np.concatenate([np.geomspace(1e-15, 0.5, 400), -np.geomspace(1e-15, 0.4, 400)])
    with mpmath.workdps(40):
        assert in_ulp(of_pairs(x)[:, LOG], [mpmath.log(mpmath.mpf(float(v))) for v in x]) <= 1.0
    np.testing.assert_array_equal(
        of_pairs([1.0, 0.0, -0.0, -1.0, np.inf, -np.inf, np.nan])[:, LOG],
        [0.0, -np.inf, -np.inf, np.nan, np.inf, np.nan, np.nan],
    )


SIGNED = st.one_of(st.floats(1e-300, 1e300), st.floats(-1e300, -1e-300))


@given(SIGNED, SIGNED)
@settings(max_examples=300, deadline=None)
def test_the_angle_of_a_point_is_numpys_in_each_quadrant(y: float, x: float) -> None:
    assert of_pairs(y, x)[0, ANGLE] == pytest.approx(np.arctan2(y, x), rel=5e-16, abs=5e-324)


def test_the_angle_of_a_point_is_within_two_ulp_all_around_and_on_the_axes() -> None:
    around = np.linspace(-np.pi, np.pi, 2001)
    y, x = np.sin(around), np.cos(around) * 1.7
    exact = [mpmath.atan2(mpmath.mpf(float(v)), mpmath.mpf(float(u))) for v, u in zip(y, x, strict=True)]
    assert in_ulp(of_pairs(y, x)[:, ANGLE], exact) <= 2.0
    y = np.array([0.0, 0.0, 0.0, 1.0, -1.0, np.inf, 1.0, np.nan, 1.0])
    x = np.array([0.0, 1.0, -1.0, 0.0, 0.0, 1.0, -np.inf, 1.0, np.nan])
    np.testing.assert_array_equal(of_pairs(y, x)[:, ANGLE], np.arctan2(y, x))


@given(st.floats(1e-6, 1e6), st.floats(-20.0, 20.0))
@settings(max_examples=300, deadline=None)
def test_powers_are_numpys_within_the_bound_that_they_state(x: float, y: float) -> None:
    found = of_pairs(x, y)[0]
    bound = (2.0 + 2.0 * abs(y * math.log(x))) * 2.3e-16
    assert found[POWER] == pytest.approx(x**y, rel=bound, abs=0.0)
    assert found[OPERATOR] == found[POWER] and found[OF_TWO] == found[OF_WHOLE]
    assert found[OF_TWO] == pytest.approx(2.0**y, rel=(2.0 + 2.0 * abs(y)) * 2.3e-16)
    assert found[ROOT] == pytest.approx(math.sqrt(x), rel=(2.0 + abs(math.log(x))) * 2.3e-16)
    assert found[INVERSE_SQUARE] == pytest.approx(x**-2, rel=(2.0 + 4.0 * abs(math.log(x))) * 2.3e-16)


def test_whole_powers_are_products_and_powers_of_zero_are_numpys() -> None:
    x = np.array([-1.7, 0.0, 3.0])
    found = of_pairs(x, 2.5)
    np.testing.assert_array_equal(found[:, CUBE], x * x * x)
    np.testing.assert_array_equal(found[:, ONE], np.ones(3))
    assert np.isnan(found[0, POWER]) and found[1, POWER] == 0.0
    np.testing.assert_array_equal(of_pairs([0.0, 0.0], np.array([0.0, -1.0]))[:, POWER], [1.0, np.inf])


@pytest.mark.slow
def test_bessel_functions_are_exact_at_zero_and_to_two_ulp_of_one_up_to_a_full_turn() -> None:
    x = np.linspace(-np.pi, np.pi, 801)
    found = values(x)[:, 1:5]
    with mpmath.workdps(40):
        for order in range(4):
            scale = float(mpmath.fac2(2 * order + 1))
            for v, e in zip(x, found[:, order], strict=True):
                m = abs(mpmath.mpf(float(v)))
                exact = 1 / mpmath.fac2(2 * order + 1)
                if v:
                    exact = mpmath.sqrt(mpmath.pi / (2 * m)) * mpmath.besselj(order + mpmath.mpf(1) / 2, m) / m**order
                assert float(abs(exact - float(e))) * scale <= 2 * np.spacing(1.0)
    assert values(np.zeros(1))[0, 1:5] == pytest.approx([1.0, 1 / 3, 1 / 15, 1 / 105], rel=1e-16)


def test_planar_vectors_are_complex_numbers() -> None:
    x = np.linspace(-2.0, 2.0, 21)
    p = x + 2j
    np.testing.assert_allclose(values(x)[:, 6], ((1j * p * p + 2 * p) * p.conj()).real, rtol=1e-14, atol=1e-14)
    np.testing.assert_array_equal(values(x)[:, 5], np.clip(x, -1.0, 2.0))
    np.testing.assert_array_equal(values(x)[:, 7], np.sqrt(np.abs(x)))


def test_blocks_keep_rows_in_order_and_fill_up_with_the_last() -> None:
    rows = np.arange(2.0 * (LANES + 3)).reshape(-1, 2)
    blocks = to_blocks(rows)
    assert blocks.shape == (2, 2, LANES)
    np.testing.assert_array_equal(to_rows(blocks, len(rows)), rows)
    assert (blocks[1, 0, 3:] == rows[-1, 0]).all()
