"""`wristctl gen-data`: samples of tip positions and bending angles."""

from __future__ import annotations

from wristctl.cli.command import Session, Table, study_command
from wristctl.config.study import Study
from wristctl.runs import Run


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What a run would draw."""
    settings, wrist = study.gen_data, study.wrist
    low, high = (1e3 * ratio * wrist.length for ratio in settings.stretch)
    return (
        f"{settings.samples} samples ({settings.sampling}), bending within +-{wrist.range_deg:g} deg, "
        f"arc length {low:g} to {high:g} mm"
    )


def gen_data(session: Session) -> Table:
    """Sample tip positions and bending angles of the wrist's constant-curvature model."""
    import numpy as np

    from wristctl.learning.dataset import draw_samples
    from wristctl.learning.metrics import angle_errors
    from wristctl.report.learning_figures import coverage
    from wristctl.report.learning_tables import MEANING, UNITS, samples_table
    from wristctl.wrist.kinematics import exact_angle

    study, run = session.study, session.run
    samples = draw_samples(session.settings, study.wrist, np.random.default_rng(run.stream("samples")))
    table = samples_table(samples)
    exact = angle_errors(exact_angle(samples.tip), samples.theta)

    run.table("data/samples.csv", table, UNITS, MEANING)
    run.arrays("data/samples.npz", samples.arrays())
    run.figure("coverage", coverage(table))

    count = len(samples.theta)
    run.metric("samples", count, meaning="number of samples")
    rows: list[tuple[str, float, float]] = []
    shown = (("theta", 180.0 / np.pi, "deg"), ("arc_length", 1e3, "mm"), ("x", 1e3, "mm"), ("y", 1e3, "mm"))
    for name, scale, unit in shown:
        low, high = scale * float(table[name].min()), scale * float(table[name].max())
        rows.append((f"{name} [{unit}]", low, high))
        run.metric(f"{name}_min_{unit}", low, unit=unit, n=count, meaning=f"least: {MEANING[name]}")
        run.metric(f"{name}_max_{unit}", high, unit=unit, n=count, meaning=f"greatest: {MEANING[name]}")
    run.metric(
        "exact_inverse_max_error_deg",
        exact.max_error_deg,
        unit="deg",
        better="lower",
        n=count,
        meaning="largest error of the exact inverse 2 atan2(y, x) on these samples",
    )
    rows.append(("error of the exact inverse [deg]", 0.0, exact.max_error_deg))
    return Table(f"{count} samples", ("quantity", "least", "greatest"), rows)


app = study_command(
    "gen-data",
    work=gen_data,
    plan=plan,
    shortcuts=("samples",),
    examples=("wristctl gen-data experiments/paper.yaml", "wristctl gen-data --samples 5000 --label large"),
)
