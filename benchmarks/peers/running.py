"""Sides as running processes that answer requests, each held to its number of cores."""

from __future__ import annotations

import json
import os
import subprocess
from pathlib import Path
from typing import Any, Self

from table import Side
from venvs import CACHE, HERE, python_of

ROOT = HERE.parents[1]


class Running:
    """One side, one task, one number of threads; a context that ends the process."""

    def __init__(self, side: Side, task: Path, segments: int, threads: int, steps: int | None = None) -> None:
        self.side = side
        cores = sorted(os.sched_getaffinity(0))[:threads]
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {
            **os.environ,
            **{name: str(threads) for name in names},
            "PYTHONPATH": str(ROOT) if side.venv is None else "",
            "PEERS_CACHE": str(CACHE),
            "C_LANES": str(side.width or 8),
            "JAX_PLATFORMS": "cpu",
            "JAX_COMPILATION_CACHE_DIR": str(CACHE / f"xla-{threads}"),  # what is compiled depends on the cores seen
        }
        self.process = subprocess.Popen(
            [python_of(side.venv), str(HERE / "worker.py"), side.module, str(task),
             str(steps or side.steps[segments]), str(threads)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True, env=environment,
            stderr=subprocess.DEVNULL if not os.environ.get("PEERS_DEBUG") else None,
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )  # fmt: skip

    def ask(self, lanes: int, ticks: int, repeats: int = 1, theta: bool = False) -> dict[str, Any]:
        """Seconds of `repeats` rollouts of `ticks` control periods, and the first lane's tip angles if asked for."""
        assert self.process.stdin is not None and self.process.stdout is not None
        request = {"lanes": lanes, "ticks": ticks, "repeats": repeats, "theta": theta}
        try:
            self.process.stdin.write(json.dumps(request) + "\n")
            self.process.stdin.flush()
            line = self.process.stdout.readline()
        except BrokenPipeError:
            line = ""
        if not line:
            raise RuntimeError(f"{self.side.name} ended without an answer (PEERS_DEBUG=1 shows its messages)")
        answer: dict[str, Any] = json.loads(line)
        return answer

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
