"""Figures inside a page, as pictures: what a foreign run's SVG may hold of scripts does not run."""

from __future__ import annotations

import base64
import re
from pathlib import Path

_DIGITS = re.compile(r"\.\d{3,}")
_PATH = re.compile(r'(?<= d=")[^"]*')
LARGEST = 300_000
"""Characters of an SVG beyond which its PNG is smaller and quicker to show."""


def inline_figure(svg: Path) -> str:
    """The figure's address as a data URL, with no more digits than a screen shows; of a large one its PNG's."""
    text = svg.read_text(encoding="utf-8", errors="replace")
    text = _PATH.sub(lambda path: _DIGITS.sub(lambda digits: digits[0][:3], path[0]).replace("\n", " "), text)
    picture = svg.with_suffix(".png")
    if len(text) > LARGEST and picture.is_file() and not picture.is_symlink():
        return f"data:image/png;base64,{base64.b64encode(picture.read_bytes()).decode()}"
    return f"data:image/svg+xml;base64,{base64.b64encode(text.encode()).decode()}"
