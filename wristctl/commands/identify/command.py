"""The wrist's parameters from logged trials."""

from __future__ import annotations

import logging
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from wristctl.commands.answer import Answer
from wristctl.commands.identify.answer import found_answer, refused_answer
from wristctl.commands.identify.bends import DRAWS, BendsTold, bends_plan, identify_bends
from wristctl.commands.identify.driven import DrivenTold
from wristctl.commands.identify.hysteresis import LoopTold, identify_loop, loop_plan
from wristctl.commands.identify.logs import LogTold, identify_logs, log_plan
from wristctl.commands.inputs import EarlierRun, Inputs
from wristctl.commands.procedure import Procedure, no_tendons
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import Argument, Setting, UserError
from wristctl.records import Run
from wristctl.records.folders_of_logs import files_of_recording

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.fit import Fit
    from wristctl.identification.intervals import Knowledge
    from wristctl.identification.lack_of_fit import Suspicion
    from wristctl.identification.problem import Problem

log = logging.getLogger(__name__)

AnyTold: TypeAlias = LogTold | DrivenTold | BendsTold | LoopTold
# Endings of names that are of tables and never of runs.
_TABLES = (".csv", ".txt", ".tsv", ".xlsx", ".xlsm", ".parquet", ".mat", ".mcap", ".db3", ".bag")
_STUDIES = (".yaml", ".yml")
# Plan and computation of each model of logs.
_OF_LOGS: Mapping[str, tuple[Callable[[Study], str], Callable[[Session], AnyTold]]] = {
    "arcs": (log_plan, identify_logs),
    "wrist": (bends_plan, identify_bends),
    "hysteresis": (loop_plan, identify_loop),
}


@dataclass(frozen=True, repr=False, eq=False)
class Identified(StudyResult):
    """A wrist's stiffness, damping, tendons and delay, with 95 % intervals."""

    kind = "identify"

    fit: Fit
    knowledge: Knowledge
    yaml: str
    """A study file with what was found: the wrist, and the actuator and sensor of a loop."""
    suspected: list[Suspicion]
    """What the residuals say that the model may lack."""
    known: str = ""
    """Study file of the first run, with the wrist's geometry, masses and pose."""

    @property
    def answer(self) -> Answer:
        """Parameters with intervals and units, and what the model misses."""
        return found_answer(self.fit, self.knowledge, self.suspected, self.place, self.known)

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, found or fixed, in the units of `frame`."""
        return self.fit.values

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value, ends of its 95 % interval, unit, what was believed, verdict."""
        import pandas as pd

        from wristctl.commands.identify.tables import COLUMNS, parameter_rows

        return pd.DataFrame(parameter_rows(self.fit, self.knowledge, {}), columns=COLUMNS)


class _Logged(NamedTuple):
    """The tables of a run of trials."""

    ticks: pd.DataFrame
    frames: pd.DataFrame
    kinds: pd.DataFrame


def with_logs(study: Study) -> Study:
    """The study with files among its runs named as open logs, and recordings that are folders by their files.

    Raises UserError for a study file among its runs.
    """
    runs = study.identify.runs
    for run in runs:
        if Path(run).suffix in _STUDIES and Path(run).is_file():
            fix = f"give a log or a run, and the study beside it: `wristctl identify my.csv --config {run}`"
            raise UserError("a study file where a log or a run is asked for", run, fix)
    files = {run: files_of_recording(Path(run)) for run in runs}
    logs = {run: found for run, found in files.items() if found != [Path(run)] or _is_log(Path(run))}
    if not logs:
        return study
    named = tuple(str(file) for found in logs.values() for file in found)
    changed = {"runs": tuple(run for run in runs if run not in logs), "logs": (*study.identify.logs, *named)}
    return study.model_copy(update={"identify": study.identify.model_copy(update=changed)})


def _is_log(path: Path) -> bool:
    return path.is_file() or path.suffix in _TABLES


def plan(study: Study, inputs: Inputs) -> str:
    """Say what will be found from which trials."""
    settings = study.identify
    if settings.model != "hysteresis" and (inner := [name for name in settings.fixed if name.startswith("inner_")]):
        other = Setting("model=hysteresis", "identify", option="--model hysteresis")
        fix = ("leave it out, or ", other, " for a loop of hysteresis")
        raise UserError(f"{inner[0]} is no parameter of this model", f"identify.fix.{inner[0]}", fix)
    if settings.logs:
        if inputs.runs():
            raise UserError("runs and logs at once", "identify.runs", "identify one or the other")
        return _OF_LOGS[settings.model][0](study)
    problem = _problem(study, inputs)
    poses = len({(trial.wrist.gravity, trial.wrist.hand_mass) for trial in problem.trials})
    frames = sum(len(trial.angle) for trial in problem.trials)
    return f"{', '.join(problem.free)} from {len(problem.trials)} trials, {frames} frames, {poses} poses or masses"


def identify(session: Session) -> Identified | AnyTold:
    """Find a real wrist's stiffness, damping, tendons and delay from trials, with 95 % intervals.

    Trials are those of hw-run runs, or of open logs of wrists with two or more tendons, in one
    plane or two, with spools, tensions or motors' currents. Of logs a parameter has its interval
    or is not identifiable, and a part that was not fitted decides which of slack, friction and
    creep they want. With `--model wrist` logs in two planes are of the study's wrist: its springs'
    axis, each tendon's place; with `--model hysteresis` a loop tells friction of the tendons.
    """
    if session.study.identify.logs:
        return _OF_LOGS[session.study.identify.model][1](session)
    import numpy as np

    from wristctl.commands.identify.figures import angles, correlations, residuals
    from wristctl.commands.identify.tables import budget_table, causes, fit_table, offers, parameters, residual_table
    from wristctl.identification.fit import fit
    from wristctl.identification.identifiability import FINER, additions, budget, not_identified, refuse
    from wristctl.identification.intervals import knowledge
    from wristctl.identification.lack_of_fit import misfits, refuse_misfit, suspicions, widened
    from wristctl.identification.posterior import posterior_draws, posterior_yaml
    from wristctl.identification.unknowns import identified_yaml

    findings, settings = session.findings, session.study.identify
    problem = _problem(session.study, session.inputs)
    with session.progress("searching"):
        fitted = fit(problem)
        sure, suspected, missed = knowledge(fitted), suspicions(fitted), misfits(fitted)
        moved = budget(fitted, sure)
        estimated = widened(sure, suspected, moved[FINER])
        lacking = not_identified(fitted, estimated)
        offered = additions(fitted, lacking) if lacking else []
    findings.numerics(integrator="RODAS3", step=settings.step, segments=settings.segments)
    tables = [
        parameters(findings, fitted, estimated, lacking), fit_table(findings, fitted, estimated),
        residual_table(missed), causes(fitted, sure, suspected), budget_table(fitted, moved),
    ]  # fmt: skip
    additions_table = offers(offered) if offered else None
    if additions_table is not None:
        tables.append(additions_table)
    with session.drawing():
        findings.figure("angles", angles, fitted)
        findings.figure("residuals", residuals, fitted, estimated)
        findings.figure("correlations", correlations, fitted, estimated)
    if estimated.misses_something:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    for suspicion in suspected:
        if suspicion.evident:
            log.warning("the trials look like %s, which the model has not; intervals are widened", suspicion.told)
    runs = [os.path.relpath(run.path) for run in session.inputs.runs().values()]
    refused = refused_answer(fitted, estimated, lacking, suspected, offered, runs)
    try:
        if settings.misfit == "refuse":
            refuse_misfit(fitted, sure, suspected, missed)
        refuse(lacking, offered, estimated.condition, problem.start)
    except UserError:
        session.tell_refused(refused, tables)
        raise
    camera = _camera(session.inputs, fitted)
    yaml = identified_yaml(fitted.values, camera)
    findings.text("data/identified.yaml", yaml)
    rng = np.random.default_rng(findings.stream("posterior"))
    draws = posterior_draws(fitted, estimated, DRAWS, rng)
    first = next(iter(session.inputs.runs().values()))
    whole = identified_yaml(fitted.values, camera, known=first.config.wrist)
    findings.text("data/posterior.yaml", whole + posterior_yaml(draws, fitted.values, camera, _period(session.inputs)))
    known = os.path.relpath(first.path / "config.yaml")
    return Identified(session.study, findings, tables, fitted, estimated, yaml, suspected, known)


def _problem(study: Study, inputs: Inputs) -> Problem:
    """The trials of all runs, and where the search for the parameters begins: at what the first run's study says."""
    from wristctl.config.plant import Actuator
    from wristctl.identification.measured_trials import measured_trials
    from wristctl.identification.problem import Problem
    from wristctl.identification.rotor_field import with_rotors
    from wristctl.identification.unknowns import believed_of

    if not inputs.runs():
        latest = Argument(_RUNS.leaf, "latest:hw-run", positional=True)
        log_too = Setting("logs=[my.csv]", "identify")
        runs_or_log = (latest, ", or the path or id of a hw-run run; or a log's file: my.csv, or ", log_too)
        raise UserError("identify needs a hw-run run or a log", "identify.runs", runs_or_log)
    settings, trials = study.identify, []
    start: dict[str, float] = {}
    believed = Actuator()
    for role, run in inputs.runs().items():
        by_log, of_log = "which are fitted by their open log", "wristctl runs export RUN, then wristctl identify FILE"
        if settings.model == "hysteresis":
            problem = "a loop of hysteresis is an open log, not a run"
            raise UserError(problem, run.id, f"{of_log} --model hysteresis")
        if run.config.hw_run.planes == 2:
            raise UserError(f"its trials bend in two planes, {by_log}", run.id, f"{of_log} --model wrist")
        if run.config.hw_run.rig is not None:
            raise UserError(f"its trials are of a robot of your own, {by_log}", run.id, of_log)
        config, logged = run.config, inputs.read(role, _logged)
        assert logged is not None
        actuator, wrist = config.hw_run.actuator, config.wrist
        exposure = settings.exposure
        if exposure is None:
            exposure = 0.0 if config.hw_run.port else config.hw_run.bench.camera.exposure
        trials += measured_trials(run.id, wrist, actuator, settings.step, *logged, exposure)
        if not start:
            start, believed = believed_of(wrist, actuator), actuator
            if config.hw_run.port is None:
                settings = with_rotors(settings, config.hw_run.bench.motors)
    return Problem(trials, start, settings, believed)


def _logged(run: Run) -> _Logged:
    return _Logged(*(run.data(name) for name in ("log", "frames", "trials")))


def _period(inputs: Inputs) -> float:
    """Time between two ticks of the trials, the longest of all runs [s]."""
    return max(float(run.config.hw_run.control_period) for run in inputs.runs().values())


def _camera(inputs: Inputs, fitted: Fit) -> dict[str, float]:
    """The camera as the frames of all runs show it."""
    import pandas as pd

    from wristctl.identification.measured_trials import camera_parameters

    logged = {role: inputs.read(role, _logged) for role in inputs}
    frames = pd.concat(
        [logged_run.frames.assign(run=role) for role, logged_run in logged.items() if logged_run is not None]
    )
    return camera_parameters(frames, fitted.values["delay"], fitted.noise)


_RUNS = EarlierRun("runs", kind="hw-run", optional=True)
IDENTIFY: Procedure[Identified | AnyTold] = Procedure(
    "identify", plan, identify, (_RUNS,), completed=with_logs, in_one_plane=no_tendons
)
