"""Tutorials: each command runs, prints what the page shows, and leaves the files that its pictures are made of."""

from __future__ import annotations

import re
from pathlib import Path
from types import ModuleType

import pytest
from PIL import Image

from tests.documented import DOCS, script_of_docs

PAGES = sorted((DOCS / "tutorials").glob("*.md"))
# What differs from walk to walk: ids of runs, times on this machine, hashes.
_APART = re.compile(r"\d{8}T\d{6}Z|-[0-9a-f]{6}\b|.*on this machine$|.*sha256 .*", re.MULTILINE)
_NUMBER = re.compile(r"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
LOOSE = 0.02
"""How far apart numbers may be that two machines print, as a share of them."""
EMULATED, AT_REST_DEG = ("hw-run", "recommend"), 0.01
"""Commands that try an emulated rig, and what its figures may be apart by beside: a wrist that rests swings by what its
camera's noise makes of friction, and the last bits of that are the processor's own."""


@pytest.fixture(scope="module")
def tutorials() -> ModuleType:
    """The script that walks the pages."""
    return script_of_docs("tutorials")


def different(text: str, other: str) -> list[tuple[str, str]]:
    """Words of two pages that differ in order, numbers by more than LOOSE."""
    words, others = (_APART.sub("", each).split() for each in (text, other))
    pairs, before, command = list[tuple[str, str]](), "", ""
    for word, another in zip(words, others, strict=False):
        command = word if before == "wristctl" else command
        if not _alike(word, another, AT_REST_DEG if command in EMULATED else 1e-9):
            pairs.append((word, another))
        before = word
    return pairs + [("", "")] * abs(len(words) - len(others))


def _alike(word: str, other: str, apart: float) -> bool:
    if _NUMBER.sub("", word) != _NUMBER.sub("", other):
        return False
    numbers = [[float(number) for number in _NUMBER.findall(each)] for each in (word, other)]
    return len(numbers[0]) == len(numbers[1]) and numbers[0] == pytest.approx(numbers[1], rel=LOOSE, abs=apart)


@pytest.mark.slow
@pytest.mark.painted
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_shows_what_its_commands_print_and_draw(page: Path, tutorials: ModuleType, tmp_path: Path) -> None:
    text = page.read_text(encoding="utf-8")
    walked = tutorials.walk(text, tmp_path)
    assert different(walked, text) == [], f"python docs/tutorials.py {page.stem} makes it anew"
    for source, target in tutorials.pictures(text, tmp_path / "walked"):
        assert source.stat().st_size > 5_000
        with Image.open(page.parent / target) as picture:
            assert picture.width >= 600


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_tutorial_says_what_is_seen_after_each_command_and_of_each_picture(page: Path, tutorials: ModuleType) -> None:
    """Between a command's output, or a picture, and the next one stands what the reader sees."""
    text = page.read_text(encoding="utf-8")
    fences = [fence for fence in tutorials.FENCE.finditer(text) if fence[1] == "console"]
    assert len(fences) >= 4 and len(tutorials.PICTURE.findall(text)) >= 1
    ends = [fence.end() for fence in fences]
    for end, after in zip(ends, [*(fence.start() for fence in fences[1:]), len(text)], strict=True):
        assert re.search(r"^You now see ", text[end:after], re.MULTILINE), text[end - 200 : end]
    for fence in fences:
        assert len(tutorials.commands(fence[2])) < len(fence[2].splitlines()), "the output stands there"


def test_every_picture_of_the_tutorials_is_one_that_the_script_makes(tutorials: ModuleType) -> None:
    made = [target for page in PAGES for _, target in tutorials.PICTURE.findall(page.read_text(encoding="utf-8"))]
    shown = [target for page in PAGES for target in re.findall(r"!\[[^\]]*\]\(([^)]+)\)", page.read_text("utf-8"))]
    assert len(PAGES) == 3 and made == shown and len(set(made)) == len(made)
    assert {(DOCS / "tutorials" / target).resolve() for target in made} == set((DOCS / "images/tutorials").iterdir())


SMALL = """\
# A page

Save as `a b.txt`:

```yaml
key: 1
```

```console
$ cat 'a b.txt' && mkdir out && cp 'a b.txt' out/x-1.txt
stale
$ echo one \\
  two >&2; wristctl runs ls --help | head -n 1 | wc -l
```

```text
$ no command
```

<!-- out/x-*.txt -->
![what it is](x.png)
"""


def test_a_walk_saves_files_runs_commands_in_order_and_replaces_what_stood_below_them(
    tutorials: ModuleType, tmp_path: Path
) -> None:
    walked = tutorials.walk(SMALL, tmp_path)
    assert walked == SMALL.replace("stale\n", "key: 1\n").replace("wc -l\n", "wc -l\n1\n")
    assert tutorials.walk(walked, _made(tmp_path / "again")) == walked
    assert list(tutorials.pictures(SMALL, tmp_path / "walked")) == [(tmp_path / "walked/out/x-1.txt", "x.png")]


def test_a_command_that_fails_and_a_picture_that_is_not_there_stop_the_walk(
    tutorials: ModuleType, tmp_path: Path
) -> None:
    with pytest.raises(RuntimeError, match="false ended with 1"):
        tutorials.walk("```console\n$ false\n```\n", tmp_path)
    with pytest.raises(FileNotFoundError, match="0 files are"):
        list(tutorials.pictures(SMALL, tmp_path))


def _made(folder: Path) -> Path:
    folder.mkdir()
    return folder


def test_pages_are_alike_but_for_runs_machines_and_the_last_digits() -> None:
    page = "error 0.26 deg in results/20261129T193625Z-simulate-robot-12dcf7\ntime 0.07 us, on this machine\nok"
    assert not different(page, page.replace("193625", "203625").replace("12dcf7", "ab0001").replace("0.07", "9"))
    assert not different(page, page.replace("0.26", "0.261"))
    tried = "$ wristctl hw-run\nswings by 0.05 deg, errs by 0.26 deg"
    assert not different(tried, tried.replace("0.05", "0.057"))
    for other in (tried.replace("0.05", "0.062"), tried.replace("0.26", "0.28")):
        assert different(tried, other)
    assert different(tried.replace("hw-run", "simulate"), tried.replace("hw-run", "simulate").replace("0.05", "0.057"))
    for other in (page.replace("0.26", "0.28"), page.replace("error", "Error"), page + " more", page[:-2]):
        assert different(page, other)
