"""Which tests run which lines: one run of the quick suite under coverage, a context for every test.

Compiled functions run outside Python, and what a file does while it is imported belongs to no test: for both nothing is
known here, and the tests of the room are the ones to ask.
"""

from __future__ import annotations

import ast
import os
import subprocess
import sys
from collections import Counter
from collections.abc import Iterable
from functools import cached_property
from pathlib import Path

from coverage import CoverageData

ROOT = Path(__file__).parents[2]
KEPT = ROOT / "build" / "mutants" / "coverage"


class Reach:
    """The tests that run a line, by a coverage file with one context per test and phase, as pytest-cov writes it."""

    def __init__(self, file: Path) -> None:
        self._data = CoverageData(str(file))
        self._data.read()

    def tests(self, file: str, line: int) -> list[str]:
        """Names of the tests that run the statement of a line, those first that run the fewest lines in all.

        `file` is relative to the package, `line` counts from 1. Empty where no test is known to.
        """
        return self._ordered(file, statement((ROOT / "wristctl" / file).read_text(encoding="utf-8"), line))

    def tests_of_file(self, file: str) -> list[str]:
        """Names of the tests that run any line of a file, in the same order."""
        return self._ordered(file, self._data.contexts_by_lineno(f"wristctl/{file}"))

    def _ordered(self, file: str, lines: Iterable[int]) -> list[str]:
        contexts = self._data.contexts_by_lineno(f"wristctl/{file}")
        names = {_name(each) for number in lines for each in contexts.get(number, ())} - {""}
        return sorted(names, key=lambda name: (self._sizes[name], name))

    @cached_property
    def _sizes(self) -> Counter[str]:
        sizes: Counter[str] = Counter()
        for file in self._data.measured_files():
            for names in self._data.contexts_by_lineno(file).values():
                sizes.update({_name(each) for each in names})
        return sizes


def _name(context: str) -> str:
    """The test of a context: pytest-cov adds `|setup`, `|run` or `|teardown`."""
    return context.rpartition("|")[0]


def statement(source: str, line: int) -> range:
    """Lines of the innermost statement that holds a line: of a compound one, those before its body."""
    first, last = line, line
    size = len(source)
    for node in ast.walk(ast.parse(source)):
        if not isinstance(node, ast.stmt):
            continue
        begin, end = node.lineno, node.end_lineno or node.lineno
        body = getattr(node, "body", None)
        if body:
            end = max(begin, body[0].lineno - 1)
        if begin <= line <= end and end - begin < size:
            first, last, size = begin, end, end - begin
    return range(first, last + 1)


def measured() -> Reach:
    """Run the quick suite under coverage where the kept run is older than a source or a test."""
    sources = [*(ROOT / "wristctl").rglob("*.py"), *(ROOT / "tests").rglob("*.py")]
    newest = max(each.stat().st_mtime for each in sources)
    if not KEPT.exists() or KEPT.stat().st_mtime < newest:
        KEPT.parent.mkdir(parents=True, exist_ok=True)
        watched = ("--cov=wristctl", "--cov-context=test", "--cov-report=")
        command = [sys.executable, "-m", "pytest", "-n", "auto", "--maxprocesses", "4", "-m", "not slow", *watched]
        subprocess.run(command, cwd=ROOT, env={**os.environ, "COVERAGE_FILE": str(KEPT)}, check=True)
    return Reach(KEPT)
