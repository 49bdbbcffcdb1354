"""Which code that came with a run may be loaded: none, until a person has seen its files and hashes and said yes."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.machinery import all_suffixes
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.wording import Argument

_MANIFEST, _SUMS = "run.json", "SHA256SUMS"
_AGREED = "WRISTCTL_TRUSTED_CODE"
"""Environment variable with the hashes that were agreed to, for the processes that a command starts."""
_LINE = re.compile(r"([0-9a-f]{64})  (.+)")

Ask = Callable[[str], bool]
"""Shows a text that names files and hashes, and answers whether a person has said yes."""

_ask: list[Ask] = []


@contextmanager
def asking(ask: Ask) -> Iterator[None]:
    """Within the block `ask` decides about code that came with a run."""
    _ask.append(ask)
    try:
        yield
    finally:
        _ask.pop()


def run_around(file: Path) -> Path | None:
    """The run directory that a file lies in, by its name or by where that leads; None where it is in none."""
    for whole in (file.absolute(), file.resolve()):
        for folder in whole.parents:
            if (folder / _MANIFEST).exists():
                return folder
    return None


def trusted(file: Path, root: Path) -> Mapping[Path, str] | None:
    """The hashes of all below `root` that a file in a run may load, which were agreed to; None for one that is in none.

    Raises UserError where nobody agrees, and for code that is not as the run was sealed.
    """
    home = run_around(file)
    if home is None:
        return None
    files = _sources(root)
    _check_seal(home, files)
    lines, whole = _listing(root, files), digest_of(root)
    if whole in os.environ.get(_AGREED, "").split(","):
        return files
    shown = f"{home} carries code, which would run with all that you may do. In {root}:\n" + "\n".join(lines)
    if not _ask or not _ask[-1](shown):
        fix = ("read it, then ", Argument("trust_code", metavar=""))
        where = f"{root}: " + ", ".join(f"{each.name} sha256 {digest}" for each, digest in files.items())
        raise UserError("the run carries code of its own, and nobody has said that it may run", where, fix)
    agree(whole)
    return files


def agree(digest: str) -> None:
    """Take code of this hash as agreed to, here and in processes that are started from here."""
    known = os.environ.get(_AGREED)
    os.environ[_AGREED] = f"{known},{digest}" if known else digest


def digest_of(root: Path) -> str:
    """One hash over every source and data file below a folder, by content and name."""
    return hashlib.sha256("\n".join(_listing(root, _sources(root))).encode()).hexdigest()


def _sources(root: Path) -> dict[Path, str]:
    """All below a folder but what Python would load in place of sources, and nothing here ever does."""
    others = tuple(set(all_suffixes()) - {".py"})
    found = sorted(each for each in root.rglob("*") if each.is_file() and not each.name.endswith(others))
    return {each: hashlib.sha256(each.read_bytes()).hexdigest() for each in found}


def _listing(root: Path, files: Mapping[Path, str]) -> list[str]:
    return [f"{digest}  {each.relative_to(root).as_posix()}" for each, digest in files.items()]


def _check_seal(home: Path, files: Mapping[Path, str]) -> None:
    sums = home / _SUMS
    if not sums.is_file():
        return
    found = (_LINE.fullmatch(line) for line in sums.read_text(encoding="utf-8", errors="replace").splitlines())
    sealed = {line[2]: line[1] for line in found if line}
    for file, digest in files.items():
        name = file.relative_to(home).as_posix() if file.is_relative_to(home) else str(file)
        if sealed.get(name) != digest:
            what = "the run's code is not as it was sealed"
            raise UserError(what, str(file), "restore the run, or take the law from where you trust it")
