"""One closed loop, with pictures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from wristctl.config.errors import under
from wristctl.config.study import Study
from wristctl.report.tables import Table
from wristctl.studies.inputs import EarlierRun, Inputs
from wristctl.studies.loop_inputs import (
    check_inverses,
    check_row,
    identified,
    inverses_of,
    network_for,
    tuned_gains,
    warn_if_it_buckles,
    warn_if_outside,
)
from wristctl.studies.procedure import Procedure
from wristctl.studies.session import Session
from wristctl.studies.study_result import StudyResult

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.simulation.trajectory import Trajectory


@dataclass(frozen=True, repr=False, eq=False)
class Simulated(StudyResult):
    """One closed loop: its trajectory, and whether the wrist bent beyond a full turn."""

    kind = "simulate"

    trajectory: Trajectory
    failed: bool

    def frame(self) -> pd.DataFrame:
        """The trajectory: time, angles, tip, tensions, ...; SI units."""
        return self.trajectory.frame()


def plan(study: Study, inputs: Inputs) -> str:
    """Check the controller and its gains."""
    settings = study.simulate
    with under("simulate"):
        check_row(settings, tuned_gains(inputs))
    return f"one rollout of {settings.horizon:g} s"


def simulate(session: Session) -> Simulated:
    """Simulate one closed loop and draw it."""
    from wristctl.report.loop_figures import angles, errors, tensions
    from wristctl.report.wrist_drawing import stroboscope
    from wristctl.simulation.closed_loop import simulate as run_simulation
    from wristctl.simulation.metrics import METRICS
    from wristctl.simulation.trajectory import COLUMNS

    study, findings = identified(session.study, "simulate", session.inputs), session.findings
    settings, wrist = study.simulate, study.wrist
    warn_if_it_buckles(findings, wrist, [settings.loop])
    network = network_for(session.inputs, wrist, [settings.loop])
    check_inverses(inverses_of([settings.reference]), network)
    with session.progress("compiling and simulating the loop"):
        done = run_simulation(study, network, tuned_gains(session.inputs))
    warn_if_outside(done.metrics["outside_domain"])
    course = done.trajectory
    own = {f"theta_{k + 1}": ("rad", "bending angle of one segment") for k in range(course.segment_theta.shape[1])}
    columns = COLUMNS | own
    units, meaning = ({name: column[i] for name, column in columns.items()} for i in range(2))
    findings.table("data/trajectory.csv", course.columns(), units=units, meaning=meaning)
    rows = []
    for name, metric in METRICS.items():
        findings.metric(name, done.metrics[name], unit=metric.unit, better="lower", meaning=metric.formula)
        rows.append((name, done.metrics[name], metric.unit, metric.formula))
    for name, unit, formula in (
        ("rmse_desired", "rad", "RMSE against the true wanted angle"),
        ("tip_rmse_mm", "mm", "RMSE of the tip's distance from the wanted position"),
        ("tip_steady_mm", "mm", "mean distance of the tip from the wanted position over the last 10 %"),
        ("outside_domain", "", "share of the wanted tips outside the network's trained domain"),
    ):
        findings.metric(name, done.metrics[name], unit=unit, better="lower", meaning=formula)
        rows.append((name, done.metrics[name], unit, formula))
    with session.progress("drawing"):
        findings.figure("angle", angles, [course])
        findings.figure("error", errors, [course])
        findings.figure("tensions", tensions, course)
        findings.figure("motion", stroboscope, course, wrist)
    title = f"{course.label}" + (" FAILED: the wrist bent beyond a full turn" if done.failed else "")
    tables = [Table(title, ("metric", "value", "unit", "meaning"), rows)]
    return Simulated(session.study, findings, tables, course, done.failed)


SIMULATE = Procedure(
    "simulate",
    plan,
    simulate,
    (
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
    ),
)
