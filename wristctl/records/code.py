"""Which code ran: version, commit, uncommitted changes, and a hash of the package that needs no git."""

from __future__ import annotations

import os
import shutil
import subprocess
import tempfile
from pathlib import Path

from wristctl.config.shipped import EXPERIMENTS
from wristctl.records.files import files_below, sha256_of, sha256_of_list
from wristctl.records.manifest import Code
from wristctl.version import __version__

_PACKAGE = Path(__file__).resolve().parents[1]
_SOURCES = ("--", ".", ":(exclude,glob)**/__pycache__/**")


def code_state() -> tuple[Code, bytes, str]:
    """The state of the running package, the patch onto its commit where there are uncommitted changes, and its files.

    The files are lines of hash and path as sha256sum writes them.
    """
    sources = _sources()
    listing = "".join(f"{digest}  {name}\n" for name, digest in sources)
    code = Code(version=__version__, tree_sha256=sha256_of_list(sources))
    commit = _git("rev-parse", "HEAD")
    if not commit or not _git("ls-files", "--", "__init__.py"):
        return code, b"", listing
    patch = _patch()
    branch = (_git("rev-parse", "--abbrev-ref", "HEAD") or b"").decode().strip()
    update = {"commit": commit.decode().strip(), "branch": branch, "dirty": bool(patch)}
    return code.model_copy(update=update), patch, listing


def tree_digest() -> str:
    """One hash over the files of the package, as they are now."""
    return sha256_of_list(_sources())


def _sources() -> list[tuple[str, str]]:
    names = [name for name in files_below(_PACKAGE) if not {"__pycache__", EXPERIMENTS} & set(Path(name).parts)]
    return [(name, sha256_of(_PACKAGE / name)) for name in names]  # a wheel has the experiments within, a clone beside


def _patch() -> bytes:
    """Changes of the package against HEAD, new files included; the user's index is not touched."""
    index = _git("rev-parse", "--git-path", "index")
    with tempfile.TemporaryDirectory() as scratch:
        copy = Path(scratch) / "index"
        if index and (_PACKAGE / index.decode().strip()).is_file():
            shutil.copyfile(_PACKAGE / index.decode().strip(), copy)
        _git("add", "--intent-to-add", *_SOURCES, index=copy)
        return _git("diff", "--binary", "HEAD", *_SOURCES, index=copy) or b""


def _git(*arguments: str, index: Path | None = None) -> bytes | None:
    environment = {**os.environ, "GIT_OPTIONAL_LOCKS": "0"}
    if index:
        environment["GIT_INDEX_FILE"] = str(index)
    try:
        done = subprocess.run(
            ["git", "-C", str(_PACKAGE), *arguments], capture_output=True, env=environment, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return done.stdout if done.returncode == 0 else None
