"""Tables and figures of hw-run: beside the paper's experiment and a simulation of the same trials."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import pandas as pd

from wristctl.cli.command import Session, Table
from wristctl.cli.loops import network_of, tuned_of
from wristctl.comparison.paper import EXPERIMENT
from wristctl.report import trial_figures
from wristctl.simulation.closed_loop import Simulation
from wristctl.trial.trials import Trial
from wristctl.trial.twin import twin
from wristctl.wrist.directions import ACTIVE, DIRECTIONS

Twins = dict[int, Simulation]
"""The simulation of each trial, by its number."""

_MEANS = ("rmse", "steady_state", "settling", "recovery", "true_rmse", "true_steady_state")
_COLUMNS = (
    "", "trials", "RMSE [rad]", "steady state [rad]", "settling [s]", "recovery [s]", "true RMSE [rad]",
    "true steady state [rad]", "simulated RMSE [rad]", "simulated steady state [rad]",
)  # fmt: skip
_BY_TRIAL = {
    "trial": "trial", "direction": "direction", "push": "push [N]", "label": "controller", "rmse": "RMSE [rad]",
    "steady_state": "steady state [rad]", "settling": "settling [s]", "recovery": "recovery [s]",
    "overshoot": "overshoot [%]", "peak_tension": "peak tension [N]", "outcome": "outcome",
}  # fmt: skip


def reported(session: Session, trials: pd.DataFrame) -> list[Table]:
    """Tables of all trials; metrics and figures on the way."""
    trials = trials[trials["outcome"] == "ok"].assign(label=trials["controller"] + "/" + trials["gains"])
    twins = _twins(session, trials)
    rows = [*_means(session, trials, twins), *_papers()]
    by_trial = Table("Trials, in the order done", list(_BY_TRIAL.values()), trials[list(_BY_TRIAL)].to_numpy().tolist())
    with session.progress("drawing"):
        _draw(session, trials, twins)
    return [Table("Means over the trials, beside the paper's experiment", _COLUMNS, rows), by_trial]


def _twins(session: Session, trials: pd.DataFrame) -> Twins:
    """Each trial in simulation; repetitions share one."""
    network, tuned = network_of(session), tuned_of(session.inputs)
    names = [row.label for row in session.settings.rows]
    done: dict[tuple[Any, ...], Simulation] = {}
    found = {}
    with session.progress("simulating the same trials"):
        for each in trials.to_dict("records"):
            key = each["direction"], each["push"], each["label"]
            if key not in done:
                trial = Trial(each["trial"], each["direction"], 0, each["push"], names.index(each["label"]))
                done[key] = twin(session.study, trial, network, tuned)
            found[each["trial"]] = done[key]
    return found


def _means(session: Session, trials: pd.DataFrame, twins: Twins) -> Iterator[tuple[Any, ...]]:
    """A row for each controller with and without a push; a metric for each number."""
    labels = [row.label for row in session.settings.rows]
    for label, pushed in ((label, pushed) for pushed in (False, True) for label in labels):
        group = trials[(trials["label"] == label) & ((trials["push"] != 0.0) == pushed)]
        if group.empty:
            continue
        means = {name: float(group[name].mean(skipna=False)) for name in _MEANS}
        simulated = [
            float(np.mean([twins[number].metrics[name] for number in group["trial"]]))
            for name in ("rmse", "steady_state")
        ]
        for name, unit in zip(_MEANS, ("rad", "rad", "s", "s", "rad", "rad"), strict=True):
            if name == "recovery" and not pushed:
                continue
            whose = [label.replace("/", "-").replace(" ", "-")] if len(labels) > 1 else []
            full = "_".join([*["pushed"] * pushed, name, *whose])
            meaning = f"mean over trials{' with a push' * pushed}, {label}"
            session.run.metric(full, means[name], unit, "lower", n=len(group), meaning=meaning)
        yield (f"{label}{', pushed' * pushed}", len(group), *means.values(), *simulated)


def _papers() -> Iterator[tuple[Any, ...]]:
    for name, printed in EXPERIMENT.items():
        count = 4 if name == "four directions" else 1
        yield (f"paper: {name}", count, printed.rmse, printed.steady_state, printed.settling, *[None] * 5)


def _draw(session: Session, trials: pd.DataFrame, twins: Twins) -> None:
    run, push = session.run, session.settings.push
    log = pd.read_csv(run.file("data/log.csv"))
    courses = []
    for each in trials.to_dict("records"):
        course, simulated = log[log["trial"] == each["trial"]], twins[each["trial"]].trajectory
        courses.append(
            trial_figures.Course(
                direction=each["direction"],
                label=each["label"],
                repetition=each["repetition"],
                **{name: course[name].to_numpy(float) for name in ("time", "theta", "theta_ref", "theta_desired")},
                tension=_sides(course, each["direction"]),
                simulated=(simulated.time, simulated.theta, simulated.error),
                push=(push.start, push.start + push.duration) if each["push"] else None,
            )
        )
    for prefix, some in (
        ("", [course for course in courses if course.push is None]),
        ("pushed-", [course for course in courses if course.push is not None]),
    ):
        if some:
            run.figure(f"{prefix}directions", trial_figures.desired_and_obtained(some))
            run.figure(f"{prefix}errors", trial_figures.errors(some))
            row = session.settings.rows[0]
            first = [each for each in some if each.label == row.label and each.repetition == 0]
            run.figure(f"{prefix}tensions", trial_figures.tensions(first, row.label))
    if session.settings.real_time or session.settings.port is not None:
        between = pd.read_csv(run.file("data/between.csv"))
        late = np.concatenate([table["late"].to_numpy(float) for table in (log, between)])
        run.figure("lateness", trial_figures.lateness(late, session.settings.control_period))


def _sides(course: pd.DataFrame, direction: str) -> Any:
    """Commanded tension (T, 2) of one tendon of the direction's side and of one of the other."""
    pulling = DIRECTIONS[direction].tendons
    holding = next(tendon for tendon in ACTIVE if tendon not in pulling)
    return course[[f"tension_{pulling[0]}", f"tension_{holding}"]].to_numpy(float)
