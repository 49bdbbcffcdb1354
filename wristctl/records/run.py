"""A run directory as read: manifest, state, data, and whether its files are still those sealed."""

from __future__ import annotations

import hashlib
import json
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from pydantic import ValidationError

from wristctl.config.errors import UserError, meant
from wristctl.config.load import load_study
from wristctl.config.study import Study
from wristctl.config.wording import Call
from wristctl.records.files import files_below, sha256_of
from wristctl.records.formats import read_arrays, read_table
from wristctl.records.lock import is_locked
from wristctl.records.manifest import CONFIG, MANIFEST, METRICS, SUMS, Manifest, command_of

if TYPE_CHECKING:
    import numpy as np
    import pandas as pd

NAME_A_RUN = ("name a run that `", Call("runs ls"), "` shows")
"""What to do where there is no run."""
_RESTORE = "restore it or name another run"
_CHANGED, _MISSING = "hash does not match what was sealed", "sealed file is missing"
_ADDED = "file was added after sealing"

RunState = Literal["running", "ok", "failed", "interrupted", "crashed", "broken"]


class Run:
    """An existing run directory, read when asked; every error is a UserError that names the file."""

    def __init__(self, path: Path) -> None:
        self.path = path.resolve()

    @property
    def id(self) -> str:
        """The directory's name."""
        return self.path.name

    @cached_property
    def manifest(self) -> Manifest:
        """run.json; UserError where it is not as it was sealed: no word of it is then believed."""
        file = self.path / MANIFEST
        # the sum first: a run that ends meanwhile writes run.json, and then its sums
        sealed = (self._sums() or {}).get(MANIFEST)
        try:
            content = file.read_bytes()
        except OSError as error:
            if sealed:
                raise UserError(_MISSING, str(file), _RESTORE) from error
            raise UserError(f"not a run directory: it has no {MANIFEST}", str(self.path), NAME_A_RUN) from error
        if sealed and hashlib.sha256(content).hexdigest() != sealed:
            raise UserError(_CHANGED, str(file), _RESTORE)
        try:
            return Manifest.model_validate_json(content)
        except ValidationError as error:
            raise UserError("not a manifest of a wristctl run", str(file), NAME_A_RUN) from error

    @property
    def kind(self) -> str:
        """The command that made it."""
        return self.manifest.kind

    @property
    def sealed(self) -> bool:
        """Whether its manifest was sealed, which makes it a run whatever has become of the manifest."""
        return MANIFEST in (self._sums() or ())

    @property
    def state(self) -> RunState:
        """How it ended: `crashed` if running by its word but without a lock, `broken` without the manifest it wrote."""
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
        return load_study([self.path / CONFIG])

    @property
    def metrics(self) -> dict[str, dict[str, Any]]:
        """metrics.json: value, unit, better, n, interval and meaning by name; empty without one."""
        file = self.path / METRICS
        try:
            found: dict[str, dict[str, Any]] = json.loads(file.read_bytes()) if file.is_file() else {}
        except ValueError as error:
            raise UserError("not valid JSON", str(file), ("run `", Call(command_of(self.kind)), "` again")) from error
        return found

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

    def file(self, name: str) -> Path:
        """The path of one of its files."""
        path = self.path / name
        if not path.is_file():
            raise UserError(f"run {self.id} has no file {name}", str(self.path), meant(name, files_below(self.path)))
        return path

    def check(self) -> None:
        """Hash every file again; UserError naming run.json, or else the first that is missing or not as sealed."""
        self.__dict__.pop("manifest", None)
        again = ("restore it or run `", Call(command_of(self.kind)), "` again")
        for path, what in self.problems():
            if what != _ADDED:
                raise UserError(what, str(self.path / path), again)

    def problems(self) -> list[tuple[str, str]]:
        """Each file that is not as it was sealed, and what is wrong with it; UserError if the run is not sealed."""
        sums = self._sums()
        if sums is None:
            raise UserError("run is not sealed", str(self.path), "use a run that has ended")
        found = [(name, _MISSING) for name in sums if not (self.path / name).is_file()]
        for name in files_below(self.path):
            if name != SUMS and name not in sums:
                found.append((name, _ADDED))
            elif name != SUMS and sha256_of(self.path / name) != sums[name]:
                found.append((name, _CHANGED))
        return sorted(found)

    def _sums(self) -> dict[str, str] | None:
        """SHA256SUMS: the hash of each sealed file by name; None where the run is not sealed."""
        try:
            text = (self.path / SUMS).read_text(encoding="utf-8", errors="replace")
        except OSError:
            return None
        lines = (line.partition("  ") for line in text.split("\n") if line)
        return {name: digest for digest, _, name in lines}
