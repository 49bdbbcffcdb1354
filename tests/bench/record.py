"""What a bench in real time leaves behind, as tests read it."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any


def wait_for(what: Callable[[], Any], patience: float = 60.0) -> Any:
    """What it gives once that is true."""
    until = time.monotonic() + patience
    while not (got := what()):
        assert time.monotonic() < until, "waited in vain"
        time.sleep(0.02)
    return got


def read(record: Path) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(record.read_text()) if record.exists() else {}
    return told


def last_step(told: dict[str, Any]) -> float:
    return max((at for at in told.get("last_step", ()) if at is not None), default=0.0)


def is_released(told: dict[str, Any]) -> bool:
    return last_step(told) > 0.0 and not any(told["energised"])
