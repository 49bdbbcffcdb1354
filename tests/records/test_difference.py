"""A difference names what changed and nothing else; a lineage names what came from what."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import InputRun, Run, start_run
from wristctl.records.difference import Change, difference
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
