"""Trials in two planes as a result: errors by plane and over both, beside the same trials in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, NamedTuple

from wristctl.commands.answer import Answer
from wristctl.commands.hw_run.answer import APART, ROWS, TrialWords, answer_of, completed, in_deg, in_s, marks_of
from wristctl.commands.printed_table import Table, two
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.control.table import Gains

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.simulation.repetitions import Simulation

_MEANS = {
    "rmse_ulnar": "rad", "rmse_flexion": "rad", "rmse": "rad", "steady_state": "rad", "settling": "s", "recovery": "s",
    "true_rmse_ulnar": "rad", "true_rmse_flexion": "rad", "true_rmse": "rad", "true_recovery": "s",
}  # fmt: skip
_BY_TRIAL = {
    "trial": "trial", "direction": "motion", "push": "push [N]", "label": "controller",
    "rmse_ulnar": "RMSE toward ulnar [rad]", "rmse_flexion": "RMSE toward flexion [rad]", "rmse": "RMSE [rad]",
    "true_rmse": "true RMSE [rad]", "largest_error": "largest error [rad]",
    "swing": "swing at the end, peak to peak [rad]", "true_swing": "true swing [rad]", "settling": "settling [s]",
    "true_recovery": "true recovery [s]", "peak_tension": "peak tension [N]", "outcome": "outcome",
}  # fmt: skip


@dataclass(frozen=True, repr=False, eq=False)
class PerformedBends(StudyResult):
    """Trials on a rig in two planes, and the same in simulation."""

    kind = "hw-run"

    trials: pd.DataFrame
    twins: dict[int, Simulation]
    """by the trial's number"""

    @property
    def answer(self) -> Answer:
        """Error by plane and over both, what a push does, and how far simulation agrees."""
        return answer_of(self.trials, in_two_planes(self.twins), self.metrics, self.marks, self.place)

    @property
    def marks(self) -> list[str]:
        """What the wrist does wrong in trials that ended well: `marks_of`."""
        from wristctl.trial.rig_belief import layout_of_rig, numbers_of

        places = len(numbers_of(layout_of_rig(self.study.hw_run, self.study.wrist)))
        return marks_of(self.trials, self.twins, self.study.wrist.tension_range, places)

    def frame(self) -> pd.DataFrame:
        """One row per trial that began."""
        return self.trials


class _Errors(NamedTuple):
    """Means over trials that ended well; nan where there is none."""

    trials: int
    ulnar: float
    flexion: float
    both: float
    true: float
    """Of the worse axis, by the true bend [rad]."""
    simulated: float
    """Of the worse axis, in simulation [rad]."""
    settling: float
    recovery: float


def _errors(trials: pd.DataFrame, twins: Mapping[int, Simulation]) -> _Errors:
    def mean(name: str) -> float:
        return float(trials[name].mean(skipna=False)) if len(trials) else math.nan

    courses = [twins[number].metrics for number in trials["trial"]]
    worse = [max(metrics["rmse_ulnar"], metrics["rmse_flexion"]) for metrics in courses]
    true = trials[["true_rmse_ulnar", "true_rmse_flexion"]].max(axis=1, skipna=False)
    recovery = "true_recovery" if trials["true_recovery"].notna().any() else "recovery"
    return _Errors(
        len(trials), mean("rmse_ulnar"), mean("rmse_flexion"), mean("rmse"),
        float(true.mean(skipna=False)) if len(trials) else math.nan,
        float(sum(worse) / len(worse)) if worse else math.nan, mean("settling"), mean(recovery),
    )  # fmt: skip


def bends_performed(session: Session, trials: pd.DataFrame, tuned: Gains | None) -> PerformedBends:
    """Tables, metrics and figures of trials in two planes, with the simulation of each."""
    from wristctl.commands.hw_run.results import means_of_trials, twins_of

    study, findings, done = session.study, session.findings, completed(trials)
    labels = [row.label for row in study.hw_run.rows]
    twins = twins_of(session, done, None, tuned)
    rows = list(means_of_trials(findings, done, labels, twins, _MEANS, ("rmse_ulnar", "rmse_flexion")))
    with session.drawing():
        _draw(session, done, twins)
    columns = ("", "trials", *(f"{name.replace('_', ' ')} [{unit}]" for name, unit in _MEANS.items()))
    simulated_columns = "simulated RMSE toward ulnar [rad]", "simulated RMSE toward flexion [rad]"
    by_trial = Table("Trials, in the order done", list(_BY_TRIAL.values()), done[list(_BY_TRIAL)].to_numpy().tolist())
    tables = [Table("Means over the trials", (*columns, *simulated_columns), rows), by_trial]
    findings.headline("rmse", "rmse_ulnar", "rmse_flexion", "true_rmse", "pushed_true_rmse")
    return PerformedBends(study, findings, tables, trials, twins)


def _draw(session: Session, done: pd.DataFrame, twins: Mapping[int, Simulation]) -> None:
    import pandas as pd

    from wristctl.commands.hw_run.trial_bend_figures import TrialBends, errors_of_bends, paths_of_bends
    from wristctl.trial.motions import motion_of
    from wristctl.trial.rig_belief import layout_of_axes, layout_of_rig
    from wristctl.trial.trial_results import logged_course, true_course
    from wristctl.wrist.spatial.held_bends import reach_of_bends

    findings, study, settings = session.findings, session.study, session.study.hw_run
    assert findings.run is not None
    log = pd.read_csv(findings.run.file("data/log.csv"))
    file = findings.run.path / "data/truth.csv"
    truth = pd.read_csv(file) if file.is_file() else None
    courses = []
    for record in done.to_dict("records"):
        if record["repetition"] or record["label"] != settings.rows[0].label:
            continue
        followed = motion_of(settings, study.wrist, record["direction"])
        logged = logged_course(log[log["trial"] == record["trial"]], followed, study.wrist)
        true = (
            None if truth is None else true_course(logged, truth[truth["trial"] == record["trial"]], study.wrist.length)
        )
        push = (settings.push.start, settings.push.start + settings.push.duration) if record["push"] else None
        courses.append(TrialBends(record["direction"], logged, true, twins[record["trial"]].trajectory, push))
    reach = reach_of_bends(study.wrist, layout_of_rig(settings, study.wrist) or layout_of_axes(study.wrist))
    for prefix, pushed in (("", False), ("pushed-", True)):
        some = [course for course in courses if (course.push is not None) == pushed]
        if not some:
            continue
        caption = "The plane of bends: wanted, measured and true, within what the tendons reach"
        findings.figure(f"{prefix}bends", paths_of_bends, some, reach, settings.rows[0].label, caption=caption)
        caption = "Errors by plane over time, measured, true and simulated"
        findings.figure(f"{prefix}errors", errors_of_bends, some, settings.rows[0].label, caption=caption)
    if courses:
        findings.overview.figure = "bends" if courses[0].push is None or len(courses) > 1 else "pushed-bends"


def in_two_planes(twins: Mapping[int, Simulation]) -> TrialWords:
    """Words for trials in two planes beside their simulation, by the trial's number."""
    return TrialWords(
        partial(_sentence, twins=twins), partial(_table, twins=twins), partial(_apart, twins=twins), twins
    )


def _sentence(trials: pd.DataFrame, label: str, twins: Mapping[int, Simulation]) -> str:
    parts = []
    for pushed in (False, True):
        group = trials[(trials["push"] != 0.0) == pushed]
        if group.empty:
            continue
        errors = _errors(group, twins)
        words = f"error {in_deg(errors.ulnar)} deg RMSE toward ulnar, {in_deg(errors.flexion)} deg toward flexion"
        if math.isfinite(errors.true):
            words += f" (truly {in_deg(errors.true)} deg on the worse axis)"
        if pushed:
            force = ", ".join(f"{newtons:g}" for newtons in sorted({abs(force) for force in group["push"]}))
            back = "at once" if errors.recovery == 0.0 else f"within {two(errors.recovery)} s"
            words = f"with a push of {force} N {words}" + f", back {back}" * math.isfinite(errors.recovery)
        parts.append(words)
    return f"{label} in two planes: {'; '.join(parts)}."


def _table(done: pd.DataFrame, labels: Sequence[str], twins: Mapping[int, Simulation]) -> Table:
    """A row for each motion and controller, with and without a push; for very many a row for each controller."""
    motions = list(dict.fromkeys(done["direction"]))
    heads = (
        "controller", "motion", "push [N]", "toward ulnar [deg]", "toward flexion [deg]", "over both [deg]",
        "true, worse axis [deg]", "simulated, worse axis [deg]", "settling [s]", "recovery [s]",
    )  # fmt: skip
    rows = []
    for label in labels:
        of_label = done[done["label"] == label]
        for motion in motions if len(motions) * len(labels) <= ROWS else ["all"]:
            of_motion = of_label if motion == "all" else of_label[of_label["direction"] == motion]
            for push, group in of_motion.groupby("push"):
                errors = _errors(group, twins)
                angles = errors.ulnar, errors.flexion, errors.both, errors.true, errors.simulated
                after = in_s(errors.recovery) if push else "-"
                rows.append(
                    (label, motion, f"{push:g}", *map(in_deg, angles), in_s(errors.settling), after)
                )  # fmt: skip
    several = len(labels) > 1
    return Table("", heads[not several :], [row[not several :] for row in rows])


def _apart(done: pd.DataFrame, labels: Sequence[str], twins: Mapping[int, Simulation]) -> list[str]:
    """Where measured and simulated errors differ much."""
    facts = []
    for label in labels:
        for pushed in (False, True):
            group = done[(done["label"] == label) & ((done["push"] != 0.0) == pushed)]
            errors = _errors(group, twins)
            measured = errors.true if math.isfinite(errors.true) else max(errors.ulnar, errors.flexion)
            ratio = measured / errors.simulated if errors.simulated > 0.0 else math.nan
            if math.isfinite(ratio) and not 1.0 / APART <= ratio <= APART:
                times = f"{two(max(ratio, 1.0 / ratio))} times {'larger' if ratio > 1.0 else 'smaller'}"
                where = f"{f'{label} ' * (len(labels) > 1)}{'with' if pushed else 'without'} a push"
                facts.append(
                    f"{where} {in_deg(measured)} deg on the worse axis, {times} than {in_deg(errors.simulated)} deg"
                )
    return [f"Measured and simulated errors do not agree: {'; '.join(facts)} simulated."] if facts else []
