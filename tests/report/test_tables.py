"""The comparison's table as text, Markdown and CSV."""

from __future__ import annotations

import csv
import io
import math

import pytest

from wristctl.report.tables import COMPARISON, Column, csv_text, markdown, significant, terminal, text

NAN = math.nan
ROWS = [
    {"controller": "smc", "gains": "tuned", "rmse": 2.7e-4, "paper_rmse": 2.7e-4, "settling": 1.2034, "failed": False},
    {"controller": "pid", "gains": "printed", "rmse": 0.5236, "paper_rmse": 1.5e-3, "settling": NAN, "failed": False},
    {"controller": "nc", "gains": "a|b", "rmse": NAN, "paper_rmse": NAN, "settling": NAN, "failed": True},
]
COLUMNS = [c for c in COMPARISON if c.key in ROWS[0]]


@pytest.mark.parametrize(
    ("value", "digits", "shown"),
    [
        (2.7e-4, 2, "2.7e-4"),
        (0.00123456, 3, "0.00123"),
        (1.2, 3, "1.20"),
        (45.678, 3, "45.7"),
        (9.999, 3, "10.0"),
        (9999.6, 2, "1.0e4"),
        (-115976.8, 3, "-1.16e5"),
        (0.0, 3, "0"),
        (math.inf, 3, "inf"),
    ],
)
def test_numbers_keep_their_significant_digits(value: float, digits: int, shown: str) -> None:
    assert significant(value, digits) == shown


def test_what_never_settles_reads_never_and_what_diverged_reads_diverged() -> None:
    lines = text(ROWS, COLUMNS).splitlines()
    assert lines[3].split() == ["pid", "printed", "0.524", "0.00150", "never"]
    assert lines[4].split() == ["nc", "a|b", "diverged", "-", "diverged"]


def test_the_papers_value_stands_beside_ours() -> None:
    heads = [column.key for column in COMPARISON]
    for ours in ("rmse", "settling", "steady_state"):
        assert heads[heads.index(ours) + 1] == f"paper_{ours}"


def test_text_columns_are_aligned_with_units_in_the_heading() -> None:
    lines = text(ROWS, [Column("controller", "controller"), Column("rmse", "RMSE", "rad")]).splitlines()
    assert lines[0] == "controller  RMSE [rad]"
    assert lines[2] == "smc            2.70e-4"
    assert len({len(line) for line in lines}) == 1


def test_markdown_escapes_bars_and_keeps_one_cell_per_column() -> None:
    lines = markdown(ROWS, COLUMNS).splitlines()
    assert len({line.replace("\\|", "").count("|") for line in lines}) == 1
    assert "a\\|b" in lines[-1]


def test_csv_reads_back_exactly() -> None:
    head, *body = csv.reader(io.StringIO(csv_text(ROWS, COLUMNS)))
    at = head.index("RMSE [rad]")
    assert [float(row[at]) for row in body[:2]] == [2.7e-4, 0.5236]
    assert body[2][at] == ""


def test_terminal_table_has_a_row_for_each_result() -> None:
    made = terminal(ROWS, COLUMNS, "Loop default")
    assert made.row_count == 3 and [c.header for c in made.columns] == [c.title for c in COLUMNS]
