"""Provenance of a run: code, machine and packages."""

import hashlib
import os
import platform
import shutil
import subprocess
import tempfile
from contextlib import suppress
from importlib import metadata
from pathlib import Path

from wristctl.records.files import files_below, sha256_of, sha256_of_list
from wristctl.records.manifest import Code, Environment
from wristctl.study_files.shipped import EXPERIMENTS
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
        process = subprocess.run(
            ["git", "-C", str(_PACKAGE), *arguments], capture_output=True, env=environment, timeout=30
        )
    except (OSError, subprocess.TimeoutExpired):
        return None
    return process.stdout if process.returncode == 0 else None


_NUMERICAL = ("numpy", "scipy", "numba", "llvmlite", "torch", "pandas", "matplotlib")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
# Settings of libraries that choose between ways of computing which may differ in the last bit.
_CODE_PATHS = (
    "OPENBLAS_CORETYPE", "MKL_CBWR", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT", "NPY_DISABLE_CPU_FEATURES",
    "NPY_ENABLE_CPU_FEATURES", "ATEN_CPU_CAPABILITY", "ONEDNN_MAX_CPU_ISA",
)  # fmt: skip


def environment_state() -> tuple[Environment, str]:
    """The environment, and every installed distribution as `name==version` lines."""
    described = [distribution.metadata for distribution in metadata.distributions()]  # read anew at every mention
    versions = [((package["Name"] or "").lower(), package["Version"]) for package in described]
    installed = dict(reversed(versions))  # the first on the path is the one that is imported
    listing = "".join(f"{name}=={version}\n" for name, version in sorted(installed.items()))
    cpu, features = _processor()
    environment = Environment(
        python=platform.python_version(),
        os=platform.platform(),
        machine=platform.machine(),
        cpu=cpu,
        cores=os.cpu_count() or 1,
        features=features,
        settings={name: os.environ[name] for name in _CODE_PATHS if name in os.environ},
        threads={name: os.environ[name] for name in _THREADS if name in os.environ},
        packages={name: installed[name] for name in _NUMERICAL if name in installed},
        packages_sha256=hashlib.sha256(listing.encode()).hexdigest(),
    )
    return environment, listing


def _processor() -> tuple[str, list[str]]:
    """The processor's name and vector instructions: libraries compute by the widest."""
    told = dict[str, str]()
    with suppress(OSError):
        for line in Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines():
            key, _, value = line.partition(":")
            told.setdefault(key.strip(), value.strip())
    flags = told.get("flags", told.get("Features", "")).split()
    vector = sorted(flag for flag in flags if flag in ("fma", "asimd", "sve") or flag.startswith(("sse4", "avx")))
    return told.get("model name", platform.processor()), vector
