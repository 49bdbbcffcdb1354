"""Logs in Excel workbooks, as spreadsheets save them: the same numbers as a text of them has."""

from __future__ import annotations

import datetime as dt
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from openpyxl import Workbook

from wristctl.errors import UserError
from wristctl.records.open_log import read_table

TIME = np.arange(40) / 50.0
HEADS: list[Any] = ["time [s]", "spool_1 [mm]", "spool_2 [mm]", "bend_y [deg]"]
ROWS: list[list[Any]] = np.round(
    np.column_stack([TIME, 4.0 * np.sin(TIME), -4.0 * np.sin(TIME), 10.0 * np.sin(TIME) / 3.0]), 9
).tolist()


def saved(file: Path, *sheets: tuple[str, Sequence[Sequence[Any]]]) -> Path:
    """A workbook with these sheets."""
    book = Workbook()
    book.remove(book.worksheets[0])
    for name, rows in sheets:
        sheet = book.create_sheet(name)
        for row in rows:
            sheet.append(row)
    book.save(file)
    return file


@pytest.mark.parametrize("above", [[], [["Tendon wrist 3, run by A."], []]])
@pytest.mark.parametrize("units_below", [False, True])
@pytest.mark.parametrize("ending", [".xlsx", ".xlsm"])
def test_a_workbook_has_the_numbers_of_the_same_log_in_text(
    above: list[list[str]], units_below: bool, ending: str, tmp_path: Path
) -> None:
    heads = [[head.split(" [")[0] for head in HEADS], ["s", "mm", "mm", "deg"]] if units_below else [HEADS]
    text = "\n".join([",".join(HEADS), *(",".join(map(repr, row)) for row in ROWS)])
    (tmp_path / "same.csv").write_text(text)
    expected = read_table(tmp_path / "same.csv")
    log = read_table(saved(tmp_path / f"log{ending}", ("Data", [*above, *heads, *ROWS]), ("Notes", [["nothing"]])))
    assert log.columns.keys() == expected.columns.keys() and log.columns["bend_y"].any()
    for name, column in expected.columns.items():
        np.testing.assert_array_equal(log.columns[name], column)
    assert list(log.trials()) == list(expected.trials())
    assert log.at(0) == f"{log.file}:{len(above) + len(heads) + 1}", "the row that the spreadsheet shows"


def test_sheets_under_the_same_header_are_trials_and_others_are_none_of_the_log(tmp_path: Path) -> None:
    sheets: list[tuple[str, list[list[Any]]]] = [
        ("Up", [HEADS, *ROWS]),
        ("Plot", [["x", "y"], [1.0, 2.0]]),
        ("Down", [HEADS, *ROWS[:25]]),
    ]
    log = read_table(saved(tmp_path / "log.xlsx", *sheets))
    assert {name: len(trial.columns["time"]) for name, trial in log.trials().items()} == {"Up": 40, "Down": 25}


@pytest.mark.parametrize("sheet", [0, 1])
def test_what_is_wrong_in_a_sheet_is_at_the_row_that_this_sheet_shows(sheet: int, tmp_path: Path) -> None:
    rows = [[list(row) for row in ROWS] for _ in range(2)]
    rows[sheet][7][2] = "lost"
    sheets = ("Up", [HEADS, *rows[0]]), ("Down", [["Of the afternoon."], HEADS, *rows[1]])
    with pytest.raises(UserError, match=rf"'lost' - .*log\.xlsx:{9 + sheet} "):
        read_table(saved(tmp_path / "log.xlsx", *sheets))


def test_sheets_of_one_header_in_other_units_are_refused(tmp_path: Path) -> None:
    bare, metres = [head.split(" [")[0] for head in HEADS], ["s", "m", "m", "deg"]
    sheets = ("Up", [bare, ["s", "mm", "mm", "deg"], *ROWS]), ("Down", [bare, metres, *ROWS])
    with pytest.raises(UserError, match="other units"):
        read_table(saved(tmp_path / "log.xlsx", *sheets))


def test_a_cell_that_nobody_filled_is_nan_also_at_the_end_of_a_row(tmp_path: Path) -> None:
    rows = [list(row) for row in ROWS]
    rows[3][3] = rows[5][1] = None
    log = read_table(saved(tmp_path / "log.xlsx", ("Data", [HEADS, *rows])))
    assert np.flatnonzero(np.isnan(log.columns["bend_y"])).tolist() == [3]
    assert np.flatnonzero(np.isnan(log.columns["spool_1"])).tolist() == [5]


def test_dates_of_a_spreadsheet_are_times(tmp_path: Path) -> None:
    begin = dt.datetime(2026, 3, 1, 12, 0, 0)
    rows = [[begin + dt.timedelta(seconds=0.5 * k), *row[1:]] for k, row in enumerate(ROWS)]
    log = read_table(saved(tmp_path / "log.xlsx", ("Data", [["time", *HEADS[1:]], *rows])))
    np.testing.assert_allclose(np.diff(log.columns["time"]), 0.5, atol=2e-6)


def test_what_is_no_log_is_named_with_its_row(tmp_path: Path) -> None:
    rows = [list(row) for row in ROWS]
    rows[7][2] = "lost"
    with pytest.raises(UserError, match=r"'lost' - .*log\.xlsx:9"):
        read_table(saved(tmp_path / "log.xlsx", ("Data", [HEADS, *rows])))
    with pytest.raises(UserError, match="no sheet of the workbook has two columns"):
        read_table(saved(tmp_path / "one.xlsx", ("Data", [["a"], [1.0]])))
    (tmp_path / "text.xlsx").write_text("time,angle")
    with pytest.raises(UserError, match="no Excel workbook"):
        read_table(tmp_path / "text.xlsx")
    with pytest.raises(UserError, match="cannot read the workbook"):
        read_table(tmp_path / "nowhere.xlsx")
