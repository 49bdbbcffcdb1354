"""The person at the terminal: told what goes on and what to do, and asked before anything moves."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from dataclasses import dataclass
from typing import TYPE_CHECKING

import typer

from wristctl.cli.progress import PLAIN, Terminal
from wristctl.cli.typed import idle, typed_line
from wristctl.config.errors import UserError
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.trial.control_loop import Shown
    from wristctl.trial.patience import Meanwhile
    from wristctl.trial.trials import Trial

YES = {"yes": "Ask nobody before the motors of real hardware move."}
"""The flag of commands that move motors, and its help."""


@dataclass(frozen=True)
class TerminalOperator:
    """Whoever typed the command; with the flag `yes` everything counts as agreed to."""

    console: Terminal
    quiet: bool
    flags: frozenset[str]
    """those of the command's flags that were given"""

    def tell(self, text: str) -> None:
        """A text on stderr, also when the command is to be quiet."""
        self.console.print(text, **PLAIN)

    def confirm(self, what: str, meanwhile: Meanwhile | None = None) -> None:
        """Asks on the terminal, and takes nothing but yes."""
        with self.console.aside():
            typer.echo(what, err=True)
            if "yes" in self.flags:
                return
            typer.echo("Type yes to go on: ", nl=False, err=True)
            if typed_line(meanwhile or idle) != "yes":
                raise UserError("nothing was moved further", fix="type yes, or --yes for scripted use", exit_code=3)

    def dare(self, what: str) -> None:
        """Only with the flag `force`."""
        if "force" not in self.flags:
            raise UserError(what, "hw-run.rows", "other gains, or go on with --force", exit_code=3)
        self.tell(what)

    def wait_for(self, what: str) -> None:
        """Waits for Enter."""
        typer.prompt(what, default="", show_default=False, err=True)

    def watch(self, trials: Sequence[Trial], session: Session) -> AbstractContextManager[Shown]:
        """The trials in a live panel on a terminal, as plain lines elsewhere."""
        from wristctl.cli.trial_panel import panel_shown, trials_counted

        live = self.console.is_terminal and not self.quiet
        return panel_shown(self.console, trials) if live else trials_counted(session, trials)
