"""The machine and the installed packages."""

from __future__ import annotations

import hashlib
import os
import platform
from importlib import metadata
from pathlib import Path

from wristctl.records.manifest import Environment

_NUMERICAL = ("numpy", "scipy", "numba", "llvmlite", "torch", "pandas", "matplotlib")
_THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def environment_state() -> tuple[Environment, str]:
    """The environment, and every installed distribution as `name==version` lines."""
    described = [each.metadata for each in metadata.distributions()]  # read anew at every mention
    found = [((each["Name"] or "").lower(), each["Version"]) for each in described]
    installed = dict(reversed(found))  # the first on the path is the one that is imported
    listing = "".join(f"{name}=={version}\n" for name, version in sorted(installed.items()))
    environment = Environment(
        python=platform.python_version(),
        os=platform.platform(),
        machine=platform.machine(),
        cpu=_cpu(),
        cores=os.cpu_count() or 1,
        threads={name: os.environ[name] for name in _THREADS if name in os.environ},
        packages={name: installed[name] for name in _NUMERICAL if name in installed},
        packages_sha256=hashlib.sha256(listing.encode()).hexdigest(),
    )
    return environment, listing


def _cpu() -> str:
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return platform.processor()
    return next(
        (line.partition(":")[2].strip() for line in lines if line.startswith("model name")),
        platform.processor(),
    )
