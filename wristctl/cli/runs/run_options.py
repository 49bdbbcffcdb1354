"""The options and arguments that the `runs` commands share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.completion import run_ids

RESULTS = Path("results")

Ref = Annotated[
    str,
    typer.Argument(
        metavar="RUN", help="Path, id, beginning of an id, latest:KIND or latest:KIND:LABEL.", autocompletion=run_ids
    ),
]
Refs = Annotated[
    list[str],
    typer.Argument(
        metavar="RUN...",
        help="Paths, ids, beginnings of ids, latest:KIND or latest:KIND:LABEL.",
        autocompletion=run_ids,
    ),
]
