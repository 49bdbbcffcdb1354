"""What a simulated loop is as a result: its answer, its fault, its marks, and the table of its metrics."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.course_table import course_of_trajectory
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings, StudyResult
from wristctl.errors import UserError

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.config.study import Study
    from wristctl.simulation.repetitions import Repeated
    from wristctl.simulation.trajectory import Trajectory


# Names of the table of a trajectory, by planes.
_TABLES = {1: "trajectory", 2: "bends"}


@dataclass(frozen=True, repr=False, eq=False)
class Simulated(StudyResult):
    """One closed loop, as often as the study says."""

    kind = "simulate"

    repeated: Repeated
    """Metrics of every repetition."""
    short_of: str = ""
    """Reason why the loop does not arrive at its reference; empty where it does."""
    advice: Sequence[str] = ()
    """What may help where it does not: sentences, and a command after `$ `."""
    simulated: Study | None = None
    """Study with the identified wrist, motors and sensor in it; None: `study`."""
    wrist: str = ""
    """The wrist in words, where it was identified."""

    @property
    def trajectory(self) -> Trajectory:
        """Trajectory of the first repetition."""
        return self.repeated.first.trajectory

    @property
    def answer(self) -> Answer:
        """The scenario and how it ends; why a loop does not arrive, and what may help."""
        from wristctl.commands.simulate.answer import answer

        return answer(self.simulated or self.study, self.repeated, self.short_of, self.advice, self.wrist)

    @property
    def course(self) -> pd.DataFrame:
        """The motion: time, bend, reference, torque, tension, tip; SI units."""
        return course_of_trajectory(self.trajectory)

    def courses(self) -> Mapping[str, Mapping[str, Any]]:
        """The columns of the trajectory, by the name of its table."""
        return {_TABLES[self.trajectory.planes]: self.trajectory.columns()}

    def frame(self) -> pd.DataFrame:
        """Every column of the trajectory; SI units."""
        return self.trajectory.frame()

    @property
    def failed(self) -> bool:
        """Whether the wrist left its range in any repetition."""
        return bool(self.repeated.failed.any())

    @property
    def fault(self) -> UserError | None:
        """Error of a wrist that left its range; None where it stayed within."""
        if not self.failed:
            return None
        fix = "look at the figures; try other gains or a slower motion"
        return UserError(f"the wrist {self.repeated.failure}", self.place, fix, exit_code=3)

    @property
    def marks(self) -> list[str]:
        """Verdicts on the loop: failed, does not arrive, limit cycle, chatters, not physical, not converged."""
        return self.repeated.marks


def trajectory_table(findings: Findings, course: Trajectory) -> None:
    """Keep a trajectory in the run, with unit and meaning of each column."""
    from wristctl.simulation.trajectory import meanings

    columns = course.columns()
    told = meanings(list(columns))
    units, meaning = ({name: column[i] for name, column in told.items()} for i in range(2))
    findings.table(f"data/{_TABLES[course.planes]}.csv", columns, units=units, meaning=meaning)


def metrics_table(findings: Findings, title: str, repeated: Repeated) -> Table:
    """Every metric, kept in the run: its value, or of several repetitions the median with its 95 % interval."""
    import numpy as np

    from wristctl.comparison.repetition_spread import spread
    from wristctl.simulation.metrics import metrics_in

    metrics, several = metrics_in(repeated.first.trajectory.planes), len(repeated.failed) > 1
    rows = list[tuple[object, ...]]()
    for name, metric in metrics.items():
        found = spread(repeated.metrics[name])
        value = found.median if several else float(repeated.metrics[name][0])
        meaning = metric.formula + "; median" * several
        findings.metric(name, value, metric.unit, "lower", found.n, found.interval, meaning)
        rows.append((name, value, *found[1:3] * several, metric.unit, metric.formula))
    if not several:
        return Table(title, ("metric", "value", "unit", "meaning"), rows)
    every = {"repetition": np.arange(len(repeated.failed)), "failed": repeated.failed, **repeated.metrics}
    findings.table("data/repetitions.csv", every, {name: metric.unit for name, metric in metrics.items()})
    heads = ("metric", "median", "95 % low", "95 % high", "unit", "meaning")
    return Table(f"{title}, {len(repeated.failed)} repetitions", heads, rows)
