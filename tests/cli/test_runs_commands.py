"""`wristctl runs ...` as it is typed."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.records import InputRun, Run, start_run


@pytest.fixture
def made(tmp_path: Path) -> tuple[Run, Run]:
    """Data, and a network trained on it, in results/."""
    with start_run("gen-data", Study(), "a", tmp_path / "results") as data:
        data.metric("rmse", 2.0, "rad", "lower")
    inputs = [InputRun("data", Run(data.path))]
    with start_run("train", Study(seed=3), "b", tmp_path / "results", inputs=inputs) as network:
        network.metric("rmse", 1.0, "rad", "lower")
    return Run(data.path), Run(network.path)


def test_ls_shows_what_was_asked_for(call: Call, made: tuple[Run, Run]) -> None:
    data, network = made
    code, out, _ = call("runs", "ls", "--where", "rmse<90")
    assert code == 0 and network.id in out and data.id not in out and out.splitlines()[0].endswith("rmse [deg]")
    listed = json.loads(call("runs", "ls", "--sort", "rmse", "--json")[1])["runs"]
    assert [each["id"] for each in listed] == [network.id, data.id]
    assert listed[0]["inputs"] == [data.id] and listed[0]["metrics"] == {"rmse": 1.0}
    listed = json.loads(call("runs", "ls", "--sort", "rmse", "--reverse", "--json")[1])["runs"]
    assert [each["id"] for each in listed] == [data.id, network.id]
    assert [line.split()[0] for line in call("runs", "ls")[1].splitlines()[2:]] == [data.id, network.id], "oldest first"
    out = call("runs", "ls", "--newer", "1h")[1]
    assert data.id in out and network.id in out
    assert call("runs", "ls", "--older", "1h")[1] == "no runs in results that meet this\n"
    code, _, err = call("runs", "ls", "--where", "rsme<1")
    assert code == 2 and "did you mean 'rmse'?" in err


def test_diff_names_each_part_that_differs(call: Call, made: tuple[Run, Run]) -> None:
    data, network = made
    found = json.loads(call("runs", "diff", data.id, network.id, "--json")[1])
    assert found["config"]["seed"] == {"before": 0, "after": 3}
    assert found["metrics"] == {"rmse": {"before": 2.0, "after": 1.0}}
    assert found["code"] == found["environment"] == {}
    out = call("runs", "diff", data.id, network.id, "--all")[1]
    assert "rmse     114.6   57.3   -57.3         -50  deg" in out
    assert f"before  {data.id}\nafter   {network.id}\n" in out
    out = call("runs", "diff", network.id, data.id, "--all")[1]
    assert "rmse      57.3  114.6    57.3         100  deg" in out
    inputs = json.loads(call("runs", "diff", network.id, data.id, "--json")[1])["inputs"]
    assert inputs == {"data": {"before": data.result_hash, "after": None}}
    assert "nothing differs" in call("runs", "diff", data.id, data.id)[1]


def test_verify_names_the_file_and_fails(call: Call, made: tuple[Run, Run]) -> None:
    data, network = made
    assert call("runs", "verify")[0] == 0
    (network.path / "metrics.json").write_text("{}")
    code, out, err = call("runs", "verify")
    assert code == 3 and "metrics.json: hash does not match" in out and "1 of 2 runs" in err
    assert call("runs", "verify", data.id)[0] == 0


@pytest.mark.parametrize("damage", ["flipped", "torn", "gone"])
def test_a_damaged_manifest_is_named_by_verify_and_refused_as_an_input(
    call: Call, made: tuple[Run, Run], damage: str
) -> None:
    data, network = made
    manifest = data.path / "run.json"
    whole = manifest.read_bytes()
    if damage == "gone":
        manifest.unlink()
    else:
        manifest.write_bytes(whole[:99] if damage == "torn" else whole.replace(b'"gen-data"', b'"gen-eata"', 1))
    what = "sealed file is missing" if damage == "gone" else "hash does not match what was sealed"
    for refs in ((), (data.id,), ("latest:gen-data",)):
        code, out, err = call("runs", "verify", *refs)
        assert code == 3 and f"  run.json: {what}" in out, refs
        assert f"1 of {1 if refs else 2} runs are not as they were sealed" in err
    for ref in (data.id, str(data.path), "latest:gen-data"):
        code, _, err = call("train", "--data", ref)
        assert code == 2 and f"error: {what} - {manifest}" in " ".join(err.split()), ref
    code, out, _ = call("runs", "replay", network.id)
    assert code == 3 and f"cause: input: data: {what} ({manifest})" in out
    for command in ("show", "report"):
        code, _, err = call("runs", command, data.id)
        assert code == 2 and f"error: {what}" in " ".join(err.split()), command
    assert what in call("runs", "ls")[1]
    assert "broken" in call("runs", "lineage", network.id)[1]


def test_rm_asks_and_refuses_to_break_lineage(
    call: Call, made: tuple[Run, Run], monkeypatch: pytest.MonkeyPatch
) -> None:
    data, network = made
    code, _, err = call("runs", "rm", data.id, "--yes")
    assert code == 2 and network.id in err and "--force" in err and data.path.is_dir()
    for answer, left in ((False, True), (True, False)):
        monkeypatch.setattr("typer.confirm", lambda *_, answer=answer, **__: answer)
        assert call("runs", "rm", network.id)[0] == (2 if left else 0)
        assert network.path.is_dir() == left
    assert call("runs", "rm", data.id, "--yes")[0] == 0 and not data.path.exists()


def test_tags_and_lineage_are_shown(call: Call, made: tuple[Run, Run]) -> None:
    data, network = made
    assert call("runs", "tag", data.id, "paper")[0] == 0
    assert json.loads(call("runs", "show", data.id, "--json")[1])["tags"] == ["paper"]
    assert data.id in call("runs", "ls", "--tag", "paper")[1]
    assert f"└─ data: {data.id} (ok)" in call("runs", "lineage", network.id)[1]
    assert f"used by {network.id}" in call("runs", "lineage", data.id)[1]


def test_report_writes_a_page_beside_the_runs(call: Call, made: tuple[Run, Run]) -> None:
    code, out, _ = call("runs", "report", *(run.id for run in made))
    page = Path(out.splitlines()[-1])
    assert code == 0 and page.parent == made[0].path.parent and made[1].id in page.read_text()
    assert call("runs", "report", made[0].id, "--to", "own.html")[0] == 0 and Path("own.html").exists()
    assert json.loads(call("runs", "ls", "--json")[1])["runs"][1]["state"] == "ok"
    assert all(run.problems() == [] for run in made)


def test_a_run_that_did_not_end_well_is_not_repeated(call: Call, tmp_path: Path) -> None:
    with pytest.raises(RuntimeError), start_run("train", Study(), "", tmp_path / "results") as live:
        raise RuntimeError
    code, _, err = call("runs", "replay", live.id)
    assert code == 2 and "run is failed, not ok" in err
