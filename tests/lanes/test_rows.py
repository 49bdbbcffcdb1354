"""Rows and NamedTuples in compiled code, for a rollout alone and for a block: what is read, written and cut off."""

from __future__ import annotations

import sys
from typing import Any, NamedTuple

import numba
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numba.core.errors import TypingError

from wristctl.lanes.blocks import to_blocks, to_rows
from wristctl.lanes.compiled import by_type, implements, kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.named_tuples import block_of, borrowed, replacing, tuple_of
from wristctl.lanes.rows import beyond, lanes_like, part, planes_like, rows_named, rows_of, square_like
from wristctl.lanes.types import LANES

WIDE = pytest.mark.parametrize("wide", [(), (LANES,)], ids=["alone", "a block"])


class Motor(NamedTuple):
    speed: Any
    torque: Any


class NoCamera(NamedTuple):
    """A part that is absent."""


class Parts(NamedTuple):
    """Arrays by block, an array of one block, a number, an absent part, and a NamedTuple of its own."""

    state: Any
    shared: Any
    period: float
    camera: Any
    motor: Any


_read, _faster = tuple_of(Motor), replacing("torque")
_motor_of = rows_named(Motor._fields)


@kernel
def _rows(given: Any, out: Any, segments: Any) -> None:
    row, result = rows_of(given), rows_of(out)
    first, rest = part(row, 1, segments), beyond(row, 3)
    result[0] = row[0]
    result[1] = first[0] + first[1]
    result[2] = rest[0]
    result[3] = float(len(first)) + 0.0 * row[0]
    matrix, scratch, vectors = square_like(first), lanes_like(first), planes_like(first)
    for i in range(len(first)):
        scratch[i] = 10.0 * first[i]
        for j in range(len(first)):
            matrix[i, j] = first[i] - 2.0 * first[j]
    result[4] = matrix[0, 1]
    result[5] = matrix[1, 0]
    result[6] = scratch[1]
    result[7] = float(len(matrix) + len(vectors)) + 0.0 * row[0]


@kernel
def _tuples(given: Any, out: Any) -> None:
    motor, result = _read(rows_of(given)), rows_of(out)
    changed = _faster(motor, (3.0 * motor.torque,))
    result[0] = changed.speed
    result[1] = changed.torque
    result[2] = _motor_of(given).torque


@kernel
def _add(parts: Any, block: int) -> None:
    own = block_of(parts, block)
    rows_of(own.state)[0] = rows_of(own.state)[0] + own.period * rows_of(own.shared)[0]
    rows_of(own.motor.speed)[0] = rows_of(own.state)[0]


@kernel
def _sum(parts: Any, out: Any) -> None:
    of_all, result = borrowed(parts), rows_of(out)
    for row in range(of_all.state.shape[0]):
        result[0] = result[0] + rows_of(of_all.state)[row] * rows_of(of_all.motor.speed)[0]


@by_type
def _heard(part: Any, x: Any) -> Any:
    """What a part makes of a number."""
    raise NotImplementedError("compiled code only")


@implements(_heard, NoCamera)
def _nothing(part: Any, x: Any) -> Any:
    return zero_like(x)


@implements(_heard, Motor)
def _fast(part: Any, x: Any) -> Any:
    return part.speed * x


@kernel
def _hear(part: Any, given: Any, out: Any) -> None:
    rows_of(out)[0] = _heard(part, rows_of(given)[0])


def numbers(rows: int, wide: tuple[int, ...]) -> Any:
    return np.random.default_rng(0).normal(size=(rows, *wide))


@WIDE
def test_rows_are_cut_indexed_and_backed_by_scratch_of_their_own(wide: tuple[int, ...]) -> None:
    given, out = numbers(5, wide), np.empty((8, *wide))
    _rows(given, out, (0, 0))
    a, b = given[1], given[2]
    wanted = [given[0], a + b, given[3], 2.0 + 0.0 * a, a - 2.0 * b, b - 2.0 * a, 10.0 * b, 4.0 + 0.0 * a]
    np.testing.assert_allclose(out, wanted, rtol=1e-15)


@WIDE
def test_tuples_are_read_by_their_own_order_and_changed_by_name(wide: tuple[int, ...]) -> None:
    given, out = numbers(2, wide), np.empty((3, *wide))
    _tuples(given, out)
    np.testing.assert_array_equal(out, [given[0], 3.0 * given[1], given[1]])


@WIDE
def test_a_block_takes_its_own_part_and_one_block_is_every_blocks(wide: tuple[int, ...]) -> None:
    motor = Motor(np.zeros((3, 1, *wide)), 7)
    parts = Parts(np.ones((3, 1, *wide)), np.full((1, 1, *wide), 4.0), 0.5, NoCamera(), motor)
    for block in (0, 2):
        _add(parts, block)
    assert [float(each.flat[0]) for each in parts.state] == [3.0, 1.0, 3.0]
    assert [float(each.flat[0]) for each in motor.speed] == [3.0, 0.0, 3.0]


@WIDE
def test_arrays_of_kernels_are_as_often_owned_behind_them_as_before(wide: tuple[int, ...]) -> None:
    arrays = [np.ones((3, 1, *wide)), np.ones((1, 1, *wide)), np.ones((3, 1, *wide))]
    flat, out = [np.full((3, *wide), 2.0), np.ones((1, *wide)), np.full((1, *wide), 5.0)], np.zeros((1, *wide))
    owned = list(map(sys.getrefcount, arrays + flat))
    for block in (0, 1, 2):
        _add(Parts(arrays[0], arrays[1], 0.5, NoCamera(), Motor(arrays[2], 7)), block)
    _sum(Parts(flat[0], flat[1], 0.5, NoCamera(), Motor(flat[2], 7)), out)
    np.testing.assert_array_equal(out, np.full((1, *wide), 30.0))
    assert list(map(sys.getrefcount, arrays + flat)) == owned


@settings(max_examples=30)
@given(st.integers(2, 40), st.integers(1, 5))
def test_every_lane_of_blocks_lies_in_one_cache_line(count: int, variables: int) -> None:
    rows = np.arange(float(count * variables)).reshape(count, variables)
    blocks = to_blocks(rows)
    assert blocks.ctypes.data % 64 == 0 and blocks.flags.c_contiguous and blocks.dtype == np.float64
    np.testing.assert_array_equal(to_rows(blocks, count), rows)


@WIDE
def test_a_body_follows_from_the_type_of_the_part_and_a_part_without_one_is_refused(wide: tuple[int, ...]) -> None:
    given, out = numbers(1, wide), np.empty((1, *wide))
    _hear(Motor(2.0, 1.0), given, out)
    np.testing.assert_array_equal(out, 2.0 * given)
    _hear(NoCamera(), given, out)
    np.testing.assert_array_equal(out, 0.0 * given)
    with pytest.raises(TypingError, match="_heard"):
        _hear(Parts(1.0, 1.0, 1.0, 1.0, 1.0), given, out)


def test_rows_are_views_of_contiguous_doubles_and_of_nothing_else() -> None:
    for wrong in (np.zeros((4, 2 * LANES))[:, ::2], np.zeros((2, LANES), np.float32), np.zeros((2, 2, LANES))):
        with pytest.raises(TypingError):
            _tuples(wrong, np.zeros((3, LANES)))


def test_an_unknown_name_of_a_row_is_refused_when_it_is_compiled() -> None:
    def reads(given: Any) -> Any:
        return _motor_of(given).weight

    with pytest.raises(TypingError, match="weight"):
        numba.njit(reads)(np.zeros((2, LANES)))
