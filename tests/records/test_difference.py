"""A difference names what changed and nothing else; a lineage names what came from what."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import InputRun, Run, start_run
from wristctl.records.difference import Change, difference
from wristctl.records.file_comparison import compare_files
from wristctl.records.lineage import ancestry, dependents
from wristctl.records.query import entries
from wristctl.records.remove import removable, remove
from wristctl.records.tags import change_tags, read_tags


def _run(results: Path, kind: str, study: Study, rmse: float = 1.0, inputs: dict[str, Run] | None = None) -> Run:
    read = [InputRun(role, run) for role, run in (inputs or {}).items()]
    with start_run(kind, study, "", results, inputs=read) as run:
        run.metric("rmse", rmse)
    return Run(run.path)


def test_only_what_differs_is_named(results: Path) -> None:
    plain = Study()
    a = _run(results, "tune", plain)
    same = difference(a, _run(results, "tune", plain))
    assert not any(vars(same).values())
    scenario = plain.tune.scenarios[0]
    moved = scenario.model_copy(update={"reference": scenario.reference.model_copy(update={"angle_deg": 21.0})})
    tune = plain.tune.model_copy(update={"candidates": 41, "scenarios": (moved, plain.tune.scenarios[1])})
    found = difference(a, _run(results, "tune", plain.model_copy(update={"tune": tune}), 0.5))
    leaves = [Change("tune.candidates", 40, 41), Change("tune.scenarios[0].reference.angle_deg", 20.0, 21.0)]
    assert found.config == leaves and found.metrics == [Change("rmse", 1.0, 0.5)]
    assert not (found.code or found.environment or found.inputs)


def test_another_machine_package_and_code_file_are_named(results: Path) -> None:
    a, b = _run(results, "tune", Study()), _run(results, "tune", Study())
    manifest = b.manifest
    manifest.environment.cpu = "another"
    manifest.code.tree_sha256 = 64 * "0"
    for name, old, new in (
        ("environment.txt", f"numpy=={np.__version__}", "numpy==0.1"),
        ("code.txt", b.file("code.txt").read_text()[:64], 64 * "f"),
    ):
        (b.path / name).write_text(b.file(name).read_text().replace(old, new, 1))
    manifest.environment.packages["numpy"] = "0.1"
    found = difference(a, b)
    assert [each.name for each in found.environment] == ["cpu", "numpy"]
    assert [each.name for each in found.code] == ["tree", a.file("code.txt").read_text().splitlines()[0][66:]]


def test_lineage_goes_back_to_the_data_and_forward_to_what_was_built_on_it(results: Path) -> None:
    data = _run(results, "gen-data", Study())
    network = _run(results, "train", Study(), inputs={"data": data})
    gains = _run(results, "tune", Study(), inputs={"network": network})
    last = _run(results, "compare", Study(), inputs={"network": network, "tuned": gains})
    tree = ancestry(last)
    assert [each.id for each in tree.inputs] == [network.id, gains.id]
    assert list(tree.lines())[2].strip("│ ") == f"└─ data: {data.id} (ok)"
    assert set(dependents(network, results)) == {gains.id, last.id} and dependents(last, results) == []
    with pytest.raises(UserError, match="2 runs were made from it"):
        removable([network])
    assert [run.id for run in removable([network, gains, last])] == [network.id, gains.id, last.id]
    change_tags(results, network.id, ["old"])
    for run in removable([network], force=True):
        remove(run)
    assert network.id not in {each.id for each in entries(results)} and read_tags(results) == {}
    assert ancestry(last).inputs[0].state == "gone"


def test_a_running_run_cannot_be_removed(results: Path) -> None:
    with start_run("tune", Study(), "", results) as live, pytest.raises(UserError, match="still going on"):
        removable([Run(live.path)], force=True)


def test_files_are_alike_within_tolerance_or_differ_at_a_named_place(tmp_path: Path) -> None:
    time = np.arange(5) / 10
    a, b = tmp_path / "a.csv", tmp_path / "b.csv"
    frame = pd.DataFrame({"time": time, "theta": np.sin(time), "rate": np.cos(time)})
    frame.to_csv(a, index=False)
    frame.assign(theta=frame["theta"] * (1 + 1e-12)).to_csv(b, index=False)
    assert compare_files(a, b).verdict == "within tolerance"
    rate = frame["rate"].to_numpy().copy()
    rate[3:] += 1e-3
    frame.assign(rate=rate).to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "column rate from time 0.3 s; largest difference 0.001")
    frame[:-1].to_csv(b, index=False)
    assert compare_files(a, b) == ("differs", "5 rows of 3 columns before, 4 rows of 3 columns now")


def test_arrays_and_text_are_compared_by_their_numbers(tmp_path: Path) -> None:
    a, b = tmp_path / "a.npz", tmp_path / "b.npz"
    time, theta = np.arange(4) / 2, np.zeros((2, 4))
    np.savez(a, time=time, theta=theta)
    np.savez(b, time=time, theta=theta + np.array([[0, 0, 1, 1], [0, 0, 0, 1]]))
    assert compare_files(a, b).detail == "array theta from row [0, 2]; largest difference 1"
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    first.write_text('{"rmse": 0.1,\n"n": 5}')
    second.write_text('{"rmse": 0.10000000001,\n"n": 5}')
    assert compare_files(first, second).verdict == "within tolerance"
    second.write_text('{"rmse": 0.1,\n"n": 6}')
    assert compare_files(first, second) == ("differs", "line 2: 5 before, 6 now")
    second.write_text('{"rmse": 0.1,\n"m": 5}')
    assert compare_files(first, second) == ("differs", "from line 2")
