"""The person at the terminal: told what goes on and what to do, and asked before anything moves."""

from __future__ import annotations

import io
import os
import select
import sys
import time
from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from wristctl.cli.progress import PLAIN, Terminal
from wristctl.commands.session import Session
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.trial.control_loop import Shown
    from wristctl.trial.supervised_wait import Meanwhile
    from wristctl.trial.trials import Trial


_MOMENT = 0.02


def typed_line(meanwhile: Meanwhile, ended: str = "") -> str:
    """The next line of stdin, its end cut off; `ended` where stdin has ended.

    `meanwhile` is called until the line is there, and may raise: reading never waits, not even for half a line.
    """
    try:
        stdin = sys.stdin.fileno()
    except (io.UnsupportedOperation, ValueError):  # no file of the system: what is in it has come already
        return (sys.stdin.readline() or ended).rstrip("\r\n")
    typed = bytearray()
    while not typed.endswith(b"\n"):
        if not select.select([stdin], [], [], 0.0)[0]:
            meanwhile()
        elif byte := os.read(stdin, 1):
            typed += byte
        else:
            break
    return typed.decode(errors="replace").rstrip("\r\n") if typed else ended


def idle() -> None:
    """A moment in which nothing else goes on."""
    time.sleep(_MOMENT)


@dataclass(frozen=True)
class TerminalOperator:
    """Person at the terminal. With the flag `yes` every question counts as agreed to."""

    console: Terminal
    quiet: bool
    flags: frozenset[str]
    """those of the command's flags that were given"""

    def tell(self, text: str) -> None:
        """A text on stderr, also when the command is to be quiet."""
        self.console.print(text, **PLAIN)

    def confirm(self, question: str, meanwhile: Meanwhile | None = None) -> None:
        """Asks on the terminal, and takes nothing but yes."""
        with self.console.aside():
            typer.echo(question, err=True)
            if "yes" in self.flags:
                return
            typer.echo("Type yes to go on: ", nl=False, err=True)
            if typed_line(meanwhile or idle) != "yes":
                raise UserError("nothing was moved further", fix="type yes, or --yes for scripted use", exit_code=3)

    def dare(self, danger: str, where: str, fix: str) -> None:
        """Only with the flag `force`."""
        if "force" not in self.flags:
            raise UserError(danger, where, f"{fix}, or go on with --force", exit_code=3)
        self.tell(danger)

    def wait_for(self, request: str) -> None:
        """Waits for Enter."""
        typer.prompt(request, default="", show_default=False, err=True)

    def watch(self, trials: Sequence[Trial], session: Session) -> AbstractContextManager[Shown]:
        """The trials in a live panel on a terminal, as plain lines elsewhere."""
        from wristctl.cli.trial_panel import panel_shown, trials_counted

        live = self.console.is_terminal and not self.quiet
        return panel_shown(self.console, trials) if live else trials_counted(session, trials)
