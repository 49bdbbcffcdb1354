"""One line about each run of a results folder, from the manifests or from a disposable index of them."""

import json
import os
import stat
import tempfile
from contextlib import suppress
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from wristctl.errors import OUT, UserError
from wristctl.plain_files import read_json
from wristctl.records.lock import lock
from wristctl.records.manifest import MANIFEST, SUMS, read_overview
from wristctl.records.run import Run

RESULTS = Path("results")
INDEX, TEMPORARY = ".index.json", ".index-"
# Start of the name of a folder with figures drawn after their run was sealed.
DRAWN = "figures-"
_SCHEMA = "wristctl.index/1"


@dataclass(frozen=True)
class IndexEntry:
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
    about: str = ""
    chief: str = ""
    """The metric that heads its page."""
    answer: str = ""
    """First sentence of its answer."""
    marks: list[str] = field(default_factory=list)
    """Why a run that ended ok is no good, in a word or two each."""
    figure: str = ""
    """Name of the figure that goes with the answer."""
    units: dict[str, str] = field(default_factory=dict)
    """Of the metrics that have one."""

    def value(self, name: str) -> Any:
        """A metric, or one of the entry's own fields; None where it has neither."""
        return self.metrics.get(name, getattr(self, name, None))


def run_names(results: Path) -> list[str]:
    """Names of the run directories of a results folder, oldest first; UserError where it cannot be read."""
    try:
        with os.scandir(results) as listing:
            return sorted(item.name for item in listing if _is_folder(item) and not item.name.startswith((".", DRAWN)))
    except FileNotFoundError:
        return []
    except OSError as error:
        raise UserError(
            f"cannot read the results folder: {error.strerror}", str(results), ("name it with ", OUT)
        ) from error


def _is_folder(item: os.DirEntry[str]) -> bool:
    try:
        return item.is_dir()
    except OSError:  # a link to itself
        return False


def indexed(results: Path, renew: bool = True) -> list[IndexEntry]:
    """All runs of a results folder, oldest first, without their tags.

    Sealed runs do not change, so theirs are kept in the folder's `.index.json`, which may be deleted at any time; an
    entry counts as long as the run's manifest and seal have the dates and sizes it was made from. `renew` writes the
    index anew where it was not up to date.
    """
    remembered = _read_index(results)
    current: dict[str, Any] = {}
    entries = []
    for name in run_names(results):
        stamp, old = _stamp(f"{results}/{name}"), remembered.get(name)
        entry = _remembered(old, name) if stamp and isinstance(old, list) and old[:1] == [stamp] else None
        if entry:
            current[name] = old
        else:
            entry = _entry(Run(results / name))
            if stamp and entry.state not in ("running", "broken", "crashed"):
                current[name] = [stamp, asdict(entry)]
        entries.append(entry)
    if renew and current != remembered:
        index = {"schema": _SCHEMA, "fields": list(IndexEntry.__dataclass_fields__), "runs": current}
        write_beside(results, INDEX, json.dumps(index))
    return entries


def _remembered(old: list[Any], name: str) -> IndexEntry | None:
    """Entry of a run as the index remembers it. None where that entry is invalid."""
    try:
        entry = IndexEntry(**old[1])
        texts = [entry.id, entry.kind, entry.label, entry.state, entry.started, entry.note, entry.about, entry.chief]
        texts += [entry.answer, entry.figure]
        lists = [*entry.inputs, *entry.tags, *entry.metrics, *entry.units, *entry.units.values(), *entry.marks]
        numbers = [value for value in (entry.wall_s, *entry.metrics.values()) if value is not None]
        fits = all(isinstance(text, str) for text in (*texts, *lists)) and entry.id == name
        return entry if fits and all(isinstance(value, int | float) for value in numbers) else None
    except (TypeError, AttributeError, IndexError):
        return None


def _entry(run: Run) -> IndexEntry:
    state = run.state
    try:
        manifest = run.manifest
        found = run.metrics if state != "broken" else {}
        overview = read_overview(run.path)
    except UserError as error:
        place = Path(error.where.partition(": ")[0])
        note = f"{place.name}: {error.what}" if place.parent == run.path else error.what
        return IndexEntry(run.id, "-", "", "broken", dated(run.id), None, note)
    undrawn = f"not drawn: {', '.join(manifest.undrawn)}" if manifest.undrawn else ""
    note = manifest.error.what if manifest.error else undrawn
    timing, inputs = manifest.timing, [record.run for record in manifest.inputs]
    return IndexEntry(
        run.id,
        manifest.kind,
        manifest.label,
        state,
        timing.started,
        timing.wall_s,
        note,
        {name: metric.get("value") for name, metric in found.items()},
        inputs,
        about=manifest.about,
        chief=next(iter(overview.cards), ""),
        answer=overview.sentence,
        marks=overview.marks,
        figure=overview.figure or next(iter(overview.captions), ""),
        units={name: unit for name, metric in found.items() if (unit := metric.get("unit") or "1") != "1"},
    )


def dated(name: str) -> str:
    """When a run whose manifest cannot be read began, by its name; nothing where that has no date."""
    try:
        return datetime.strptime(name[:16], "%Y%m%dT%H%M%SZ").replace(tzinfo=UTC).isoformat()
    except ValueError:
        return ""


def _stamp(path: str) -> list[int] | None:
    """Stamp that identifies a sealed run among others of its name. None for a run without a seal."""
    try:
        manifest, sums = os.stat(f"{path}/{MANIFEST}"), os.stat(f"{path}/{SUMS}")
    except OSError:
        return None
    return [manifest.st_mtime_ns, manifest.st_size, sums.st_mtime_ns, sums.st_size]


def _read_index(results: Path) -> dict[str, Any]:
    try:
        index = read_json(results / INDEX)
        if index["schema"] == _SCHEMA and index["fields"] == list(IndexEntry.__dataclass_fields__):
            runs: dict[str, Any] = dict(index["runs"])
            return runs
    except (OSError, ValueError, KeyError, TypeError):
        pass
    return {}


def write_beside(results: Path, name: str, text: str) -> None:
    """Replace a file of a results folder that may be deleted at any time; a folder that cannot be written does without.

    Several may write at once: each has a temporary file of its own.
    """
    with suppress(OSError):
        descriptor, temporary = tempfile.mkstemp(prefix=TEMPORARY, dir=results)
        try:
            with open(descriptor, "w", encoding="utf-8") as file:
                lock(descriptor)  # `runs gc` takes it for no leftover
                file.write(text)
                file.flush()
                os.chmod(temporary, stat.S_IMODE(os.stat(results).st_mode) & 0o666)  # whoever may read the folder
                os.replace(temporary, results / name)
        except OSError:
            os.unlink(temporary)
