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
_CODE_PATHS = (
    "OPENBLAS_CORETYPE", "MKL_CBWR", "NUMBA_CPU_NAME", "NUMBA_CPU_FEATURES", "NUMBA_OPT", "NPY_DISABLE_CPU_FEATURES",
    "NPY_ENABLE_CPU_FEATURES", "ATEN_CPU_CAPABILITY", "ONEDNN_MAX_CPU_ISA",
)  # fmt: skip
"""Settings of libraries that choose between ways of computing which may differ in the last bit."""


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
        features=_features(),
        settings={name: os.environ[name] for name in _CODE_PATHS if name in os.environ},
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


def _features() -> list[str]:
    """The processor's vector instructions: libraries compute by the widest."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        return []
    flags = next((line.partition(":")[2].split() for line in lines if line.startswith(("flags", "Features"))), [])
    return sorted(each for each in flags if each in ("fma", "asimd", "sve") or each.startswith(("sse4", "avx")))
