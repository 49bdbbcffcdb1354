"""Sides as running processes that answer requests, each held to its number of cores."""

from __future__ import annotations

import json
import os
import selectors
import subprocess
import time
from pathlib import Path
from typing import Any, Self

from table import Side
from venvs import CACHE, HERE, python_of

ROOT = HERE.parents[1]
PATIENCE = 240.0
"""Seconds that a side may take for one answer, compilation included."""


class Failed(Exception):
    """A side that ended without an answer, or gave none in time."""


class Running:
    """One side, one task, one number of threads and of steps a tick; a context that ends the process."""

    def __init__(self, side: Side, task: Path, threads: int, steps: int) -> None:
        self.side, self.steps = side, steps
        cores = sorted(os.sched_getaffinity(0))[:threads]
        names = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")
        environment = {
            **os.environ,
            **{name: str(threads) for name in names},
            "PYTHONPATH": str(ROOT),
            "PEERS_CACHE": str(CACHE),
            **({} if side.width is None else {"C_LANES": str(side.width)}),
            "JAX_PLATFORMS": "cpu",
            "JAX_COMPILATION_CACHE_DIR": str(CACHE / f"xla-{threads}"),  # what is compiled depends on the cores seen
            "JAX_PERSISTENT_CACHE_MIN_COMPILE_TIME_SECS": "0",
        }
        self.process = subprocess.Popen(
            [python_of(side.venv), str(HERE / "worker.py"), side.module, str(task), str(steps), str(threads)],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, env=environment, cwd=CACHE,
            stderr=subprocess.DEVNULL if not os.environ.get("PEERS_DEBUG") else None,
            preexec_fn=lambda: os.sched_setaffinity(0, cores),
        )  # fmt: skip

    def ask(self, lanes: int, ticks: int, repeats: int = 1, theta: bool = False) -> dict[str, Any]:
        """Seconds of `repeats` rollouts of `ticks` control periods, and the first lane's motion if asked for.

        Failed where the process ended or the answer takes longer than PATIENCE.
        """
        assert self.process.stdin is not None
        request = {"lanes": lanes, "ticks": ticks, "repeats": repeats, "theta": theta}
        try:
            self.process.stdin.write(json.dumps(request).encode() + b"\n")
            self.process.stdin.flush()
        except BrokenPipeError:
            pass  # what is missing is the answer
        answer: dict[str, Any] = json.loads(self._line())
        return answer

    def _line(self) -> bytes:
        assert self.process.stdout is not None
        line, due = b"", time.monotonic() + PATIENCE
        with selectors.DefaultSelector() as selector:
            selector.register(self.process.stdout, selectors.EVENT_READ)
            while not line.endswith(b"\n"):
                if not selector.select(max(0.0, due - time.monotonic())):
                    raise Failed(f"no answer in {PATIENCE:.0f} s")
                got = os.read(self.process.stdout.fileno(), 1 << 16)
                if not got:
                    raise Failed("ended without an answer (PEERS_DEBUG=1 shows its messages)")
                line += got
        return line

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.process.kill()
        self.process.wait()
