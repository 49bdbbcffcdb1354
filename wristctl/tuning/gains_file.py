"""The file of tuned gains: data/gains.json of a tune run, {controller: {gain: value}}."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from wristctl.config.errors import UserError
from wristctl.config.wording import Call
from wristctl.records.files import write_text

Gains = Mapping[str, Mapping[str, float]]


def write_gains(path: Path, gains: Gains) -> None:
    """Write gains by controller and name; floats round-trip exactly."""
    write_text(path, json.dumps(gains, indent=2) + "\n")


def read_gains(path: Path) -> Gains:
    """Read a file of tuned gains; UserError if it is none."""
    try:
        gains = json.loads(path.read_bytes())
        return {str(name): {str(k): float(v) for k, v in each.items()} for name, each in gains.items()}
    except (OSError, ValueError, AttributeError, TypeError) as error:
        raise UserError("not a file of tuned gains", str(path), ("name a run of `", Call("tune"), "`")) from error
