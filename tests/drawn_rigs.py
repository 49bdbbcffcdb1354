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


def tried(asked: argparse.Namespace, trial: Callable[[int], Any], beside: str = "tried") -> Iterator[tuple[int, Any]]:
    """Each rig's number with what its trial came to, as JSON has it; `beside` names the file of what is kept."""
    before, file = ended(asked, beside), _file(asked, beside)
    file.parent.mkdir(parents=True, exist_ok=True)
    for number in range(asked.first, asked.first + asked.count):
        if number not in before:
            line = json.dumps({"number": number, "came": trial(number)}, default=_plain)
            with file.open("a") as kept:
                kept.write(f"{line}\n")
            before[number] = json.loads(line)["came"]
        yield number, before[number]


def ended(asked: argparse.Namespace, beside: str = "tried") -> dict[int, Any]:
    """What every rig came to that has been tried, by its number, in this order."""
    file = _file(asked, beside)
    lines = [json.loads(line) for line in file.read_text().splitlines()] if file.is_file() else []
    return dict(sorted((line["number"], line["came"]) for line in lines))


def _file(asked: argparse.Namespace, beside: str) -> Path:
    file: Path = asked.kept / f"{beside}.jsonl"
    return file


def _plain(value: Any) -> Any:
    """An array or a number of NumPy's as Python has it."""
    return value.tolist() if hasattr(value, "tolist") else list(value)
