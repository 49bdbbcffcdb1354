"""Work for the tests of units: it can be slow, fail, kill its worker, or differ from one machine to another."""

from __future__ import annotations

import os
import signal
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np


def walk(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """A random walk of its own stream."""
    time.sleep(spec.get("takes", 0.0))
    rng = np.random.default_rng(spec["seed"])
    return {"walk": rng.standard_normal(spec["steps"]).cumsum(), "at": np.array(spec["seed"])}


_furnished: list[int] = []


def furnish(spec: Mapping[str, Any]) -> None:
    """Leave in this process what `fetched` needs."""
    _furnished.append(spec["left"])


def fetched(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """What was left there, and how often."""
    return {"left": np.array(_furnished), "asked": np.array(spec["asked"])}


def fail(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Never comes to an end; notes each try."""
    with Path(spec["tries"]).open("a") as file:
        file.write("x")
    raise ArithmeticError(f"no walk from {spec['seed']}")


def fail_once(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """As walk, the second time."""
    file = Path(spec["tries"])
    if not file.exists():
        file.write_text("x")
        raise OSError(28, "No space left on device")
    return walk(spec)


def die(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """Takes its worker with it."""
    with Path(spec["tries"]).open("a") as file:
        file.write("x")
    time.sleep(0.05)
    os.kill(os.getpid(), signal.SIGKILL)
    return {}


def constant(spec: Mapping[str, Any]) -> str:
    """The same everywhere."""
    return f"golden {spec}"


def process(spec: Mapping[str, Any]) -> str:
    """Another in every process."""
    return f"golden of {os.getpid()}"


def threads() -> Any:
    """An executor of one's own."""
    from concurrent.futures import ThreadPoolExecutor

    return ThreadPoolExecutor(2)


def no_executor() -> str:
    """Nothing that could work."""
    return "nobody"
