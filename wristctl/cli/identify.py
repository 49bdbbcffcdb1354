"""`wristctl identify`: the wrist's parameters from logged trials."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.cli.progress import PLAIN
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.identification.fit import Fit, Problem
    from wristctl.identification.identifiability import Addition
    from wristctl.identification.intervals import Knowledge

log = logging.getLogger(__name__)

_ALIKE = 0.2
"""Autocorrelation of neighbouring residuals beyond which the model is said to miss something."""


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """Say what will be found from which trials."""
    problem = _problem(study, inputs)
    poses = len({(trial.wrist.gravity, trial.wrist.hand_mass) for trial in problem.trials})
    frames = sum(len(trial.angle) for trial in problem.trials)
    return f"{', '.join(problem.free)} from {len(problem.trials)} trials, {frames} frames, {poses} poses or masses"


def identify(session: Session) -> list[Table]:
    """Find stiffness, damping, tendons and delay of a real wrist from logged trials, with 95 % intervals."""
    from wristctl.identification.fit import fit
    from wristctl.identification.identifiability import additions, budget, not_identified, refuse
    from wristctl.identification.identified import identified_yaml
    from wristctl.identification.intervals import knowledge
    from wristctl.report.identify_figures import angles, correlations, residuals

    run, problem = session.run, _problem(session.study, session.inputs)
    with session.progress("compiling and searching"):
        found = fit(problem)
        known = knowledge(found)
        lacking = not_identified(found, known)
        offered = additions(found, lacking) if lacking else []
        moved = budget(found, known)
    run.numerics(integrator="RODAS3", step=session.settings.step, segments=session.settings.segments)
    tables = [_parameters(session, found, known, lacking), _fit(session, found, known), _budget(found, moved)]
    if offered:
        tables.append(_offers(offered))
    with session.progress("drawing"):
        run.figure("angles", angles(found))
        run.figure("residuals", residuals(found, known))
        run.figure("correlations", correlations(found, known))
    if known.autocorrelation > _ALIKE:
        log.warning("neighbouring residuals are alike: the model misses something; the intervals are widened for it")
    if lacking:
        text = "\n\n".join(table.text() for table in tables)
        run.summary(f"```\n{text}\n```")
        session.console.print(text, **PLAIN)
    refuse(lacking, offered, known.condition, problem.start)
    camera = _camera(session.inputs, found)
    run.file("data/identified.yaml").write_text(identified_yaml(found.values, camera), encoding="utf-8")
    return tables


def _problem(study: Study, inputs: Mapping[str, Run]) -> Problem:
    """The trials of all runs, and where the search for the parameters begins: at what the first run's study says."""
    from wristctl.identification.fit import Problem
    from wristctl.identification.measured_trials import measured_trials

    settings, trials = study.identify, []
    start: dict[str, float] = {}
    for run in inputs.values():
        config = run.config
        actuator = config.hw_run.actuator
        wrist, (ticks, frames, kinds) = config.wrist, (run.data(name) for name in ("log", "frames", "trials"))
        exposure = settings.exposure
        if exposure is None:
            exposure = 0.0 if config.hw_run.port else config.hw_run.bench.camera.exposure
        length = actuator.step_length
        trials += measured_trials(run.id, wrist, length, settings.step, ticks, frames, kinds, exposure)
        own = {name: getattr(wrist, name) for name in ("stiffness", "damping", "tendon_radius")}
        known = {"tendon_stiffness": actuator.tendon_stiffness, "friction": actuator.friction, "delay": 0.0}
        start = start or own | known
    return Problem(trials, start, settings)


def _parameters(session: Session, found: Fit, known: Knowledge, lacking: Mapping[str, float]) -> Table:
    import pandas as pd

    from wristctl.identification.intervals import interval
    from wristctl.identification.unknowns import UNKNOWNS

    run, rows = session.run, []
    for name, value in found.values.items():
        unknown, start = UNKNOWNS[name], found.problem.start[name]
        held = name not in found.problem.free
        low, high = (value, value) if held else interval(found, known, name)
        verdict = "fixed" if held else "not identified" if name in lacking else "identified"
        rows.append((name, value, low, high, unknown.unit, start, verdict))
        if verdict == "identified":
            run.metric(name, value, unknown.unit, n=len(found.problem.trials), interval=(low, high))
    columns = ("parameter", "value", "low", "high", "unit", "believed", "verdict")
    meaning = {"low": "of the 95 % interval", "high": "of the 95 % interval", "believed": "by the first run's study"}
    run.table("data/parameters.csv", pd.DataFrame(rows, columns=columns), {}, meaning)
    return Table("Parameters with 95 % intervals", columns, rows)


def _fit(session: Session, found: Fit, known: Knowledge) -> Table:
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
        session.run.metric(name, value if np.isfinite(value) else None, unit, n=frames, meaning=meaning)
    names = list(found.problem.free)
    size = len(names)
    matrix = pd.DataFrame(known.correlation[:size, :size], columns=names)
    matrix.insert(0, "parameter", names)
    session.run.table("data/correlation.csv", matrix)
    errors = found.x[size:], known.half_widths[size:]
    small = pd.DataFrame({"error": list(found.problem.coordinates)[size:], "value": errors[0], "half_width": errors[1]})
    units = {"value": "rad (zero), m (spool)", "half_width": "rad (zero), m (spool)"}
    session.run.table("data/zeros.csv", small, units)
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


def _camera(inputs: Mapping[str, Run], found: Fit) -> dict[str, float]:
    """The camera as the frames of all runs show it: rate, frames from exposure to use, noise, dropped share."""
    import numpy as np
    import pandas as pd

    frames = pd.concat([run.data("frames").assign(run=role) for role, run in inputs.items()])
    rate = 1.0 / float(frames.groupby(["run", "trial"]).captured.diff().median())
    used = float((frames.used - frames.captured).mean())
    return {
        "frame_rate": rate,
        "delay_frames": float(np.clip((used + found.values["delay"]) * rate, 0.0, 20.0)),
        "noise_deg": float(np.degrees(found.noise)),
        "dropped": float((frames.verdict != "ok").mean()),
    }


app = study_command(
    "identify",
    work=identify,
    plan=plan,
    inputs=(EarlierRun("runs", kind="hw-run"),),
    argument="runs",
    examples=(
        "wristctl identify latest:hw-run",
        "wristctl identify UPRIGHT_RUN LEVEL_RUN --set fix.friction=0.1",
        "wristctl tune experiments/paper.yaml --from-identified latest:identify",
    ),
)
