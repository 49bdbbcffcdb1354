"""Samples of tip positions and bends."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from wristctl.commands.answer import Answer
from wristctl.commands.gen_data.answer import CLOSED_FORM, QUANTITIES, Measured, answer_of, counted, measured_of, ranged
from wristctl.commands.gen_data.transitions import Moved, plan_transitions, record_transitions
from wristctl.commands.inputs import EarlierRun, Given, Inputs
from wristctl.commands.loop_warnings import warn_of_one_plane
from wristctl.commands.printed_table import Table
from wristctl.commands.procedure import Procedure
from wristctl.commands.quantities import RANGE, keep_range
from wristctl.commands.results import StudyResult
from wristctl.commands.session import Session
from wristctl.config.learning import TrainSettings
from wristctl.config.study import Study
from wristctl.errors import Argument, Call, Setting, UserError
from wristctl.records import Run

if TYPE_CHECKING:
    import pandas as pd

    from wristctl.learning.dataset import Samples
    from wristctl.learning.measured_samples import RecordedCourse
    from wristctl.learning.transitions import Transitions


# Samples beyond which there is no samples.csv, which nobody would read, and the figure shows some of them.
READABLE = 200_000


@dataclass(frozen=True, repr=False, eq=False)
class Generated(StudyResult):
    """Samples of tip positions [m] and bends in P planes [rad]."""

    kind = "gen-data"

    samples: Samples
    measured: Measured | None = None
    """What was read of recordings; None where samples were drawn."""

    @property
    def answer(self) -> Answer:
        """What was drawn or read, with its ranges in deg and mm."""
        why = "" if self.measured else _why_two(self.study)
        ranges = Table("", RANGE, self.tables[0].rows[:-1])
        return answer_of(ranges, self.metrics, self.place, split_of(self.samples), self.measured, why)

    def frame(self) -> pd.DataFrame:
        """One row per sample: the tip, the other inputs, the bend, arc_length; SI units."""
        from wristctl.commands.train.tables import samples_table

        return samples_table(self.samples)


def plan(study: Study, inputs: Inputs) -> str:
    """Plan of a data set."""
    settings, wrist = study.gen_data, study.wrist
    for name, present in (("run", "run" in inputs), ("csv", bool(settings.files))):
        if present and settings.source != name:
            noun = "a run is" if name == "run" else "files are"
            fix = Setting(f"source={name}", "gen-data", option=f"--source {name}")
            raise UserError(f"{noun} given, but source is {settings.source}", "gen-data.source", fix)
    if settings.source == "transitions":
        return plan_transitions(study)
    if settings.measured:
        courses, run = recorded(study, inputs), inputs.runs().get("run")
        result = f"a {inputs['run'].kind} result" if "run" in inputs else counted(len(settings.files), "file")
        whose = run.id if run else result
        measured = measured_of(courses)
        chosen = "all" if settings.samples is None else f"at most {settings.samples} of"
        return f"{chosen} {measured.samples} samples of {whose}, {measured.recordings}"
    within = f"within +-{wrist.range_deg:g} deg"
    if planes_of_study(study) == 2:
        within = f"in two planes by up to {wrist.range_deg:g} deg"
    begin = f"{settings.drawn_samples} samples ({settings.sampling}), bending {within}, "
    if settings.source == "plant":
        tilts = ", ".join(f"{tilt:g}" for tilt in (*settings.poses, *settings.held_out_poses))
        low, high = (100.0 * ratio for ratio in settings.payload)
        return begin + f"{settings.segments} segments, tilted by {tilts} deg, payload {low:g} to {high:g} %"
    low, high = (1e3 * ratio * wrist.length for ratio in settings.stretch)
    return begin + f"arc length {low:g} to {high:g} mm"


def gen_data(session: Session) -> Generated | Moved:
    """Sample tip positions and bends (constant curvature, equilibria under load, earlier runs), or motions."""
    if session.study.gen_data.source == "transitions":
        return record_transitions(session)
    import numpy as np

    from wristctl.commands.gen_data.figures import workspace
    from wristctl.commands.train.figures import coverage
    from wristctl.commands.train.tables import MEANING, UNITS, samples_table
    from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE
    from wristctl.learning.evaluation import angle_errors, exact_bends

    findings = session.findings
    entropy = findings.stream("samples")
    courses = recorded(session.study, session.inputs)
    total = None if courses else session.study.gen_data.drawn_samples
    with session.progress("drawing", total, "samples") as advance:
        samples = drawn(session.study, entropy, courses, advance)
        advance(len(samples.theta))
    table = samples_table(samples)
    planes = samples.planes
    exact = angle_errors(exact_bends(samples.tip), samples.theta, planes)

    count = len(samples.theta)
    with session.progress("writing"):
        if count <= READABLE:
            findings.table("data/samples.csv", table, UNITS, MEANING)
        findings.arrays("data/samples.npz", samples.arrays())
        findings.figure("coverage", coverage, table.iloc[:: -(-count // READABLE)], count)
        findings.figure("workspace", workspace, session.study.wrist, planes)

    findings.metric("samples", count, meaning="number of samples")
    for code, name in ((HELD_PAYLOAD, "payload"), (HELD_POSE, "pose")):
        share = float(np.mean(samples.held_out == code))
        findings.metric(f"held_out_{name}_share", share, n=count, meaning=f"share held out of training by its {name}")
    rows = [
        keep_range(findings, quantity, samples.size if quantity.name == "bend" else table[quantity.name], True)
        for quantity in ranged(planes, samples.names)
    ]
    for name in ("rmse_deg", "max_error_deg"):
        meaning = f"error of the exact inverse {CLOSED_FORM[planes]} on these samples"
        findings.metric(f"exact_inverse_{name}", getattr(exact, name), "deg", "lower", count, meaning=meaning)
    rows.append(("error of the exact inverse", 0.0, exact.max_error_deg, "deg"))
    first = QUANTITIES[planes][0]
    findings.headline(
        "samples", f"{first}_min_deg", f"{first}_max_deg", "exact_inverse_rmse_deg", "exact_inverse_max_error_deg"
    )
    tables = [Table(f"{count} samples", RANGE, rows)]
    return Generated(session.study, findings, tables, samples, measured_of(courses) if courses else None)


def drawn(
    study: Study, entropy: tuple[int, int], courses: Sequence[RecordedCourse], advance: Callable[[int], object] = int
) -> Samples:
    """The samples that the study's gen-data section asks for, of these recordings where it asks for measured ones.

    `advance` is told how many there are by now.
    """
    import numpy as np

    from wristctl.learning.dataset import asked_of, draw_samples

    settings, rng = study.gen_data, np.random.default_rng(entropy)
    if settings.measured:
        from wristctl.learning.measured_samples import samples_of_courses

        return samples_of_courses(courses, settings.samples, rng)
    warn_of_one_plane(study.wrist, [asked_of(settings)])
    if settings.source == "plant":
        from wristctl.learning.dataset import draw_equilibria

        return draw_equilibria(settings, study.wrist, rng, advance)
    return draw_samples(settings, study.wrist, rng)


def split_of(samples: Samples) -> str | None:
    """How `train` can part samples: by recordings, else by samples; None where there are too few for either."""
    import numpy as np

    from wristctl.learning.dataset import split_samples

    settings = TrainSettings()
    for split, recording in (("recording", samples.recording), ("sample", None)):
        with suppress(UserError):
            split_samples(
                len(samples.theta), settings.train_share, np.random.default_rng(0), samples.held_out, recording
            )
            return split
    return None


def samples_of(source: Run | Generated | Moved) -> Samples | Transitions:
    """The samples of a gen-data run or result."""
    from wristctl.learning.dataset import Samples
    from wristctl.learning.transitions import Transitions

    if not isinstance(source, Run):
        return source.samples
    arrays = source.array("samples")
    return Transitions.from_arrays(arrays) if "torque" in arrays else Samples.from_arrays(arrays)


def recorded(study: Study, inputs: Inputs) -> list[RecordedCourse]:
    """The recordings that the study's gen-data section names; none where its samples are drawn. Raises UserError."""
    if not study.gen_data.measured:
        return []
    if study.gen_data.source == "csv":
        from wristctl.learning.measured_samples import read_courses

        if not study.gen_data.files:
            raise UserError("source csv needs files", "gen-data.files", Setting("files=[recording.csv]", "gen-data"))
        names = study.gen_data.columns or ""
        return [course for file in study.gen_data.files for course in read_courses(Path(file), names)]
    courses = inputs.read("run", _courses_of)
    if courses is None:
        fix = Call("gen-data", arguments=(Argument("run", "latest:simulate"),))
        raise UserError("source run needs a run", "gen-data.run", fix)
    return courses


def _courses_of(source: Given) -> list[RecordedCourse]:
    """Tips and bends of every course that a run keeps: tables and arrays with tip_x, tip_y and theta, or in space."""
    from wristctl.learning.measured_samples import NEEDED, courses_in

    courses = [course for name, columns in _kept(source) for course in courses_in(columns, name)]
    if not courses:
        tips = "name a simulate, compare, track or hw-run run; one made before tips were logged has to be repeated"
        raise UserError(
            f"no course in that {source.kind} run: it has no data with {', '.join(NEEDED)}",
            str(source.path) if isinstance(source, Run) else "run",
            tips,
        )
    return courses


def _kept(source: Given) -> list[tuple[str, Mapping[str, Any]]]:
    """Every table and every set of arrays of a run by its name, or what a result would have written of that."""
    if isinstance(source, Run):
        folder = source.path / "data"
        frames = [(file.stem, source.data(file.stem)) for file in sorted(folder.glob("*.csv"))]
        tables = [
            (table_name, {str(name): column.to_numpy() for name, column in frame.items()})
            for table_name, frame in frames
        ]
        return [*tables, *((file.stem, source.array(file.stem)) for file in sorted(folder.glob("*.npz")))]
    return list(source.courses().items())


def planes_of_study(study: Study) -> int:
    """Planes of the samples that a study draws. Raises UserError."""
    from wristctl.learning.dataset import planes_of_samples

    return planes_of_samples(study.gen_data, study.wrist)


def _why_two(study: Study) -> str:
    from wristctl.learning.dataset import asked_of
    from wristctl.simulation.planes import why_two

    reason = why_two(study.wrist, [asked_of(study.gen_data)])
    return reason if " out of " in reason else ""


def pulled_to_samples(study: Study) -> bool:
    """Whether the samples that a study draws are equilibria of a wrist that two sides of tendons hold in one plane."""
    return study.gen_data.source == "plant" and planes_of_study(study) == 1


GEN_DATA = Procedure(
    "gen-data", plan, gen_data, (EarlierRun("run", kind=None, optional=True),), in_one_plane=pulled_to_samples
)
