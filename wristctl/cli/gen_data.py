"""`wristctl gen-data`: samples of tip positions and bending angles."""

from __future__ import annotations

from typing import TYPE_CHECKING

from wristctl.cli.command import EarlierRun, Session, Table, study_command
from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run

if TYPE_CHECKING:
    from wristctl.learning.dataset import Samples
    from wristctl.wrist.kinematics import Array


def plan(study: Study, inputs: dict[str, Run]) -> str:
    """What a run would draw."""
    settings, wrist = study.gen_data, study.wrist
    if "run" in inputs and settings.source != "run":
        raise UserError("a run is given, but source is " + settings.source, "gen-data.source", "--source run")
    if settings.source == "run":
        courses = _courses(_source(inputs))
        return f"at most {settings.samples} of {sum(map(len, courses))} samples of {inputs['run'].id}"
    begin = f"{settings.samples} samples ({settings.sampling}), bending within +-{wrist.range_deg:g} deg, "
    if settings.source == "plant":
        tilts = ", ".join(f"{tilt:g}" for tilt in (*settings.poses, *settings.held_out_poses))
        low, high = (100.0 * ratio for ratio in settings.payload)
        return begin + f"{settings.segments} segments, tilted by {tilts} deg, payload {low:g} to {high:g} %"
    low, high = (1e3 * ratio * wrist.length for ratio in settings.stretch)
    return begin + f"arc length {low:g} to {high:g} mm"


def gen_data(session: Session) -> Table:
    """Sample tip positions and bending angles: constant curvature, equilibria under load, or earlier runs."""
    import numpy as np

    from wristctl.learning.angle_errors import angle_errors
    from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE
    from wristctl.report.learning_figures import coverage
    from wristctl.report.learning_tables import MEANING, UNITS, samples_table
    from wristctl.wrist.kinematics import exact_angle

    run = session.run
    samples = drawn(session.study, run.stream("samples"), session.inputs)
    table = samples_table(samples)
    exact = angle_errors(exact_angle(samples.tip), samples.theta)

    run.table("data/samples.csv", table, UNITS, MEANING)
    run.arrays("data/samples.npz", samples.arrays())
    run.figure("coverage", coverage(table))

    count = len(samples.theta)
    run.metric("samples", count, meaning="number of samples")
    for code, name in ((HELD_PAYLOAD, "payload"), (HELD_POSE, "pose")):
        share = float(np.mean(samples.held_out == code))
        run.metric(f"held_out_{name}_share", share, n=count, meaning=f"share held out of training by its {name}")
    rows: list[tuple[str, float, float]] = []
    known = {"theta": (180.0 / np.pi, "deg"), "pose": (180.0 / np.pi, "deg"), "hand_mass": (1.0, "kg")}
    for name in ("theta", "arc_length", "x", "y", *samples.names):
        scale, unit = known.get(name, (1e3, "mm"))
        low, high = scale * float(table[name].min()), scale * float(table[name].max())
        rows.append((f"{name} [{unit}]", low, high))
        run.metric(f"{name}_min_{unit}", low, unit=unit, n=count, meaning=f"least: {MEANING[name]}")
        run.metric(f"{name}_max_{unit}", high, unit=unit, n=count, meaning=f"greatest: {MEANING[name]}")
    for name in ("rmse_deg", "max_error_deg"):
        meaning = "error of the exact inverse 2 atan2(y, x) on these samples"
        run.metric(f"exact_inverse_{name}", getattr(exact, name), "deg", "lower", count, meaning=meaning)
    rows.append(("error of the exact inverse [deg]", 0.0, exact.max_error_deg))
    return Table(f"{count} samples", ("quantity", "least", "greatest"), rows)


def drawn(study: Study, entropy: tuple[int, int], inputs: dict[str, Run]) -> Samples:
    """The samples that the study's gen-data section asks for."""
    import numpy as np

    from wristctl.learning.dataset import draw_samples, samples_of_courses

    settings, rng = study.gen_data, np.random.default_rng(entropy)
    if settings.source == "run":
        return samples_of_courses(_courses(_source(inputs)), settings.samples, rng)
    if settings.source == "plant":
        from wristctl.learning.equilibria import draw_equilibria

        return draw_equilibria(settings, study.wrist, rng)
    return draw_samples(settings, study.wrist, rng)


def _source(inputs: dict[str, Run]) -> Run:
    if "run" not in inputs:
        raise UserError("source run needs a run", "gen-data.run", "wristctl gen-data --run latest:simulate")
    return inputs["run"]


def _courses(run: Run) -> list[Array]:
    """Tips and angles of every course that a run keeps: tables and arrays with tip_x, tip_y and theta."""
    import numpy as np

    from wristctl.records.formats import read_arrays, read_table

    wanted = ("tip_x", "tip_y", "theta")
    folder = run.path / "data"
    frames = [read_table(file) for file in sorted(folder.glob("*.csv"))]
    tables = [{str(name): column.to_numpy() for name, column in frame.items()} for frame in frames]
    arrays = [read_arrays(file) for file in sorted(folder.glob("*.npz"))]
    found = [
        np.column_stack([np.asarray(columns[name], np.float64).ravel() for name in wanted])
        for columns in (*tables, *arrays)
        if all(name in columns for name in wanted)
    ]
    if not found:
        raise UserError(
            f"no course in that {run.kind} run: it has no data with {', '.join(wanted)}",
            str(run.path),
            "name a simulate or compare run",
        )
    return found


app = study_command(
    "gen-data",
    work=gen_data,
    plan=plan,
    inputs=(EarlierRun("run", kind=None, optional=True),),
    shortcuts=("samples", "source"),
    examples=(
        "wristctl gen-data experiments/paper.yaml",
        "wristctl gen-data --samples 5000 --label large",
        "wristctl gen-data --source plant --set segments=4",
        "wristctl gen-data --source run --run latest:simulate",
    ),
)
