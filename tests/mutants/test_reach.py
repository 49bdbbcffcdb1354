"""Which tests run a line is read from a coverage file; a line belongs to its whole statement, not to a body's."""

from __future__ import annotations

from pathlib import Path

import pytest
from coverage import CoverageData

from tests.mutants import reach

SOURCE = """\
LIMIT = 3.0


def clipped(values,
            limit):
    if (values >
            limit):
        return dict(
            limit=limit,
        )
    return values
"""


@pytest.mark.parametrize(("line", "lines"), [(1, [1]), (4, [4, 5]), (7, [6, 7]), (9, [8, 9, 10]), (11, [11])])
def test_a_line_stands_for_its_statement(line: int, lines: list[int]) -> None:
    assert list(reach.statement(SOURCE, line)) == lines


def test_the_tests_of_a_line_come_by_how_little_else_they_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "wristctl").mkdir()
    (tmp_path / "wristctl" / "clip.py").write_text(SOURCE, encoding="utf-8")
    monkeypatch.setattr(reach, "ROOT", tmp_path)
    measured = CoverageData(str(tmp_path / "kept"))
    for context, lines in {
        "": [1, 4],
        "tests/a.py::test_wide|run": [6, 8, 11],
        "tests/a.py::test_narrow[x|y]|run": [6, 8],
        "tests/b.py::test_elsewhere|setup": [11],
    }.items():
        measured.set_context(context)
        measured.add_lines({"wristctl/clip.py": lines})
    measured.write()
    reached = reach.Reach(tmp_path / "kept")
    assert reached.tests("clip.py", 9) == ["tests/a.py::test_narrow[x|y]", "tests/a.py::test_wide"]
    assert reached.tests("clip.py", 11) == ["tests/b.py::test_elsewhere", "tests/a.py::test_wide"]
    assert reached.tests("clip.py", 1) == []
    assert reached.tests_of_file("clip.py") == ["tests/b.py::test_elsewhere", *reached.tests("clip.py", 9)]
