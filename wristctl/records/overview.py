"""What a run's page begins with and in which order it goes on: overview.json."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

from wristctl.records.manifest import OVERVIEW


@dataclass
class Overview:
    """The answer in words and its figure, the metrics that head the page, and the figures in reading order."""

    answer: list[str] = field(default_factory=list)
    """Lines; empty where a command has no answer but its tables."""
    figure: str = ""
    """The name of the figure that goes with it."""
    cards: list[str] = field(default_factory=list)
    """Names of metrics."""
    captions: dict[str, str] = field(default_factory=dict)
    """What each figure shows, by its name and in reading order; also of those that were not drawn."""
    marks: list[str] = field(default_factory=list)
    """Why a run that was done is no good, in a word or two each; empty where it is sound."""

    def text(self) -> str:
        """As the file holds it."""
        return json.dumps(asdict(self), indent=2, ensure_ascii=False) + "\n"


def read_overview(folder: Path) -> Overview:
    """Of a run directory; an empty one where there is none, or none that can be read: it is an order, and no result."""
    file = folder / OVERVIEW
    try:
        found: Any = {} if file.is_symlink() else json.loads(file.read_bytes())
    except (OSError, ValueError, RecursionError):
        found = {}
    if not isinstance(found, dict):
        return Overview()
    answer, cards, captions, marks = (found.get(name) for name in ("answer", "cards", "captions", "marks"))
    return Overview(
        _texts(answer),
        found["figure"] if isinstance(found.get("figure"), str) else "",
        _texts(cards),
        {name: text for name, text in captions.items() if isinstance(text, str)} if isinstance(captions, dict) else {},
        _texts(marks),
    )


def _texts(found: Any) -> list[str]:
    return [each for each in found if isinstance(each, str)] if isinstance(found, list) else []
