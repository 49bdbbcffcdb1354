"""Rigs drawn by their numbers and tried one by one; what has ended is kept, and a later run goes on from there."""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any


def options(description: str | None, count: int, kept: str) -> argparse.ArgumentParser:
    """Options that say which rigs are tried, so many by default, and in which folder of build/ they are kept."""
    parser = argparse.ArgumentParser(description=description)
    parser.add_argument("--first", type=int, default=0, help="number of the first rig")
    parser.add_argument("--count", type=int, default=count)
    parser.add_argument("--kept", type=Path, default=Path("build") / kept, help="what has ended is kept here")
    return parser


def tried(asked: argparse.Namespace, trial: Callable[[int], Any], beside: str = "") -> Iterator[tuple[int, Any]]:
    """Each rig's number with what its trial came to, as JSON has it; `beside` is a folder in that of what is kept."""
    folder = asked.kept / beside
    folder.mkdir(parents=True, exist_ok=True)
    for number in range(asked.first, asked.first + asked.count):
        file = folder / f"{number}.json"
        if not file.is_file():
            file.write_text(json.dumps(trial(number), default=_plain))
        yield number, json.loads(file.read_text())


def _plain(value: Any) -> Any:
    """An array or a number of NumPy's as Python has it."""
    return value.tolist() if hasattr(value, "tolist") else list(value)
