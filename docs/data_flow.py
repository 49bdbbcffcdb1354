"""Write anew what the lines of docs/data-flow.md show: `python docs/data_flow.py`.

The page is walked as the tutorials are, in a folder of its own; then its Python is run in order: fences as they stand,
and each line of a table, whose value replaces the one beside it.
"""

from __future__ import annotations

import re
from contextlib import chdir
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from tutorials import FENCE, walk

PAGE = Path(__file__).with_name("data-flow.md")
STOP = re.compile(r"^(\| [^|]+ \| `([^`|]+)` \| )`[^`|]*` \|$", re.MULTILINE)
"""A stop: its meaning with its place, its line of Python, and what that shows."""


def filled(text: str, folder: Path) -> str:
    """The page with what its lines show, run in the empty `folder`. Raises what a line raises."""
    names = dict[str, Any]()

    def shown(stop: re.Match[str]) -> str:
        return f"{stop[1]}`{' '.join(str(eval(stop[2], names)).split())}` |"

    walked, parts, at = walk(text, folder), list[str](), 0
    with chdir(folder / "walked"):
        for fence in FENCE.finditer(walked):
            parts += [STOP.sub(shown, walked[at : fence.start()]), fence[0]]
            if fence[1] == "python":
                exec(fence[2], names)
            at = fence.end()
        return "".join([*parts, STOP.sub(shown, walked[at:])])


if __name__ == "__main__":
    with TemporaryDirectory() as scratch:
        PAGE.write_text(filled(PAGE.read_text(encoding="utf-8"), Path(scratch)), encoding="utf-8")
