"""A difference names what changed and nothing else; a lineage names what came from what."""

from __future__ import annotations

import json
import shutil
from pathlib import Path

import numpy as np
import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.plotting.page import lineage_picture
from wristctl.records import InputRun, Run, start_run
from wristctl.records.archive import with_ancestors
from wristctl.records.difference import Change, changes, difference
from wristctl.records.find import entries
from wristctl.records.lineage import Ancestor, ancestry, dependents, input_run
from wristctl.records.manifest import Code, Input
from wristctl.records.removal import removable, remove
from wristctl.records.replay import changed_inputs
from wristctl.records.tags import change_tags, read_tags
from wristctl.study_files.load import load_study


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
    assert found.environment == [
        Change("cpu", a.manifest.environment.cpu, "another"),
        Change("numpy", np.__version__, "0.1"),
    ]
    assert [each.name for each in found.code] == ["tree", a.file("code.txt").read_text().splitlines()[0][66:]]


def test_each_fact_of_the_machine_is_named(results: Path) -> None:
    a, b = _run(results, "tune", Study()), _run(results, "tune", Study())
    threads = a.manifest.environment.threads | {"OMP_NUM_THREADS": "7"}
    other = {"python": "3.0.0", "os": "another", "machine": "arm64", "cores": 1000, "threads": threads}
    b.__dict__["manifest"] = a.manifest.model_copy(
        update={"environment": a.manifest.environment.model_copy(update=other)}
    )
    found = {each.name: (each.before, each.after) for each in difference(a, b).environment}
    before = a.manifest.environment
    assert found == {
        **{name: (getattr(before, name), other[name]) for name in ("python", "os", "machine", "cores")},
        "OMP_NUM_THREADS": (before.threads.get("OMP_NUM_THREADS"), "7"),
    }


def test_the_code_is_named_by_version_commit_and_changes(results: Path) -> None:
    a, b = _run(results, "tune", Study()), _run(results, "tune", Study())
    commits = {"before": "0123456789abcdef", "after": "fedcba9876543210"}
    for run, (name, commit), dirty in zip((a, b), commits.items(), (False, True), strict=True):
        run.manifest.code = Code(version=name, commit=commit, dirty=dirty, tree_sha256=4 * commit)
    assert difference(a, b).code == [
        Change("version", "before", "after"),
        Change("commit", "0123456789ab", "fedcba987654 with changes"),
        Change("tree", "0123456789ab", "fedcba987654"),
    ]
    b.manifest.code = a.manifest.code.model_copy(update={"commit": None, "tree_sha256": 64 * "0"})
    assert difference(a, b).code[0] == Change("commit", "0123456789ab", None)
    b.manifest.code = a.manifest.code.model_copy(update={"version": "2", "commit": None})
    assert difference(a, b).code == [], "the same files are the same code, whatever they are called"


def test_a_value_of_another_type_is_a_change_and_what_is_absent_is_none() -> None:
    before = {"a": 1, "b": 1, "c": "x", "d": None}
    after = {"c": "x", "b": True, "a": 1.0, "e": (1, 2)}
    assert changes(before, after) == [Change("a", 1, 1.0), Change("b", 1, True), Change("e", None, (1, 2))]
    assert changes(before, before) == []


def test_an_input_differs_by_its_result_and_not_by_its_name(results: Path) -> None:
    first, same, other = (_run(results, "train", Study(), rmse) for rmse in (1.0, 1.0, 2.0))
    assert first.id != same.id
    a, b, c = (
        _run(results, "tune", load_study([], [f"tune.network={read.id}"]), inputs={"network": read})
        for read in (first, same, other)
    )
    assert not any(vars(difference(a, b)).values()), "another run with the same result is no difference"
    found = difference(a, c)
    assert found.inputs == [Change("network", first.result_hash, other.result_hash)] and found.config == []
    without = _run(results, "tune", Study())
    for one, two, change in ((without, a, (None, first.result_hash)), (a, without, (first.result_hash, None))):
        found = difference(one, two)
        assert found.inputs == [Change("network", *change)] and found.config == [], "of either run"


def test_an_input_is_looked_for_beside_the_run_and_then_where_it_was(results: Path, tmp_path: Path) -> None:
    data = _run(results, "gen-data", Study())
    network = _run(results, "train", Study(), inputs={"data": data})
    moved = shutil.copytree(results, tmp_path / "moved")
    (record,) = network.manifest.inputs
    assert input_run(Run(moved / network.id), record).path == moved / data.id
    shutil.rmtree(moved / data.id)
    assert input_run(Run(moved / network.id), record).path == data.path
    shutil.rmtree(data.path)
    with pytest.raises(UserError, match="the data run is gone"):
        input_run(Run(moved / network.id), record)


def test_an_input_with_another_result_says_so_in_the_lineage(results: Path) -> None:
    data = _run(results, "gen-data", Study())
    network = _run(results, "train", Study(), inputs={"data": data})
    assert [each.state for each in ancestry(network).inputs] == ["ok"]
    other = _run(results, "gen-data", Study(), 2.0)
    shutil.rmtree(data.path)
    other.path.rename(data.path)
    assert [each.state for each in ancestry(network).inputs] == ["another result than was read"]
    assert f"input: data: another result than was read ({data.path})" in changed_inputs(network)


def test_a_tree_of_lineage_is_drawn(results: Path) -> None:
    leaf = Ancestor("d", "gen-data", "ok", "data")
    tree = Ancestor("c", "compare", "ok", "", (Ancestor("n", "train", "ok", "network", (leaf,)), leaf))
    assert list(tree.lines()) == ["c (ok)", "├─ network: n (ok)", "│  └─ data: d (ok)", "└─ data: d (ok)"]


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


@pytest.mark.slow
def test_runs_that_share_their_inputs_are_each_visited_once(results: Path) -> None:
    """24 layers of two runs, each made from both of the layer before it: 2^24 ways lead back."""
    layers = [[_run(results, "gen-data", Study())]]
    for _ in range(24):
        inputs = {f"data[{k}]": run for k, run in enumerate(layers[-1])}
        layers.append([_run(results, "train", Study(), inputs=inputs) for _ in range(2)])
    last, visited = layers[-1][0], 2 * 24
    tree = ancestry(last)
    assert len(tree.runs()) == visited and tree.runs()[-1] is tree and len(tree.plain()) == visited
    lines = list(tree.lines())
    assert len(lines) == 2 * visited - 3 and sum(line.endswith(" - as above") for line in lines) == 2 * 22
    assert lineage_picture(tree).count("<title>") == visited
    assert {run.id for run in with_ancestors(last)} == {one.id for one in tree.runs()}


@pytest.mark.slow
def test_a_chain_of_runs_may_be_as_long_as_it_likes(results: Path) -> None:
    """1,500 runs, by their manifests alone."""
    first = _run(results, "train", Study())
    manifest, before = first.manifest, first.id
    for number in range(1500):
        result = first.result_hash if number == 0 else ""
        record = Input(role="data", kind="train", run=before, path=str(results / before), result_sha256=result)
        before = f"20260101T000000Z-train-{number}"
        (results / before).mkdir()
        content = manifest.model_copy(update={"id": before, "inputs": [record], "result_sha256": None})
        (results / before / "run.json").write_text(content.model_dump_json(by_alias=True))
    tree = ancestry(Run(results / before))
    assert len(tree.runs()) == 1501 and tree.runs()[0].id == first.id
    assert list(tree.lines())[-1].endswith(f"└─ data: {first.id} (ok)")
    assert len(json.loads(json.dumps(tree.plain()))) == 1501 and lineage_picture(tree).count("<title>") == 1501
