"""Tables are aligned, rounded for people, and never wider than the terminal where that can be."""

from __future__ import annotations

import math
import re
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.cli.runs.latex import latex_table
from wristctl.commands.printed_table import Table, table_for_people

TABLE = Table("T", ("name", "rmse [rad]", "ok"), [("smc", 1 / 3, True), ("pid", None, False), ("x", math.nan, True)])


def test_columns_are_aligned_and_numbers_have_four_digits() -> None:
    assert TABLE.text().splitlines() == [
        "T",
        "",
        "name  rmse [rad]  ok",
        "----  ----------  ---",
        "smc       0.3333  yes",
        "pid            -  no",
        "x              -  yes",
    ]


def test_a_kept_table_is_shown_in_degrees_whatever_else_is_kept_with_it() -> None:
    kept = {"title": "T", "columns": ["name", "rmse [rad]"], "rows": [["smc", math.pi], ["pid", None]], "note": "more"}
    shown = table_for_people(kept)
    assert list(shown.columns) == ["name", "rmse [deg]"] and list(shown.rows) == [["smc", 180.0], ["pid", None]]


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
    assert [line.split() for line in text.splitlines() if line.startswith("smc")] == [["smc", "0.3333"], ["smc", "yes"]]


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
