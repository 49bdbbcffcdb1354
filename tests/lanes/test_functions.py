"""Elementary functions of lanes against 40-digit arithmetic and NumPy."""

from __future__ import annotations

from typing import Any

import mpmath
import numpy as np
import pytest

from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.functions import bessel, clip, exp, expm1_of_negative, tanh
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


def test_exp_is_within_one_ulp_and_ends_at_its_limits() -> None:
    with mpmath.workdps(40):
        assert in_ulp(values(EXPONENTS)[:, 8], [mpmath.exp(mpmath.mpf(float(v))) for v in EXPONENTS]) <= 1.0
    x = np.array([0.0, 44.0, 45.0, 1e300, -44.0, -45.0, -1e300, np.nan])
    np.testing.assert_allclose(values(x)[:, 8], np.exp(x.clip(-44.0, 44.0)), rtol=3e-16)
    assert values(x)[0, 8] == 1.0


def test_expm1_of_what_is_negative_is_within_one_and_a_half_ulp_however_small_it_is() -> None:
    x = -abs(EXPONENTS[EXPONENTS != 0.0])
    with mpmath.workdps(40):
        assert in_ulp(values(x)[:, 9], [mpmath.expm1(mpmath.mpf(float(v))) for v in x]) <= 1.5
    assert values(np.array([0.0, -40.0, -1e300]))[:, 9].tolist() == [0.0, -1.0, -1.0]


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
