"""report.html: one run on one page that needs nothing but a browser."""

from __future__ import annotations

import base64
import hashlib
import math
import os
import re
import shlex
from collections.abc import Callable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from wristctl.escape import printable, printable_lines
from wristctl.plain_files import read_plain, unreadable
from wristctl.plotting.animation import animation
from wristctl.plotting.page_tables import shown_tables
from wristctl.reader_units import in_degrees, metric_in_words, without_dust
from wristctl.records.lineage import Ancestor, ancestry
from wristctl.records.manifest import CONFIG, Manifest, read_overview
from wristctl.records.run import Run
from wristctl.records.run_writer import Undrawn
from wristctl.study_files.keys import command_of
from wristctl.version import __version__

if TYPE_CHECKING:
    from jinja2 import Environment


_DIGITS = re.compile(r"\.\d{3,}")
_PATH = re.compile(r'(?<= d=")[^"]*')
# Characters of an SVG beyond which its PNG is smaller and quicker to show.
LARGEST = 300_000


def inline_figure(svg: Path) -> str:
    """The figure's address as a data URL, with no more digits than a screen shows; of a large one its PNG's."""
    text = _content(svg).decode("utf-8", errors="replace")
    text = _PATH.sub(lambda path: _DIGITS.sub(lambda digits: digits[0][:3], path[0]).replace("\n", " "), text)
    picture = svg.with_suffix(".png")
    if len(text) > LARGEST and os.path.lexists(picture):
        return f"data:image/png;base64,{base64.b64encode(_content(picture)).decode()}"
    return f"data:image/svg+xml;base64,{base64.b64encode(text.encode()).decode()}"


def _content(picture: Path) -> bytes:
    try:
        return read_plain(picture, links=False)
    except OSError as error:
        raise unreadable(error, picture) from error


_WIDTH, _HEIGHT, _GAP, _ROW = 192, 44, 44, 60
_WORDS = {"gen-data": "data", "train": "network", "tune": "gains", "compare": "comparison", "hw-run": "trial"}


def lineage_picture(tree: Ancestor) -> str:
    """SVG markup: each run once, as far left as what it was made from allows; empty where there is nothing behind."""
    if not tree.inputs:
        return ""
    nodes = {node.id: node for node in tree.runs()}
    edges = dict.fromkeys((ancestor.id, node.id) for node in nodes.values() for ancestor in node.inputs)
    columns = dict[str, int]()
    for name, node in nodes.items():  # after its inputs
        columns[name] = max((1 + columns.get(ancestor.id, 0) for ancestor in node.inputs), default=0)
    rows: dict[str, int] = {}
    for name in sorted(nodes, key=lambda name: (columns[name], name)):
        rows[name] = sum(columns[other_name] == columns[name] for other_name in rows)
    width = (max(columns.values()) + 1) * (_WIDTH + _GAP) - _GAP + 4
    height = (max(rows.values()) + 1) * _ROW
    place = {name: (2 + columns[name] * (_WIDTH + _GAP), 6 + rows[name] * _ROW) for name in nodes}
    middle = _HEIGHT // 2
    return render(
        "lineage.svg",
        width=width,
        height=height,
        wide=_WIDTH,
        high=_HEIGHT,
        gap=_GAP,
        arrows=[(place[a][0] + _WIDTH, place[a][1] + middle, place[b][0], place[b][1] + middle) for a, b in edges],
        boxes=[
            (printable(name), _WORDS.get(node.kind, node.kind), node.state, name == tree.id, *place[name])
            for name, node in nodes.items()
        ],
    )


# Figures of angle and error over time, which come before every table.
_OVERLAY = re.compile(r"overlay-|(angle|error)s?$")
# The line below the heads of an aligned table.
_RULE = re.compile(r"-+(  -+)*")


def blocks(lines: Sequence[str]) -> list[dict[str, Any]]:
    """The blocks of an answer, which empty lines part: a `table`, a `command`, `lines` as they are, or `text`.

    An aligned table's columns are those of the rule below its heads, which may be broken into lines. One that was
    too wide for a terminal goes on in the next, with its first column again: here they are one.
    """
    parts: list[list[str]] = [[]]
    for line in lines:
        if line.strip():
            parts[-1].append(line)
        else:
            parts.append([])
    found = list[dict[str, Any]]()
    for block in (_block(part) for part in parts if part):
        if found and block["kind"] == found[-1]["kind"] == "table" and _first(block) == _first(found[-1]):
            found[-1]["columns"] += block["columns"][1:]
            found[-1]["rows"] = [[*row, *more[1:]] for row, more in zip(found[-1]["rows"], block["rows"], strict=True)]
        else:
            found.append(block)
    return found


def _first(table: dict[str, Any]) -> list[str]:
    """Head and cells of a table's first column."""
    return [table["columns"][0], *(row[0] for row in table["rows"])]


def _block(part: Sequence[str]) -> dict[str, Any]:
    rule = next((at for at, line in enumerate(part[1:], start=1) if _RULE.fullmatch(line)), None)
    if rule:
        starts = [0, *(space.end() for space in re.finditer(" +", part[rule]))]
        spans = list(zip(starts, [*starts[1:], None], strict=True))
        cells = [[line[start:end].strip() for start, end in spans] for line in part]
        heads = [" ".join(filter(None, words)) for words in zip(*cells[:rule], strict=True)]
        return {"kind": "table", "columns": heads, "rows": cells[rule + 1 :]}
    if len(part) == 1 and part[0].startswith("wristctl "):
        return {"kind": "command", "text": part[0]}
    as_is = any(line.startswith(" ") for line in part)
    return {"kind": "lines" if as_is else "text", "text": "\n".join(part) if as_is else " ".join(part)}


# What only a terminal's reader can use: options, and the name of the page itself.
_OPTION = re.compile(r"--all\b|report\.html")
_SENTENCE = re.compile(r"(?<=[.!?:;])\s+(?=[A-Z])")
_IN_A_TITLE = re.compile(r"; [^;]*: --all$")


def for_a_page(answer: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """The blocks of an answer without what is said of options of the command line, all of which the page shows."""
    shown = []
    for block in answer:
        if block["kind"] in ("text", "lines") and _OPTION.search(block["text"]):
            sentences = _SENTENCE.split(_IN_A_TITLE.sub("", block["text"]))
            block = block | {"text": " ".join(part for part in sentences if not _OPTION.search(part))}
        if block.get("text", True):
            shown.append(block)
    return shown


def _stands_in(answer: Sequence[dict[str, Any]], table: dict[str, Any]) -> bool:
    """Whether the answer holds the table: the same heads, and in each row the same first cell."""
    firsts = [str(row[0]) for row in table["rows"] if row]
    return any(
        block["kind"] == "table"
        and block["columns"] == [str(head) for head in table["columns"]]
        and [row[0] for row in block["rows"]] == firsts
        for block in answer
    )


_LEAST_DEG = 1e-3

# Headline numbers shown where the command names none, and what a page shows of every metric.
_CARDS, _KEPT = 6, ("value", "unit", "better", "n", "meaning")

# Figures of a page: name, caption and data URL.
Figures = list[tuple[str, str, str]]
Part = TypeVar("Part")


def page(run: Run, manifest: Manifest, beside: Path | None = None, undrawn: Undrawn | None = None) -> str:
    """The page of a run; the manifest may be newer than what the directory holds, while the run is being sealed.

    `beside` is a folder of figures that were drawn later. `undrawn` is called for a part that cannot be drawn, which is
    then left out, and may note more in the manifest; without it the part's error is raised.
    """

    def part(name: str, draw: Callable[[], Part], default: Part) -> Part:
        try:
            with run.reading():
                return draw()
        except Exception as error:
            if undrawn is None:
                raise
            undrawn(name, error)
            return default

    overview, drawn = read_overview(run.path), figures(run, beside)
    answer = for_a_page(blocks(overview.answer))
    known = {*(name for name, *_ in drawn), *(name.removeprefix("figure ") for name in manifest.undrawn)}
    moving = part("the animation", lambda: animation(run), None)
    space = part("the view in space", lambda: _in_space(run), None)
    lineage = part("the lineage", lambda: lineage_picture(ancestry(run, state=manifest.state)), "")
    results = part("the tables", lambda: shown_tables(run), list[dict[str, Any]]())
    first = [picture for picture in drawn if picture[0] == overview.figure or _OVERLAY.match(picture[0])]
    return render(
        "run.html",
        heading=run.id,
        manifest=manifest,
        command=command_of(manifest.kind),
        verdict=", ".join(overview.marks) if manifest.state == "ok" else "",
        answer=answer,
        headline=headline(run.metrics, overview.cards, manifest.state == "ok"),
        metrics=[(name, *map(_for_people(metric).get, _KEPT)) for name, metric in run.metrics.items()],
        tables=[
            table | {"title": _IN_A_TITLE.sub("", table["title"])} for table in results if not _stands_in(answer, table)
        ],
        figures=[picture for picture in drawn if picture not in first],
        first=first,
        later=[caption or name for name, caption in overview.captions.items() if name not in known],
        animation=moving,
        space=space,
        lineage=lineage,
        provenance=_provenance(manifest),
        files=[(output.path, output.bytes, output.sha256, not output.volatile) for output in manifest.outputs],
        config=run.file(CONFIG).read_text(encoding="utf-8", errors="replace"),
    )


def _in_space(run: Run) -> dict[str, Any] | None:
    """What the page plays of a run in two planes; None of any other run. Without its tables nothing is imported."""
    if not any(run.has(f"data/{table}.csv") for table in ("bends", "trials")):
        return None
    from wristctl.plotting.spatial_view import spatial_view

    return spatial_view(run)


def render(template: str, **content: Any) -> str:
    """A page from one of the templates; everything is escaped but what they mark as markup."""
    return _templates().get_template(template).render(version=__version__, **content)


@cache
def _templates() -> Environment:
    from jinja2 import Environment, FileSystemLoader

    folder = Path(__file__).parent / "templates"
    environment = Environment(
        loader=FileSystemLoader(folder), autoescape=True, trim_blocks=True, lstrip_blocks=True, finalize=_shown
    )
    environment.filters["cell"], environment.filters["words"] = _cell, metric_in_words
    scripts = [environment.get_template(script.name).render().encode() for script in sorted(folder.glob("*.js"))]
    hashes = [base64.b64encode(hashlib.sha256(script).digest()).decode() for script in scripts]
    allowed = " ".join(f"'sha256-{digest}'" for digest in hashes)  # no other script runs in a page
    environment.globals["allowed"] = allowed
    return environment


def figures(run: Run, beside: Path | None = None) -> Figures:
    """Name, caption and data URL of each figure of a run, in reading order where the run has one, then by name."""
    captions = read_overview(run.path).captions
    order = {name: position for position, name in enumerate(captions)}
    folders = [run.path / "figures", *([beside] if beside else [])]
    files = [file for folder in folders for file in folder.glob("*.svg") if not file.is_symlink()]
    files.sort(key=lambda file: (order.get(file.stem, len(order)), file.stem))
    return [(file.stem, captions.get(file.stem) or file.stem.replace("-", " "), inline_figure(file)) for file in files]


def _shown(value: Any) -> Any:
    """Value for a page, with terminal control characters removed from texts."""
    return printable_lines(value) if type(value) is str else value


def _cell(value: Any, head: Any = "") -> str:
    """A cell for a person, below its column's head: an angle that nobody can measure is one of less than 0.001 deg."""
    if isinstance(value, float) and str(head).endswith(("[deg]", "[deg s]")) and 0.0 < abs(value) < _LEAST_DEG:
        return f"<{_LEAST_DEG:g}"
    if value is None:
        return "-"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{without_dust(value):.4g}" if math.isfinite(value) else "-"
    return str(value)


def headline(metrics: dict[str, dict[str, Any]], cards: Sequence[str], ended: bool) -> list[tuple[str, dict[str, Any]]]:
    """The metrics that the command chose; where a run that ended ok chose none, the first that may be better or worse.

    Of these errors of the angle come first, for they say how well the wrist was controlled.
    What stopped before it chose has no result: its metrics are of how it went.
    """
    with_value = {name: metric for name, metric in metrics.items() if metric["value"] is not None}
    chosen = [name for name in cards if name in with_value]
    if not (chosen or ended):
        return []
    judged = [name for name, metric in with_value.items() if metric.get("better")]
    chosen = chosen or sorted(judged, key=lambda name: with_value[name].get("unit") != "rad") or list(with_value)
    return [(name, _for_people(with_value[name])) for name in chosen[:_CARDS]]


def _for_people(metric: dict[str, Any]) -> dict[str, Any]:
    value, unit = in_degrees(metric["value"], metric.get("unit") or "")
    return metric | {"value": value, "unit": unit}


def _provenance(manifest: Manifest) -> list[tuple[str, str]]:
    code, machine = manifest.code, manifest.environment
    commit = f", commit {code.commit[:12]}{' with uncommitted changes' if code.dirty else ''}" if code.commit else ""
    packages = ", ".join(f"{name} {version}" for name, version in machine.packages.items())
    return [
        ("command", shlex.join(manifest.argv)),
        ("code", f"wristctl {code.version}{commit}, tree {code.tree_sha256[:12]}"),
        *((f"input {record.role}", f"{record.run}, result {record.result_sha256[:12]}") for record in manifest.inputs),
        ("configuration", manifest.config_sha256),
        ("fingerprint", manifest.fingerprint),
        ("result", manifest.result_sha256 or ""),
        ("machine", f"{machine.cpu}, {machine.cores} cores, {machine.os}"),
        ("python", machine.python),
        ("packages", packages),
        ("numerics", ", ".join(f"{name} {value}" for name, value in manifest.numerics.items()) or "-"),
        ("memory, processor time", f"{manifest.timing.max_rss_mb or 0:.0f} MB, {manifest.timing.cpu_s or 0:.1f} s"),
    ]
