"""The seal of a run directory: SHA256SUMS, and all that must hold where a run is taken for what it was.

It shows accidents: a lost, changed, swapped or added file, a copy cut short. It is no signature: who means to deceive
can seal a directory anew, which is what `wristctl runs sign` and `verify --signed` are for (records/signature.py).
"""

import os
import stat
from collections.abc import Iterator
from pathlib import Path

from wristctl.records.files import LINK, NOT_PLAIN, PART, files_below, sha256_of, sha256_of_list, sync, write_text
from wristctl.records.lock import LOCK
from wristctl.records.manifest import CONFIG, MANIFEST, PACKAGES, SIGNATURE, SOURCES, SUMS, Manifest

REQUIRED = (MANIFEST, CONFIG, PACKAGES, SOURCES)
"""Files that every run has."""

CHANGED, MISSING = "hash does not match what was sealed", "sealed file is missing"
ADDED, ADDED_FOLDER = "file was added after sealing", "folder was added after sealing"
SIGNING = f".{SIGNATURE}{PART}"
"""What stays where `runs sign` was killed."""
_BESIDE = (SUMS, SIGNATURE, SIGNING, LOCK)
"""What stands beside the files that are sealed; a lock stays where a process was killed at the very end."""

Fault = tuple[str, str]
"""A path in the run directory, and what is wrong with it."""


def write_seal(folder: Path, known: dict[str, str]) -> None:
    """Seal a directory as it is, all on the disk before; `known` are hashes of files that are on the disk already."""
    found = {}
    for name in files_below(folder):
        if name not in _BESIDE and not (folder / name).is_symlink():
            if name not in known:
                sync(folder / name)
            found[name] = known.get(name) or sha256_of(folder / name)
    for below in sorted({(folder / name).parent for name in found}):
        sync(below)
    write_text(folder / SUMS, "".join(f"{digest}  {name}\n" for name, digest in sorted(found.items())))


def entries(folder: Path) -> Iterator[tuple[str, str]]:
    """Everything below, hidden or not, by relative POSIX path: file, link, odd, or folder where it is empty."""
    waiting = [""]
    while waiting:
        below = waiting.pop()
        with os.scandir(folder / below) as found:
            inside = sorted(found, key=lambda each: each.name)
        if below and not inside:
            yield below, "folder"
        for each in inside:
            name = f"{below}/{each.name}" if below else each.name
            mode = each.stat(follow_symlinks=False).st_mode
            if stat.S_ISDIR(mode):
                waiting.append(name)
            else:
                yield name, "link" if stat.S_ISLNK(mode) else "file" if stat.S_ISREG(mode) else "odd"


def added(folder: Path, sums: dict[str, str]) -> list[str]:
    """Whatever stands in a sealed run and is not the run's, by name; nothing is hashed."""
    return sorted(name for name, _ in entries(folder) if name not in sums and name not in _BESIDE)


def faults_of_files(folder: Path, sums: dict[str, str]) -> list[Fault]:
    """Each file that is not as it was sealed."""
    found, there = [], set()
    for name, kind in entries(folder):
        there.add(name)
        if kind in ("link", "odd"):
            found.append((name, LINK if kind == "link" else NOT_PLAIN))
        elif name in sums:
            if kind == "folder":
                found.append((name, NOT_PLAIN))
            elif sha256_of(folder / name) != sums[name]:
                found.append((name, CHANGED))
        elif name not in _BESIDE:
            found.append((name, ADDED_FOLDER if kind == "folder" else ADDED))
    found += [(name, MISSING) for name in sums if name not in there]
    found += [(name, "is not among what was sealed") for name in REQUIRED if name not in sums]
    return sorted(found)


def faults_of_manifest(folder: Path, sums: dict[str, str], manifest: Manifest) -> list[Fault]:
    """Where the seal and the manifest, which has the hashes of outputs and result, are not of one mind."""
    found = []
    if manifest.id != folder.name:
        found.append((MANIFEST, f"is that of run {manifest.id}, and stands in the folder {folder.name}"))
    for each in manifest.outputs:
        if each.path not in sums:
            found.append((each.path, f"is an output of {MANIFEST}, and not in {SUMS}"))
        elif each.sha256 != sums[each.path]:
            found.append((each.path, f"hash in {SUMS} is not that in {MANIFEST}"))
    for name, digest in manifest.code.foreign.items():
        if sums.get(name) != digest:
            found.append((name, f"hash in {SUMS} is not that in {MANIFEST}"))
    if manifest.result_sha256 != result_hash(manifest):
        found.append((MANIFEST, "result_sha256 is not that of the outputs"))
    return found


def result_hash(manifest: Manifest) -> str:
    """One hash over the outputs that are results."""
    return sha256_of_list([(each.path, each.sha256) for each in manifest.outputs if not each.volatile])
