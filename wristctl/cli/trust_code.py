"""Whether a person lets code run that came with a run."""

from __future__ import annotations

import sys

import typer

from wristctl.cli.typed import idle, typed_line


def asked_to_trust(given: bool, shown: str) -> bool:
    """Shows what would run; yes where --trust-code was `given`, or where it is typed at a terminal, and never else."""
    typer.echo(shown, err=True)
    if given or not sys.stdin.isatty():
        return given
    typer.echo("Read it. Type yes to let it run: ", nl=False, err=True)
    return typed_line(idle) == "yes"
