"""Session of a study: inputs, findings, progress and operator."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from wristctl.commands.answer import Answer
from wristctl.commands.inputs import Inputs
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.config.study import Study
from wristctl.errors import UserError

if TYPE_CHECKING:
    from wristctl.trial.control_loop import Shown
    from wristctl.trial.supervised_wait import Meanwhile
    from wristctl.trial.trials import Trial


class Done(Protocol):
    """Called with how much is done by now, how much of it an earlier run had done, and figures to show beside it."""

    def __call__(self, count: int = 0, kept: int = 0, **figures: float) -> None:
        """Say it."""


# Notes an event by its name, with fields.
Event = Callable[..., None]


class ShowProgress(Protocol):
    """Display of the progress of a task while a block works on it; notes it as events."""

    def __call__(
        self, event: Event, task: str, total: int | None, unit: str, then: float = 0.0, after: float = 0.0
    ) -> AbstractContextManager[Done]:
        """Begin to show `task`; without a `total` its length is unknown."""


class Operator(Protocol):
    """The person at the rig, or whoever else watches."""

    def tell(self, text: str) -> None:
        """Show a text that is no part of the result."""

    def confirm(self, action: str, meanwhile: Meanwhile | None = None) -> None:
        """Ask for agreement to `action`, and return once it is given. Raises UserError where it is refused.

        Until then `meanwhile` is called again and again: what it raises ends the question.
        """

    def dare(self, action: str) -> None:
        """Allow an action that is unsafe on hardware. Raises UserError unless the operator has forced it."""

    def wait_for(self, action: str) -> None:
        """Ask the operator for `action`, and return once it is done."""

    def watch(self, trials: Sequence[Trial], session: Session) -> AbstractContextManager[Shown]:
        """Show the trials while a block performs them: it yields what each tick is handed to."""


@dataclass(frozen=True)
class Session:
    """The study with its inputs named for good, the inputs, where findings go, and who is told or asked meanwhile."""

    study: Study
    inputs: Inputs
    findings: Findings
    show: ShowProgress
    operator: Operator
    executor: str = "serial"
    """Who does units of work, as `--executor` names it: what is found does not depend on it."""
    typed: Sequence[str] = ()
    """The study's files and settings as the command line had them, for commands that are advised."""

    def progress(
        self, task: str, total: int | None = None, unit: str = "", then: float = 0.0, after: float = 0.0
    ) -> AbstractContextManager[Done]:
        """Show the progress of `task`: a context manager that yields `done(count, **figures)`.

        The time left is that of the command: what it takes after the task is `then` times the task's own time, and
        `after` [s], which does not grow with the task.
        """
        return self.show(self.findings.event, task, total, unit, then, after)

    def tell_refused(self, answer: Answer, tables: Sequence[Table] = ()) -> None:
        """Tell the answer of a result that is refused, and keep it with its tables in the run's README."""
        text = "\n".join(answer.lines())
        parts = [text, *(table.text() for table in tables)]
        self.findings.summary("\n\n".join(f"```\n{part}\n```" for part in parts))
        self.operator.tell(text)

    @contextmanager
    def drawing(self) -> Iterator[None]:
        """Show that a block draws; where it fails, what was computed stands without its further figures."""
        with self.progress("drawing"), self.findings.drawing():
            yield


class Unattended:
    """Shows nothing, and agrees to nothing."""

    def tell(self, text: str) -> None:
        """Nobody to tell."""

    def confirm(self, action: str, meanwhile: Meanwhile | None = None) -> None:
        """Raises UserError."""
        raise UserError(f"nobody is there to agree to this: {action}", fix="use the command line", exit_code=3)

    def dare(self, action: str) -> None:
        """Raises UserError."""
        self.confirm(action)

    def wait_for(self, action: str) -> None:
        """Raises UserError."""
        self.confirm(action)

    @contextmanager
    def watch(self, trials: Sequence[Trial], session: Session) -> Iterator[Shown]:
        """The ticks are looked at by nobody."""
        yield lambda row: None
