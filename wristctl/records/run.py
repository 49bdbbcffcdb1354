"""A run directory as read: manifest, state, data, and whether its files are still those sealed."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from wristctl.config.former_names import OF_KINDS
from wristctl.config.study import Study
from wristctl.errors import Call, UserError, meant, reason_of
from wristctl.plain_files import LINK, open_plain, read_json, read_plain, unreadable
from wristctl.records.files import files_below, sha256_of
from wristctl.records.formats import read_arrays, read_table
from wristctl.records.lock import is_locked
from wristctl.records.manifest import CONFIG, MANIFEST, METRICS, SUMS, Manifest
from wristctl.records.seal import (
    ADDED,
    ADDED_FOLDER,
    CHANGED,
    MISSING,
    faults_of_files,
    faults_of_manifest,
    largest,
)
from wristctl.sha256sums import read_seal
from wristctl.study_files.keys import command_of
from wristctl.study_files.load import read_study

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

# Advice to a user where there is no run.
NAME_A_RUN = ("name a run that `", Call("runs ls"), "` shows")
_RESTORE = "restore it or name another run"

RunState = Literal["running", "ok", "failed", "interrupted", "crashed", "broken"]


class Run:
    """An existing run directory, read when asked; every error is a UserError that names the file."""

    def __init__(self, path: Path) -> None:
        full_path = Path(os.path.abspath(path))
        self.path = full_path.parent.resolve() / full_path.name  # a link stays one: what is deleted is the link
        self._asked: list[str] = []  # files, in the order in which they were asked for

    def __repr__(self) -> str:
        return f"Run({str(self.path)!r})"

    @property
    def id(self) -> str:
        """The directory's name."""
        return self.path.name

    @cached_property
    def manifest(self) -> Manifest:
        """run.json; UserError where it is not as it was sealed: no word of it is then believed."""
        file = self.path / MANIFEST
        # the sum first: a run that ends meanwhile writes run.json, and then its sums
        sealed = (read_seal(self.path) or {}).get(MANIFEST)
        try:
            content = read_plain(file, links=False)
        except OSError as error:
            if not isinstance(error, FileNotFoundError | NotADirectoryError):
                raise unreadable(error, file) from error
            if sealed:
                raise UserError(MISSING, str(file), _RESTORE) from error
            raise UserError(f"not a run directory: it has no {MANIFEST}", str(self.path), NAME_A_RUN) from error
        if sealed and hashlib.sha256(content).hexdigest() != sealed:
            raise UserError(CHANGED, str(file), _RESTORE)
        try:
            return Manifest.model_validate_json(content)
        except (ValidationError, RecursionError) as error:
            fix = (*NAME_A_RUN, ", or upgrade wristctl where a newer one made it")
            place = ".".join(map(str, error.errors()[0]["loc"])) if isinstance(error, ValidationError) else ""
            where = f"{file}: {place[:100]}" if place else str(file)
            raise UserError("not a manifest of a run that this wristctl knows", where, fix) from error

    @property
    def kind(self) -> str:
        """The command that made it."""
        return self.manifest.kind

    @property
    def kind_today(self) -> str:
        """The same, or the command of which that is a mode today."""
        if self.kind not in OF_KINDS:
            return self.kind
        return "identify" if self.config.identify.model == "hysteresis" else "analyse"

    @property
    def sealed(self) -> bool:
        """Whether its manifest was sealed, which makes it a run whatever has become of the manifest."""
        return MANIFEST in (read_seal(self.path) or ())

    @property
    def state(self) -> RunState:
        """State of the run. `crashed`: the manifest says running, but nobody holds the lock. `broken`: no manifest."""
        if is_locked(self.path):
            return "running"
        self.__dict__.pop("manifest", None)
        try:
            state = self.manifest.state
        except UserError:
            return "broken"
        return "crashed" if state == "running" or not (self.path / SUMS).is_file() else state

    @cached_property
    def config(self) -> Study:
        """The resolved study it ran."""
        of_kind = [OF_KINDS[self.kind]] if self.kind in OF_KINDS else []
        return read_study([self.file(CONFIG)], of_kind, note=False)[0]

    @property
    def metrics(self) -> dict[str, dict[str, Any]]:
        """metrics.json: value, unit, better, n, interval and meaning by name; empty without one."""
        content = self.json(METRICS) if self.has(METRICS) else {}
        if not isinstance(content, dict) or not all(map(_is_metric, content.values())):
            again = ("run `", Call(command_of(self.kind)), "` again")
            raise UserError("no table of metrics", str(self.path / METRICS), again)
        return content

    @property
    def result_hash(self) -> str:
        """One hash over everything the run found; empty where it was not sealed."""
        return self.manifest.result_sha256 or ""

    def data(self, name: str) -> pd.DataFrame:
        """The table data/<name>.csv."""
        return read_table(self.file(f"data/{name}.csv"))

    def array(self, name: str) -> dict[str, np.ndarray]:
        """The arrays of data/<name>.npz."""
        return read_arrays(self.file(f"data/{name}.npz"))

    def has(self, name: str) -> bool:
        """Whether there is something of this name, be it a file that can be read or not."""
        return os.path.lexists(self.path / name)

    def file(self, name: str) -> Path:
        """Path of one of its files; UserError where there is none, or it is no plain one: a link leads anywhere."""
        path = self.path / name
        if any(part.is_symlink() for part in (path, *path.parents[: len(Path(name).parts) - 1])):
            raise UserError(LINK, str(path), _RESTORE)
        sealed = next((output.bytes for output in self.manifest.outputs if output.path == name), 0)
        try:
            open_plain(path, max(sealed, largest(name)), links=False).close()
        except (FileNotFoundError, NotADirectoryError):
            fix = meant(name, files_below(self.path))
            raise UserError(f"run {self.id} has no file {name}", str(self.path), fix) from None
        except OSError as error:
            raise unreadable(error, path) from error
        if name != CONFIG:  # which is checked when it is read
            self._asked.append(name)
        return path

    @contextmanager
    def reading(self) -> Iterator[None]:
        """A block that reads files of the run: what they lack is the user's error, which names them."""
        before = len(self._asked)
        try:
            yield
        except (UserError, MemoryError):
            raise
        except Exception as error:
            names = list(dict.fromkeys(self._asked[before:]))
            if not names:
                raise
            sums = read_seal(self.path) or {}
            changed = [name for name in names if sums.get(name, "") not in ("", sha256_of(self.path / name))]
            problem = CHANGED if changed else f"does not hold what wristctl reads there: {reason_of(error)}"
            places = [str(self.path / name) for name in changed or names]
            raise UserError(problem, ", ".join(places), _RESTORE, exit_code=3) from error

    def json(self, name: str) -> Any:
        """Content of one of its JSON files. Raises UserError."""
        file = self.file(name)
        try:
            return read_json(file, links=False)
        except OSError as error:
            raise unreadable(error, file) from error
        except ValueError as error:
            again = ("restore it, or run `", Call(command_of(self.kind)), "` again")
            raise UserError("not valid JSON", str(file), again) from error

    def check(self) -> None:
        """Hash every file again; UserError naming run.json, or else the first that is missing or not as sealed."""
        self.__dict__.pop("manifest", None)
        again = ("restore it or run `", Call(command_of(self.kind)), "` again")
        for path, problem in self.problems():
            if problem not in (ADDED, ADDED_FOLDER):
                raise UserError(problem, str(self.path / path), again)

    def problems(self) -> list[tuple[str, str]]:
        """Files that differ from the seal, each with its fault. Raises UserError if the run is not sealed.

        Where no file differs, the manifest is compared with the seal as well.
        """
        sums = read_seal(self.path)
        if sums is None:
            raise UserError("run is not sealed", str(self.path), "use a run that has ended")
        self.__dict__.pop("manifest", None)
        try:
            manifest = self.manifest
        except UserError as error:
            faults = faults_of_files(self.path, sums, None)
            known = any(name == MANIFEST for name, _ in faults)
            return faults if known else sorted([*faults, (MANIFEST, error.what)])
        return sorted(faults_of_files(self.path, sums, manifest) + faults_of_manifest(self.path, sums, manifest))


def _is_metric(value: object) -> bool:
    """Whether this is an entry of metrics.json, as far as others rely on it."""
    if not isinstance(value, dict) or not _is_number(value.get("value")):
        return False
    interval = value.get("interval")
    pair = interval is None or (isinstance(interval, list) and len(interval) == 2 and all(map(_is_number, interval)))
    return pair and all(isinstance(value.get(name) or "", str) for name in ("unit", "better", "meaning"))


def _is_number(value: object) -> bool:
    return value is None or isinstance(value, int | float)
