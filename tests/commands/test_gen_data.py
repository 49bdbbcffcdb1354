"""Samples as they are told: which would be drawn, their ranges in mm and deg, what is held out, courses of a run."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, repeated, session
from wristctl.commands.gen_data.command import GEN_DATA, Generated, samples_of
from wristctl.commands.inputs import Inputs
from wristctl.commands.simulate.results import Simulated
from wristctl.commands.train.command import TRAIN
from wristctl.commands.train.tables import MEANING
from wristctl.errors import UserError
from wristctl.learning import dataset
from wristctl.learning import dataset as equilibria
from wristctl.learning.dataset import HELD_PAYLOAD, HELD_POSE, Samples
from wristctl.learning.domain import Domain
from wristctl.learning.evaluation import angle_errors
from wristctl.records import Run, start_run
from wristctl.wrist.kinematics import arc_tip, exact_angle

TIP = np.array([[0.08, 0.01], [0.07, -0.02], [0.06, 0.03], [0.05, 0.04]])
OTHERS = np.array([[-0.5, 0.1], [0.25, 0.4], [0.0, 0.2], [0.1, 0.3]])
THETA = exact_angle(TIP) + np.radians([1.0, -3.0, 0.0, 2.0])
LENGTHS = np.array([0.081, 0.085, 0.09, 0.095])
Generate = Callable[..., Generated]


def samples(others: bool = True) -> Samples:
    """Four samples, one held out by its payload, two by their pose."""
    names, columns = (("pose", "hand_mass"), OTHERS) if others else ((), OTHERS[:, :0])
    held = np.array([HELD_PAYLOAD, HELD_POSE, 0, HELD_POSE])
    return Samples(TIP, THETA, LENGTHS, Domain((-1.0, 1.0), (0.0, 1.0)), columns, names, held, 3)


@pytest.fixture
def generate(monkeypatch: pytest.MonkeyPatch) -> Generate:
    """Samples that were drawn as these four."""

    def drawn(settings: Any, wrist: Any, rng: Any, done: Any = None) -> Samples:
        assert (settings.samples, wrist.length) == (50, 0.1) and isinstance(rng, np.random.Generator)
        return samples(settings.source == "plant")

    monkeypatch.setattr(dataset, "draw_samples", drawn)
    monkeypatch.setattr(equilibria, "draw_equilibria", drawn)

    def generated(source: str, run: Any = None) -> Any:
        study = wristctl.load_study(None, f"gen-data={{source: {source}, samples: 50}}", "wrist.length=0.1")
        return GEN_DATA.perform(session(study, run))

    return generated


def test_ranges_are_told_in_deg_mm_and_kg(generate: Generate) -> None:
    done = generate("plant")
    error = angle_errors(exact_angle(TIP), THETA)
    degrees = np.degrees(THETA)
    (table,) = done.tables
    assert table.title == "4 samples" and table.columns == ("quantity", "least", "greatest", "unit")
    names = ["theta [deg]", "arc_length [mm]", "x [mm]", "y [mm]", "pose [deg]", "hand_mass [kg]"]
    assert [row[0] for row in table.rows] == [
        "bending angle", "arc length", "tip, along the straight wrist", "tip, aside", "tilt of the wrist",
        "mass in the hand", "error of the exact inverse",
    ]  # fmt: skip
    assert [row[3] for row in table.rows] == ["deg", "mm", "mm", "mm", "deg", "kg", "deg"]
    assert done.answer.table is not None and list(done.answer.table.rows) == list(table.rows[:-1])
    ends = [
        (degrees.min(), degrees.max()), (81.0, 95.0), (50.0, 80.0), (-20.0, 40.0),
        (math.degrees(-0.5), math.degrees(0.25)), (0.1, 0.4), (0.0, 3.0),
    ]  # fmt: skip
    np.testing.assert_allclose([row[1:3] for row in table.rows], ends, atol=1e-9)
    for name, (low, high) in zip(names, ends[:-1], strict=True):
        quantity, unit = name.removesuffix("]").split(" [")
        metrics = [done.findings.metrics[f"{quantity}_{end}_{unit}"] for end in ("min", "max")]
        assert [each["value"] for each in metrics] == pytest.approx([low, high])
        assert {(each["unit"], each["n"]) for each in metrics} == {(unit, 4)}
        assert [each["meaning"] for each in metrics] == [f"{end}: {MEANING[quantity]}" for end in ("least", "greatest")]
    known = done.metrics
    shares = {"held_out_payload_share": 0.25, "held_out_pose_share": 0.5}
    assert list(known.items())[:3] == [("samples", 4), *shares.items()]
    assert known["exact_inverse_max_error_deg"] == pytest.approx(3.0)
    assert known["exact_inverse_rmse_deg"] == pytest.approx(error.rmse_deg) == pytest.approx(math.sqrt(14.0 / 4.0))
    assert known_of(done.findings, "exact_inverse_rmse_deg", "held_out_pose_share") == [
        ("deg", "lower", 4),
        ("", "", 4),
    ]
    assert list(done.figures) == ["coverage", "workspace"]


def test_samples_without_other_inputs_name_none(generate: Generate) -> None:
    rows = generate("pcc").tables[0].rows
    assert [row[0].split()[0] for row in rows] == ["bending", "arc", "tip,", "tip,", "error"]


def test_a_run_keeps_samples_that_are_read_back_whole(generate: Generate, tmp_path: Path) -> None:
    with start_run("gen-data", wristctl.load_study(None), "", tmp_path) as live:
        done = generate("plant", live)
    run = Run(live.path)
    columns = columns_of(run, "data/samples.csv")
    assert columns["theta"] == ("rad", "bending angle") and columns["x"][0] == "m"
    pd.testing.assert_frame_equal(run.data("samples"), done.frame())
    for each in (samples_of(run), samples_of(done)):
        assert isinstance(each, Samples)
        np.testing.assert_array_equal(each.inputs, samples().inputs)
        assert (each.segments, list(each.held_out)) == (3, [HELD_PAYLOAD, HELD_POSE, 0, HELD_POSE])


def plan(settings: str, **inputs: Any) -> str:
    study = wristctl.load_study(None, f"gen-data={{samples: 30, {settings}}}", "wrist={length: 0.2, range_deg: 50}")
    return GEN_DATA.plan(study, Inputs(inputs))


def test_a_plan_says_what_would_be_drawn() -> None:
    assert plan("source: pcc, sampling: uniform, stretch: [0.5, 1.25]") == (
        "30 samples (uniform), bending within +-50 deg, arc length 100 to 250 mm"
    )
    plant = "source: plant, sampling: uniform, segments: 3, poses: [0, 45], held_out_poses: [30], payload: [0.5, 2.0]"
    assert plan(plant) == (
        "30 samples (uniform), bending within +-50 deg, 3 segments, tilted by 0, 45, 30 deg, payload 50 to 200 %"
    )


def simulated() -> Any:
    study = wristctl.load_study(None)
    return Simulated(study, session(study).findings, [], repeated("one"))


def test_courses_of_a_result_are_what_is_sampled() -> None:
    given = simulated()
    assert plan("source: run", run=given) == "at most 30 of 200 samples of a simulate result, 1 recording"
    study = wristctl.load_study(None, "gen-data={source: run, samples: 30}")
    done: Any = GEN_DATA.perform(session(study, inputs={"run": given}))
    course = given.trajectory
    rows = {(*tip, theta) for tip, theta in zip(course.tip.tolist(), course.theta.tolist(), strict=True)}
    drawn = [(*tip, theta) for tip, theta in zip(done.samples.tip.tolist(), done.samples.theta.tolist(), strict=True)]
    assert len(drawn) == 30 == len(set(drawn)) and set(drawn) <= rows
    again: Any = GEN_DATA.perform(session(study, inputs={"run": given}))
    np.testing.assert_array_equal(again.samples.theta, done.samples.theta)


def made_run(tmp_path: Path, tables: dict[str, Sequence[str]], arrays: dict[str, Sequence[str]]) -> Run:
    with start_run("compare", wristctl.load_study(None), "", tmp_path) as live:
        for name, columns in tables.items():
            live.table(f"data/{name}.csv", {column: np.arange(12.0) for column in columns})
        for name, columns in arrays.items():
            live.arrays(f"data/{name}.npz", {column: 100.0 + np.arange(8.0).reshape(2, 4) for column in columns})
    return Run(live.path)


def test_every_table_and_array_of_a_run_with_tip_and_angle_is_a_course(tmp_path: Path) -> None:
    whole = ("tip_y", "theta", "tip_x")
    run = made_run(tmp_path, {"b": whole, "a": (*whole, "time"), "c": whole[:2]}, {"z": whole, "y": ("theta",)})
    assert plan("source: run", run=run) == f"at most 30 of {12 + 12 + 8} samples of {run.id}, 4 recordings"
    with pytest.raises(UserError) as caught:
        plan("source: run", run=made_run(tmp_path, {"c": whole[:2]}, {}))
    assert caught.value.what == "no course in that compare run: it has no data with tip_x, tip_y, theta"
    assert Path(caught.value.where).parent == tmp_path


def test_a_run_and_its_source_belong_together() -> None:
    with pytest.raises(UserError, match="a run is given, but source is pcc") as caught:
        plan("source: pcc", run=simulated())
    assert "--source run" in str(caught.value)
    with pytest.raises(UserError, match="source run needs a run"):
        plan("source: run")
    (need,) = GEN_DATA.needs
    assert need.optional and need.kind is None


@pytest.fixture
def logs(tmp_path: Path) -> list[Path]:
    """Files with 1,200 rows in all, one of them without an angle."""
    files = []
    for number in range(4):
        theta = np.random.default_rng(number).uniform(-0.6, 0.6, 300)
        columns = np.column_stack([1e3 * arc_tip(theta, 0.08), np.degrees(theta)])
        columns[7:8, 2] = math.nan if number == 2 else columns[7, 2]
        files.append(tmp_path / f"log{number}.csv")
        rows = [",".join(map(repr, row)) for row in columns.tolist()]
        files[-1].write_text("\n".join(["tip_x [mm],tip_y [mm],angle [deg]", *rows]) + "\n")
    return files


@pytest.mark.parametrize(
    ("samples", "planned", "said", "count"),
    [
        ("null", "all 1199 samples of 4 files", "all of 4 recordings", 1199),
        ("1000", "at most 1000 of 1199 samples of 4 files", "drawn from the 1199 of 4 recordings", 1000),
    ],
)
def test_of_recordings_every_sample_is_taken_unless_a_number_is_given(
    tmp_path: Path, logs: list[Path], samples: str, planned: str, said: str, count: int
) -> None:
    named = ", ".join(map(str, logs))
    study = wristctl.load_study(None, f"gen-data={{source: csv, files: [{named}], samples: {samples}}}")
    left_out = "(left out: 1 row without a tip or an angle)"
    assert GEN_DATA.plan(study, Inputs()) == f"{planned}, 4 recordings {left_out}"
    done = wristctl.gen_data(study, out=tmp_path / "runs")
    assert done.run is not None and len(done.run.array("samples")["theta"]) == count
    for text in (" ".join(done.answer.lines()), done.run.file("README.md").read_text().replace("\n", " ")):
        assert f"{count} samples of tip position" in text and f"{said} {left_out}" in text


def test_the_numbers_of_samples_that_are_drawn_and_read_are_the_papers_and_all(logs: list[Path]) -> None:
    assert GEN_DATA.plan(wristctl.load_study(None), Inputs()).startswith("1000 samples (sobol)")
    measured = wristctl.load_study(None, "gen-data.source=csv", f"gen-data.files=[{', '.join(map(str, logs))}]")
    assert "on samples of its own: 599 samples to train on, 300 to choose by, 300" in TRAIN.plan(measured, Inputs())


@pytest.mark.painted
@pytest.mark.slow
def test_of_more_samples_than_anybody_reads_the_arrays_alone_are_kept(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wristctl.commands.gen_data.command.READABLE", 100)
    for count, csv, shown in ((100, True, "100"), (250, False, "84 of 250")):
        study = wristctl.load_study(None, f"gen-data.samples={count}")
        with start_run("gen-data", study, "", tmp_path) as live:
            GEN_DATA.perform(session(study, live))
        run = Run(live.path)
        assert (run.path / "data" / "samples.csv").exists() == csv
        assert len(run.array("samples")["theta"]) == count == run.metrics["samples"]["value"]
        assert f"<!-- {shown} samples of the tip -->" in run.file("figures/coverage.svg").read_text()


@pytest.mark.parametrize("source", ["pcc", "plant"])
def test_the_answer_gives_the_ranges_of_every_quantity_in_deg_and_mm(generate: Generate, source: str) -> None:
    done = generate(source)
    lines, table = done.summary, done.answer.table
    assert table is not None and len(lines) <= 32 and max(map(len, lines)) <= 100
    ranges = [(row[1], row[2]) for row in done.tables[0].rows[:-1]]
    assert [row[1:3] for row in table.rows] == ranges and len(ranges) == (6 if source == "plant" else 4)
    assert {row[3] for row in table.rows} <= {"deg", "mm", "kg"} and lines[0].startswith("4 samples ")
    assert f"{done.metrics['exact_inverse_max_error_deg']:.2g} deg" in " ".join(lines)
    assert "25 % by their payload, 50 % by their pose" in " ".join(lines)
