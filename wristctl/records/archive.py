"""Runs on their way to somebody else: one archive with a run and all that it was made from, and its way back.

What comes out of an archive is somebody's word: it is written where names inside the results folder lead and nowhere
else, nothing of it is run or loaded, and a run whose files are not those sealed does not arrive.
"""

from __future__ import annotations

import json
import re
import shutil
import stat
import tempfile
import zipfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import NamedTuple

from wristctl.config.errors import UserError
from wristctl.config.sha256sums import read_seal, unreadable
from wristctl.records.files import PART, replacing, sync
from wristctl.records.lineage import input_run
from wristctl.records.lock import LOCK
from wristctl.records.manifest import SIGNATURE, SUMS
from wristctl.records.run import Run

PACK, SCHEMA = "pack.json", "wristctl.pack/1"
_ID = re.compile(r"[A-Za-z0-9_][A-Za-z0-9_.-]{0,199}")
_LARGEST_SHARE = 200
"""How many times its size an archive may hold: what was squeezed more is no data of ours."""
_LARGEST_LIST = 1 << 20
_PIECE = 1 << 20
_FIX = "ask for it again: this is not what `wristctl runs pack` wrote"


def with_ancestors(run: Run) -> list[Run]:
    """The run and all that it was made from, what was made first first.

    Raises UserError where one is gone, has not ended, is not as it was sealed, or is not what was read then.
    """
    found: dict[Path, Run] = {}

    def add(one: Run, users: tuple[Path, ...]) -> None:
        one.check()
        for each in one.manifest.inputs:
            behind = input_run(one, each)
            if behind.result_hash != each.result_sha256:
                what = f"the {each.role} run has another result than the one that was read"
                raise UserError(what, str(behind.path), "bring back the run that was read", exit_code=3)
            if behind.path not in (one.path, *users):
                add(behind, (one.path, *users))
        found.setdefault(one.path, one)

    add(run, ())
    return list(found.values())


def pack(run: Run, file: Path) -> list[Run]:
    """Write the archive; the runs in it. Of each the sealed files, its seal and its signature, by the run's id."""
    runs = with_ancestors(run)
    if len({each.id for each in runs}) < len(runs):
        raise UserError("two runs of one id", run.id, "they are copies: keep one")
    if file.exists():
        raise UserError("a file is in the way", str(file), "remove it, or name another with --file")
    with replacing(file) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        told = {"schema": SCHEMA, "run": run.id, "runs": [each.id for each in runs]}
        _write(archive, PACK, json.dumps(told, indent=2).encode() + b"\n")
        for each in runs:
            beside = [name for name in (SUMS, SIGNATURE) if (each.path / name).is_file()]
            for name in [*sorted(read_seal(each.path) or ()), *beside]:
                _write(archive, f"{each.id}/{name}", (each.path / name).read_bytes())
    return runs


def _write(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, (stat.S_IFREG | 0o644) << 16
    archive.writestr(entry, content)


class Unpacked(NamedTuple):
    """What came out of an archive: the run that it is about, those that are new here, and those that were here."""

    run: Run
    new: list[Run]
    known: list[Run]


def unpack(file: Path, results: Path) -> Unpacked:
    """Put an archive's runs into a results folder: all of them, or none.

    Raises UserError for what is no such archive, for names that lead elsewhere, links, and runs that are not as they
    were sealed or stand here already with other contents (exit code 3).
    """
    results.mkdir(parents=True, exist_ok=True)
    try:
        with zipfile.ZipFile(file) as archive:
            about, entries = _contents(archive, file)
            scratch = Path(tempfile.mkdtemp(prefix=".unpack-", suffix=PART, dir=results))
            try:
                _extract(archive, entries, scratch)
                return _moved(about, scratch, results, file)
            finally:
                shutil.rmtree(scratch, ignore_errors=True)
    except OSError as error:
        raise unreadable(error, file) from error
    except (zipfile.BadZipFile, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise UserError(f"no archive of runs: {error}", str(file), _FIX) from error


class _About(NamedTuple):
    run: str
    runs: list[str]


def _contents(archive: zipfile.ZipFile, file: Path) -> tuple[_About, list[zipfile.ZipInfo]]:
    """Which runs, and their entries; UserError where a name is none of theirs."""
    entries = archive.infolist()
    if sum(each.file_size for each in entries) > _LARGEST_SHARE * max(file.stat().st_size, 1):
        raise UserError("it holds far more than its size", str(file), _FIX)
    names = [each.filename for each in entries]
    if len(set(names)) < len(names) or len({name.casefold() for name in names}) < len(names):
        raise UserError("a name stands there twice", str(file), _FIX)
    about = _about(archive, file)
    for each in entries:
        _check_name(each, about.runs, file)
    return about, [each for each in entries if each.filename != PACK]


def _about(archive: zipfile.ZipFile, file: Path) -> _About:
    if PACK not in archive.namelist() or archive.getinfo(PACK).file_size > _LARGEST_LIST:
        raise UserError(f"no archive of runs: it has no {PACK}", str(file), _FIX)
    try:
        told = json.loads(archive.read(PACK))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{PACK} is not valid JSON", str(file), _FIX) from error
    runs = told.get("runs") if isinstance(told, Mapping) else None
    if not isinstance(told, Mapping) or not isinstance(runs, list) or told.get("run") not in runs:
        raise UserError(f"{PACK} names no runs", str(file), _FIX)
    if told.get("schema") != SCHEMA:
        raise UserError("packed by another wristctl than this one", str(file), "upgrade wristctl")
    if not all(isinstance(each, str) and _ID.fullmatch(each) for each in runs) or len(set(runs)) < len(runs):
        raise UserError("a name that is no run's id", str(file), _FIX)
    return _About(told["run"], runs)


def _check_name(entry: zipfile.ZipInfo, runs: list[str], file: Path) -> None:
    if entry.filename == PACK:
        return
    mode, parts = entry.external_attr >> 16, entry.filename.split("/")
    plain = not entry.is_dir() and (stat.S_IFMT(mode) in (0, stat.S_IFREG)) and not entry.flag_bits & 1
    inside = parts[0] in runs and len(parts) > 1 and all(part not in ("", ".", "..", LOCK) for part in parts)
    if not inside or "\\" in entry.filename or "\0" in entry.orig_filename or ":" in parts[0]:
        raise UserError(f"a name that leads elsewhere: {entry.filename!r}", str(file), _FIX)
    if not plain:
        raise UserError(f"no plain file: {entry.filename!r}", str(file), _FIX)


def _extract(archive: zipfile.ZipFile, entries: list[zipfile.ZipInfo], scratch: Path) -> None:
    for entry in entries:
        path = scratch.joinpath(*entry.filename.split("/"))
        path.parent.mkdir(parents=True, exist_ok=True)
        with archive.open(entry) as source, path.open("xb") as target:
            shutil.copyfileobj(source, target, _PIECE)
        sync(path)


def _moved(about: _About, scratch: Path, results: Path, file: Path) -> Unpacked:
    """The runs in their place, once all are seen to be what was sealed."""
    here = {name: results / name for name in about.runs}
    for name in about.runs:
        for path, what in _problems(scratch / name):
            raise UserError(f"{path}: {what}", f"{name} in {file}", "ask for it again: nothing was kept", exit_code=3)
        if here[name].exists() and not _same(here[name], scratch / name):
            what = "a run of this id is here already, and is another"
            raise UserError(what, str(here[name]), "another results folder, with --out", exit_code=3)
    new = [name for name in about.runs if not here[name].exists()]
    for name in new:
        (scratch / name).rename(here[name])
    sync(results)
    known = [Run(here[name]) for name in about.runs if name not in new]
    return Unpacked(Run(here[about.run]), [Run(here[name]) for name in new], known)


def _problems(folder: Path) -> Iterator[tuple[str, str]]:
    if not folder.is_dir():
        yield folder.name, "is not in it"
    else:
        yield from Run(folder).problems()


def _same(one: Path, other: Path) -> bool:
    return (one / SUMS).is_file() and (one / SUMS).read_bytes() == (other / SUMS).read_bytes()
