"""Build the site: `make docs`, or `python docs/build_site.py`; it needs no network. Open build/site/html/index.html.

The source is the pages of this folder and of the root, and pages that are generated: the help of every command, the
messages of the motor board, the manifest of runs, the gallery with its runs, and the notebooks with what they show.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from gallery import write_gallery
from typer.main import get_command
from typer.testing import CliRunner

from wristctl.cli.app import app, typer_of
from wristctl.cli.commands import COMMANDS
from wristctl.records.manifest import Manifest

ROOT = Path(__file__).parents[1]
# What pages link to and is no page.
LINKED = ("experiments", "wristctl", "tests", "benchmarks", "CITATION.cff", "LICENSE", "Makefile", "constraints.txt")
FRONT = """\
<!doctype html>
<meta http-equiv="refresh" content="0; url=docs/index.html">
<a href="docs/index.html">wristctl</a>
"""
# Width of a terminal in the pages [characters].
COLUMNS = 100


def assemble(source: Path) -> None:
    """Copy the pages into the folder `source`, each where it lies here, so that links hold."""
    shutil.rmtree(source, ignore_errors=True)
    source.mkdir(parents=True)
    for page in ROOT.glob("*.md"):
        shutil.copy(page, source)
    shutil.copytree(ROOT / "docs", source / "docs", ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    for name in LINKED:
        (source / name).symlink_to(ROOT / name)


def add_index(source: Path) -> None:
    """Put the words of docs/index_words.toml below the title of their pages, as main entries of the index."""
    for name, words in tomllib.loads((ROOT / "docs" / "index_words.toml").read_text(encoding="utf-8")).items():
        page = source / "docs" / f"{name}.md"
        title, rest = page.read_text(encoding="utf-8").split("\n", 1)
        entries = ", ".join(f"! {word}" for word in words)
        page.write_text(f"{title}\n\n```{{index}} {entries}\n```\n{rest}", encoding="utf-8")


def link_gallery(source: Path) -> None:
    """Let the front page lead to the gallery, which is there on the site alone."""
    front = source / "docs" / "index.md"
    text = front.read_text(encoding="utf-8")
    linked = re.sub(r"a gallery of runs(.*), on the site that .*", r"[a gallery of runs](gallery.md)\1.", text)
    if linked == text:
        raise ValueError("docs/index.md names no gallery of runs")
    front.write_text(linked, encoding="utf-8")


def calls() -> Iterator[list[str]]:
    """Every command that the help shows, and behind each group the commands in it."""

    def within(command: Any, path: list[str]) -> Iterator[list[str]]:
        yield path
        for name, below in getattr(command, "commands", {}).items():
            if not below.hidden:
                yield from within(below, [*path, name])

    for name, entry in COMMANDS.items():
        if not entry.hidden:
            yield from within(get_command(typer_of(entry)), [name])


def command_pages(source: Path) -> None:
    """One page per command, with the help that the terminal shows, and their list."""
    folder = source / "docs" / "reference" / "command-line"
    folder.mkdir(parents=True)
    helps: dict[str, list[str]] = {}
    sys.argv.append("--all")  # the help then has every option
    for call in calls():
        answer = CliRunner().invoke(app, [*call, "--help"], prog_name="wristctl")
        if answer.exit_code:
            raise RuntimeError(f"wristctl {' '.join(call)} --help: {answer.output}")
        text = "\n".join(line.rstrip() for line in answer.output.strip().splitlines())
        helps.setdefault(call[0], []).append(f"# wristctl {' '.join(call)}\n\n```text\n{text}\n```\n")
    sys.argv.remove("--all")
    for name, parts in helps.items():
        first, *others = parts
        (folder / f"{name}.md").write_text("\n".join([first, *(f"#{part}" for part in others)]))
    lines = [f"- [`{name}`](command-line/{name}.md): {COMMANDS[name].line}" for name in helps]
    listed = "\n".join(f"command-line/{name}" for name in helps)
    (folder.parent / "command-line.md").write_text(
        "# The command line\n\nWhat `wristctl COMMAND --help --all` prints. [Commands, studies and "
        "Python](../commands.md) says what all of them share.\n\n"
        + "\n".join(lines)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"
    )


def board_page(source: Path) -> None:
    """The table of messages between host and motor board."""
    table = tomllib.loads((ROOT / "wristctl" / "board" / "messages.toml").read_text())
    parts = [
        "# The motor board's messages\n\nFrom `wristctl/board/messages.toml`, of which host and firmware are "
        "generated.\n"
    ]
    for section, entries in table.items():
        if section == "protocol":
            parts.append("".join(f"- {key}: {value}\n" for key, value in entries.items()))
            continue
        parts.append(f"## {section.capitalize()}\n")
        for name, entry in entries.items():
            facts = entry if isinstance(entry, dict) else {"": entry}
            parts.append(
                f"- **{name}**: "
                + "; ".join(_fact(key, value) for key, value in facts.items() if value not in ("", []))
            )
        parts.append("")
    (source / "docs" / "reference" / "board-messages.md").write_text("\n".join(parts))


def _fact(key: str, value: Any) -> str:
    text = ", ".join(f"`{item}`" for item in value) if isinstance(value, list) else str(value)
    return f"{key.replace('_', ' ')} {text}".strip() if key != "meaning" else text


def manifest_page(source: Path) -> None:
    """The fields of run.json."""
    schema = Manifest.model_json_schema(by_alias=True)
    parts = [
        "# The manifest of a run\n\nThe fields of `run.json` in each run directory; [runs](../runs.md) says what may "
        "be relied on.\n"
    ]
    for name, part in {"Manifest": schema, **schema.get("$defs", {})}.items():
        if "properties" not in part:
            continue
        parts += [
            f"## {name}\n",
            part.get("description", "").replace("\n", " "),
            "",
            "| field | type | meaning |",
            "|---|---|---|",
        ]
        parts += [
            f"| `{field}` | {_type(of)} | {of.get('description', '')} |" for field, of in part["properties"].items()
        ]
        parts.append("")
    (source / "docs" / "reference" / "manifest.md").write_text("\n".join(parts))


def _type(of: dict[str, Any]) -> str:
    if "$ref" in of:
        name = of["$ref"].rsplit("/", 1)[-1]
        return f"[{name}](#{name.lower()})"
    if "anyOf" in of:
        return " or ".join(_type(other) for other in of["anyOf"])
    if "enum" in of:
        return ", ".join(f"`{value}`" for value in of["enum"])
    if of.get("type") == "array":
        return f"list of {_type(of.get('items', {}))}"
    return str(of.get("type", "any"))


def notebook_pages(source: Path, work: Path) -> None:
    """Run the notebooks in the folder `work`, and put their pages with outputs in place of those without."""
    for page in sorted((ROOT / "docs" / "notebooks").glob("*.md")):
        folder = work / page.stem
        shutil.rmtree(folder, ignore_errors=True)
        command = [sys.executable, str(ROOT / "docs" / "execute_notebooks.py"), str(page), str(folder)]
        subprocess.run(command, env=os.environ | {"OMP_NUM_THREADS": "1"}, check=True)
        for name in (page.name, f"{page.stem}.ipynb"):
            shutil.copy(folder / name, source / "docs" / "notebooks")


def build(source: Path, html: Path) -> int:
    """Run Sphinx; a warning is an error. Returns its exit code."""
    conf = ["-c", str(ROOT / "docs")]
    done = subprocess.run(
        [sys.executable, "-m", "sphinx", "-b", "html", "-W", "--keep-going", "-q", *conf, str(source), str(html)],
        env=os.environ | {"OMP_NUM_THREADS": "1"},
        check=False,
    )
    (html / "index.html").write_text(FRONT)
    return done.returncode


def main() -> None:
    """Assemble, generate, build."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--without-gallery", action="store_true", help="run nothing: the gallery stays empty, notebooks show no output"
    )
    parser.add_argument("--into", type=Path, default=ROOT / "build" / "site", help="folder of source and HTML")
    asked = parser.parse_args()
    source, html = asked.into / "source", asked.into / "html"
    assemble(source)
    add_index(source)
    link_gallery(source)
    command_pages(source)
    board_page(source)
    manifest_page(source)
    write_gallery(source / "docs", asked.into / "gallery", run=not asked.without_gallery)
    if not asked.without_gallery:
        notebook_pages(source, asked.into / "notebooks")
    code = build(source, html)
    if code == 0:
        sys.stdout.write(f"open {html / 'index.html'}\n")
    sys.exit(code)


if __name__ == "__main__":
    os.environ["TERMINAL_WIDTH"] = str(COLUMNS)
    main()
