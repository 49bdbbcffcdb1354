"""The documentation site: it builds without a warning, pages are near its front, search knows the field's words."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections import deque
from pathlib import Path
from urllib.parse import unquote

import pytest

from wristctl.cli.commands import COMMANDS

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site's HTML, built without the gallery's runs."""
    folder = tmp_path_factory.mktemp("site")
    script = [sys.executable, str(ROOT / "docs" / "build_site.py"), "--without-gallery", "--into", str(folder)]
    built = subprocess.run(script, text=True, capture_output=True, check=False, cwd=ROOT, env=os.environ)
    assert built.returncode == 0, built.stderr  # a warning is an error
    return folder / "html"


def links(page: Path) -> set[Path]:
    """Pages that a page links to."""
    targets = re.findall(r'href="([^"#:]+\.html)[#"]', page.read_text(encoding="utf-8"))
    return {(page.parent / unquote(target)).resolve() for target in targets}


def test_every_page_is_within_three_clicks_of_the_front(site: Path) -> None:
    front = (site / "docs" / "index.html").resolve()
    clicks, waiting = {front: 0}, deque([front])
    while waiting:
        page = waiting.popleft()
        for target in links(page) - clicks.keys():
            assert target.is_file(), f"{page.relative_to(site)} links to {target}"
            clicks[target] = clicks[page] + 1
            waiting.append(target)
    pages = {page.resolve() for page in (site / "docs").rglob("*.html")}
    assert {page.name for page in pages if clicks.get(page, 99) > 3} == set()
    assert len(pages) > 60


def test_every_command_of_the_help_has_a_page_with_all_its_options(site: Path) -> None:
    for name, entry in COMMANDS.items():
        page = site / "docs" / "reference" / "command-line" / f"{name}.html"
        assert page.is_file() != entry.hidden, name
    text = (site / "docs" / "reference" / "command-line" / "simulate.html").read_text(encoding="utf-8")
    assert "--debug" in text, "advanced options stand there too"
    assert "wristctl runs replay" in (site / "docs" / "reference" / "command-line" / "runs.html").read_text()


@pytest.mark.parametrize(
    ("word", "page"),
    [("hysteresis", "docs/hysteresis"), ("identification", "docs/identify"), ("ATmega2560", "docs/overview"),
     ("replay", "docs/runs"), ("RODAS3", "docs/overview")],
)  # fmt: skip
def test_the_index_of_the_search_knows_words_of_the_field(site: Path, word: str, page: str) -> None:
    text = (site / "searchindex.js").read_text(encoding="utf-8")
    index = json.loads(text.removeprefix("Search.setIndex(").rstrip().rstrip(";").rstrip(")"))
    pages = set()
    for terms in (index["titleterms"], index["terms"]):
        stem = max(
            (key for key in terms if word.lower().startswith(key)), key=len, default=""
        )  # as a stemmer leaves it
        places = terms.get(stem, [])
        pages |= {index["docnames"][place] for place in ([places] if isinstance(places, int) else places)}
    assert page in pages
