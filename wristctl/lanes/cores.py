"""The processor's cores."""

from __future__ import annotations

import os


def cores() -> int:
    """Cores that this process may use; OMP_NUM_THREADS may say fewer, as it does in a worker that shares a machine."""
    there = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    said = os.environ.get("OMP_NUM_THREADS", "").partition(",")[0]
    return max(1, min(there, int(said))) if said.isdigit() else there
