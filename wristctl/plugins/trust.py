"""Trust in code that came with a run. It is loaded once a person has seen its files and hashes, and agreed.

Nobody is asked about a run that the same user sealed on this machine: its code has run already.
"""

import hashlib
import os
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from importlib.machinery import BYTECODE_SUFFIXES
from pathlib import Path

from wristctl.errors import Argument, UserError
from wristctl.escape import printable
from wristctl.plain_files import read_plain, unreadable
from wristctl.plugins.own_runs import is_noted
from wristctl.sha256sums import SUMS, read_seal

_MANIFEST, _CONFIG, _CODE = "run.json", "config.yaml", "code"
# Files that nothing but a run has, each of which is left where another was lost or taken away.
_MARKS = (_MANIFEST, SUMS, "code.txt")
# Environment variable with the hashes that were agreed to, for the processes that a command starts.
_AGREED = "WRISTCTL_TRUSTED_CODE"

# Shows a text that names files and hashes, and answers whether a person has said yes.
Ask = Callable[[str], bool]

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
    """The run directory that a file lies in, by its name or by where that leads; None where it is in none.

    What is left of a run is one still: any of the files that mark it, were they links that lead nowhere, or a
    configuration beside copies of code.
    """
    for path in (file.absolute(), file.resolve()):
        for folder in path.parents:
            if any(os.path.lexists(folder / name) for name in _MARKS):
                return folder
            if os.path.lexists(folder / _CONFIG) and os.path.lexists(folder / _CODE):
                return folder
    return None


def trusted(file: Path, root: Path) -> Mapping[Path, str] | None:
    """The hashes of all below `root` that a file in a run may load, which were agreed to; None for one that is in none.

    Those of a run that this user sealed here count as agreed to. Raises UserError where nobody agrees, and for code
    that is not as the run was sealed.
    """
    home = run_around(file)
    if home is None:
        return None
    files, sealed = _sources(root), read_seal(home)
    _check_seal(home, sealed, files)
    whole_digest = digest_of(root, files)
    if whole_digest in os.environ.get(_AGREED, "").split(",") or _sealed_here(home, sealed, root):
        return files
    lines = [printable(line) for line in _listing(root, files)]  # a name may hold what a terminal obeys
    shown = f"{printable(home)} carries code, which would run with all that you may do. In {printable(root)}:\n"
    if not _ask or not _ask[-1](shown + "\n".join(lines)):
        fix = ("read it, then ", Argument("trust_code", metavar=""))
        where = f"{root}: " + ", ".join(f"{source.name} sha256 {digest}" for source, digest in files.items())
        raise UserError("the run carries code of its own, and nobody has said that it may run", where, fix)
    agree(whole_digest)
    return files


def agree(digest: str) -> None:
    """Take code of this hash as agreed to, here and in processes that are started from here."""
    agreed = os.environ.get(_AGREED)
    os.environ[_AGREED] = f"{agreed},{digest}" if agreed else digest


def digest_of(root: Path, files: Mapping[Path, str]) -> str:
    """One hash over all source and data files below a folder, by their hashes and names."""
    return hashlib.sha256("\n".join(_listing(root, files)).encode(errors="surrogateescape")).hexdigest()


def _sources(root: Path) -> dict[Path, str]:
    """All below a folder but what Python would load in place of sources, and nothing here ever does."""
    sources = (path for path in root.rglob("*") if path.is_file() and not path.name.endswith(tuple(BYTECODE_SUFFIXES)))
    return {source: hashlib.sha256(_content(source)).hexdigest() for source in sources}


def _content(source: Path) -> bytes:
    try:
        return read_plain(source)
    except OSError as error:
        raise unreadable(error, source) from error


def digest_now(file: Path) -> str:
    """SHA-256 of a file as it is; empty where it cannot be read."""
    try:
        return hashlib.sha256(read_plain(file)).hexdigest()
    except OSError:
        return ""


def _listing(root: Path, files: Mapping[Path, str]) -> list[str]:
    return [f"{digest}  {source.relative_to(root).as_posix()}" for source, digest in sorted(files.items())]


def _sealed_here(home: Path, sealed: Mapping[str, str] | None, root: Path) -> bool:
    """Whether this user sealed the run on this machine, with this configuration beside the code.

    The code itself is as it was sealed, or it is refused before.
    """
    noted = sealed and root.is_relative_to(home / _CODE) and is_noted(sealed)
    return bool(noted and sealed and digest_now(home / _CONFIG) == sealed.get(_CONFIG))


def _check_seal(home: Path, sealed: Mapping[str, str] | None, files: Mapping[Path, str]) -> None:
    if sealed is None:
        return
    complete = _MANIFEST in sealed  # else it was cut short, or is a list of other files
    for file, digest in files.items():
        name = file.relative_to(home).as_posix() if file.is_relative_to(home) else str(file)
        if sealed.get(name, "" if complete else digest) != digest:
            problem = "the run's code is not as it was sealed"
            raise UserError(problem, str(file), "restore the run, or take the controller from where you trust it")
