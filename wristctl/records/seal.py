"""The seal of a run directory: SHA256SUMS, and all that must hold where a run is taken for what it was.

It shows accidents: a lost, changed, swapped or added file, a copy cut short. It is no signature: who means to deceive
can seal a directory anew, which is what `wristctl runs sign` and `verify --signed` are for (records/signature.py).
"""

import os
import stat
from collections.abc import Iterator, Mapping
from pathlib import Path

from wristctl.plain_files import LARGEST, LARGEST_DATA, LINK, NOT_PLAIN
from wristctl.records.files import PART, files_below, sha256_of, sha256_of_list, sync, write_text
from wristctl.records.lock import LOCK
from wristctl.records.manifest import CONFIG, MANIFEST, PACKAGES, SIGNATURE, SOURCES, SUMS, Manifest

# Files that every run has.
REQUIRED = (MANIFEST, CONFIG, PACKAGES, SOURCES)

CHANGED, MISSING = "hash does not match what was sealed", "sealed file is missing"
ADDED, ADDED_FOLDER = "file was added after sealing", "folder was added after sealing"
# File that remains after a killed `runs sign`.
SIGNING = f".{SIGNATURE}{PART}"
# Files of a run outside its seal. A lock remains where a process was killed at the very end.
_BESIDE = (SUMS, SIGNATURE, SIGNING, LOCK)

# Folders of a run whose files may be large.
_LARGE = ("data", "models", "inputs")

# A path in the run directory, and what is wrong with it.
Fault = tuple[str, str]


def write_seal(folder: Path, digests: dict[str, str]) -> None:
    """Seal a directory as it is, all on the disk before; `known` are hashes of files that are on the disk already."""
    sums = {}
    for name in files_below(folder):
        if name not in _BESIDE and not (folder / name).is_symlink():
            if name not in digests:
                sync(folder / name)
            sums[name] = digests.get(name) or sha256_of(folder / name)
    for below in sorted({(folder / name).parent for name in sums}):
        sync(below)
    write_text(folder / SUMS, "".join(f"{digest}  {name}\n" for name, digest in sorted(sums.items())))


def entries(folder: Path) -> Iterator[tuple[str, str]]:
    """Everything below, hidden or not, by relative POSIX path: file, link, odd, or folder where it is empty."""
    waiting = [""]
    while waiting:
        below = waiting.pop()
        with os.scandir(folder / below) as listing:
            inside = sorted(listing, key=lambda item: item.name)
        if below and not inside:
            yield below, "folder"
        for item in inside:
            name = f"{below}/{item.name}" if below else item.name
            mode = item.stat(follow_symlinks=False).st_mode
            if stat.S_ISDIR(mode):
                waiting.append(name)
            else:
                yield name, "link" if stat.S_ISLNK(mode) else "file" if stat.S_ISREG(mode) else "odd"


def added(folder: Path, sums: dict[str, str]) -> list[str]:
    """Names of files in a sealed run that are not part of it. Hashes nothing."""
    return sorted(name for name, _ in entries(folder) if name not in sums and name not in _BESIDE)


def faults_of_files(folder: Path, sums: Mapping[str, str], manifest: Manifest | None) -> list[Fault]:
    """Files that differ from the seal, each with its fault.

    A file of another size than the manifest says, where there is one, is not hashed, nor one too large for its name.
    """
    faults, present = [], set()
    sizes = {output.path: output.bytes for output in manifest.outputs} if manifest else {}
    for name, kind in entries(folder):
        present.add(name)
        if kind in ("link", "odd"):
            faults.append((name, LINK if kind == "link" else NOT_PLAIN))
        elif name in sums:
            if kind == "folder":
                faults.append((name, NOT_PLAIN))
            elif not _is_sealed(folder, name, sums[name], sizes.get(name)):
                faults.append((name, CHANGED))
        elif name not in _BESIDE:
            faults.append((name, ADDED_FOLDER if kind == "folder" else ADDED))
    faults += [(name, MISSING) for name in sums if name not in present]
    faults += [(name, "is not among what was sealed") for name in REQUIRED if name not in sums]
    return sorted(faults)


def largest(name: str) -> int:
    """Most bytes of a file of a run by its name, unless its manifest says more."""
    return LARGEST_DATA if name.split("/")[0] in _LARGE else LARGEST


def _is_sealed(folder: Path, name: str, digest: str, size: int | None) -> bool:
    """Whether a file is the one that was sealed, which had this size where that is known."""
    now = (folder / name).stat().st_size
    if now > largest(name) if size is None else now != size:
        return False
    return sha256_of(folder / name, now) == digest


def faults_of_manifest(folder: Path, sums: Mapping[str, str], manifest: Manifest) -> list[Fault]:
    """Contradictions between the seal and the hashes of outputs and result in the manifest."""
    faults = []
    if manifest.id != folder.name:
        faults.append((MANIFEST, f"is that of run {manifest.id}, and stands in the folder {folder.name}"))
    for output in manifest.outputs:
        if output.path not in sums:
            faults.append((output.path, f"is an output of {MANIFEST}, and not in {SUMS}"))
        elif output.sha256 != sums[output.path]:
            faults.append((output.path, f"hash in {SUMS} is not that in {MANIFEST}"))
    for name, digest in manifest.code.foreign.items():
        if sums.get(name) != digest:
            faults.append((name, f"hash in {SUMS} is not that in {MANIFEST}"))
    if manifest.result_sha256 != result_hash(manifest):
        faults.append((MANIFEST, "result_sha256 is not that of the outputs"))
    return faults


def result_hash(manifest: Manifest) -> str:
    """One hash over the outputs that are results."""
    return sha256_of_list([(output.path, output.sha256) for output in manifest.outputs if not output.volatile])
