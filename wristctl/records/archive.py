"""Runs on their way to somebody else: one archive with a run and all that it was made from, and its way back.

What comes out of an archive is somebody's word: it is written where names inside the results folder lead and nowhere
else, nothing of it is run or loaded, and a run whose files are not those sealed does not arrive.
"""

import json
import re
import shutil
import stat
import tempfile
import zipfile
import zlib
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from os.path import lexists
from pathlib import Path
from typing import NamedTuple

from wristctl.errors import FILE, UserError, writing
from wristctl.plain_files import LARGEST_DATA, unreadable
from wristctl.records.files import PART, content_of, replacing, sync, sync_all, write_bytes
from wristctl.records.index import dated
from wristctl.records.lineage import each_once, input_run
from wristctl.records.lock import LOCK, RunLock
from wristctl.records.manifest import SIGNATURE, SUMS
from wristctl.records.run import Run
from wristctl.sha256sums import read_seal

PACK, SCHEMA = "pack.json", "wristctl.pack/1"
# Most files of an archive: ten times the files of a full study of all laws.
MOST_FILES = 50_000
# A run's id begins with the time that it was begun at.
_ID = re.compile(r"[0-9TZ]{16}-[A-Za-z0-9_.-]{0,183}")
# Largest ratio of unpacked to packed size. A higher ratio is no run data.
_LARGEST_SHARE = 200
_LARGEST_LIST = 1 << 20
_LONGEST_NAME = 1000
_PIECE = 1 << 20
_FIX = "ask for it again: this is not what `wristctl runs pack` wrote"


def with_ancestors(run: Run) -> list[Run]:
    """The run and all its ancestors, the oldest first.

    Raises UserError where one is gone, has not ended, is not as it was sealed, or is not what was read then.
    """

    def inputs(one: Run) -> Iterator[Run]:
        one.check()
        for record in one.manifest.inputs:
            behind = input_run(one, record)
            if behind.result_hash != record.result_sha256:
                problem = f"the {record.role} run has another result than the one that was read"
                raise UserError(problem, str(behind.path), "bring back the run that was read", exit_code=3)
            yield behind

    return list(each_once(run, lambda one: one.path, inputs).values())


def pack(run: Run, file: Path) -> list[Run]:
    """Write the archive; the runs in it. Of each the sealed files, its seal and its signature, by the run's id."""
    runs = with_ancestors(run)
    if len({member.id for member in runs}) < len(runs):
        raise UserError("two runs of one id", run.id, "they are copies: keep one")
    if file.exists():
        raise UserError("a file is in the way", str(file), "remove it, or name another with --file")
    files = [member.path / name for member in runs for name in _packed(member)]
    if len(files) >= MOST_FILES:
        raise UserError(f"{len(files)} files, and an archive holds {MOST_FILES}", run.id, "copy the folders themselves")
    with replacing(file, FILE) as temporary, zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive:
        contents = {"schema": SCHEMA, "run": run.id, "runs": [each.id for each in runs]}
        _write(archive, PACK, json.dumps(contents, indent=2).encode() + b"\n")
        for member in runs:
            for name in _packed(member):
                _write(archive, f"{member.id}/{name}", content_of(member.path / name, LARGEST_DATA, links=False))
    return runs


def _packed(run: Run) -> list[str]:
    """Names of the files of a run that travel."""
    beside = [name for name in (SUMS, SIGNATURE) if run.has(name)]
    return [*sorted(read_seal(run.path) or ()), *beside]


def _write(archive: zipfile.ZipFile, name: str, content: bytes) -> None:
    entry = zipfile.ZipInfo(name, date_time=(1980, 1, 1, 0, 0, 0))
    entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, (stat.S_IFREG | 0o644) << 16
    archive.writestr(entry, content)


class Unpacked(NamedTuple):
    """The run that an archive is about; those that are new here, that were here, and of these that are signed now."""

    run: Run
    new: list[Run]
    known: list[Run]
    signed: list[Run]


def unpack(file: Path, results: Path) -> Unpacked:
    """Put an archive's runs into a results folder: all of them, or none.

    A run that is here already stays as it is; where it has no signature, it is given that of the archive.

    Raises UserError for a file that is no such archive, for names that lead elsewhere, links, and runs that are not as
    they were sealed, here or in the archive, or stand here already with other contents (exit code 3).
    """
    if file.exists() and not file.is_file():
        raise UserError("no plain file", str(file), "name the archive that `wristctl runs pack` wrote")
    with _reading(file):
        archive = zipfile.ZipFile(file)
    with archive:
        with _reading(file):
            run, runs, entries = _contents(archive, file)
        with writing(results):
            results.mkdir(parents=True, exist_ok=True)
            scratch, lock = _scratch(results)
        try:
            _extract(archive, entries, scratch, file)
            return _moved(run, runs, scratch, results, file)
        finally:
            shutil.rmtree(scratch, ignore_errors=True)
            lock.release()


@contextmanager
def _reading(file: Path) -> Iterator[None]:
    """Within the block, which only reads, whatever is wrong with an archive is the user's error."""
    try:
        yield
    except OSError as error:
        raise unreadable(error, file) from error
    except (zipfile.BadZipFile, zlib.error, EOFError, NotImplementedError, RuntimeError, ValueError) as error:
        raise UserError(f"no archive of runs: {error}", str(file), _FIX) from error


def _scratch(results: Path) -> tuple[Path, RunLock]:
    """A hidden folder to unpack into, and its lock: a sign of life for `runs gc`."""
    while True:
        scratch = Path(tempfile.mkdtemp(prefix=".unpack-", suffix=PART, dir=results))
        with suppress(FileNotFoundError):  # `runs gc` saw an empty folder, and took it away
            return scratch, RunLock(scratch)


def _contents(archive: zipfile.ZipFile, file: Path) -> tuple[str, list[str], list[zipfile.ZipInfo]]:
    """Run, runs and entries of an archive. Raises UserError for a name that no run may have."""
    entries = archive.infolist()
    if len(entries) > MOST_FILES:
        raise UserError(f"it holds {len(entries)} files, and at most {MOST_FILES} are taken", str(file), _FIX)
    if sum(entry.file_size for entry in entries) > _LARGEST_SHARE * max(file.stat().st_size, 1):
        raise UserError("it holds far more than its size", str(file), _FIX)
    names = [entry.filename for entry in entries]
    if len(set(names)) < len(names) or len({name.casefold() for name in names}) < len(names):
        raise UserError("a name stands there twice", str(file), _FIX)
    if long := next((name for name in names if len(name.encode(errors="replace")) > _LONGEST_NAME), None):
        raise UserError(f"a name of more than {_LONGEST_NAME} bytes: {long[:40]!r}...", str(file), _FIX)
    run, runs = _about(archive, file)
    folders = {name[:position] for name in names for position, character in enumerate(name) if character == "/"}
    for entry in entries:
        _check_name(entry, runs, file)
        if entry.filename in folders:
            raise UserError(f"a file and a folder of one name: {entry.filename!r}", str(file), _FIX)
    return run, runs, [entry for entry in entries if entry.filename != PACK]


def _about(archive: zipfile.ZipFile, file: Path) -> tuple[str, list[str]]:
    """The run that an archive is about, and all that are in it."""
    if PACK not in archive.namelist() or archive.getinfo(PACK).file_size > _LARGEST_LIST:
        raise UserError(f"no archive of runs: it has no {PACK}", str(file), _FIX)
    try:
        header = json.loads(archive.read(PACK))
    except (ValueError, RecursionError) as error:
        raise UserError(f"{PACK} is not valid JSON", str(file), _FIX) from error
    runs = header.get("runs") if isinstance(header, Mapping) else None
    if not isinstance(header, Mapping) or not isinstance(runs, list) or header.get("run") not in runs:
        raise UserError(f"{PACK} names no runs", str(file), _FIX)
    if header.get("schema") != SCHEMA:
        raise UserError("packed by another wristctl than this one", str(file), "upgrade wristctl")
    ids = [name for name in runs if isinstance(name, str) and _ID.fullmatch(name) and dated(name)]
    if len(set(ids)) < len(runs):
        raise UserError("a name that is no run's id", str(file), _FIX)
    return header["run"], ids


def _check_name(entry: zipfile.ZipInfo, runs: list[str], file: Path) -> None:
    if entry.filename == PACK:
        return
    mode, parts = entry.external_attr >> 16, entry.filename.split("/")
    plain = not entry.is_dir() and (stat.S_IFMT(mode) in (0, stat.S_IFREG)) and not entry.flag_bits & 1
    inside = parts[0] in runs and len(parts) > 1 and all(part not in ("", ".", "..", LOCK) for part in parts)
    if not inside or "\\" in entry.filename or "\0" in entry.orig_filename or ":" in parts[0]:
        raise UserError(f"a name that leads elsewhere: {entry.filename!r}", str(file), _FIX)
    if not plain or entry.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
        raise UserError(f"no plain file: {entry.filename!r}", str(file), _FIX)


def _extract(archive: zipfile.ZipFile, entries: list[zipfile.ZipInfo], scratch: Path, file: Path) -> None:
    paths = [scratch.joinpath(*entry.filename.split("/")) for entry in entries]
    with writing(scratch.parent):
        for entry, path in zip(entries, paths, strict=True):
            path.parent.mkdir(parents=True, exist_ok=True)
            with path.open("xb") as target:
                for piece in _pieces(archive, entry, file):
                    target.write(piece)
        sync_all([*paths, *{path.parent for path in paths}])


def _pieces(archive: zipfile.ZipFile, entry: zipfile.ZipInfo, file: Path) -> Iterator[bytes]:
    with _reading(file):
        source = archive.open(entry)
    with source:
        while True:
            with _reading(file):
                piece = source.read(_PIECE)
            if not piece:
                return
            yield piece


def _moved(run: str, runs: list[str], scratch: Path, results: Path, file: Path) -> Unpacked:
    """The runs in their place, once all are seen to be what was sealed."""
    destinations = {name: results / name for name in runs}
    for name in runs:
        there = (scratch / name).is_dir()
        for path, problem in Run(scratch / name).problems() if there else [(name, "is not in it")]:
            fix = "ask for it again: nothing was kept"
            raise UserError(f"{path}: {problem}", f"{name} in {file}", fix, exit_code=3)
        if lexists(destinations[name]):
            _check_same(destinations[name], scratch / name)
    new = [name for name in runs if not lexists(destinations[name])]
    present = [Run(destinations[name]) for name in runs if name not in new]
    signed = [run for run in present if _signed_too(run.path, scratch / run.id)]
    with writing(results):
        for name in new:
            (scratch / name).rename(destinations[name])
        sync(results)
    return Unpacked(Run(destinations[run]), [Run(destinations[name]) for name in new], present, signed)


def _check_same(existing: Path, arrived: Path) -> None:
    """UserError where what is here under a run's id is another run, or that run and damaged."""
    sums = [content_of(folder / SUMS, links=False) for folder in (existing, arrived) if lexists(folder / SUMS)]
    if len(sums) < 2 or sums[0] != sums[1]:
        problem = "a run of this id is here already, and is another"
        raise UserError(problem, str(existing), "another results folder, with --out", exit_code=3)
    try:
        Run(existing).check()
    except UserError as error:
        problem = f"the run is here already, and is damaged: {error.what}"
        raise UserError(problem, error.where, "delete that copy, and unpack again", exit_code=3) from error


def _signed_too(existing: Path, arrived: Path) -> bool:
    """Give a run its signature of the archive where it has none here; whether that was so."""
    if lexists(existing / SIGNATURE) or not (arrived / SIGNATURE).is_file():
        return False
    write_bytes(existing / SIGNATURE, (arrived / SIGNATURE).read_bytes())
    return True
