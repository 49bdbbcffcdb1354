"""`wristctl runs sign`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from wristctl.cli.options import Debug, Out
from wristctl.cli.runs.run_options import RESULTS, Ref
from wristctl.cli.say import say
from wristctl.records import open_run
from wristctl.records.signature import sign as sign_run

KEY = Path("~/.ssh/id_ed25519")


def sign(
    ref: Ref,
    key: Annotated[
        Path, typer.Option("--key", help="Your private SSH key; where an agent holds it, the public one.")
    ] = KEY,
    out: Out = RESULTS,
    debug: Debug = False,
) -> None:
    """Sign a run: with your SSH key, over the hashes of all its files. `verify --signed` checks it."""
    run = open_run(ref, out)
    made = sign_run(run, key.expanduser())
    say(f"{run.id}  signed with {made.key}")
