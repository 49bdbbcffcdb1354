"""What a bench in real time leaves behind, as tests read it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any


def read(record: Path) -> dict[str, Any]:
    told: dict[str, Any] = json.loads(record.read_text()) if record.exists() else {}
    return told


def last_step(told: dict[str, Any]) -> float:
    return max((at for at in told.get("last_step", ()) if at is not None), default=0.0)


def is_released(told: dict[str, Any]) -> bool:
    return last_step(told) > 0.0 and not any(told["energised"])
