"""Which runs there are: one line about each, from the manifests or from a disposable index of them."""

from __future__ import annotations

import json
import os
import re
import tempfile
from collections.abc import Iterable, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, field, replace
from datetime import UTC, datetime, timedelta
from fnmatch import fnmatchcase
from operator import eq, ge, gt, le, lt, ne
from pathlib import Path
from typing import Any

from wristctl.config.errors import UserError, meant
from wristctl.runs.find import RESULTS, run_names
from wristctl.runs.manifest import MANIFEST, SUMS
from wristctl.runs.run import Run
from wristctl.runs.tags import read_tags

INDEX = ".index.json"
_SCHEMA = "wristctl.index/1"
_COMPARISONS = {"<=": le, ">=": ge, "!=": ne, "==": eq, "<": lt, ">": gt, "=": eq}
_SECONDS = {"s": 1, "m": 60, "h": 3600, "d": 86400, "w": 604800}


@dataclass(frozen=True)
class Entry:
    """A run in one line; `note` says why it failed or is broken, `metrics` are the values by name."""

    id: str
    kind: str
    label: str
    state: str
    started: str
    wall_s: float | None
    note: str
    metrics: dict[str, float | None] = field(default_factory=dict)
    inputs: list[str] = field(default_factory=list)
    tags: list[str] = field(default_factory=list)

    def value(self, name: str) -> Any:
        """A metric, or one of the entry's own fields; None where it has neither."""
        return self.metrics.get(name, getattr(self, name, None))


def entries(results: Path = RESULTS) -> list[Entry]:
    """All runs of a results folder, oldest first, with their tags.

    Sealed runs do not change, so theirs are kept in the folder's `.index.json`, which may be deleted at any time; an
    entry counts as long as the run's manifest has the date and size it was made from.
    """
    known = _read_index(results)
    kept: dict[str, Any] = {}
    found, tags = [], read_tags(results)
    for name in run_names(results):
        stamp, old = _stamp(f"{results}/{name}"), known.get(name)
        if stamp and old and old[0] == stamp:
            entry, kept[name] = Entry(**old[1]), old
        else:
            entry = _entry(Run(results / name))
            if stamp and entry.state not in ("running", "broken", "crashed"):
                kept[name] = [stamp, asdict(entry)]
        found.append(replace(entry, tags=tags[name]) if name in tags else entry)
    if kept != known:
        _write_index(results, kept)
    return found


def select(
    found: Iterable[Entry],
    kind: str | None = None,
    label: str | None = None,
    state: str | None = None,
    tag: str | None = None,
    where: Sequence[str] = (),
    newer: str | None = None,
    older: str | None = None,
) -> list[Entry]:
    """The entries that meet every condition: `where` like "rmse<1e-3", ages like 30m, 12h, 2d; kind and label may be
    patterns with *. Raises UserError for a condition that cannot be read, or a metric that no run has."""
    chosen = [
        each
        for each in found
        if fnmatchcase(each.kind, kind or "*")
        and fnmatchcase(each.label, label or "*")
        and state in (None, each.state)
        and (tag is None or tag in each.tags)
    ]
    for text in where:
        name, compare, bound = _condition(text)
        _known(name, chosen, text)
        chosen = [each for each in chosen if _number(each.value(name)) and compare(each.value(name), bound)]
    if newer:
        chosen = [each for each in chosen if each.started and each.started >= _before(newer, "--newer")]
    if older:
        chosen = [each for each in chosen if each.started and each.started < _before(older, "--older")]
    return chosen


def in_order(found: Sequence[Entry], by: str) -> list[Entry]:
    """Sorted by a field or metric; runs that have none come last."""
    _known(by, found, f"--sort {by}")
    have = [each for each in found if each.value(by) not in (None, "")]
    return sorted(have, key=lambda each: each.value(by)) + [each for each in found if each not in have]


def _known(name: str, found: Sequence[Entry], where: str) -> None:
    own = {"id", "kind", "label", "state", "started", "wall_s"}
    names = {metric for each in found for metric in each.metrics} | own
    if found and name not in names:
        raise UserError(f"no run has a metric {name!r}", where, meant(name, sorted(names)))


def _condition(text: str) -> tuple[str, Any, float]:
    found = re.fullmatch(r"(.+?)\s*(<=|>=|!=|==|<|>|=)\s*([^<>=!]+)", text)
    try:
        if found:
            return found[1], _COMPARISONS[found[2]], float(found[3])
    except ValueError:
        pass
    raise UserError("not a condition on a metric", f"--where {text}", "for example --where 'rmse<1e-3'")


def _before(age: str, option: str) -> str:
    found = re.fullmatch(r"([0-9.]+)([smhdw])", age)
    if not found:
        raise UserError("not an age", f"{option} {age}", "a number with s, m, h, d or w: 12h, 2d")
    instant = datetime.now(UTC) - timedelta(seconds=float(found[1]) * _SECONDS[found[2]])
    return instant.isoformat(timespec="microseconds")


def _number(value: Any) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _entry(run: Run) -> Entry:
    state = run.state
    try:
        manifest = run.manifest
        metrics = {name: each.get("value") for name, each in run.metrics.items()} if state != "broken" else {}
    except (UserError, AttributeError) as error:
        return Entry(run.id, "-", "", "broken", "", None, getattr(error, "what", "metrics.json is no table of metrics"))
    note = manifest.error.what if manifest.error else ""
    timing, inputs = manifest.timing, [each.run for each in manifest.inputs]
    return Entry(run.id, manifest.kind, manifest.label, state, timing.started, timing.wall_s, note, metrics, inputs)


def _stamp(path: str) -> list[int] | None:
    """What tells a sealed run from any other under its name; None where it is not sealed."""
    try:
        manifest, sums = os.stat(f"{path}/{MANIFEST}"), os.stat(f"{path}/{SUMS}")
    except OSError:
        return None
    return [manifest.st_mtime_ns, manifest.st_size, sums.st_mtime_ns, sums.st_size]


def _read_index(results: Path) -> dict[str, Any]:
    try:
        index = json.loads((results / INDEX).read_bytes())
        if index["schema"] == _SCHEMA and index["fields"] == list(Entry.__dataclass_fields__):
            runs: dict[str, Any] = index["runs"]
            return runs
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return {}


def _write_index(results: Path, runs: dict[str, Any]) -> None:
    """Replace the index; a folder that cannot be written does without."""
    text = json.dumps({"schema": _SCHEMA, "fields": list(Entry.__dataclass_fields__), "runs": runs})
    with suppress(OSError):
        descriptor, temporary = tempfile.mkstemp(prefix=".index", dir=results)
        try:
            with open(descriptor, "w", encoding="utf-8") as file:
                file.write(text)
            os.replace(temporary, results / INDEX)
        except OSError:
            os.unlink(temporary)
