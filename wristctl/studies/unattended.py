"""A study performed by a script or notebook: nobody is at the rig."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING

from wristctl.config.errors import UserError
from wristctl.studies.session import Session

if TYPE_CHECKING:
    from wristctl.trial.control_loop import Shown
    from wristctl.trial.patience import Meanwhile
    from wristctl.trial.trials import Trial


class Unattended:
    """Shows nothing, and agrees to nothing."""

    def tell(self, text: str) -> None:
        """Nobody to tell."""

    def confirm(self, what: str, meanwhile: Meanwhile | None = None) -> None:
        """Raises UserError."""
        raise UserError(f"nobody is there to agree to this: {what}", fix="use the command line", exit_code=3)

    def dare(self, what: str) -> None:
        """Raises UserError."""
        self.confirm(what)

    def wait_for(self, what: str) -> None:
        """Raises UserError."""
        self.confirm(what)

    @contextmanager
    def watch(self, trials: Sequence[Trial], session: Session) -> Iterator[Shown]:
        """The ticks are looked at by nobody."""
        yield lambda row: None
