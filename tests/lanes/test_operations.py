"""Every operation of lanes, for a rollout alone and for a block, against NumPy and exact fractions."""

from __future__ import annotations

from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import kernel
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import (
    common_integer,
    dot,
    exp2i,
    floor,
    planar,
    polynomial,
    rounded,
    sqrt,
    turn,
    where,
    zero_like,
)
from wristctl.lanes.rows import rows_of
from wristctl.lanes.types import LANES

Array = NDArray[np.float64]

NUMBERS = st.floats(min_value=-1e6, max_value=1e6, allow_nan=False).map(lambda x: x + 0.0)
COUNTS = pytest.mark.parametrize("count", [1, LANES, LANES + 3], ids=["alone", "a block", "two blocks"])

_cubic = polynomial((2.0, -1.0, 0.5, 0.25))


@kernel
def _arithmetic(given: Any, out: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    a, b, c, d = row[0], row[1], row[2], row[3]
    result[0] = a + b
    result[1] = a - b
    result[2] = a * b
    result[3] = a / b
    result[4] = -a
    result[5] = a * b + c
    result[6] = c + a * b
    result[7] = a * b - c
    result[8] = c - a * b
    result[9] = a * b + c * d
    result[10] = a * b - c * d
    result[11] = rounded(a * b) + c
    result[12] = 2 * a + 1.5
    result[13] = 1 / b
    result[14] = sqrt(abs(a))
    result[15] = floor(a)
    result[16] = exp2i(floor(clip(a, -1000.0, 1000.0)))
    result[17] = minimum(a, b)
    result[18] = maximum(a, 3)
    result[19] = _cubic(1e-3 * a)


@kernel
def _zeros(given: Any, out: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    result[0] = zero_like(row[0])
    result[1] = row[1] + zero_like(row[0])


@kernel
def _comparisons(given: Any, out: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    a, b, c = row[0], row[1], row[2]
    result[0] = where(a < b, 1.0, 0.0)
    result[1] = where(a <= b, 1.0, 0.0)
    result[2] = where(a > b, 1.0, 0.0)
    result[3] = where(a >= b, 1.0, 0.0)
    result[4] = where((a < b) & (b < c), 1.0, 0.0)
    result[5] = where((a < b) | (b < c), 1.0, 0.0)
    result[6] = where(a < 2.0, a, b)


@kernel
def _vectors(given: Any, out: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    u, v = planar(row[0], row[1]), planar(row[2], row[3])
    along, across = planar(1.0 + 0.0 * row[0], 0.0), planar(0.0 * row[0], 1.0)
    found = (u + v, u - v, row[0] * v, 2.0 * v, u * v, turn(u), -0.5 * u + turn(v))
    for k in range(len(found)):
        result[2 * k] = dot(found[k], along)
        result[2 * k + 1] = dot(found[k], across)
    result[2 * len(found)] = dot(u, v)


def run(operations: Any, given: Array, results: int) -> Array:
    """Results (count, results) of numbers (count, 4)."""
    blocks = to_blocks(given)
    out = np.empty((len(blocks), results, *blocks.shape[2:]))
    for block, result in zip(blocks, out, strict=True):
        operations(block, result)
    return to_rows(out, len(given))


def drawn(count: int, seed: int = 0) -> Array:
    rng = np.random.default_rng(seed)
    return rng.normal(size=(count, 4)) * 10.0 ** rng.integers(-8, 8, size=(count, 4))


def fused(a: float, b: float, c: float) -> float:
    """a b + c, rounded once."""
    return float(Fraction(a) * Fraction(b) + Fraction(c))


def expected(a: float, b: float, c: float, d: float) -> list[float]:
    """What the operations give, each operation of a double's own rounding but where a product and a sum fuse."""
    x = 1e-3 * a
    cubic = fused(fused(0.25, x, 0.5), x * x, fused(-1.0, x, 2.0))
    steps = max(-1000.0, min(1000.0, a))
    return [
        a + b, a - b, a * b, a / b, -a, fused(a, b, c), fused(a, b, c), fused(a, b, -c), fused(-a, b, c),
        fused(a, b, c * d), fused(a, b, -(c * d)), a * b + c, fused(2.0, a, 1.5), 1.0 / b, np.sqrt(abs(a)),
        np.floor(a), 2.0 ** np.floor(steps), min(a, b), max(a, 3.0), cubic,
    ]  # fmt: skip


@COUNTS
def test_arithmetic_is_that_of_doubles_and_a_product_beside_a_sum_is_rounded_once(count: int) -> None:
    given = drawn(count)
    found = run(_arithmetic, given, 20)
    np.testing.assert_array_equal(found, np.array([expected(*map(float, row)) for row in given]))
    plain = given[:, 0] * given[:, 1] + given[:, 2]
    assert count == 1 or (found[:, 5] != plain).any() or (found[:, 9] != plain).any()


@COUNTS
def test_zero_is_0_beside_whatever_number(count: int) -> None:
    given = drawn(count, 3)
    given[::3, 0], given[1::3, 0], given[2::3, 0] = np.nan, -np.inf, -1.0
    given[-1, 0] = -np.inf
    found = run(_zeros, given, 2)
    assert found[:, 0].tobytes() == np.zeros(count).tobytes()
    np.testing.assert_array_equal(found[:, 1], given[:, 1])


@settings(max_examples=60)
@given(st.lists(st.tuples(NUMBERS, NUMBERS.filter(bool), NUMBERS, NUMBERS), min_size=1, max_size=LANES + 2))
def test_a_lane_has_its_bits_alone_and_among_others(rows: list[tuple[float, float, float, float]]) -> None:
    given = np.array(rows)
    together = run(_arithmetic, given, 20)
    alone = np.concatenate([run(_arithmetic, row[None], 20) for row in given])
    assert together.tobytes() == alone.tobytes()
    np.testing.assert_array_equal(together, np.array([expected(*row) for row in rows]))


@COUNTS
def test_comparisons_choose_lane_by_lane_and_nothing_compares_with_nan(count: int) -> None:
    given = np.round(drawn(count, 1))
    given[0] = np.nan
    given[-1, 1] = given[-1, 0]  # equal
    a, b, c = given[:, 0], given[:, 1], given[:, 2]
    with np.errstate(invalid="ignore"):
        wanted = [a < b, a <= b, a > b, a >= b, (a < b) & (b < c), (a < b) | (b < c), np.where(a < 2.0, a, b)]
    np.testing.assert_array_equal(run(_comparisons, given, 7), np.array(wanted, float).T)


@COUNTS
def test_planar_vectors_are_complex_numbers_and_i_turns_them(count: int) -> None:
    given = drawn(count, 2)
    given /= np.abs(given).max()
    u, v = given[:, 0] + 1j * given[:, 1], given[:, 2] + 1j * given[:, 3]
    wanted = [u + v, u - v, given[:, 0] * v, 2.0 * v, u * v, 1j * u, -0.5 * u + 1j * v]
    parts = [part for each in wanted for part in (each.real, each.imag)] + [(u.conj() * v).real]
    np.testing.assert_allclose(run(_vectors, given, 15), np.array(parts).T, rtol=0.0, atol=1e-15)


@kernel
def _indexed(given: Any, out: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    number = common_integer(row[0])
    for k in range(number):
        result[k] = row[number] + k


@pytest.mark.parametrize("shape", [(), (LANES,)], ids=["alone", "a block"])
def test_a_number_that_all_lanes_have_is_an_index_and_a_number_of_turns(shape: tuple[int, ...]) -> None:
    given, out = np.zeros((4, *shape)), np.full((4, *shape), -1.0)
    given[0], given[3] = 3.0, 20.0
    _indexed(given, out)
    np.testing.assert_array_equal(out.reshape(4, -1)[:, 0], [20.0, 21.0, 22.0, -1.0])
    assert (out.reshape(4, -1) == out.reshape(4, -1)[:, :1]).all()
