"""Tables are aligned, and go on below where the terminal ends."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from wristctl.commands.printed_table import Table, number, two

FOUR = Table("", ("name", "ab", "cdef", "g"), [("smc", 1, 2, 3), ("pid", 4, 5, 6)])
"""Columns of widths 4, 2, 4 and 1, two blanks between them: 17 all together."""


def test_a_table_goes_on_below_only_where_it_is_wider_than_the_terminal() -> None:
    assert FOUR.text(17) == FOUR.text() == FOUR.text(80)
    assert FOUR.text(17).splitlines()[0] == "name  ab  cdef  g"
    assert FOUR.text(16).splitlines() == [
        "name  ab  cdef",
        "----  --  ----",
        "smc    1     2",
        "pid    4     5",
        "",
        "name  g",
        "----  -",
        "smc   3",
        "pid   6",
    ]


def test_a_block_below_is_as_wide_as_the_terminal_too() -> None:
    heads = [line for line in FOUR.text(11).splitlines() if line.startswith("name")]
    assert heads == ["name  ab", "name  cdef", "name  g"]
    three = Table("", ("name", "abcd", "ab", "cd"), [("smc", 1, 2, 3)])
    assert [line for line in three.text(12).splitlines() if line.startswith("name")] == ["name  abcd", "name  ab  cd"]


def test_every_block_names_its_rows_and_shows_a_column_however_narrow_the_terminal() -> None:
    heads = [line for line in FOUR.text(1).splitlines() if line.startswith("name")]
    assert heads == ["name  ab", "name  cdef", "name  g"]


@pytest.mark.parametrize(("width", "kept"), [(17, 4), (16, 3), (10, 2), (1, 2)])
def test_where_there_is_no_room_the_last_columns_are_left_out(width: int, kept: int) -> None:
    narrow = FOUR.within(width)
    assert list(narrow.columns) == list(FOUR.columns[:kept])
    assert [list(row) for row in narrow.rows] == [list(row[:kept]) for row in FOUR.rows]


def test_long_heads_are_broken_where_else_the_columns_have_no_room() -> None:
    wide = Table("", ("name", "RMSE of the moves [deg]", "held"), [("smc", 1, "yes"), ("pid-angle", 2.25, "no")])
    assert wide.text(100) == wide.text() and "RMSE of the moves [deg]" in wide.text(100).splitlines()[0]
    assert wide.text(30).splitlines() == [
        "           RMSE of the",
        "name       moves [deg]  held",
        "---------  -----------  ----",
        "smc                  1  yes",
        "pid-angle         2.25  no",
    ]
    assert list(wide.within(30).columns) == list(wide.columns) and len(wide.within(20).columns) == 2


def test_words_stand_to_the_left_and_numbers_to_the_right() -> None:
    mixed = Table("", ("mixed", "words", "count"), [("a", "b", 1), (2, "c", None)]).text().splitlines()
    assert mixed[2:] == ["a      b          1", "2      c          -"]


@pytest.mark.parametrize(("value", "shown"), [(1 / 3, "0.3333"), (12345.0, "1.234e+04"), (-0.5, "-0.5"), (2.0, "2")])
def test_numbers_have_four_digits(value: float, shown: str) -> None:
    assert number(value) == shown


@pytest.mark.parametrize("value", [math.inf, -math.inf, math.nan])
def test_what_is_no_number_is_a_dash(value: float) -> None:
    assert number(value) == "-"


@pytest.mark.parametrize("told", [number, two])
def test_what_rounding_leaves_of_nothing_is_0_and_small_quantities_are_themselves(told: Callable[[float], str]) -> None:
    assert [told(value) for value in (-0.0, 2.8e-107, -3e-31, 0.0)] == ["0"] * 4
    assert float(told(-2.5e-12)) == -2.5e-12 and float(told(6.6e-27)) == 6.6e-27
