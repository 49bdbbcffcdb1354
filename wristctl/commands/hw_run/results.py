"""Trials on a rig as a result: their metrics beside a simulation of the same trials and the paper's experiment."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.course_table import course_of_log
from wristctl.commands.hw_run.answer import answer_of, marks_of
from wristctl.commands.hw_run.trial_means import (
    ELLIPSE,
    OF_MEANS,
    completed,
    known_means,
    means,
    quantities,
    with_simulation,
)
from wristctl.commands.quantities import table_of
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.control.table import Gains
    from wristctl.simulation.repetitions import Simulation
    from wristctl.wrist.kinematics import Inverse

# Quantities of the table of trials.
_OF_A_TRIAL = (
    "trial", "direction", "push", "label", "rmse_ulnar", "rmse_flexion", "rmse", "true_rmse_ulnar", "true_rmse_flexion",
    "true_rmse", *ELLIPSE, "largest_error", "steady_state", "overshoot", "swing", "true_swing", "settling", "recovery",
    "true_recovery", "peak_tension", "outcome",
)  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class Performed(StudyResult):
    """Trials on a rig in one plane or two, and the same in simulation."""

    kind = "hw-run"

    trials: pd.DataFrame
    twins: dict[int, Simulation]
    """by the trial's number"""
    tension_limit: float = math.inf
    """Tension [N] beyond which the trials would have been stopped."""
    expected_peak: float = math.inf
    """Largest tension [N] that they need in simulation; infinite where none says so."""

    @property
    def answer(self) -> Answer:
        """Error by motion, settling and recovery, and how far simulation agrees."""
        tensions = self.tension_limit, self.expected_peak
        return answer_of(self.trials, self.twins, self.metrics, self.marks, self.place, *tensions)

    @property
    def marks(self) -> list[str]:
        """What the wrist does wrong in trials that ended well: `marks_of`."""
        from wristctl.trial.rig_belief import layout_of_rig, numbers_of

        settings, wrist = self.study.hw_run, self.study.wrist
        places = 2 if settings.planes == 1 else len(numbers_of(layout_of_rig(settings, wrist)))
        return marks_of(self.trials, self.twins, wrist.tension_range, places)

    @property
    def course(self) -> pd.DataFrame:
        """Every tick of every trial: trial, time, bend, reference, torque, tension, tip; SI units."""
        if self.run is None:
            raise RuntimeError("trials are logged in a run directory, and there is none")
        return course_of_log(self.run.data("log"), self.study.wrist)

    def frame(self) -> pd.DataFrame:
        """One row per trial that began."""
        return self.trials


def performed(session: Session, trials: pd.DataFrame, network: Inverse | None, tuned: Gains | None) -> Performed:
    """Tables of all trials that ended well, with metrics and figures, and the simulation of each."""
    import pandas as pd

    from wristctl.commands.hw_run.figures import draw_trials

    findings, done = session.findings, completed(trials)
    twins = twins_of(session, done, network, tuned)
    theirs = bool((done["controller"] == "smc").any())
    labels = [row.label for row in session.study.hw_run.rows]
    compared = with_simulation(done, twins)
    rows = [*_means_kept(findings, compared, labels), *(_papers() if theirs else ())]
    with session.drawing():
        draw_trials(session, done, twins)
    title = "Means over the trials" + ", beside the paper's experiment with the same law" * theirs
    # of a real rig nothing is true, and without a push nothing recovers
    measured = (name for name in known_means(compared) if any(pd.notna(row.get(name)) for row in rows))
    columns = ("label", "trials", *measured)
    of_trials = [name for name in _OF_A_TRIAL if name in done]
    tables = [
        table_of(title, quantities(columns), rows),
        table_of("Trials, in the order done", quantities(of_trials), done[of_trials].to_dict("records")),
    ]
    findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "true_rmse", "settling", "pushed_true_rmse")
    return Performed(session.study, findings, tables, trials, twins)


def twins_of(
    session: Session, done: pd.DataFrame, network: Inverse | None, tuned: Gains | None
) -> dict[int, Simulation]:
    """Simulation of every trial that ended well, by its number, whose motors are asked for no more than in the trial.
    Repetitions share one."""
    from wristctl.trial.experiment import spared
    from wristctl.trial.trial_results import twin
    from wristctl.trial.trials import Trial

    study = session.study.model_copy(update={"wrist": spared(session.study.wrist, session.study.hw_run)})
    names = [row.label for row in session.study.hw_run.rows]
    simulated: dict[tuple[Any, ...], Simulation] = {}
    twins = {}
    with session.progress("simulating the same trials"):
        for row in done.to_dict("records"):
            key = row["direction"], row["push"], row["label"]
            seen = not math.isfinite(row.get("true_rmse", math.nan))
            if key not in simulated:
                trial = Trial(row["trial"], row["direction"], 0, row["push"], names.index(row["label"]))
                simulated[key] = twin(study, trial, network, tuned, seen=seen)
            twins[row["trial"]] = simulated[key]
    return twins


def _means_kept(findings: Findings, trials: pd.DataFrame, labels: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Means for each controller with and without a push, each number a metric; what follows a push only with one."""
    for label, pushed in ((label, pushed) for pushed in (False, True) for label in labels):
        group = trials[(trials["label"] == label) & ((trials["push"] != 0.0) == pushed)]
        if group.empty:
            continue
        values = means(group)
        for quantity in quantities(name for name in OF_MEANS if name in values):
            if quantity.name.endswith("recovery") and not pushed:
                continue
            whose = [label.replace("/", "-").replace(" ", "-")] if len(labels) > 1 else []
            name = "_".join([*["pushed"] * pushed, quantity.name, *whose])
            of = quantity.meaning or "mean"
            meaning = f"{of} over trials{' with a push' * pushed}, {label}"
            value, aimless = values[quantity.name], quantity.name.endswith("error_toward")
            findings.metric(name, value, quantity.unit, "" if aimless else "lower", n=len(group), meaning=meaning)
        yield {"label": f"{label}{', pushed' * pushed}", **values}


def _papers() -> Iterator[dict[str, Any]]:
    """Hardware results of the paper's own law."""
    from wristctl.comparison.paper import EXPERIMENT

    for name, printed in EXPERIMENT.items():
        count = 4 if name == "four directions" else 1
        numbers = {"rmse": printed.rmse, "steady_state": printed.steady_state, "settling": printed.settling}
        yield {"label": f"paper: {name}", "trials": count, **numbers}
