"""The options that the `hw` commands share, and how they show what a board says of itself."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

Port = Annotated[
    str | None,
    typer.Option("--port", help="Serial port, socket://host:port, or emulated; without it the only board found."),
]
Baud = Annotated[int, typer.Option("--baud", help="Of the serial line.")]
Image = Annotated[Path | None, typer.Option("--image", help="Another program than the packaged firmware (Intel hex).")]

BAUD = 250_000


def facts_of(values: dict[str, Any]) -> dict[str, Any]:
    """Names for states, faults and flags; why the board started in words; the dictionary in hex."""
    from wristctl.board.messages import RESET_MEANING, Reset

    named = {key: value.name or "none" if hasattr(value, "name") else value for key, value in values.items()}
    if isinstance(cause := values.get("reset_cause"), Reset):
        why = [RESET_MEANING[each] for each in cause & ~Reset.WARM] or ["hidden by the boot loader"]
        named["reset_cause"] = "; ".join(why + [RESET_MEANING[Reset.WARM]] * (Reset.WARM in cause))
    return {**named, "dictionary": f"{values['dictionary']:08x}", "firmware": ".".join(map(str, values["firmware"]))}
