"""Controllers are compared and tuned on wrists that bend in two planes: all rows in the same, as simulate has it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.config.families import Family
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.cases import measure
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.drawn_worlds import asked_of, drawn_cases
from wristctl.simulation.planes import motion_in, planes_of
from wristctl.study_files.load import load_study

pytestmark = pytest.mark.slow

THREE = ("wrist.tendons=three", "compare.horizon=1.5", "compare.loops={sampled: {plant_segments: 2}}",
    "compare.inverses=[none]",
    "compare.controllers=[{controller: pid-ff, gains: default}, {controller: ct-dob, gains: default}]",
    "compare.references=[{kind: circle, angle_deg: 15, turn: 1}, {kind: minimum-jerk, angle_deg: -20}]")  # fmt: skip


def test_rows_are_the_loops_that_simulate_runs_with_columns_of_each_plane(tmp_path: Path) -> None:
    study = load_study([], list(THREE))
    done = wristctl.compare(study, out=tmp_path)
    table = done.frame()
    assert set(table["controller"]) == {"pid-ff", "ct-dob"} and len(table) == 4
    loop = study.compare.loops["sampled"]
    for row in table.to_dict("records"):
        reference = study.compare.references["jerk" in row["reference"]]
        followed, law = motion_in(2, reference, "ulnar", study.wrist, 1.5, 1e-3), controller(row["controller"])
        alone = follow(law, np.array(gains_of(law, "default")), followed, study.wrist, loop).metrics
        for name in ("rmse", "rmse_ulnar", "rmse_flexion", "peak_tension", "chattering"):
            assert row[name] == pytest.approx(alone[name], rel=1e-9), name
    series = done.series()
    assert series["bend_flexion"].shape == series["pull_3"].shape == (4, 300) and "theta" not in series
    assert done.run is not None and not done.run.problems()
    names = {file.stem for file in (done.run.path / "figures").glob("*.png")}
    assert any(name.startswith("overlay") for name in names)
    assert done.summary and "ct-dob" in " ".join(done.summary)


def test_a_wrist_of_four_tendons_is_compared_in_one_plane_until_one_motion_leaves_it() -> None:
    four = [each for each in THREE if "tendons" not in each]
    one = wristctl.compare(load_study([], [*four, "compare.references=[{kind: minimum-jerk}]"])).frame()
    both = wristctl.compare(
        load_study([], [*four, "compare.references=[{kind: minimum-jerk}, {kind: circle}]"])
    ).frame()
    assert "rmse_flexion" not in one and "rmse_flexion" in both
    same = both[both["reference"].str.contains("minimum")].reset_index(drop=True)
    np.testing.assert_allclose(same["rmse"], one["rmse"], rtol=1e-6)
    np.testing.assert_allclose(same["peak_tension"], one["peak_tension"], rtol=1e-6)


def test_what_leaves_the_reach_of_three_weak_tendons_is_warned_of(caplog: pytest.LogCaptureFixture) -> None:
    weak = [*THREE, "wrist.tension_limit=6", "compare.references=[{kind: circle, angle_deg: 40, turn: 1}]"]
    wristctl.compare(load_study([], weak))
    assert any("tensions of 6 N hold at most" in record.message for record in caplog.records)
    with pytest.raises(UserError, match="beyond the wrist's range"):
        wristctl.compare(load_study([], [*THREE, "compare.references=[{kind: circle, angle_deg: 70, turn: 0.5}]"]))


def test_gains_that_are_found_in_two_planes_beat_what_was_tried_first_and_simulate_takes_them(tmp_path: Path) -> None:
    settings = [
        "wrist.tendons=three", "tune.controllers=[pid-ff]", "tune.iterations=3", "tune.candidates=6",
        "tune.horizon=1.0", "tune.loops={here: {plant_segments: 1}}",
        "tune.scenarios=[{loop: here, reference: {kind: circle, angle_deg: 15, turn: 1}}]",
    ]  # fmt: skip
    done = wristctl.tune(load_study([], settings), out=tmp_path)
    search = done.searches["pid-ff"]
    assert search.tried.values.shape == (3, 6) and search.objective == search.tried.values.min()
    assert done.run is not None
    file = done.run.path / "data" / "controllers" / "pid-ff.yaml"
    again = wristctl.simulate(load_study([file], []))
    assert again.trajectory.planes == 2 and again.trajectory.tension.shape[1] == 3 and not again.marks
    assert not any("hw-run" in line for line in done.summary), "no board winds three tendons"


def test_a_family_bends_in_two_planes_in_all_its_worlds_where_one_end_of_a_draw_does() -> None:
    drawn = {"loop": {"plant_segments": 1}, "horizon": 0.6, "references": ({"duration": 0.4},)}
    family = Family.model_validate(drawn | {"draw": {"plant.stiffness_scale": (0.8, 1.2)}})
    aside = Family.model_validate(
        drawn | {"draw": {"disturbances.toward_deg": (0.0, 40.0), "disturbances.load": (1, 2)}}
    )
    wrist = load_study([], []).wrist
    assert (planes_of(wrist, asked_of(family)), planes_of(wrist, asked_of(aside))) == (1, 2)
    law = controller("pid-ff")
    gains = np.array([gains_of(law, "default")])
    cases = drawn_cases(aside, "a", "test", 0, 4, wrist)
    assert all(case.motion.planes == 2 for case in cases)
    found = measure(law, gains, cases, wrist, ("rmse", "oscillation", "energy", "hunting"))
    assert found.places == 4 and (found.metrics["rmse"] > 0.0).all() and (found.metrics["energy"] > 0.0).all()
    for k, case in enumerate(cases):
        alone = follow(law, gains[0], case.motion, wrist, case.loop).metrics
        assert found.metrics["rmse"][0, k] == pytest.approx(alone["rmse"], rel=1e-9)
        assert found.metrics["energy"][0, k] == pytest.approx(alone["energy"], rel=1e-9)


def test_what_is_drawn_within_a_range_or_a_list_takes_a_family_out_of_its_plane_too() -> None:
    drawn = {"loop": {"plant_segments": 1, "disturbances": {"load": 1.0}}, "references": ({"duration": 0.4},)}
    wrist = load_study([], []).wrist
    within = Family.model_validate(drawn | {"draw": {"disturbances.toward_deg": "-180..180"}})
    among = Family.model_validate(drawn | {"draw": {"disturbances.toward_deg": (0.0, 40.0, 180.0)}})
    row = Family.model_validate(drawn | {"together": ({}, {"disturbances.toward_deg": 30.0}, {})})
    along = Family.model_validate(drawn | {"draw": {"disturbances.toward_deg": (0.0, 180.0)}})
    assert [planes_of(wrist, asked_of(one)) for one in (within, among, row, along)] == [2, 2, 2, 1]


LEVEL = ("wrist.gravity=[0,0]", "wrist.gravity_flexion=9.81")
SAYS = "All loops bend in two planes: gravity bends the wrist out of the motion's plane."
SMALL = {
    "compare": ("compare.horizon=0.5", "compare.loops={here: {plant_segments: 1}}", "compare.inverses=[none]",
        "compare.controllers=[{controller: pid-ff, gains: default}]", "compare.references=[{duration: 0.3}]"),
    "tune": ("tune.controllers=[pid-ff]", "tune.iterations=1", "tune.candidates=2", "tune.horizon=0.5",
        "tune.loops={here: {plant_segments: 1}}", "tune.scenarios=[{loop: here, reference: {duration: 0.3}}]"),
}  # fmt: skip


@pytest.mark.parametrize("command", SMALL)
def test_the_answer_says_why_all_bend_in_two_planes_and_one_plane_warns_of_what_it_leaves_out(
    command: str, caplog: pytest.LogCaptureFixture
) -> None:
    perform = getattr(wristctl, command)
    answer = perform(load_study([], [*SMALL[command], *LEVEL])).answer
    assert SAYS in answer.notes
    assert not any("planes" in note for note in perform(load_study([], list(SMALL[command]))).answer.notes)
    assert not caplog.records
    one = f"{command}.loops={{here: {{plant_segments: 1, planes: 1}}}}"
    answer = perform(load_study([], [*SMALL[command], *LEVEL, one])).answer
    assert not any("planes" in note for note in answer.notes)
    (warning,) = [record.getMessage() for record in caplog.records]
    assert warning == "gravity bends the wrist out of the motion's plane, which `planes: 1` leaves out"


def test_families_say_and_warn_too(caplog: pytest.LogCaptureFixture) -> None:
    family = "families={f: {loop: {plant_segments: 1}, horizon: 0.5, references: [{duration: 0.3}]}}"
    row = "compare.controllers=[{controller: pid-ff, gains: default}]"
    settings = [family, row, "compare.worlds={family: f, draws: 4}", *LEVEL]
    answer = wristctl.compare(load_study([], settings)).answer
    assert answer is not None and SAYS in answer.notes
    assert not caplog.records
    wristctl.compare(load_study([], [*settings, "families.f.loop.planes=1"]))
    assert any("which `planes: 1` leaves out" in record.getMessage() for record in caplog.records)


def test_a_ranking_in_two_planes_is_the_same_for_the_same_seed_to_the_hash(tmp_path: Path) -> None:
    family = (
        "families={f: {loop: {plant_segments: 1}, horizon: 0.6, draw: {plant.stiffness: x0.8..1.2, "
        "reference.angle_deg: 10..20, reference.toward_deg: -180..180, reference.turn: 0.6..1}, "
        "references: [{kind: ellipse}, {kind: diagonal, duration: 0.3}]}}"
    )
    rows = "compare.controllers=[{controller: pid-ff, gains: default}, {controller: ct-dob, gains: default}]"
    settings = [family, rows, "compare.worlds={family: f, draws: 8}"]
    runs = [wristctl.compare(load_study([], [*settings, f"seed={seed}"]), out=tmp_path).run for seed in (1, 1, 2)]
    first, again, other = [run.result_hash for run in runs if run is not None]
    assert first == again != other
