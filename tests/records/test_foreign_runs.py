"""Runs made by strangers: cycles, ways out of the folder, newer versions, repetitions that are killed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.plotting.page import page
from wristctl.records import InputRun, Run, list_runs, open_run, start_run
from wristctl.records.lineage import ancestry
from wristctl.records.seal import write_seal

Make = Callable[..., Run]


def test_a_run_that_names_itself_as_its_input_is_told_of(make: Make) -> None:
    run = make()
    with start_run("train", Study(), "", run.path.parent, inputs=[InputRun("data", run)]) as live:
        pass
    manifest = live.path / "run.json"
    text = manifest.read_text().replace(run.id, live.id).replace(f'"kind": "{run.kind}"', '"kind": "train"')
    manifest.write_text(text)
    write_seal(live.path, {})
    (itself,) = ancestry(Run(live.path)).inputs
    assert itself.state == "its own ancestor: that cannot be"


def test_an_input_that_leads_out_of_the_results_is_not_followed_by_name(make: Make, tmp_path: Path) -> None:
    """Nor is anything else of such a manifest believed."""
    run = make()
    outside = tmp_path / "outside"
    shutil.copytree(run.path, outside)
    with start_run("train", Study(), "", run.path.parent, inputs=[InputRun("data", run)]) as live:
        pass
    manifest = json.loads((live.path / "run.json").read_text())
    manifest["inputs"][0].update(run="../../outside", path="/nowhere")
    (live.path / "run.json").write_text(json.dumps(manifest))
    write_seal(live.path, {})
    assert Run(live.path).state == "broken"
    with pytest.raises(UserError, match=r"not a manifest.*inputs\.0\.run"):
        ancestry(Run(live.path))


def test_a_key_more_is_passed_over_and_a_later_schema_is_named_and_still_verified(make: Make) -> None:
    run = make()
    content = json.loads((run.path / "run.json").read_text())
    (run.path / "run.json").write_text(json.dumps({**content, "mood": "good"}))
    write_seal(run.path, {})
    assert Run(run.path).state == "ok" and Run(run.path).problems() == []
    (run.path / "run.json").write_text(json.dumps({**content, "schema": "wristctl.run/2"}))
    write_seal(run.path, {})
    found = open_run(run.path)
    with pytest.raises(UserError, match="upgrade wristctl"):
        found.manifest  # noqa: B018
    assert found.state == "broken" and [name for name, _ in found.problems()] == ["run.json"]


@pytest.mark.slow
def test_a_killed_replay_takes_its_repetition_with_it(tmp_path: Path) -> None:
    results, scratch = tmp_path / "results", tmp_path / "tmp"
    scratch.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "TMPDIR": str(scratch)}
    wristctl = [sys.executable, "-P", "-m", "wristctl"]
    made = [*wristctl, "gen-data", "--samples", "2000", "--out", str(results)]
    subprocess.run(made, env=environment, check=True, capture_output=True)
    replay = [*wristctl, "runs", "replay", "latest:gen-data", "--out", str(results)]
    child = subprocess.Popen(replay, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    below = Path(f"/proc/{child.pid}/task/{child.pid}/children")
    while not (found := [each for each in below.read_text().split() if _repeats(each)]):
        time.sleep(0.01)
    child.kill()
    child.wait()
    until = time.monotonic() + 60.0
    while any(Path(f"/proc/{each}/environ").exists() and _lives(each) for each in found):
        assert time.monotonic() < until
        time.sleep(0.02)
    assert "ok" not in [run.state for each in scratch.glob("wristctl-replay-*") for run in list_runs(each)]


def _repeats(pid: str) -> bool:
    """Whether a child is the repetition already, and no longer a copy of its parent."""
    return b"--label\0replay" in Path(f"/proc/{pid}/cmdline").read_bytes()


def _lives(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_a_link_in_a_run_is_not_followed_into_a_report(make: Make, tmp_path: Path) -> None:
    secret = tmp_path / "secret"
    secret.write_text("of this computer")
    for name in ("config.yaml", "tables.json", "data"):
        run = make()
        file = run.path / name
        shutil.rmtree(file) if file.is_dir() else file.unlink(missing_ok=True)
        file.symlink_to(tmp_path if name == "data" else secret)
        with pytest.raises(UserError, match="is a link"):
            run.data("samples") if name == "data" else page(Run(run.path), run.manifest)


ODD_TABLES = [
    b"\xff",
    b"3",
    b"[3]",
    b'[{"title": "a", "columns": ["x"], "rows": [1]}]',
    b'[{"title": 1, "columns": [], "rows": []}]',
    b'[{"title": "", "columns": [], "rows": [[{}]]}]',
    b"[" * 100_000,
]


@pytest.mark.parametrize("content", ODD_TABLES)
def test_odd_tables_are_named_and_no_bug(make: Make, content: bytes) -> None:
    run = make()
    (run.path / "tables.json").write_bytes(content)
    with pytest.raises(UserError, match=r"no tables as wristctl writes them|not valid JSON") as caught:
        page(run, run.manifest)
    assert caught.value.where == str(run.path / "tables.json")
