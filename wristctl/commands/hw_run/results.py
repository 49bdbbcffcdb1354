"""Tables and figures of hw-run in one plane or two: beside the paper's experiment and a simulation of the trials."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.commands.hw_run import figures as trial_figures
from wristctl.commands.hw_run.answer import completed
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.commands.session import Session
from wristctl.comparison.paper import EXPERIMENT
from wristctl.config.hw_run import HwRunSettings
from wristctl.control.table import Gains
from wristctl.simulation.repetitions import Simulation
from wristctl.trial.log import column_of
from wristctl.trial.rig_belief import layout_of_axes, layout_of_rig, names_of_planes, numbers_of, places_of_tendons
from wristctl.trial.trial_results import twin
from wristctl.trial.trials import Trial
from wristctl.wrist.directions import DIRECTIONS
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.spatial.held_bends import reach_of_bends
from wristctl.wrist.tendon_layout import TendonLayout

# The simulation of each trial, by its number.
Twins = dict[int, Simulation]

# Metrics whose means are told, in so many planes, with their units; and those that their simulation has beside.
_MEANS = {
    1: {
        "rmse": "rad", "steady_state": "rad", "settling": "s", "recovery": "s", "true_rmse": "rad",
        "true_steady_state": "rad",
    },
    2: {
        "rmse_ulnar": "rad", "rmse_flexion": "rad", "rmse": "rad", "steady_state": "rad", "settling": "s",
        "recovery": "s", "true_rmse_ulnar": "rad", "true_rmse_flexion": "rad", "true_rmse": "rad",
        "true_recovery": "s",
    },
}  # fmt: skip
_SIMULATED = {1: ("rmse", "steady_state"), 2: ("rmse_ulnar", "rmse_flexion")}
# Columns of the table of all trials; in one plane there are no errors by plane.
_BY_TRIAL = {
    "trial": "trial", "direction": "direction", "push": "push [N]", "label": "controller",
    "rmse_ulnar": "RMSE toward ulnar [rad]", "rmse_flexion": "RMSE toward flexion [rad]", "rmse": "RMSE [rad]",
    "true_rmse": "true RMSE [rad]", "steady_state": "steady state [rad]", "largest_error": "largest error [rad]",
    "settling": "settling [s]", "recovery": "recovery [s]", "true_recovery": "true recovery [s]",
    "overshoot": "overshoot [%]", "swing": "swing at rest, peak to peak [rad]", "true_swing": "true swing [rad]",
    "peak_tension": "peak tension [N]", "outcome": "outcome",
}  # fmt: skip


def trial_tables(
    session: Session, trials: pd.DataFrame, network: Inverse | None, tuned: Gains | None
) -> tuple[list[Table], Twins]:
    """Tables of all trials that ended well, with metrics and figures, and the simulation of each."""
    trials, planes = completed(trials), session.study.hw_run.planes
    twins = twins_of(session, trials, network, tuned)
    theirs = planes == 1 and bool((trials["controller"] == "smc").any())
    labels, units, simulated = [row.label for row in session.study.hw_run.rows], _MEANS[planes], _SIMULATED[planes]
    means = means_of_trials(session.findings, trials, labels, twins, units, simulated)
    rows = [*means, *(_papers() if theirs else ())]
    heads = [
        *(_head(name, unit) for name, unit in units.items()),
        *(_head(f"simulated_{name}", "rad") for name in simulated),
    ]
    shown = {name: head for name, head in _BY_TRIAL.items() if name in trials}
    by_trial = Table("Trials, in the order done", list(shown.values()), trials[list(shown)].to_numpy().tolist())
    with session.drawing():
        _draw(session, trials, twins)
    if planes > 1:
        session.findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "true_rmse", "pushed_true_rmse")
    title = "Means over the trials" + ", beside the paper's experiment with the same law" * theirs
    return [Table(title, ("", "trials", *heads), rows), by_trial], twins


def _head(name: str, unit: str) -> str:
    words = name.replace("rmse", "RMSE").replace("_ulnar", " toward ulnar").replace("_flexion", " toward flexion")
    return f"{words.replace('_', ' ')} [{unit}]"


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
    findings, settings, wrist = session.findings, session.study.hw_run, session.study.wrist
    log, layout, first = _logged(findings, "log"), layout_of_rig(settings, wrist), settings.rows[0].label
    truth = _logged(findings, "truth") if findings.run and (findings.run.path / "data/truth.csv").is_file() else None
    courses = [_course(record, log, truth, settings, layout, twins) for record in trials.to_dict("records")]
    for prefix, pushed in (("", False), ("pushed-", True)):
        some = [course for course in courses if (course.push is not None) == pushed]
        if not some:
            continue
        alone = [course for course in some if course.label == first and course.repetition == 0]
        if settings.planes == 1:
            findings.figure(f"{prefix}directions", trial_figures.desired_and_obtained, some)
        else:
            reach = reach_of_bends(wrist, layout or layout_of_axes(wrist))
            caption = "The plane of bends: wanted, measured and true, within what the tendons reach"
            findings.figure(f"{prefix}bends", trial_figures.paths, alone, reach, first, caption=caption)
            findings.overview.figure = findings.overview.figure or f"{prefix}bends"
        findings.figure(f"{prefix}errors", trial_figures.errors, some)
        findings.figure(f"{prefix}tensions", trial_figures.tensions, alone, first)
    if settings.real_time or settings.port is not None:
        logs = (log, _logged(findings, "between"))
        late = np.concatenate([table["late"].to_numpy(float) for table in logs])
        findings.figure("lateness", trial_figures.lateness, late, settings.control_period)


def _course(
    record: Mapping[Any, Any], logs: pd.DataFrame, truths: pd.DataFrame | None, settings: HwRunSettings,
    layout: TendonLayout | None, twins: Twins,
) -> trial_figures.LoggedTrial:  # fmt: skip
    """One trial, as logged, beside its simulation and what is true of it."""
    log, direction, push = logs[logs["trial"] == record["trial"]], record["direction"], settings.push
    planes = names_of_planes(settings.planes, DIRECTIONS[direction].plane if settings.planes == 1 else "")

    def of_planes(name: str, table: pd.DataFrame = log) -> Array:
        return table[[column_of(name, plane, len(planes)) for plane in planes]].to_numpy(float)

    time, wanted, true = log["time"].to_numpy(float), of_planes("bend_ref"), None
    if truths is not None and len(truth := truths[truths["trial"] == record["trial"]]):
        at, bend = truth["time"].to_numpy(float), of_planes("bend", truth)
        asked = np.stack([np.interp(at, time, course) for course in wanted.T], axis=1)
        true = trial_figures.Course(at, bend, bend - asked)
    simulated = twins[record["trial"]].trajectory
    in_planes = len(simulated.time), len(planes)
    return trial_figures.LoggedTrial(
        direction=direction,
        label=record["label"],
        repetition=record["repetition"],
        planes=planes,
        time=time,
        bend=of_planes("bend"),
        bend_ref=wanted,
        wanted=of_planes("bend_desired") if len(planes) == 1 else wanted,
        tension=_tensions(log, direction, planes, layout),
        simulated=trial_figures.Course(
            simulated.time, simulated.theta.reshape(in_planes), simulated.error.reshape(in_planes)
        ),
        true=true,
        push=(push.start, push.start + push.duration) if record["push"] else None,
    )


def _logged(findings: Findings, name: str) -> pd.DataFrame:
    assert findings.run is not None
    return pd.read_csv(findings.run.file(f"data/{name}.csv"))


def _tensions(
    log: pd.DataFrame, direction: str, planes: Sequence[str], layout: TendonLayout | None
) -> dict[str, Array]:  # fmt: skip
    """Commanded tensions (N,) by tendon; in one plane of one on the direction's side, and of one on the other."""
    columns = {f"tendon {number}": log[f"tension_{number}"].to_numpy(float) for number in numbers_of(layout)}
    if len(planes) > 1:
        return columns
    place, side = places_of_tendons(planes, layout), 0 if DIRECTIONS[direction].sign > 0 else 1
    pulls, holds = (int(np.flatnonzero((place == side) == on)[0]) for on in (True, False))
    tensions = list(columns.values())
    return {"tendons that pull": tensions[pulls], "tendons that hold against": tensions[holds]}
