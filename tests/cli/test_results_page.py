"""The page in the results folder of a clone: git keeps it and no run, and no command takes it for one."""

from __future__ import annotations

import re
import shutil
import subprocess
import tempfile
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Call
from wristctl.cli.runs import app
from wristctl.config.study import Study
from wristctl.records import Run, start_run
from wristctl.records.tags import known_tags

PAGE = ROOT / "results" / "README.md"


def test_git_keeps_the_page_and_nothing_else_of_results(tmp_path: Path) -> None:
    shutil.copy(ROOT / ".gitignore", tmp_path)
    kept = ["results/README.md", "benchmarks/results/peers.json"]
    left = ["results/run/README.md", "results/.index.json", "results/tags.json", "my-wrist/results/run/run.json"]
    for name in (*kept, *left):
        (tmp_path / name).parent.mkdir(parents=True, exist_ok=True)
        (tmp_path / name).touch()
    subprocess.run(["git", "init", "--quiet"], cwd=tmp_path, check=True)
    call = ["git", "ls-files", "--others", "--exclude-standard"]
    listed = subprocess.run(call, cwd=tmp_path, check=True, capture_output=True, text=True).stdout.split()
    assert sorted(listed) == sorted([".gitignore", *kept])


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """The results folder of a new clone."""
    folder = tmp_path / "results"
    folder.mkdir()
    shutil.copy(PAGE, folder)
    return folder


def test_no_command_takes_the_page_for_a_run_or_touches_it(
    call: Call, results: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))  # replays of others that were killed leave folders
    assert call("runs", "ls") == (0, "no runs in results\n", "")
    with start_run("tune", Study(), "a", results) as live:
        live.metric("rmse", 2.0, "rad", "lower")
    run = Run(live.path)
    for _ in range(2):  # read from the runs, then from the index
        assert [line.split()[0] for line in call("runs", "ls")[1].splitlines()[2:]] == [run.id]
    code, out, _ = call("runs", "verify")
    assert code == 0 and run.id in out and "README" not in out
    assert call("runs", "tag", "latest:tune", "paper")[0] == 0 and known_tags(results) == {run.id: ["paper"]}
    code, _, err = call("runs", "verify", "results/README.md")
    assert code == 2 and "not a run directory" in err
    assert call("runs", "gc", "--yes")[:2] == (0, "nothing is left over in results\n")
    assert call("runs", "rm", run.id, "--yes")[0] == 0
    assert (results / "README.md").read_bytes() == PAGE.read_bytes()


def test_the_page_names_commands_that_there_are() -> None:
    named = re.findall(r"`wristctl runs (\w+)", PAGE.read_text(encoding="utf-8"))
    there = {command.name for command in app.registered_commands}
    assert set(named) >= {"ls", "show", "verify", "replay"} and set(named) <= there
