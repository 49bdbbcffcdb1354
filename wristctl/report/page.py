"""report.html: one run on one page that needs nothing but a browser."""

from __future__ import annotations

import base64
import hashlib
import json
import math
import shlex
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl import __version__
from wristctl.config.errors import UserError
from wristctl.config.printable import printable_lines
from wristctl.config.wording import Call
from wristctl.records.lineage import ancestry
from wristctl.records.manifest import CONFIG, TABLES, Manifest, command_of
from wristctl.records.overview import read_overview
from wristctl.records.run import Run
from wristctl.report.animation import animation
from wristctl.report.inline_figure import inline_figure
from wristctl.report.lineage_picture import lineage_picture

if TYPE_CHECKING:
    from jinja2 import Environment

_CARDS = 6
"""Headline numbers shown where the command names none."""

Figures = list[tuple[str, str, str]]
"""Name, caption and data URL."""


def page(run: Run, manifest: Manifest, beside: Path | None = None) -> str:
    """The page of a run; the manifest may be newer than what the directory holds, while the run is being sealed.

    `beside` is a folder of figures that were drawn later.
    """
    overview, drawn = read_overview(run.path), figures(run, beside)
    there = {name for name, *_ in drawn}
    return render(
        "run.html",
        heading=run.id,
        manifest=manifest,
        command=command_of(manifest.kind),
        verdict=", ".join(overview.marks) if manifest.state == "ok" else "",
        answer=overview.answer,
        headline=_headline(run.metrics, overview.cards),
        metrics=_metrics(run),
        tables=tables(run),
        figures=[each for each in drawn if each[0] != overview.figure],
        first=[each for each in drawn if each[0] == overview.figure],
        undrawn=[caption or name for name, caption in overview.captions.items() if name not in there],
        animation=animation(run),
        lineage=lineage_picture(ancestry(run, state=manifest.state)),
        provenance=_provenance(manifest),
        files=[(each.path, each.bytes, each.sha256, not each.volatile) for each in manifest.outputs],
        config=run.file(CONFIG).read_text(encoding="utf-8", errors="replace"),
    )


def render(template: str, **content: Any) -> str:
    """A page from one of the templates; everything is escaped but what they mark as markup."""
    return _templates().get_template(template).render(version=__version__, **content)


@cache
def _templates() -> Environment:
    from jinja2 import Environment, FileSystemLoader

    folder = Path(__file__).parent / "templates"
    made = Environment(
        loader=FileSystemLoader(folder), autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )
    made.filters["cell"] = _cell
    scripts = [made.get_template(each.name).render().encode() for each in sorted(folder.glob("*.js"))]
    hashes = [base64.b64encode(hashlib.sha256(script).digest()).decode() for script in scripts]
    made.globals["allowed"] = " ".join(f"'sha256-{each}'" for each in hashes)  # no other script runs in a page
    return made


def figures(run: Run, beside: Path | None = None) -> Figures:
    """Name, caption and data URL of each figure of a run, in reading order where the run has one, then by name."""
    captions = read_overview(run.path).captions
    order = {name: at for at, name in enumerate(captions)}
    folders = [run.path / "figures", *([beside] if beside else [])]
    files = [file for folder in folders for file in folder.glob("*.svg") if not file.is_symlink()]
    files.sort(key=lambda file: (order.get(file.stem, len(order)), file.stem))
    return [(file.stem, captions.get(file.stem) or file.stem.replace("-", " "), inline_figure(file)) for file in files]


def _shown(value: Any) -> Any:
    """What stands in a page, which somebody may look at in a terminal: texts without what that obeys."""
    return printable_lines(value) if type(value) is str else value


def _cell(value: Any) -> str:
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.4g}" if math.isfinite(value) else "-"
    return str(value)


def _headline(metrics: dict[str, dict[str, Any]], cards: Sequence[str]) -> list[tuple[str, dict[str, Any]]]:
    """The metrics that the command chose; where it chose none, the first that may be better or worse."""
    known = {name: each for name, each in metrics.items() if each["value"] is not None}
    chosen = [name for name in cards if name in known]
    chosen = chosen or [name for name, each in known.items() if each.get("better")] or list(known)
    return [(name, known[name]) for name in chosen[:_CARDS]]


def _metrics(run: Run) -> list[tuple[Any, ...]]:
    kept = ("value", "unit", "better", "n", "meaning")
    return [(name, *(each.get(key) for key in kept)) for name, each in run.metrics.items()]


def tables(run: Run) -> list[dict[str, Any]]:
    """The tables that a command printed or kept: title, columns and rows each."""
    if not (run.path / TABLES).exists():
        return []
    file = run.file(TABLES)
    try:
        found = json.loads(file.read_bytes())
    except (ValueError, RecursionError):
        found = None
    if not isinstance(found, list) or not all(map(_is_table, found)):
        again = ("restore it, or run `", Call(command_of(run.kind)), "` again")
        raise UserError("no tables as wristctl writes them", str(file), again)
    return found


def _is_table(found: object) -> bool:
    """Whether a page can show it: a title, names of columns and rows of cells."""
    if not isinstance(found, dict) or not isinstance(found.get("title"), str):
        return False
    columns, rows = found.get("columns"), found.get("rows")
    if not isinstance(columns, list) or not isinstance(rows, list) or not all(isinstance(row, list) for row in rows):
        return False
    return not any(isinstance(cell, list | dict) for row in (columns, *rows) for cell in row)


def _provenance(manifest: Manifest) -> list[tuple[str, str]]:
    code, machine = manifest.code, manifest.environment
    commit = f", commit {code.commit[:12]}{' with uncommitted changes' if code.dirty else ''}" if code.commit else ""
    packages = ", ".join(f"{name} {version}" for name, version in machine.packages.items())
    return [
        ("command", shlex.join(manifest.argv)),
        ("code", f"wristctl {code.version}{commit}, tree {code.tree_sha256[:12]}"),
        *((f"input {each.role}", f"{each.run}, result {each.result_sha256[:12]}") for each in manifest.inputs),
        ("configuration", manifest.config_sha256),
        ("fingerprint", manifest.fingerprint),
        ("result", manifest.result_sha256 or ""),
        ("machine", f"{machine.cpu}, {machine.cores} cores, {machine.os}"),
        ("python", machine.python),
        ("packages", packages),
        ("numerics", ", ".join(f"{name} {value}" for name, value in manifest.numerics.items()) or "-"),
        ("memory, processor time", f"{manifest.timing.max_rss_mb or 0:.0f} MB, {manifest.timing.cpu_s or 0:.1f} s"),
    ]
