"""The person beside a real wrist: told what to do, and asked before anything moves."""

from __future__ import annotations

from collections.abc import Callable

import typer

from wristctl.cli.command import Session
from wristctl.config.errors import UserError


def operator(session: Session) -> Callable[[str], None]:
    """Asks on the terminal, and takes nothing but yes; with --yes everything counts as done."""

    def ask(what: str) -> None:
        with session.console.aside():
            typer.echo(what, err=True)
            if "yes" in session.flags:
                return
            if typer.prompt("Type yes to go on", default="no", show_default=False, err=True) != "yes":
                raise UserError("nothing was moved further", fix="type yes, or --yes for scripted use", exit_code=3)

    return ask
