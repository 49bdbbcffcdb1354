"""Inputs by role: as given or as a study names them, read once, recorded, and refused where of another kind."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import wristctl
from tests.commands.conftest import repeated, session
from wristctl.commands.hw_run.command import HW_RUN
from wristctl.commands.inputs import EarlierRun, Inputs, named_for_good, opened
from wristctl.commands.perform import prepare
from wristctl.commands.simulate.results import Simulated
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, start_run
from wristctl.study_files.load import load_study
from wristctl.trial.calibration import WristCalibration
from wristctl.trial.homing import Zero

STUDY = wristctl.load_study(None)
NETWORK, TUNED = EarlierRun("network", "train", optional=True), EarlierRun("tuned", "tune", optional=True)
RUNS = EarlierRun("runs", "hw-run")


def made(out: Path, kind: str) -> Run:
    with start_run(kind, STUDY, "", out) as live:
        pass
    return Run(live.path)


def in_memory() -> Simulated:
    return Simulated(STUDY, session(STUDY).findings, [], repeated("one"))


def test_of_a_need_nothing_is_optional_or_unfinished_unless_said() -> None:
    assert (RUNS.optional, RUNS.unfinished) == (False, False)


def test_an_input_is_read_once_by_each_reader() -> None:
    given = in_memory()
    inputs, read = Inputs({"run": given}), list[Any]()

    def kind(each: Any) -> str:
        read.append(each)
        return str(each.kind)

    def study(each: Any) -> object:
        return each.study

    assert [inputs.read("run", kind) for _ in range(2)] == ["simulate"] * 2 and read == [given]
    assert inputs.read("run", study) is STUDY
    assert inputs.read("network", kind) is None and len(read) == 1
    assert (list(inputs), len(inputs), inputs["run"]) == (["run"], 1, given)
    assert list(Inputs()) == []


def test_runs_and_results_of_runs_are_recorded_and_what_is_in_memory_cannot_be(tmp_path: Path) -> None:
    run, written, given = made(tmp_path, "train"), in_memory(), in_memory()
    with start_run("simulate", STUDY, "", tmp_path) as live:
        written.findings.run = live
    kept = Inputs({"network": run, "run": written})
    assert kept.runs()["network"] is run and kept.runs()["run"].path == live.path
    assert [(each.role, each.run.path) for each in kept.recorded()] == [("network", run.path), ("run", live.path)]
    assert isinstance(kept.recorded()[0], InputRun)
    mixed = Inputs({"network": run, "run": given})
    assert mixed.runs() == {"network": run}
    with pytest.raises(UserError) as caught:
        mixed.recorded()
    assert caught.value.where == "run" and caught.value.fix == "write it too: wristctl simulate --out DIR"


def test_inputs_are_those_given_else_those_that_the_section_names(tmp_path: Path) -> None:
    first, second, tune = made(tmp_path, "train"), made(tmp_path, "train"), made(tmp_path, "tune")
    section = STUDY.simulate.model_copy(update={"network": first.id, "tuned": "latest:tune"})

    def found(given: dict[str, Any]) -> dict[str, Any]:
        opened_ = opened("simulate", section, (NETWORK, TUNED), given, tmp_path)
        return {role: getattr(each, "path", each) for role, each in opened_.items()}

    assert found({}) == {"network": first.path, "tuned": tune.path}
    assert found({"network": None}) == found({})
    for given in (second, second.id, second.path):
        assert found({"network": given})["network"] == second.path
    assert opened("simulate", STUDY.simulate, (NETWORK, TUNED), {}, tmp_path) == {}


def test_a_leaf_of_several_names_each_by_its_place(tmp_path: Path) -> None:
    runs = [made(tmp_path, "hw-run") for _ in range(3)]
    for given in ([each.id for each in runs], tuple(runs), [runs[0], runs[1].path, runs[2].id]):
        inputs = opened("identify", STUDY.identify, (RUNS,), {"runs": given}, tmp_path)
        assert {role: run.path for role, run in inputs.runs().items()} == {
            f"runs[{at}]": each.path for at, each in enumerate(runs)
        }
    for one in (runs[1], runs[1].id):
        assert list(opened("identify", STUDY.identify, (RUNS,), {"runs": one}, tmp_path)) == ["runs[0]"]
    named = STUDY.identify.model_copy(update={"runs": (runs[2].id,)})
    (found,) = opened("identify", named, (RUNS,), {}, tmp_path).runs().values()
    assert found.path == runs[2].path


def test_what_is_missing_is_asked_for_with_a_fix(tmp_path: Path) -> None:
    with pytest.raises(UserError) as caught:
        opened("identify", STUDY.identify, (RUNS,), {}, tmp_path)
    assert str(caught.value) == (
        "identify needs a hw-run run - identify.runs - fix: latest:hw-run, or the path or id of a hw-run run"
    )
    with pytest.raises(UserError) as caught:
        opened("simulate", STUDY.simulate, (EarlierRun("network", "train"),), {}, tmp_path)
    assert caught.value.fix == "--network latest:train, or the path or id of a train run"


def test_another_kind_is_refused_as_a_run_and_as_a_result(tmp_path: Path) -> None:
    tune, given = made(tmp_path, "tune"), in_memory()
    with pytest.raises(UserError, match="train"):
        opened("simulate", STUDY.simulate, (NETWORK,), {"network": tune}, tmp_path)
    with pytest.raises(UserError) as caught:
        opened("simulate", STUDY.simulate, (NETWORK,), {"network": given}, tmp_path)
    assert caught.value.what == "a simulate result where a train run is needed"
    assert caught.value.fix == "for example --network latest:train"
    for kind in ("simulate", None):
        need = EarlierRun("run", kind, optional=True)
        assert opened("gen-data", STUDY.gen_data, (need,), {"run": given}, tmp_path)["run"] is given


def test_a_stopped_run_can_be_taken_up_where_that_is_meant(tmp_path: Path) -> None:
    need = EarlierRun("resume", "train", optional=True, unfinished=True)
    with pytest.raises(KeyboardInterrupt), start_run("train", STUDY, "", tmp_path) as live:
        raise KeyboardInterrupt
    inputs = opened("train", STUDY.train, (need,), {"resume": live.path}, tmp_path)
    assert inputs.runs()["resume"].path == live.path
    with pytest.raises(UserError, match="a tune run where a train run is needed"):
        opened("train", STUDY.train, (need,), {"resume": made(tmp_path, "tune")}, tmp_path)
    with (
        start_run("train", STUDY, "", tmp_path) as live,
        pytest.raises(UserError, match="that run is still going on"),
    ):
        opened("train", STUDY.train, (need,), {"resume": live.path}, tmp_path)


def test_runs_are_named_by_id_within_the_folder_and_by_path_beyond_it(tmp_path: Path) -> None:
    inside, outside = made(tmp_path / "in", "train"), made(tmp_path / "out", "tune")
    inputs = Inputs({"network": inside, "tuned": outside, "from_identified": in_memory()})
    section = named_for_good(inputs, STUDY.simulate, tmp_path / "in")
    assert (section.network, section.tuned, section.from_identified) == (inside.id, str(outside.path), None)
    assert section.horizon == STUDY.simulate.horizon
    several = Inputs({"runs[0]": outside, "runs[1]": inside})
    assert named_for_good(several, STUDY.identify, tmp_path / "in").runs == (str(outside.path), inside.id)


def calibrated_in(out: Path, markers: int, label: str) -> Run:
    """A run that keeps a calibration by so many cameras."""
    zero = Zero((1, 1, 1, 1), (900.0,) * 4, (0.0,) * markers, (0.0,) * 4)
    with start_run("calibrate-wrist", STUDY, label, out) as live:
        live.file("data/wrist.json").write_text(json.dumps(WristCalibration(zero, "ulnar", 1, (0,) * 4).plain()))
    return Run(live.path)


def test_a_calibration_of_other_planes_is_passed_over_and_refused_by_name(tmp_path: Path) -> None:
    """Of a study that gives its planes, and of one whose reference needs two."""
    two, one = calibrated_in(tmp_path, 2, "two"), calibrated_in(tmp_path, 1, "one")
    for settings, fits, other, where in (
        (["planes=2"], two, one, "in two planes"),
        (["reference.kind=circumduction"], two, one, "in two planes"),
        ([], one, two, "in one plane"),
    ):
        study = load_study((), settings, "hw-run")
        prepared = prepare(HW_RUN, study, tmp_path, {"calibration": "latest:calibrate-wrist"})
        assert prepared.inputs.runs()["calibration"].path == fits.path
        with pytest.raises(UserError, match=f"holds no calibration of all axes {where}") as refused:
            prepare(HW_RUN, study, tmp_path, {"calibration": other.id})
        assert refused.value.where == str(other.path)


def test_a_board_without_a_calibration_of_its_planes_is_told_what_makes_one(tmp_path: Path) -> None:
    calibrated_in(tmp_path, 1, "one")
    with pytest.raises(UserError, match=r"no calibrate-wrist run .* in two planes") as refused:
        prepare(HW_RUN, load_study((), ["planes=2"], "hw-run"), tmp_path, {"calibration": "latest:calibrate-wrist"})
    assert "wristctl hw calibrate wrist" in str(refused.value.fix)
