"""A study as it can be called for: the earlier runs that it reads, what it would do, and the doing."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Generic, TypeVar

from wristctl.config.keys import SUBJECTS
from wristctl.config.study import Study
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    from wristctl.simulation.size import Size

Found = TypeVar("Found", bound=StudyResult)


@dataclass(frozen=True)
class Procedure(Generic[Found]):
    """What a command does with its section of a study. Its docstring is that of `perform`."""

    kind: str
    """The command's name, and its runs' kind."""
    plan: Callable[[Study, Inputs], str]
    """Says what will be done; raises UserError for what can be known before anything is computed or written."""
    perform: Callable[[Session], Found]
    """Computes; writes what it finds where the session's findings have a run directory."""
    needs: tuple[EarlierRun, ...] = ()
    in_units: bool = False
    """Whether it works in units, which other processes and machines may do."""
    doubts: Callable[[Study, Inputs], None] | None = None
    """Raises UserError for what the command does not do without `--force`."""
    size: Callable[[Study], Size] | None = None
    """The rollouts that it asks for, where it can be done at many values of its settings."""

    @property
    def sweeps(self) -> bool:
        """Whether it can be done at many values of its settings."""
        return self.size is not None

    def section(self, study: Study) -> Any:
        """The section of a study that names what it reads."""
        return getattr(study, self.subject.replace("-", "_"))

    @property
    def subject(self) -> str:
        """The command in whose section that is: its own, or that of the one it works on."""
        return SUBJECTS.get(self.kind, self.kind)
