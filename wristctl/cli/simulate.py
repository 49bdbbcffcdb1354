"""`wristctl simulate`: one closed loop, with pictures."""

from __future__ import annotations

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.errors import under
from wristctl.config.study import Study
from wristctl.records import Run


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """Check the controller and its gains."""
    from wristctl.cli.loops import check_row, tuned_of

    settings = study.simulate
    with under("simulate"):
        check_row(settings, tuned_of(inputs))
    return f"one rollout of {settings.horizon:g} s"


def simulate(session: Session) -> Table:
    """Simulate one closed loop and draw it."""
    from wristctl.cli.loops import identified, network_of, tuned_of, warn_if_it_buckles, warn_if_outside
    from wristctl.report.loop_figures import angles, errors, tensions
    from wristctl.report.wrist_drawing import stroboscope
    from wristctl.simulation.closed_loop import simulate as run_simulation
    from wristctl.simulation.metrics import METRICS
    from wristctl.simulation.trajectory import COLUMNS

    session = identified(session, "simulate")
    run, wrist = session.run, session.study.wrist
    warn_if_it_buckles(session, [session.settings.loop])
    with session.progress("compiling and simulating the loop"):
        repeated = run_simulation(session.study, network_of(session), tuned_of(session.inputs))
    done = repeated.first
    warn_if_outside(done.metrics["outside_domain"])
    course = done.trajectory
    own = {f"theta_{k + 1}": ("rad", "bending angle of one segment") for k in range(course.segment_theta.shape[1])}
    columns = COLUMNS | own
    units, meaning = ({name: column[i] for name, column in columns.items()} for i in range(2))
    run.table("data/trajectory.csv", course.columns(), units=units, meaning=meaning)
    rows = []
    for name, metric in METRICS.items():
        run.metric(name, done.metrics[name], unit=metric.unit, better="lower", meaning=metric.formula)
        rows.append((name, done.metrics[name], metric.unit, metric.formula))
    for name, unit, formula in (
        ("rmse_desired", "rad", "RMSE against the true wanted angle"),
        ("tip_rmse_mm", "mm", "RMSE of the tip's distance from the wanted position"),
        ("tip_steady_mm", "mm", "mean distance of the tip from the wanted position over the last 10 %"),
        ("outside_domain", "", "share of the wanted tips outside the network's trained domain"),
    ):
        run.metric(name, done.metrics[name], unit=unit, better="lower", meaning=formula)
        rows.append((name, done.metrics[name], unit, formula))
    with session.progress("drawing"):
        run.figure("angle", angles([course]))
        run.figure("error", errors([course]))
        run.figure("tensions", tensions(course))
        run.figure("motion", stroboscope(course, wrist))
    title = f"{course.label}" + (" FAILED: the wrist bent beyond a full turn" if done.failed else "")
    return Table(title, ("metric", "value", "unit", "meaning"), rows)


app = study_command(
    "simulate",
    work=simulate,
    plan=plan,
    inputs=(
        EarlierRun("network", kind="train", optional=True),
        EarlierRun("tuned", kind="tune", optional=True),
        EarlierRun("from_identified", kind="identify", optional=True),
    ),
    shortcuts=("controller", "gains"),
    examples=(
        "wristctl simulate --controller smc --gains exchanged",
        "wristctl simulate --set reference.kind=step --set loop.plant_segments=1",
        "wristctl simulate --gains tuned --tuned latest:tune",
    ),
)
