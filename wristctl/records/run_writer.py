"""A run while it is going on: what it writes, and how it ends."""

from __future__ import annotations

import json
import logging
import os
import resource
import shlex
import sys
import time
import traceback
from collections.abc import Callable, Mapping
from contextlib import suppress
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING, Any, Literal

from wristctl.errors import UserError, reason_of
from wristctl.interrupt import asked
from wristctl.plugins.own_runs import note
from wristctl.records import formats
from wristctl.records.files import check_plain, files_below, sha256_of, sync, write_bytes, write_text
from wristctl.records.journal import Journal, jsonable, now
from wristctl.records.manifest import (
    CONFIG,
    CONSOLE,
    EVENTS,
    MANIFEST,
    METRICS,
    OVERVIEW,
    PACKAGES,
    PATCH,
    README,
    REPORT,
    SOURCES,
    SUMS,
    Column,
    EndState,
    Error,
    Manifest,
    Output,
    TakenOver,
)
from wristctl.records.seal import entries, result_hash, write_seal
from wristctl.seeds import stream
from wristctl.sha256sums import read_seal
from wristctl.study_files.keys import command_of

if TYPE_CHECKING:
    import numpy as np
    from matplotlib.figure import Figure

_log = logging.getLogger(__name__)


def readme(manifest: Manifest, summary: str) -> str:
    """The run in a page: command, inputs, result, files with their columns, how to repeat and to check it."""
    lines = [
        f"# {manifest.id}",
        "",
        f"`{shlex.join(manifest.argv)}`: {manifest.state}, wristctl {manifest.code.version}, "
        f"seed {manifest.seed}, started {manifest.timing.started}, {manifest.timing.wall_s or 0:.1f} s.",
        *(
            f"\nInput `{record.role}`: {record.kind} run {record.run} (result {record.result_sha256[:12]})."
            for record in manifest.inputs
        ),
        *([_TAKEN_OVER.format(units=manifest.units)] if manifest.units else []),
        *([f"\nError: {manifest.error.what} {manifest.error.where}".rstrip()] if manifest.error else []),
        *(f"\nNot drawn: {name}: {reason}" for name, reason in manifest.undrawn.items()),
        *(["", "## Result", "", summary.strip()] if summary else []),
        *(["", "## Files", ""] if manifest.outputs else []),
    ]
    units = [output for output in manifest.outputs if output.path.startswith("units/")]
    if units:
        lines.append(
            f"- `units/` (outside the result hash): {len(units)} units of work, for a run that goes on from here"
        )
    for output in manifest.outputs:
        if output in units:
            continue
        lines.append(f"- `{output.path}`" + " (outside the result hash)" * output.volatile)
        for column in output.columns:
            unit = f" [{column.unit}]" if column.unit else ""
            lines.append(f"  - `{column.name}`{unit}" + f": {column.meaning}" * bool(column.meaning))
    again = f"wristctl {command_of(manifest.kind)} --config {manifest.id}/{CONFIG}"
    going_on = bool(units) and manifest.state == "interrupted"
    lines += [
        "",
        "## Repeat and check",
        "",
        *[f"- on from here, from the folder above: `{again} --resume {manifest.id}`"] * going_on,
        f"- again, with a verdict on each file: `wristctl runs replay {manifest.id}`",
        f"- again as a new run, from the folder above: `{again}`",
        f"- result hash: `{manifest.result_sha256}`",
        f"- unchanged since: `sha256sum -c {SUMS}`",
        f"- code, machine, hashes: `{MANIFEST}`; packages: `{PACKAGES}`"
        + f"; uncommitted changes: `{PATCH}`" * bool(manifest.code.dirty),
    ]
    if foreign := manifest.code.foreign:
        lines.append(f"- code from elsewhere, which you should read before you run it: `{'`, `'.join(foreign)}`")
    return "\n".join(lines) + "\n"


_TAKEN_OVER = (
    "\n{units.taken_over} units of work were computed in run {units.run}, which this one goes on from; "
    "{units.computed_again} more of its units were computed again here, and gave the same."
)


# Notes what could not be drawn, by its name.
Undrawn = Callable[[str, Exception], None]
# Makes report.html of a run directory and its finished manifest; parts that cannot be drawn are noted and left out.
Page = Callable[[Path, Manifest, Undrawn], str]

# Space kept from the start, so that a run on a full disk can still say that it failed.
RESERVE, _RESERVED = ".reserve", 512 * 1024
_RESULTS = ("data", "models", "figures")
_PROVENANCE = (CONFIG, PACKAGES, PATCH, SOURCES)
_RECORDS = {MANIFEST, SUMS, CONFIG, EVENTS, CONSOLE, PACKAGES, PATCH, SOURCES, README, REPORT}


class LiveRun:
    """The writing side of a run directory, handed out by `start_run`."""

    def __init__(
        self, path: Path, manifest: Manifest, page: Page | None = None, files: Mapping[str, str] | None = None,
        code: Mapping[str, str] | None = None,
    ) -> None:  # fmt: skip
        self.path, self.id, self._page, self.files = path, manifest.id, page, dict(files or {})
        self.code = dict(code or {})
        """References to the copied code, by those of the originals."""
        self._home = path.stat()
        kept = (*_PROVENANCE, *self.files.values(), *manifest.code.foreign)
        self._provenance = {name: sha256_of(path / name) for name in kept if (path / name).is_file()}
        self._handed: set[str] = set()
        with (path / RESERVE).open("wb") as file:
            file.write(bytes(_RESERVED))
        self._manifest = manifest
        self._metrics: dict[str, dict[str, Any]] = {}
        self._columns: dict[str, list[Column]] = {}
        self._volatile: set[str] = set()
        self.exit_code = 0
        """The command's, where the run itself ends ok."""
        self._summary: list[str] = []
        self._began = time.perf_counter(), time.process_time()
        self._write_manifest()
        self._journal = Journal(path)  # last: it listens until the run ends, and a run that cannot begin never does
        self.event, self.console = self._journal.event, self._journal.console
        self.event("start", kind=manifest.kind)

    @property
    def lacking(self) -> Mapping[str, str]:
        """Pictures that could not be drawn by now, with the reason."""
        return self._manifest.undrawn

    def stream(self, name: str) -> tuple[int, int]:
        """Entropy of the random stream `name` for `numpy.random.default_rng`, noted in the manifest."""
        self._manifest.streams[name] = stream(self._manifest.seed, name)
        return self._manifest.streams[name]

    @property
    def has_found(self) -> bool:
        """Whether it holds a metric, or an output other than the head of its page, by now."""
        written = (name for name in self._handed if name != OVERVIEW)
        return bool(self._metrics) or any((self.path / name).is_file() for name in written)

    def table(
        self,
        name: str,
        columns: formats.Columns,
        units: Mapping[str, str] | None = None,
        meaning: Mapping[str, str] | None = None,
    ) -> None:
        """Write columns, or a DataFrame, as CSV (exact round trip); the columns' units and meaning are noted."""
        formats.write_table(self.file(name), columns)
        units, meaning = units or {}, meaning or {}
        names = map(str, columns.keys())
        self.columns(name, {name: (units.get(name, ""), meaning.get(name, "")) for name in names})

    def columns(self, name: str, columns: Mapping[str, tuple[str, str]]) -> None:
        """Note unit and meaning of each column of a table, which may be written otherwise than by `table`."""
        named = columns.items()
        self._columns[name] = [Column(name=name, unit=unit, meaning=meaning) for name, (unit, meaning) in named]

    def arrays(self, name: str, arrays: Mapping[str, np.ndarray]) -> None:
        """Write arrays as npz."""
        formats.write_arrays(self.file(name), arrays)

    def file(self, name: str) -> Path:
        """Path for an output of any format. It becomes part of the run when the run ends."""
        relative = PurePosixPath(name)
        if relative.is_absolute() or ".." in relative.parts or name in _RECORDS:
            raise ValueError(f"{name!r} is no name for an output of a run")
        self._still_there()
        for folder in reversed(relative.parents[:-1]):
            (self.path / folder).mkdir(exist_ok=True)
        self._handed.add(name)
        return self.path / relative

    def figure(self, name: str, draw: Callable[[], Figure]) -> None:
        """Write figures/<name>.png and .svg; one that cannot be drawn is noted instead."""
        try:
            with formats.own_look():
                pictures = formats.pictures(draw(), name)
        except Exception as error:
            if asked():  # Ctrl-C, of which a library made this
                raise
            self.undrawn(f"figure {name}", error)
            return
        for suffix, content in pictures.items():
            write_bytes(self.file(f"figures/{name}{suffix}"), content)

    def undrawn(self, name: str, error: Exception) -> None:
        """Note a picture that could not be drawn: what was computed stands without it."""
        self._manifest.undrawn[name] = reason_of(error)
        self.console("".join(traceback.format_exception(error)))
        _log.warning("%s could not be drawn: %s", name, reason_of(error))

    def metric(
        self,
        name: str,
        value: float | None,
        unit: str = "",
        better: Literal["lower", "higher", ""] = "",
        n: int = 1,
        interval: tuple[float, float] | None = None,
        meaning: str = "",
    ) -> None:
        """A number of metrics.json (None: there is none): unit, better direction, sample size, interval."""
        self._metrics[name] = jsonable(
            {"value": value, "unit": unit, "better": better, "n": n, "interval": interval, "meaning": meaning}
        )

    def numerics(self, **facts: Any) -> None:
        """Note how numbers were computed (dtype, integrator, step, threads) in the manifest."""
        self._manifest.numerics.update(jsonable(facts))

    def took_over(self, run: str, taken_over: int, computed_again: int) -> None:
        """Note, more of them in a later call, the units of work that were taken over from the run that is resumed."""
        noted = self._manifest.units or TakenOver(run=run)
        noted.taken_over += taken_over
        noted.computed_again += computed_again
        self._manifest.units = noted

    def volatile(self, name: str) -> None:
        """Keep an output outside the result hash because it holds wall times or the like."""
        self._volatile.add(name)

    def summary(self, markdown: str, first: bool = False) -> None:
        """Add to the result in words and tables that README.md shows, or begin it."""
        self._summary.insert(0 if first else len(self._summary), markdown)

    def end(self, state: EndState, exit_code: int = 0, error: Error | None = None) -> Manifest:
        """Seal the run: hashes of all outputs, README, report, manifest, SHA256SUMS last. Called by `start_run`."""
        self._still_there()
        reserve = self.path / RESERVE
        if state != "ok":
            reserve.unlink(missing_ok=True)
        self.event("end", state=state)
        if self._metrics:
            write_text(self.path / METRICS, json.dumps(self._metrics, indent=2, allow_nan=False) + "\n")
        if state == "ok":
            self._only_files()
        manifest = self._manifest
        manifest.state, manifest.exit_code, manifest.error = state, exit_code, error
        recorded = _RECORDS | set(manifest.code.foreign)
        plain = (name for name in files_below(self.path) if not (self.path / name).is_symlink())
        manifest.outputs = [self._output(name) for name in plain if name not in recorded]
        if state == "ok":
            self._nothing_lost({output.path for output in manifest.outputs})
        manifest.result_sha256 = result_hash(manifest)
        wall, cpu = self._began
        manifest.timing.ended = now()
        manifest.timing.wall_s, manifest.timing.cpu_s = time.perf_counter() - wall, time.process_time() - cpu
        unit = 2**20 if sys.platform == "darwin" else 2**10
        manifest.timing.max_rss_mb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / unit
        self._write_report(manifest)
        self._journal.close()
        write_text(self.path / README, readme(manifest, "\n\n".join(self._summary)))
        self._write_manifest()
        for left in (reserve, *self.path.rglob(RESERVE)):  # also what a part of the run kept for itself
            left.unlink(missing_ok=True)
        self._still_there()
        for folder in sorted(item for item in self.path.rglob("*") if item.is_dir())[::-1]:
            if not any(folder.iterdir()):
                folder.rmdir()
        write_seal(self.path, {output.path: output.sha256 for output in manifest.outputs})
        if manifest.code.foreign or any(output.path.startswith("code/") for output in manifest.outputs):
            note(read_seal(self.path) or {})
        return manifest

    def close(self) -> None:
        """Listen no longer, however the run has ended. Called by `start_run`."""
        self._journal.close()

    def _still_there(self) -> None:
        """UserError where the folder is no longer the one that the run began with."""
        there = False
        with suppress(OSError):
            there = os.path.samestat(self.path.stat(), self._home)
        if not there:
            problem = "the run's folder was removed, moved or replaced while it ran"
            raise UserError(problem, str(self.path), "leave it where it is, and run again")

    def _only_files(self) -> None:
        """UserError where something in the run is no plain file: it could not be sealed."""
        for name, kind in entries(self.path):
            if kind in ("link", "odd"):
                check_plain(self.path / name)

    def _nothing_lost(self, outputs: set[str]) -> None:
        """UserError where something that the run has written is gone, or its provenance is another."""
        lost = [self.path / name for name in sorted(self._handed - outputs)]
        kept = ((self.path / name, digest) for name, digest in self._provenance.items())
        lost += [path for path, digest in kept if not path.is_file() or sha256_of(path) != digest]
        if lost:
            raise UserError("a file of the run was removed or changed while it ran", str(lost[0]), "run again")

    def _write_report(self, manifest: Manifest) -> None:
        """report.html, a picture of results that stand: whatever is wrong with it must not cost the run."""
        if self._page is None:
            return
        try:
            write_text(self.path / REPORT, self._page(self.path, manifest, self.undrawn))
        except Exception as error:
            self.undrawn(REPORT, error)

    def _output(self, name: str) -> Output:
        path = self.path / name
        sync(path)
        result = name == METRICS or name.split("/")[0] in _RESULTS
        return Output(
            path=name,
            sha256=sha256_of(path),
            bytes=path.stat().st_size,
            volatile=not result or name in self._volatile,
            columns=self._columns.get(name, []),
        )

    def _write_manifest(self) -> None:
        write_text(self.path / MANIFEST, self._manifest.model_dump_json(by_alias=True, indent=2) + "\n")
