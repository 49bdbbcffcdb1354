"""`import wristctl` does what the commands do: in memory, or into the very run directory that they write."""

from __future__ import annotations

import json
import shutil
import sys
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from wristctl.cli.app import main
from wristctl.commands.results import StudyResult
from wristctl.config.controller_row import Row
from wristctl.config.study import Study
from wristctl.control import table as gains_file
from wristctl.errors import UserError
from wristctl.learning import network_file
from wristctl.records import Run

CHAIN = ("gen_data", "train", "tune", "compare", "simulate", "analyse", "hysteresis", "audit")
INPUTS: dict[str, dict[str, str]] = {
    "gen_data": {},
    "train": {"data": "gen_data"},
    "tune": {"network": "train"},
    "compare": {"network": "train", "tuned": "tune"},
    "simulate": {"network": "train", "tuned": "tune"},
    "analyse": {"network": "train", "tuned": "tune"},
    "hysteresis": {},
    "audit": {"table1": "train"},
}
"""What each function is given of those before it."""
MODES = {"hysteresis": {"of": "hysteresis"}}
"""What is a mode of `analyse`."""
MAIN_TABLE = {
    "gen_data": "samples", "train": "trials", "compare": "comparison", "simulate": "trajectory", "analyse": "margins",
    "hysteresis": "loops", "audit": "claims", "identify": "parameters",
}  # fmt: skip
"""The table of the run that `frame` is, where it is one."""

Results = dict[str, StudyResult]


def _chain(study: Study, out: Path | None) -> Results:
    found: Results = {}
    for name in CHAIN:
        given: dict[str, Any] = {leaf: found[earlier] for leaf, earlier in INPUTS[name].items()}
        function = getattr(wristctl, "analyse" if name in MODES else name)
        found[name] = function(study, **given, **MODES.get(name, {}), out=out, label="small" if out else "")
    return found


@pytest.fixture(scope="module")
def in_memory(study: Study, tmp_path_factory: pytest.TempPathFactory) -> Results:
    """The whole chain, each given the results before it, in an empty folder that stays empty."""
    here = tmp_path_factory.mktemp("memory")
    with pytest.MonkeyPatch.context() as during:
        during.chdir(here)
        found = _chain(study, None)
    assert not list(here.iterdir())
    return found


@pytest.fixture(scope="module")
def recorded(study: Study, folder: Path) -> Results:
    """The same in run directories."""
    return _chain(study, folder)


def _values(metrics: Mapping[str, Any]) -> dict[str, Any]:
    found = {name: each["value"] if isinstance(each, dict) else each for name, each in metrics.items()}
    return {name: np.nan if value is None else value for name, value in found.items()}


@pytest.mark.parametrize("name", CHAIN)
@pytest.mark.slow
def test_numbers_are_the_same_in_memory_and_in_a_sealed_run(name: str, in_memory: Results, recorded: Results) -> None:
    memory, kept = in_memory[name], recorded[name]
    assert memory.run is None and isinstance(kept.run, Run) and kept.run.state == "ok" and kept.run.problems() == []
    np.testing.assert_equal(memory.metrics, kept.metrics)
    np.testing.assert_equal(_values(kept.run.metrics), {k: v if v == v else np.nan for k, v in kept.metrics.items()})
    pd.testing.assert_frame_equal(memory.frame(), kept.frame())
    if name in MAIN_TABLE:
        pd.testing.assert_frame_equal(
            kept.frame().replace("", np.nan), kept.run.data(MAIN_TABLE[name]).replace("", np.nan), check_dtype=False
        )
    assert [table.title for table in memory.tables] == [table.title for table in kept.tables]
    drawn = {file.stem for file in (kept.run.path / "figures").glob("*.svg")}
    assert set(memory.figures) == set(kept.figures) == set(kept.findings.overview.captions)
    assert drawn <= set(kept.figures), "what is left for later is known of"


@pytest.mark.parametrize("name", ["gen_data", "train", "tune", "simulate"])
def test_out_leaves_what_the_command_leaves(
    name: str, recorded: Results, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The same result hash, the same files; and the run's configuration, given to the command, does it all again."""
    run = recorded[name].run
    assert run is not None
    shutil.copytree(run.path.parent, tmp_path / "results")
    monkeypatch.chdir(tmp_path)
    command = name.replace("_", "-")
    config = str(tmp_path / "results" / run.id / "config.yaml")
    monkeypatch.setattr(sys, "argv", ["wristctl", command, "-c", config, "--label", "typed", "-q"])
    with pytest.raises(SystemExit) as ended:
        main()
    typed = wristctl.open_run(f"latest:{command}")
    assert ended.value.code == 0 and typed.manifest.label == "typed" and typed.result_hash == run.result_hash

    def names(each: Run) -> set[str]:
        return {file.relative_to(each.path).as_posix() for file in each.path.rglob("*")}

    assert names(typed) == names(run)
    assert [(each.role, each.run) for each in typed.manifest.inputs] == [
        (each.role, each.run) for each in run.manifest.inputs
    ]


def test_inputs_are_recorded_by_their_runs(recorded: Results) -> None:
    compared = recorded["compare"].run
    assert compared is not None
    inputs = {each.role: each.run for each in compared.manifest.inputs}
    ids = {name: found.run.id for name, found in recorded.items() if found.run is not None}
    assert inputs == {"network": ids["train"], "tuned": ids["tune"]}
    assert recorded["compare"].study.compare.tuned == ids["tune"] == compared.config.compare.tuned


def test_an_input_may_be_a_result_a_run_an_id_a_path_or_the_latest(
    study: Study, recorded: Results, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder.parent)
    network, tuned = recorded["train"].run, recorded["tune"].run
    assert network is not None and tuned is not None
    expected = recorded["simulate"].metrics
    for given in (
        {"network": recorded["train"], "tuned": tuned},
        {"network": network.id, "tuned": str(tuned.path)},
        {"network": "latest:train", "tuned": tuned.path},
    ):
        np.testing.assert_equal(wristctl.simulate(study, **given).metrics, expected)
    named = study.simulate.model_copy(update={"network": "latest:train", "tuned": "latest:tune"})
    in_study = study.model_copy(update={"simulate": named})
    np.testing.assert_equal(wristctl.simulate(in_study).metrics, expected)


def test_a_network_and_gains_are_read_once_by_plan_search_and_comparison(
    study: Study, recorded: Results, folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    read: list[str] = []

    def counted(function: Callable[[Path], Any]) -> Callable[[Path], Any]:
        def counting(path: Path) -> Any:
            read.append(function.__name__)
            return function(path)

        return counting

    monkeypatch.setattr(network_file, "load_network", counted(network_file.load_network))
    monkeypatch.setattr(gains_file, "read_gains", counted(gains_file.read_gains))
    network, tuned = recorded["train"].run, recorded["tune"].run
    step = {"kind": "step", "angle_deg": 10.0, "inverse": "network"}
    search = {"candidates": 2, "iterations": 1, "horizon": 0.1, "loops": {"fast": {"plant_segments": 1}}}
    search |= {"controllers": ["pid"], "scenarios": [{"loop": "fast", "reference": step}]}
    (folder.parent / "search.yaml").write_text(json.dumps({"compare": {"tuning": search}}))
    tuning = wristctl.load_study(folder.parent / "search.yaml").compare.tuning
    rows = (*study.compare.rows, Row(controller="pid", gains="tuned"))
    compared = study.compare.model_copy(update={"tuning": tuning, "rows": rows})
    done = wristctl.compare(study.model_copy(update={"compare": compared}), network=network, tuned=tuned)
    assert sorted(read) == ["load_network", "read_gains"] and set(done.searches) == {"pid"}


def test_samples_may_come_from_courses_in_memory(in_memory: Results, recorded: Results) -> None:
    again = wristctl.load_study(None, "gen-data={source: run, samples: 30}")
    for name in ("simulate", "compare"):
        memory, kept = (wristctl.gen_data(again, run=found[name]) for found in (in_memory, recorded))  # type: ignore[arg-type]
        from_run = wristctl.gen_data(again, run=recorded[name].run)
        pd.testing.assert_frame_equal(memory.frame(), from_run.frame())
        pd.testing.assert_frame_equal(kept.frame(), from_run.frame())
    with pytest.raises(UserError, match="no course in that tune"):
        wristctl.gen_data(again, run=in_memory["tune"])  # type: ignore[arg-type]


def test_domain_objects_are_what_they_are_called(in_memory: Results) -> None:
    found: Any = in_memory
    samples, network = found["gen_data"].samples, found["train"].network
    assert len(samples.theta) == 40 and np.isfinite(network.angle(samples.tip)).all()
    assert found["train"].choice is None and len(found["train"].trials["network"]) == 1
    assert set(found["tune"].gains) == {"smc", "pid"} and set(found["tune"].gains["smc"]) == {"P1", "P2", "P3"}
    assert list(found["tune"].frame().columns[:4]) == ["controller", "restart", "iteration", "candidate"]
    assert len(found["tune"].frame()) == 2 * 2 * 2
    assert [row.label for row in found["compare"].rows] == ["smc/tuned", "feedforward/default"]
    assert found["simulate"].failed is False
    pd.testing.assert_frame_equal(found["simulate"].frame(), found["simulate"].trajectory.frame())
    assert found["audit"].judgements[0].verdict == "contradicted"


def test_a_figure_is_drawn_when_it_is_asked_for_and_once(in_memory: Results, tmp_path: Path) -> None:
    figures = in_memory["simulate"].figures
    assert list(figures) == ["course", "angle", "error", "tensions", "sliding", "motion"] and len(figures) == 6
    angle = figures["angle"]
    assert angle is figures["angle"] and angle.axes
    angle.savefig(tmp_path / "angle.png")
    assert (tmp_path / "angle.png").stat().st_size > 1000
    with pytest.raises(KeyError):
        figures["angel"]


def test_a_result_shows_itself_in_a_line_and_as_the_command_prints_it(in_memory: Results, recorded: Results) -> None:
    memory, kept = in_memory["tune"], recorded["tune"]
    assert repr(memory).startswith("<Tuned: in memory; ") and "convergence" in repr(memory)
    assert kept.run is not None and str(kept.run.path) in repr(kept)
    assert str(memory.tables) == str(kept.tables) and memory.tables[0].text() in str(memory)
    assert str(kept) in (kept.run.path / "console.log").read_text()


def test_nothing_is_printed_and_progress_is_told_to_whom_asks(
    study: Study, in_memory: Results, capfd: pytest.CaptureFixture[str]
) -> None:
    told: list[tuple[str, int, int | None, Mapping[str, float]]] = []
    wristctl.tune(study, network=in_memory["train"], progress=lambda *all_: told.append(all_))  # type: ignore[arg-type]
    counts = [(count, total, facts) for what, count, total, facts in told if what == "tuning smc"]
    assert [told_of[:2] for told_of in counts] == [(0, 2), (1, 2), (2, 2)] and np.isfinite(counts[-1][2]["best"])
    assert capfd.readouterr() == ("", "")


def test_runs_are_a_table_with_the_filters_of_the_command(
    recorded: Results, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    table = wristctl.runs(out=folder)
    assert list(table["kind"]) == ["gen-data", "train", "tune", "compare", "simulate", "analyse", "analyse", "audit"]
    assert set(table["label"]) == {"small"} and (table["state"] == "ok").all()
    assert table.set_index("kind")["rmse"]["simulate"] == recorded["simulate"].metrics["rmse"]
    low = wristctl.runs("rmse<1e9", kind="simulate", newer="1d", out=folder)
    assert list(low["id"]) == [recorded["simulate"].run.id]  # type: ignore[union-attr]
    assert wristctl.runs(where=["rmse<-1"], out=folder).empty and wristctl.runs(out=folder / "none").empty
    assert wristctl.runs(sort="kind", reverse=True, out=folder)["kind"][0] == "tune"
    monkeypatch.setattr(sys, "argv", ["wristctl", "runs", "ls", "--kind", "t*", "--json", "--out", str(folder)])
    with pytest.raises(SystemExit):
        main()
    listed = [each["id"] for each in json.loads(capsys.readouterr().out)["runs"]]
    assert listed == list(wristctl.runs(kind="t*", out=folder)["id"]) and len(listed) == 2
