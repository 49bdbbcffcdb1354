"""Excel workbooks: cells of their sheets as text, and logs that a laboratory keeps in them, a sheet for a trial."""

from __future__ import annotations

import csv
import io
from pathlib import Path

from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain

SUFFIXES = (".xlsx", ".xlsm")
_FIX = "a workbook that a spreadsheet has saved as .xlsx"


def read_sheets(file: Path) -> dict[str, list[list[str]]]:
    """Rows of cells as text, by the names of the sheets in their order; a missing cell is an empty text.

    Of a formula the value that the spreadsheet found last. Raises UserError for a file that is no workbook.
    """
    import pandas as pd

    try:
        with open_plain(file, LARGEST_DATA) as stream:
            frames = pd.read_excel(
                stream, sheet_name=None, header=None, dtype=object, na_filter=False, engine="openpyxl"
            )
    except OSError as error:
        reason = error.strerror or error
        raise UserError(f"cannot read the workbook: {reason}", str(file), "check the path") from error
    except Exception as error:  # openpyxl names no errors of its own for a file that is none: BadZipFile, KeyError, ...
        raise UserError("it is no Excel workbook", str(file), _FIX) from error
    return {str(name): [list(map(str, row)) for row in frame.to_numpy()] for name, frame in frames.items()}


def texts_of_sheets(file: Path) -> dict[str, str]:
    """Texts, whose cells tabs part, of the sheets that are a log, by their names; the lines are the sheets' rows.

    They are those under the header of the first that has two columns. Raises UserError where none has.
    """
    sheets = {name: [_filled(row) for row in rows] for name, rows in read_sheets(file).items()}
    heads = {name: next((row for row in rows if len(row) > 1 and all(row)), None) for name, rows in sheets.items()}
    header = next(filter(None, heads.values()), None)
    if header is None:
        raise UserError("no sheet of the workbook has two columns", str(file), "a header and samples below it")
    return {name: _text_of(sheets[name], len(header)) for name, head in heads.items() if head == header}


def _text_of(rows: list[list[str]], width: int) -> str:
    text = io.StringIO()
    whole = ([*row, *[""] * (width - len(row))] if len(row) > 1 else row for row in rows)
    csv.writer(text, delimiter="\t", lineterminator="\n").writerows(whole)
    return text.getvalue()


def _filled(row: list[str]) -> list[str]:
    """The cells of a row up to the last that has something."""
    last = max((k for k, cell in enumerate(row) if cell.strip()), default=-1)
    return row[: last + 1]
