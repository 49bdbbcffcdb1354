"""Cells of an Excel workbook by sheet: the part of Office Open XML (ECMA-376) that tables of numbers use."""

import re
import zipfile
from pathlib import Path
from xml.etree import ElementTree

from wristctl.errors import UserError
from wristctl.plain_files import LARGEST_DATA, open_plain

_MAIN = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_LINK = "{http://schemas.openxmlformats.org/officeDocument/2006/relationships}id"
_FIX = "a workbook that a spreadsheet has saved as .xlsx"


def read_sheets(file: Path) -> dict[str, list[list[str]]]:
    """Rows of cells as text, by the names of the sheets in their order; a missing cell is an empty text.

    Raises UserError for a file that is no workbook.
    """
    try:
        with open_plain(file, LARGEST_DATA) as stream, zipfile.ZipFile(stream) as archive:
            shared = _shared(archive)
            links = ElementTree.fromstring(archive.read("xl/_rels/workbook.xml.rels"))
            targets = {link.get("Id"): str(link.get("Target")) for link in links}
            book = ElementTree.fromstring(archive.read("xl/workbook.xml"))
            sheets = {str(sheet.get("name")): targets[sheet.get(_LINK)] for sheet in book.iter(f"{_MAIN}sheet")}
            parts = {name: f"xl/{target.removeprefix('/xl/')}" for name, target in sheets.items()}
            return {name: _rows(archive.read(part), shared) for name, part in parts.items()}
    except OSError as error:
        raise UserError(f"cannot read the workbook: {error.strerror}", str(file), "check the path") from error
    except (zipfile.BadZipFile, KeyError, ElementTree.ParseError) as error:
        raise UserError("it is no Excel workbook", str(file), _FIX) from error


def _shared(archive: zipfile.ZipFile) -> list[str]:
    """Texts that cells name by their numbers."""
    if "xl/sharedStrings.xml" not in archive.namelist():
        return []
    texts = ElementTree.fromstring(archive.read("xl/sharedStrings.xml"))
    return ["".join(part.text or "" for part in text.iter(f"{_MAIN}t")) for text in texts.iter(f"{_MAIN}si")]


def _rows(content: bytes, shared: list[str]) -> list[list[str]]:
    rows: list[list[str]] = []
    for row in ElementTree.fromstring(content).iter(f"{_MAIN}row"):
        cells = {_column(cell.get("r") or "", place): _text(cell, shared) for place, cell in enumerate(row)}
        rows.append([cells.get(place, "") for place in range(1 + max(cells, default=-1))])
    width = max(map(len, rows), default=0)
    return [[*row, *[""] * (width - len(row))] for row in rows]


def _column(reference: str, place: int) -> int:
    """Number of a cell's column, from 0, by its reference such as AB12; by its place where it has none."""
    letters = re.match(r"[A-Z]+", reference)
    if letters is None:
        return place
    number = 0
    for letter in letters[0]:
        number = 26 * number + ord(letter) - ord("A") + 1
    return number - 1


def _text(cell: ElementTree.Element, shared: list[str]) -> str:
    value = cell.find(f"{_MAIN}v")
    if cell.get("t") == "inlineStr":
        return "".join(part.text or "" for part in cell.iter(f"{_MAIN}t"))
    if value is None or value.text is None:
        return ""
    return shared[int(value.text)] if cell.get("t") == "s" else value.text
