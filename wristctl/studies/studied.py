"""What the study of all laws found."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.errors import UserError
from wristctl.studies.fair_units import StudyPlace
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.comparison.order_shifts import OrderShift
    from wristctl.comparison.term_values import TermValue
    from wristctl.comparison.world_ranking import WorldRanking
    from wristctl.tuning.search import Search
    from wristctl.work.fan_out import Poisoned


@dataclass(frozen=True, repr=False, eq=False)
class Studied(StudyResult):
    """All laws on all families."""

    kind = "study"

    answer: list[str]
    """Which law for which rig, what each term buys, and how far the order can be relied on: lines of 100 columns."""
    rankings: dict[str, WorldRanking]
    """By family."""
    searches: dict[StudyPlace, Search]
    terms: list[TermValue]
    shifts: list[OrderShift]
    poisoned: list[Poisoned]
    """Units that failed wherever they were tried: their rows are left out."""

    @property
    def fault(self) -> UserError | None:
        """That units were given up."""
        if not self.poisoned:
            return None
        first, where = self.poisoned[0], str(self.findings.run.path) if self.findings.run else ""
        others = f" and {len(self.poisoned) - 1} more" if len(self.poisoned) > 1 else ""
        what = f"{first.unit.name}{others} failed wherever tried, and is left out: {first.why}"
        return UserError(what, where, "mend it and resume: what is done is kept", exit_code=3)

    def frame(self) -> pd.DataFrame:
        """A row per family and row of its ranking, best first; angles in rad."""
        import pandas as pd

        from wristctl.comparison.world_ranking import ranking_frame

        tables = {name: ranking_frame(found) for name, found in self.rankings.items()}
        return pd.concat(tables, names=["family"]).reset_index("family").reset_index(drop=True)
