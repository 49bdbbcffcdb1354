"""Trials on a rig as a result: their metrics beside a simulation of the same trials and the paper's experiment."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.quantities import Quantity, table_of
from wristctl.commands.results import Findings, StudyResult
from wristctl.commands.session import Session

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.control.table import Gains
    from wristctl.simulation.repetitions import Simulation
    from wristctl.wrist.kinematics import Inverse

_QUANTITIES = {
    quantity.name: quantity
    for quantity in (
        Quantity("trial"),
        Quantity("label", heading="controller"),
        Quantity("direction", heading="motion"),
        Quantity("force", "N", heading="push"),
        Quantity("push", "N"),
        Quantity("trials"),
        Quantity("rmse_ulnar", "rad", heading="RMSE toward ulnar"),
        Quantity("rmse_flexion", "rad", heading="RMSE toward flexion"),
        Quantity("rmse", "rad", heading="RMSE"),
        Quantity("largest_error", "rad"),
        Quantity("steady_state", "rad"),
        Quantity("settling", "s"),
        Quantity("recovery", "s"),
        Quantity("overshoot", "%"),
        Quantity("swing", "rad", heading="swing at rest, peak to peak"),
        Quantity("peak_tension", "N"),
        Quantity("outcome"),
    )
}
# Metrics of which means are taken, by the log and truly; those also of the trials' simulation; and those of each trial.
_BY_LOG = ("rmse_ulnar", "rmse_flexion", "rmse", "steady_state", "settling", "recovery")
_OF_MEANS = (*_BY_LOG, "true_rmse_ulnar", "true_rmse_flexion", "true_rmse", "true_steady_state", "true_recovery")
_SIMULATED = ("rmse_ulnar", "rmse_flexion", "rmse", "steady_state")
_OF_A_TRIAL = (
    "trial", "direction", "push", "label", "rmse_ulnar", "rmse_flexion", "rmse", "true_rmse", "largest_error",
    "steady_state", "overshoot", "swing", "true_swing", "settling", "recovery", "true_recovery", "peak_tension",
    "outcome",
)  # fmt: skip


def quantities(names: Iterable[str]) -> list[Quantity]:
    """Quantities of trials by name, after `true_` of the true bend, after `simulated_` of the trials' simulation."""
    found = []
    for name in names:
        begin, _, rest = name.partition("_")
        if begin in ("true", "simulated"):
            of_log = _QUANTITIES[rest]
            heading = f"{begin} {of_log.heading.partition(',')[0] or rest.replace('_', ' ')}"
            found.append(replace(of_log, name=name, heading=heading))
        else:
            found.append(_QUANTITIES[name])
    return found


@dataclass(frozen=True, repr=False, eq=False)
class Performed(StudyResult):
    """Trials on a rig in one plane or two, and the same in simulation."""

    kind = "hw-run"

    trials: pd.DataFrame
    twins: dict[int, Simulation]
    """by the trial's number"""

    @property
    def answer(self) -> Answer:
        """Error by motion, settling and recovery, and how far simulation agrees."""
        from wristctl.commands.hw_run.answer import answer_of

        return answer_of(self.trials, self.twins, self.metrics, self.marks, self.place)

    @property
    def marks(self) -> list[str]:
        """What the wrist does wrong in trials that ended well: `marks_of`."""
        from wristctl.commands.hw_run.answer import marks_of
        from wristctl.trial.rig_belief import layout_of_rig, numbers_of

        settings, wrist = self.study.hw_run, self.study.wrist
        places = 2 if settings.planes == 1 else len(numbers_of(layout_of_rig(settings, wrist)))
        return marks_of(self.trials, self.twins, wrist.tension_range, places)

    def frame(self) -> pd.DataFrame:
        """One row per trial that began."""
        return self.trials


def performed(session: Session, trials: pd.DataFrame, network: Inverse | None, tuned: Gains | None) -> Performed:
    """Tables of all trials that ended well, with metrics and figures, and the simulation of each."""
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
    columns = ("label", "trials", *_known(compared))
    of_trials = [name for name in _OF_A_TRIAL if name in done]
    tables = [
        table_of(title, quantities(columns), rows),
        table_of("Trials, in the order done", quantities(of_trials), done[of_trials].to_dict("records")),
    ]
    if "rmse_ulnar" in done:
        findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "true_rmse", "pushed_true_rmse")
    return Performed(session.study, findings, tables, trials, twins)


def completed(trials: pd.DataFrame) -> pd.DataFrame:
    """Trials that ended well, with `label`, and their swings at rest from crest to crest [rad], by log and truly."""
    done = trials[trials["outcome"] == "ok"]
    swings = {f"{true}swing": 2.0 * done[f"{true}oscillation"] for true in ("", "true_")}
    return done.assign(label=done["controller"] + "/" + done["gains"], force=done["push"].abs(), **swings)


def twins_of(
    session: Session, done: pd.DataFrame, network: Inverse | None, tuned: Gains | None
) -> dict[int, Simulation]:
    """Simulation of every trial that ended well, by its number. Repetitions share one."""
    from wristctl.trial.trial_results import twin
    from wristctl.trial.trials import Trial

    names = [row.label for row in session.study.hw_run.rows]
    simulated: dict[tuple[Any, ...], Simulation] = {}
    twins = {}
    with session.progress("compiling and simulating the same trials"):
        for row in done.to_dict("records"):
            key = row["direction"], row["push"], row["label"]
            if key not in simulated:
                trial = Trial(row["trial"], row["direction"], 0, row["push"], names.index(row["label"]))
                simulated[key] = twin(session.study, trial, network, tuned)
            twins[row["trial"]] = simulated[key]
    return twins


def with_simulation(done: pd.DataFrame, twins: Mapping[int, Simulation]) -> pd.DataFrame:
    """The trials with the metrics of their simulation as `simulated_...`."""
    names = [name for name in _SIMULATED if name in done]
    courses = [twins[number].metrics for number in done["trial"]]
    return done.assign(**{f"simulated_{name}": [metrics[name] for metrics in courses] for name in names})


def _known(trials: pd.DataFrame) -> list[str]:
    return [name for name in (*_OF_MEANS, *(f"simulated_{name}" for name in _SIMULATED)) if name in trials]


def means(trials: pd.DataFrame) -> dict[str, float]:
    """Number of trials, and means of their metrics; nan where there is none, or where one of them has no value."""
    values = trials[_known(trials)].astype(float).mean(skipna=False)
    return {"trials": len(trials), **{str(name): float(value) for name, value in values.items()}}


def _means_kept(findings: Findings, trials: pd.DataFrame, labels: Sequence[str]) -> Iterator[dict[str, Any]]:
    """Means for each controller with and without a push, each number a metric; what follows a push only with one."""
    for label, pushed in ((label, pushed) for pushed in (False, True) for label in labels):
        group = trials[(trials["label"] == label) & ((trials["push"] != 0.0) == pushed)]
        if group.empty:
            continue
        values = means(group)
        for quantity in quantities(name for name in _OF_MEANS if name in values):
            if quantity.name.endswith("recovery") and not pushed:
                continue
            whose = [label.replace("/", "-").replace(" ", "-")] if len(labels) > 1 else []
            name = "_".join([*["pushed"] * pushed, quantity.name, *whose])
            meaning = f"mean over trials{' with a push' * pushed}, {label}"
            findings.metric(name, values[quantity.name], quantity.unit, "lower", n=len(group), meaning=meaning)
        yield {"label": f"{label}{', pushed' * pushed}", **values}


def _papers() -> Iterator[dict[str, Any]]:
    """Hardware results of the paper's own law."""
    from wristctl.comparison.paper import EXPERIMENT

    for name, printed in EXPERIMENT.items():
        count = 4 if name == "four directions" else 1
        numbers = {"rmse": printed.rmse, "steady_state": printed.steady_state, "settling": printed.settling}
        yield {"label": f"paper: {name}", "trials": count, **numbers}
