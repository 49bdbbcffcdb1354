"""Figures inside a page: SVG with ids of its own and no more digits than a screen shows."""

from __future__ import annotations

import base64
import html
import re
from pathlib import Path

_HEAD = re.compile(r"<\?xml.*?\?>|<!DOCTYPE.*?>|<metadata>.*?</metadata>|<style.*?</style>", re.DOTALL)
"""What does not belong inside a page; matplotlib's style would rule all of it, page.css has it for figures alone."""
_DIGITS = re.compile(r"\.\d{3,}")
_PATH = re.compile(r'(?<= d=")[^"]*')
LARGEST = 300_000
"""Characters of an SVG beyond which its PNG is smaller and quicker to show."""


def inline_figure(svg: Path, prefix: str) -> str:
    """The figure as SVG markup whose ids begin with `prefix`; where that is too large, its PNG beside it."""
    text = _HEAD.sub("", svg.read_text(encoding="utf-8")).strip()
    text = _PATH.sub(lambda path: _DIGITS.sub(lambda digits: digits[0][:3], path[0]).replace("\n", " "), text)
    picture = svg.with_suffix(".png")
    name = html.escape(svg.stem.replace("-", " "), quote=True)
    if len(text) > LARGEST and picture.is_file():
        data = base64.b64encode(picture.read_bytes()).decode()
        return f'<img alt="{name}" src="data:image/png;base64,{data}">'
    for mark in (' id="', 'xlink:href="#', "url(#"):
        text = text.replace(mark, mark + prefix)
    return text.replace("<svg ", f'<svg role="img" aria-label="{name}" ', 1)
