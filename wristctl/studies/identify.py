"""The wrist's parameters from logged trials."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

from wristctl.config.study import Study
from wristctl.records import Run
from wristctl.report.printed_table import Table
from wristctl.studies.findings import Findings
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.identification.fit import Fit, Problem
    from wristctl.identification.identifiability import Addition
    from wristctl.identification.intervals import Knowledge

log = logging.getLogger(__name__)

_COLUMNS = ("parameter", "value", "low", "high", "unit", "believed", "verdict")


@dataclass(frozen=True, repr=False, eq=False)
class Identified(StudyResult):
    """A wrist's stiffness, damping, tendons and delay, with 95 % intervals."""

    kind = "identify"

    fit: Fit
    knowledge: Knowledge
    yaml: str
    """A study file with what was found: the wrist, and the actuator and sensor of a loop."""

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, found or fixed, in the units of `frame`."""
        return self.fit.values

    def frame(self) -> pd.DataFrame:
        """One row per parameter: value, ends of its 95 % interval, unit, what was believed, verdict."""
        import pandas as pd

        return pd.DataFrame(_parameter_rows(self.fit, self.knowledge, {}), columns=_COLUMNS)


class _Logged(NamedTuple):
    """The tables of a run of trials."""

    ticks: pd.DataFrame
    frames: pd.DataFrame
    kinds: pd.DataFrame


def plan(study: Study, inputs: Inputs) -> str:
    """Say what will be found from which trials."""
    problem = _problem(study, inputs)
    poses = len({(trial.wrist.gravity, trial.wrist.hand_mass) for trial in problem.trials})
    frames = sum(len(trial.angle) for trial in problem.trials)
    return f"{', '.join(problem.free)} from {len(problem.trials)} trials, {frames} frames, {poses} poses or masses"


def identify(session: Session) -> Identified:
    """Find stiffness, damping, tendons and delay of a real wrist from logged trials, with 95 % intervals."""
    from wristctl.identification.fit import fit
    from wristctl.identification.identifiability import additions, budget, not_identified, refuse
    from wristctl.identification.identified import identified_yaml
    from wristctl.identification.intervals import knowledge
    from wristctl.report.identify_figures import angles, correlations, residuals

    findings, settings = session.findings, session.study.identify
    problem = _problem(session.study, session.inputs)
    with session.progress("compiling and searching"):
        found = fit(problem)
        known = knowledge(found)
        lacking = not_identified(found, known)
        offered = additions(found, lacking) if lacking else []
        moved = budget(found, known)
    findings.numerics(integrator="RODAS3", step=settings.step, segments=settings.segments)
    tables = [_parameters(findings, found, known, lacking), _fit(findings, found, known), _budget(found, moved)]
    if offered:
        tables.append(_offers(offered))
    with session.progress("drawing"):
        findings.figure("angles", angles, found)
        findings.figure("residuals", residuals, found, known)
        findings.figure("correlations", correlations, found, known)
    if known.misses_something:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    if lacking:
        text = "\n\n".join(table.text() for table in tables)
        findings.summary(f"```\n{text}\n```")
        session.operator.tell(text)
    refuse(lacking, offered, known.condition, problem.start)
    yaml = identified_yaml(found.values, _camera(session.inputs, found))
    findings.text("data/identified.yaml", yaml)
    return Identified(session.study, findings, tables, found, known, yaml)


def _problem(study: Study, inputs: Inputs) -> Problem:
    """The trials of all runs, and where the search for the parameters begins: at what the first run's study says."""
    from wristctl.identification.fit import Problem
    from wristctl.identification.measured_trials import measured_trials

    settings, trials = study.identify, []
    start: dict[str, float] = {}
    for role, run in inputs.runs().items():
        config, logged = run.config, inputs.read(role, _logged)
        assert logged is not None
        actuator, wrist = config.hw_run.actuator, config.wrist
        exposure = settings.exposure
        if exposure is None:
            exposure = 0.0 if config.hw_run.port else config.hw_run.bench.camera.exposure
        trials += measured_trials(run.id, wrist, actuator.step_length, settings.step, *logged, exposure)
        own = {name: getattr(wrist, name) for name in ("stiffness", "damping", "tendon_radius")}
        names = ("tendon_stiffness", "friction", "sheath", "presliding")
        known = {name: float(getattr(actuator, name)) for name in names} | {"delay": 0.0}
        start = start or own | known
    return Problem(trials, start, settings)


def _logged(run: Run) -> _Logged:
    return _Logged(*(run.data(name) for name in ("log", "frames", "trials")))


def _parameter_rows(
    found: Fit, known: Knowledge, lacking: Mapping[str, float]
) -> list[tuple[str, float, float, float, str, float, str]]:
    from wristctl.identification.intervals import interval
    from wristctl.identification.unknowns import UNKNOWNS

    rows = []
    for name, value in found.values.items():
        held = name not in found.problem.free
        low, high = (value, value) if held else interval(found, known, name)
        verdict = "fixed" if held else "not identified" if name in lacking else "identified"
        rows.append((name, value, low, high, UNKNOWNS[name].unit, found.problem.start[name], verdict))
    return rows


def _parameters(findings: Findings, found: Fit, known: Knowledge, lacking: Mapping[str, float]) -> Table:
    import pandas as pd

    rows = _parameter_rows(found, known, lacking)
    for name, value, low, high, unit, _, verdict in rows:
        if verdict == "identified":
            findings.metric(name, value, unit, n=len(found.problem.trials), interval=(low, high))
    meaning = {"low": "of the 95 % interval", "high": "of the 95 % interval", "believed": "by the first run's study"}
    findings.table("data/parameters.csv", pd.DataFrame(rows, columns=_COLUMNS), {}, meaning)
    return Table("Parameters with 95 % intervals", _COLUMNS, rows)


def _fit(findings: Findings, found: Fit, known: Knowledge) -> Table:
    import numpy as np
    import pandas as pd

    frames = sum(map(len, found.residuals))
    rows = [
        ("condition", known.condition, "", "condition number of the Jacobian, columns scaled to unit length"),
        ("residual", float(np.degrees(found.noise)), "deg", "standard deviation of marker less model"),
        ("autocorrelation", known.autocorrelation, "", "of neighbouring residuals"),
        ("frames", float(frames), "", "frames used"),
        ("independent_frames", known.effective, "", "independent frames that would tell as much"),
        ("evaluations", float(found.evaluations), "", "evaluations of the model and its Jacobian"),
    ]
    for name, value, unit, meaning in rows:
        findings.metric(name, value if np.isfinite(value) else None, unit, n=frames, meaning=meaning)
    names = list(found.problem.free)
    size = len(names)
    matrix = pd.DataFrame(known.correlation[:size, :size], columns=names)
    matrix.insert(0, "parameter", names)
    findings.table("data/correlation.csv", matrix)
    errors = found.x[size:], known.half_widths[size:]
    small = pd.DataFrame({"error": list(found.problem.coordinates)[size:], "value": errors[0], "half_width": errors[1]})
    units = {"value": "rad (zero), m (spool)", "half_width": "rad (zero), m (spool)"}
    findings.table("data/zeros.csv", small, units)
    return Table("Fit", ("", "value", "unit", "meaning"), rows)


def _budget(found: Fit, moved: Mapping[str, Mapping[str, float]]) -> Table:
    from wristctl.identification.identifiability import KNOWN
    from wristctl.identification.unknowns import UNKNOWNS

    def cell(name: str, shift: float) -> str:
        if UNKNOWNS[name].log:
            return f"{100.0 * shift:+.2f} %"
        return f"{1e3 * shift:+.3f} ms" if UNKNOWNS[name].unit == "s" else f"{shift:+.4f}"

    names = found.problem.free
    rows = [(KNOWN[what], *(cell(name, shifts[name]) for name in names)) for what, shifts in moved.items()]
    return Table("What would move the result, if believed and not so", ("believed", *names), rows)


def _offers(offered: list[Addition]) -> Table:
    from wristctl.identification.identifiability import width_text

    names = list(offered[0].half_widths)
    rows = [
        (each.what, *(width_text(name, each.half_widths[name]) for name in names), "yes" if each.enough else "no")
        for each in offered
    ]
    return Table("What to add, and half the interval that it would leave", ("added", *names, "enough"), rows)


def _camera(inputs: Inputs, found: Fit) -> dict[str, float]:
    """The camera as the frames of all runs show it."""
    import pandas as pd

    from wristctl.identification.camera_parameters import camera_parameters

    logged = {role: inputs.read(role, _logged) for role in inputs}
    frames = pd.concat([each.frames.assign(run=role) for role, each in logged.items() if each is not None])
    return camera_parameters(frames, found.values["delay"], found.noise)


IDENTIFY = Procedure("identify", plan, identify, (EarlierRun("runs", kind="hw-run"),))
