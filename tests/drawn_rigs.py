"""Rigs drawn by their numbers and tried one by one; what has ended is kept, and a later run goes on from there."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

COMMITTED = Path("benchmarks") / "results"
"""Folder of what is kept beside the code: rigs that take hours, which are tried a few at a time."""


def options(description: str | None, count: int, kept: str, within: Path = Path("build")) -> argparse.ArgumentParser:
    """Options that say which rigs are tried, so many by default, and in which folder they are kept."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--first", type=int, default=0, help="number of the first rig")
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--kept", type=Path, default=within / kept, help="what has ended is kept here")
    return parser


class Kept:
    """What trials came to, by what each was of: a line of JSON for each, so that several programs may add to a file."""

    def __init__(self, file: Path) -> None:
        self._file = file

    def add(self, of: int | str, came: Any) -> None:
        """Keep what one came to."""
        self._file.parent.mkdir(parents=True, exist_ok=True)
        with self._file.open("a") as lines:
            lines.write(json.dumps({"of": of, "came": came}, default=_plain) + "\n")

    def all(self) -> dict[Any, Any]:
        """What all came to, in order; of one that was tried twice the last."""
        lines = self._file.read_text().splitlines() if self._file.is_file() else []
        came = {line["of"]: line["came"] for line in map(json.loads, lines)}
        return {of: came[of] for of in sorted(came)}


def tried(asked: argparse.Namespace, trial: Callable[[int], Any], beside: str = "tried") -> Iterator[tuple[int, Any]]:
    """Each rig's number with what its trial came to, as JSON has it; `beside` names the file of what is kept."""
    kept, before = _kept(asked, beside), ended(asked, beside)
    for number in range(asked.first, asked.first + asked.count):
        if number not in before:
            kept.add(number, trial(number))
            before = kept.all()
        yield number, before[number]


def ended(asked: argparse.Namespace, beside: str = "tried") -> dict[int, Any]:
    """What every rig came to that has been tried, by its number, in this order."""
    return _kept(asked, beside).all()


def _kept(asked: argparse.Namespace, beside: str) -> Kept:
    return Kept(asked.kept / f"{beside}.jsonl")


def _plain(value: Any) -> Any:
    """An array or a number of NumPy's as Python has it."""
    return value.tolist() if hasattr(value, "tolist") else list(value)
