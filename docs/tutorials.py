"""Walk the tutorials and write what each command prints below it: `python docs/tutorials.py [NAME ...]`.

Each page of docs/tutorials is walked in a folder of its own, as a newcomer does: a fence after "Save as `FILE`" becomes
that file, each line of a `console` fence that begins with `$ ` is run by bash, and its output replaces the lines up to
the next one. A comment `<!-- PLACE -->` above a picture says which file of the folder it is: a figure of a run, or a
report, whose head is shown.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

from shots import few_colours, shot

HERE = Path(__file__).parent
PAGES = sorted((HERE / "tutorials").glob("*.md"))
FENCE = re.compile(r"^```(\w+)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
SAVED = re.compile(r"Save as `([^`]+)`[^`]*\Z")
PICTURE = re.compile(r"^<!-- (\S+) -->\n!\[[^\]]*\]\(([^)]+)\)$", re.MULTILINE)
COLUMNS = 100
"""Width of the terminal [characters]."""
SHOWN = (1000, 960)
"""Of a report: width and height [px]."""


def environment(folder: Path) -> dict[str, str]:
    """One in which `wristctl` is this Python's, made in `folder`, with one thread and a terminal of COLUMNS."""
    programs = folder / "bin"
    programs.mkdir()
    program = programs / "wristctl"
    program.write_text(f'#!/bin/sh\nexec {shlex.quote(sys.executable)} -m wristctl "$@"\n', encoding="utf-8")
    program.chmod(0o755)
    threads = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    return os.environ | threads | {"COLUMNS": str(COLUMNS), "PATH": path}


def walk(text: str, folder: Path) -> str:
    """The page with what its commands print, run in the empty `folder`. Raises RuntimeError where one fails."""
    place = folder / "walked"
    place.mkdir()
    with_wristctl = environment(folder)
    parts, at = [], 0
    for fence in FENCE.finditer(text):
        parts.append(text[at : fence.start()])
        saved = SAVED.search(parts[-1])
        content = fence[2]
        if saved:
            (place / saved[1]).write_text(content, encoding="utf-8")
        elif fence[1] == "console":
            content = "".join(f"$ {line}\n{run(line, place, with_wristctl)}" for line in commands(content))
        parts.append(f"```{fence[1]}\n{content}```")
        at = fence.end()
    return "".join([*parts, text[at:]])


def commands(console: str) -> list[str]:
    """Command lines of a fence; one that ends in a backslash goes on in the next."""
    return re.findall(r"^\$ ((?:.*\\\n)*.*)$", console, re.MULTILINE)


def run(command: str, place: Path, with_wristctl: dict[str, str]) -> str:
    """What a command prints to stdout, without blank lines at its end."""
    sys.stderr.write(f"{command}\n")
    done = subprocess.run(
        ["bash", "-c", command], cwd=place, env=with_wristctl, text=True, capture_output=True, check=False
    )
    if done.returncode:
        raise RuntimeError(f"{command} ended with {done.returncode}: {done.stderr[-2000:]}")
    lines = "\n".join(line.rstrip() for line in done.stdout.rstrip().splitlines())
    return f"{lines}\n" if lines else ""


def pictures(text: str, place: Path) -> Iterator[tuple[Path, str]]:
    """File in the folder `place` and target of each picture. Raises FileNotFoundError where there is not just one."""
    for pattern, target in PICTURE.findall(text):
        found = sorted(place.glob(pattern))
        if len(found) != 1:
            raise FileNotFoundError(f"{target}: {len(found)} files are {pattern}")
        yield found[0], target


def remake(page: Path) -> None:
    """Walk a page, and write it and its pictures anew. Its runs stay in build/tutorials."""
    folder = HERE.parent / "build" / "tutorials" / page.stem
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir(parents=True)
    text = walk(page.read_text(encoding="utf-8"), folder)
    page.write_text(text, encoding="utf-8")
    for source, target in pictures(text, folder / "walked"):
        picture = (page.parent / target).resolve()
        picture.parent.mkdir(parents=True, exist_ok=True)
        if source.suffix == ".html":
            shot(source, picture, *SHOWN)
        else:
            few_colours(source, picture)


def main() -> None:
    """Remake the pages that are named, or all."""
    for page in PAGES:
        if page.stem in (sys.argv[1:] or page.stem):
            remake(page)


if __name__ == "__main__":
    main()
