"""Tables and figures of hw-run: beside the paper's experiment and a simulation of the same trials."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from wristctl.commands.hw_run import figures as trial_figures
from wristctl.commands.hw_run.answer import completed
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.comparison.paper import EXPERIMENT
from wristctl.control.table import Gains
from wristctl.simulation.repetitions import Simulation
from wristctl.trial.trial_results import twin
from wristctl.trial.trials import Trial
from wristctl.wrist.directions import ACTIVE, DIRECTIONS
from wristctl.wrist.kinematics import Inverse

# The simulation of each trial, by its number.
Twins = dict[int, Simulation]

_MEANS = {
    "rmse": "rad", "steady_state": "rad", "settling": "s", "recovery": "s", "true_rmse": "rad",
    "true_steady_state": "rad",
}  # fmt: skip
_COLUMNS = (
    "", "trials", "RMSE [rad]", "steady state [rad]", "settling [s]", "recovery [s]", "true RMSE [rad]",
    "true steady state [rad]", "simulated RMSE [rad]", "simulated steady state [rad]",
)  # fmt: skip
_BY_TRIAL = {
    "trial": "trial", "direction": "direction", "push": "push [N]", "label": "controller", "rmse": "RMSE [rad]",
    "steady_state": "steady state [rad]", "settling": "settling [s]", "recovery": "recovery [s]",
    "overshoot": "overshoot [%]", "swing": "swing at rest, peak to peak [rad]",
    "true_swing": "true swing [rad]", "peak_tension": "peak tension [N]", "outcome": "outcome",
}  # fmt: skip


def trial_tables(
    session: Session, trials: pd.DataFrame, network: Inverse | None, tuned: Gains | None
) -> tuple[list[Table], Twins]:
    """Tables of all trials that ended well, with metrics and figures, and the simulation of each."""
    trials = completed(trials)
    twins = twins_of(session, trials, network, tuned)
    theirs = bool((trials["controller"] == "smc").any())
    labels = [row.label for row in session.study.hw_run.rows]
    means = means_of_trials(session.findings, trials, labels, twins, _MEANS, ("rmse", "steady_state"))
    rows = [*means, *(_papers() if theirs else ())]
    by_trial = Table("Trials, in the order done", list(_BY_TRIAL.values()), trials[list(_BY_TRIAL)].to_numpy().tolist())
    with session.drawing():
        _draw(session, trials, twins)
    title = "Means over the trials" + ", beside the paper's experiment with the same law" * theirs
    return [Table(title, _COLUMNS, rows), by_trial], twins


def twins_of(session: Session, done: pd.DataFrame, network: Inverse | None, tuned: Gains | None) -> Twins:
    """Simulation of every trial that ended well. Repetitions share one."""
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


def means_of_trials(
    findings: Findings, done: pd.DataFrame, labels: Sequence[str], twins: Twins, units: Mapping[str, str],
    simulated: Sequence[str],
) -> Iterator[tuple[Any, ...]]:  # fmt: skip
    """A row for each controller with and without a push: number of trials, means of the metrics that have units here,
    and means of those `simulated`. A metric for each number; what follows a push only with one."""
    for label, pushed in ((label, pushed) for pushed in (False, True) for label in labels):
        group = done[(done["label"] == label) & ((done["push"] != 0.0) == pushed)]
        if group.empty:
            continue
        means = {name: float(group[name].mean(skipna=False)) for name in units}
        model = [float(np.mean([twins[number].metrics[name] for number in group["trial"]])) for name in simulated]
        for name, unit in units.items():
            if name.endswith("recovery") and not pushed:
                continue
            whose = [label.replace("/", "-").replace(" ", "-")] if len(labels) > 1 else []
            full = "_".join([*["pushed"] * pushed, name, *whose])
            meaning = f"mean over trials{' with a push' * pushed}, {label}"
            findings.metric(full, means[name], unit, "lower", n=len(group), meaning=meaning)
        yield (f"{label}{', pushed' * pushed}", len(group), *means.values(), *model)


def _papers() -> Iterator[tuple[Any, ...]]:
    """Hardware results of the paper's own law."""
    for name, printed in EXPERIMENT.items():
        count = 4 if name == "four directions" else 1
        yield (f"paper: {name}", count, printed.rmse, printed.steady_state, printed.settling, *[None] * 5)


def _draw(session: Session, trials: pd.DataFrame, twins: Twins) -> None:
    findings, settings = session.findings, session.study.hw_run
    push, log = settings.push, _logged(findings, "log")
    courses = []
    for record in trials.to_dict("records"):
        course, simulated = log[log["trial"] == record["trial"]], twins[record["trial"]].trajectory
        courses.append(
            trial_figures.LoggedTrial(
                direction=record["direction"],
                label=record["label"],
                repetition=record["repetition"],
                **{name: course[name].to_numpy(float) for name in ("time", "theta", "theta_ref", "theta_desired")},
                tension=_sides(course, record["direction"]),
                simulated=(simulated.time, simulated.theta, simulated.error),
                push=(push.start, push.start + push.duration) if record["push"] else None,
            )
        )
    for prefix, some in (
        ("", [course for course in courses if course.push is None]),
        ("pushed-", [course for course in courses if course.push is not None]),
    ):
        if some:
            findings.figure(f"{prefix}directions", trial_figures.desired_and_obtained, some)
            findings.figure(f"{prefix}errors", trial_figures.errors, some)
            row = settings.rows[0]
            first = [
                logged_trial
                for logged_trial in some
                if logged_trial.label == row.label and logged_trial.repetition == 0
            ]
            findings.figure(f"{prefix}tensions", trial_figures.tensions, first, row.label)
    if settings.real_time or settings.port is not None:
        logs = (log, _logged(findings, "between"))
        late = np.concatenate([table["late"].to_numpy(float) for table in logs])
        findings.figure("lateness", trial_figures.lateness, late, settings.control_period)


def _logged(findings: Findings, name: str) -> pd.DataFrame:
    assert findings.run is not None
    return pd.read_csv(findings.run.file(f"data/{name}.csv"))


def _sides(course: pd.DataFrame, direction: str) -> Any:
    """Commanded tension (T, 2) of one tendon of the direction's side and of one of the other."""
    pulling = DIRECTIONS[direction].tendons
    holding = next(tendon for tendon in ACTIVE if tendon not in pulling)
    return course[[f"tension_{pulling[0]}", f"tension_{holding}"]].to_numpy(float)
