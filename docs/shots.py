"""Pictures of pages in a headless Chromium, with few colours, so that they stay small in the repository."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from pathlib import Path

from PIL import Image

COLOURS = 64
_BARS = 200
"""Height that a window has beside its page, at most [px]."""


def few_colours(source: Path, picture: Path, height: int | None = None) -> None:
    """The picture `source`, or its upper `height` pixels, as the PNG `picture` of 64 colours."""
    with Image.open(source) as whole:
        upper = whole.crop((0, 0, whole.width, height or whole.height))
        few = upper.convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
        few.save(picture, optimize=True)


def shot(page: Path, picture: Path, width: int, height: int) -> None:
    """The head of a page, `width` by `height` pixels, as the PNG `picture`. Without a browser the program ends."""
    browser = shutil.which("chromium")
    if browser is None:
        raise SystemExit("error: no chromium - fix: apt-get install chromium")
    with tempfile.TemporaryDirectory() as folder:
        taken = Path(folder) / "shot.png"
        options = ["--headless", "--no-sandbox", "--disable-gpu", "--hide-scrollbars"]
        options += ["--disable-background-networking", f"--user-data-dir={folder}/profile"]
        options += [f"--window-size={width},{height + _BARS}", f"--screenshot={taken}"]
        subprocess.run([browser, *options, page.resolve().as_uri()], check=True, capture_output=True)
        few_colours(taken, picture, height)
