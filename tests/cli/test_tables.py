"""Tables are aligned, rounded for people, and never wider than the terminal where that can be."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.cli.runs.latex import latex_table
from wristctl.commands.printed_table import Table
from wristctl.reader_units import readable

TABLE = Table("T", ("name", "rmse [rad]", "ok"), [("smc", 1 / 3, True), ("pid", None, False), ("x", math.nan, True)])


def test_columns_are_aligned_and_numbers_have_four_digits() -> None:
    assert TABLE.text().splitlines() == [
        "T",
        "",
        "name  rmse [deg]  ok",
        "----  ----------  ---",
        "smc         19.1  yes",
        "pid            -  no",
        "x              -  yes",
    ]


def test_angles_are_read_in_degrees_by_column_and_by_row_and_counts_are_none() -> None:
    heads, rows = readable(["name", "rmse [rad]"], [["smc", math.pi], ["pid", None]])
    assert heads == ["name", "rmse [deg]"] and rows == [["smc", 180.0], ["pid", None]]
    by_row = Table("", ("metric", "value", "unit", "n"), [("rmse", math.pi, "rad", 7), ("peak", 9.5, "N", 7)])
    assert [line.split() for line in by_row.text().splitlines()[2:]] == [
        ["rmse", "180", "deg", "7"],
        ["peak", "9.5", "N", "7"],
    ]
    assert by_row.rows[0][1] == math.pi, "a program reads what was computed"


def test_an_answer_has_three_digits_and_no_angle_that_nobody_could_measure() -> None:
    errors = Table("", ("name", "error [rad]", "time [s]"), [("a", 1e-9, 1e-9), ("b", 0.0, 15000.0), ("c", 1.0, 1 / 3)])
    cells = [line.split() for line in errors.text(digits=3).splitlines()[2:]]
    assert cells == [["a", "<0.001", "1e-9"], ["b", "0", "15000"], ["c", "57.3", "0.333"]]


def test_the_readme_of_a_run_has_its_angles_in_degrees(tmp_path: Path) -> None:
    study = wristctl.load_study(
        None, "simulate.controller=pid-ff", "simulate.horizon=0.6", "simulate.loop.plant_segments=1"
    )
    done = wristctl.simulate(study, out=tmp_path)
    assert done.run is not None
    (row,) = re.findall(r"^rmse +(\S+) +(\S+)", done.run.file("README.md").read_text(), re.MULTILINE)
    assert row[1] == "deg" and float(row[0]) == pytest.approx(math.degrees(done.metrics["rmse"]), rel=1e-3)


def test_a_narrow_terminal_gets_the_columns_below_each_other() -> None:
    text = TABLE.text(18)
    assert max(map(len, text.splitlines())) <= 18
    assert [line.split() for line in text.splitlines() if line.startswith("smc")] == [["smc", "19.1"], ["smc", "yes"]]


def test_counts_are_whole_whatever_library_made_them() -> None:
    assert Table("", ("n", "ok"), [(np.int64(123456), np.True_)]).text().splitlines()[-1] == "123456  yes"


def test_no_text_in_a_table_forges_a_line_or_moves_a_cursor() -> None:
    odd = "a\x1b]0;b\x07\nforged  ok\u2028\x85c\u202e"
    table = Table(odd, (odd, "n"), [(odd, 1.0), (None, 2.0)])
    for text, lines in (
        (table.text(), 6),
        (latex_table(table), latex_table(Table("a", ("a", "n"), table.rows)).count("\n") + 1),
    ):
        assert len(text.splitlines()) == lines and all(each.isprintable() for each in text.splitlines()), text


def test_a_table_without_rows_shows_its_columns() -> None:
    assert Table("", ("a", "b"), []).text() == "a  b\n-  -"


def test_latex_has_caption_and_label_and_columns_below_each_other_where_they_are_many() -> None:
    narrow = latex_table(TABLE, "own-1")
    assert "\\caption{T}" in narrow and "\\label{tab:own-1}" in narrow and narrow.count("begin{tabular}") == 1
    wide = latex_table(
        Table("", [f"column {number} [rad]" for number in range(12)], [tuple(range(12))]), "", "of a run"
    )
    assert "\\caption{of a run}" in wide and "label" not in wide and wide.count("begin{tabular}") > 2
    assert wide.count("{") == wide.count("}") and wide.count("column 0 [") == wide.count("begin{tabular}")
