"""What a study found, as it is handed out."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, ClassVar

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Figures, Findings

if TYPE_CHECKING:
    import pandas as pd


@dataclass(frozen=True, repr=False, eq=False)
class StudyResult(ABC):
    """A study's metrics, tables and figures; each kind of study adds what else it found.

    The same with and without a run directory.
    """

    kind: ClassVar[str]
    """The command that makes such a result."""

    study: Study
    """As it was performed: inputs that have a run directory are named in it."""
    findings: Findings
    tables: Sequence[Table]
    """What the command prints."""

    @abstractmethod
    def frame(self) -> pd.DataFrame:
        """The main table."""

    @property
    def fault(self) -> UserError | None:
        """What the command ends with although the study was done: a result that cannot stand; None where it can."""
        return None

    @property
    def summary(self) -> Sequence[str]:
        """What was found in a few lines of at most 100 columns, as its `answer`; empty where the tables are that."""
        answer = getattr(self, "answer", ())
        return answer if isinstance(answer, list) else ()

    @property
    def marks(self) -> list[str]:
        """Why a result is no good, in a word or two each: the verdict on the run's page; empty where it is sound."""
        return []

    @property
    def remark(self) -> bool:
        """Whether the summary only introduces the tables, which are printed all the same."""
        return False

    @property
    def metrics(self) -> dict[str, float]:
        """Numbers by name, in the units that the run's metrics.json gives; nan where there is none."""
        known = {name: each["value"] for name, each in self.findings.metrics.items()}
        return {name: math.nan if value is None else value for name, value in known.items()}

    @property
    def figures(self) -> Figures:
        """matplotlib figures by name, each drawn when it is first asked for."""
        return self.findings.figures

    @cached_property
    def run(self) -> Run | None:
        """The sealed run directory; None where the result is in memory only."""
        return Run(self.findings.run.path) if self.findings.run else None

    def __str__(self) -> str:
        return "\n\n".join([*["\n".join(self.summary)] * bool(self.summary), *(table.text() for table in self.tables)])

    def __repr__(self) -> str:
        where = str(self.findings.run.path) if self.findings.run else "in memory"
        return f"<{type(self).__name__}: {where}; {len(self.metrics)} metrics; {self.figures!r}>"
