"""The page of how numbers and gains flow: each place is in the package, and each line shows what the page says."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import wristctl
from tests.documented import DOCS, script_of_docs

PACKAGE = Path(wristctl.__file__).parent
PAGE = (DOCS / "data-flow.md").read_text(encoding="utf-8")
PLACE = re.compile(r"`([a-z_/]+\.py):([A-Za-z_.]+)`")


def names_of(body: list[ast.stmt], before: str = "") -> set[str]:
    """Functions, classes with their methods, and constants of a module or a class."""
    found = set[str]()
    for node in body:
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            found.add(before + node.name)
            found |= names_of(node.body, f"{node.name}.") if isinstance(node, ast.ClassDef) else set()
        elif isinstance(node, ast.Assign):
            targets = [each for target in node.targets for each in ast.walk(target)]
            found |= {before + each.id for each in targets if isinstance(each, ast.Name)}
    return found


def missing(text: str) -> list[str]:
    """Places that a text names, by file below the package and name, and the package does not have."""
    wrong = []
    for file, name in PLACE.findall(text):
        path = PACKAGE / file
        if not path.is_file() or name not in names_of(ast.parse(path.read_text(encoding="utf-8")).body):
            wrong.append(f"{file}:{name}")
    return wrong


def test_each_place_of_the_page_is_in_the_package() -> None:
    assert len(PLACE.findall(PAGE)) > 30 and missing(PAGE) == []


def test_a_place_that_is_gone_is_found() -> None:
    page = "`control/pd_ff.py:law`, `control/pd_ff.py:lew`, `control/pdff.py:law`, `control/law.py:Controller.torque`"
    assert missing(page) == ["control/pd_ff.py:lew", "control/pdff.py:law", "control/law.py:Controller.torque"]


def test_each_row_of_a_stop_is_run() -> None:
    rows = [line for line in PAGE.splitlines() if line.count("|") == 4 and ".py:" in line]
    assert len(rows) == len(script_of_docs("data_flow").STOP.findall(PAGE)) > 30


@pytest.mark.slow
def test_the_lines_of_the_page_show_what_it_says(tmp_path: Path) -> None:
    script = script_of_docs("data_flow")
    stale = script.STOP.sub(r"\1`?` |", PAGE)
    assert stale.count("`?`") > 30
    assert script.filled(stale, tmp_path) == PAGE, "python docs/data_flow.py makes it anew"
