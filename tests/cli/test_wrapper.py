"""What holds for every command: output, exit codes, one-line errors, dry run, interruption."""

from __future__ import annotations

import json
import os
import pty
import signal
import subprocess
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.records import Run, list_runs, open_run

Command = Callable[..., subprocess.CompletedProcess[str]]
Begin = Callable[..., subprocess.Popen[bytes]]


def _files(folder: Path) -> list[Path]:
    return sorted(folder.rglob("*"))


def test_data_goes_to_stdout_and_the_last_line_is_the_run(probe: Command, tmp_path: Path) -> None:
    done = probe("gen-data", "--label", "quick")
    assert done.returncode == 0, done.stderr
    lines = done.stdout.splitlines()
    run = Run(tmp_path / lines[-1])
    assert (run.state, run.kind, run.manifest.label) == ("ok", "gen-data", "quick")
    assert lines[0] == "Samples"
    assert any(line.split() == ["first", "0.1235"] for line in lines)
    assert not done.stderr, "what takes less than a second is not told"
    assert "\x1b" not in done.stdout + done.stderr
    assert "first      0.1235" in (run.path / "README.md").read_text()


def test_json_is_one_object_with_unrounded_values(probe: Command, tmp_path: Path) -> None:
    done = probe("gen-data", "--json", "-q")
    result = json.loads(done.stdout)
    assert result["tables"][0]["rows"] == [["first", 0.123456], ["second", None]]
    assert result["metrics"]["rmse"]["value"] == 1e-3
    assert result["result_sha256"] == Run(tmp_path / result["run"]).result_hash
    assert done.stderr == ""


def test_the_same_command_and_seed_give_the_same_result_hash(probe: Command) -> None:
    hashes = {json.loads(probe("gen-data", "--seed", "3", "--json").stdout)["result_sha256"] for _ in range(2)}
    assert len(hashes) == 1


def test_dry_run_prints_a_study_and_a_plan_and_writes_nothing(probe: Command, tmp_path: Path) -> None:
    done = probe("gen-data", "--dry-run", "--set", "samples=77", "--seed", "5")
    assert done.returncode == 0
    assert "# 77 samples\n" in done.stdout
    assert _files(tmp_path) == []
    (tmp_path / "again.yaml").write_text(done.stdout)
    again = probe("gen-data", "again.yaml", "--dry-run")
    assert again.stdout == done.stdout


def test_files_options_overrides_and_shortcuts_reach_the_study(probe: Command, tmp_path: Path) -> None:
    probe("gen-data")
    (tmp_path / "a.yaml").write_text("seed: 1\ntrain: {epochs: 3, batch: 5}\n")
    (tmp_path / "b.yaml").write_text("train: {epochs: 4}\n")
    done = probe(
        "train",
        "a.yaml",
        "-c",
        "b.yaml",
        "--set",
        "wrist.length=9e-2",
        "--epochs",
        "6",
        "--seed",
        "8",
        "--data",
        "latest:gen-data",
    )
    assert done.returncode == 0, done.stderr
    run = Run(tmp_path / done.stdout.splitlines()[-1])
    study = run.config
    assert (study.seed, study.train.epochs, study.train.batch, study.wrist.length) == (8, 6, 5, 0.09)
    assert study.train.data == open_run("latest:gen-data", tmp_path / "results").id
    assert run.manifest.inputs[0].role == "data"


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["gen-data", "--set", "sample=3"], "unknown key 'sample' - --set sample=3 - fix: did you mean 'samples'?"),
        (["gen-data", "--set", "samples=many"], "'many' should be a valid integer"),
        (["gen-data", "--set", "wrist.mass=-1"], "-1 should be greater than 0 - --set wrist.mass=-1: wrist.mass"),
        (["gen-data", "--set", "wrist.mass=.nan"], "nan should be a finite number"),
        (["gen-data", "bad.yaml"], "unknown key 'lenght' - bad.yaml:2: wrist.lenght - fix: did you mean 'length'?"),
        (["gen-data", "absent.yaml"], "there is no study file"),
        (["gen-data", "--out", "bad.yaml"], "cannot create a run directory"),
        (["gen-data", "--label", "a/b"], "a label holds"),
        (["gen-data", "--seed", "x"], "fix: wristctl gen-data --help"),
        (["gen-data", "--sede", "3"], "--seed"),
        (["gendata"], "Did you mean 'gen-data'?"),
        (["train"], "train needs a gen-data run - train.data - fix: --data latest:gen-data"),
        (["train", "--data", "foreign"], "not a run directory: it has no run.json"),
        (["train", "--data", "2026"], "no such run"),
        (["train", "--data", "latest:gen-data"], "no gen-data run that ended ok"),
    ],
)
def test_bad_input_is_one_line_and_exit_2_and_leaves_nothing(
    probe: Command, tmp_path: Path, arguments: list[str], said: str
) -> None:
    (tmp_path / "bad.yaml").write_text("wrist:\n  lenght: 0.1\n")
    (tmp_path / "foreign").mkdir()
    before = _files(tmp_path)
    done = probe(*arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert done.stderr.startswith("error: ")
    assert said in done.stderr
    assert _files(tmp_path) == before


def test_an_input_that_was_changed_or_is_of_another_kind_is_refused(probe: Command, tmp_path: Path) -> None:
    data = tmp_path / probe("gen-data").stdout.splitlines()[-1]
    done = probe("train", "--data", data.name)
    again = probe("train", "--data", done.stdout.splitlines()[-1])
    assert (again.returncode, "a train run where a gen-data run is needed" in again.stderr) == (2, True)
    (data / "data" / "samples.csv").write_text("x\n0.1\n")
    changed = probe("train", "--data", str(data))
    assert changed.returncode == 2
    assert len(changed.stderr.splitlines()) == 1
    assert f"hash does not match what was sealed - {data / 'data' / 'samples.csv'}" in changed.stderr


def test_a_bug_is_exit_1_and_says_where_the_traceback_is(probe: Command, tmp_path: Path) -> None:
    done = probe("gen-data", action="bug")
    assert done.returncode == 1
    last = done.stderr.splitlines()[-1]
    assert last.startswith("error: bug in wristctl: ZeroDivisionError: of this probe - the traceback is in ")
    assert "Traceback" not in done.stderr
    (run,) = list_runs(tmp_path / "results")
    assert run.state == "failed"
    assert "ZeroDivisionError: of this probe" in (run.path / "console.log").read_text()
    assert last.endswith(f"{run.id}/console.log")
    assert "Traceback" in probe("gen-data", "--debug", action="bug").stderr


def test_an_error_inside_the_work_keeps_its_exit_code(probe: Command, tmp_path: Path) -> None:
    done = probe("gen-data", action="check")
    assert done.returncode == 3
    assert done.stderr.splitlines()[-1] == "error: the check failed - here - fix: mend it"
    assert [run.state for run in list_runs(tmp_path / "results")] == ["failed"]


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.slow
def test_interruption_ends_with_130_and_keeps_what_was_found(
    begin: Begin, tmp_path: Path, number: signal.Signals
) -> None:
    child = begin("gen-data", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()
    child.send_signal(number)
    _, said = child.communicate()
    (run,) = list_runs(tmp_path / "results")
    assert child.returncode == 130
    assert said.decode().splitlines() == [f"interrupted; what was found: wristctl runs show results/{run.id}"]
    assert run.state == "interrupted"
    assert run.file("data/samples.csv").is_file()
    run.check()


@pytest.mark.slow
def test_a_killed_command_leaves_a_run_that_is_listed_as_crashed(
    begin: Begin, wristctl: Command, tmp_path: Path
) -> None:
    child = begin("gen-data", stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    assert child.stdout is not None
    child.stdout.readline()
    child.kill()
    child.wait()
    listed = json.loads(wristctl("runs", "ls", "--json").stdout)["runs"]
    assert [entry["state"] for entry in listed] == ["crashed"]


@pytest.mark.slow
def test_an_interrupted_terminal_is_left_with_its_cursor(begin: Begin) -> None:
    ours, theirs = pty.openpty()
    child = begin("gen-data", stdin=theirs, stdout=theirs, stderr=theirs)
    os.close(theirs)
    shown = b""
    while b"ready" not in shown:
        shown += os.read(ours, 1000)
    child.send_signal(signal.SIGINT)
    try:
        while piece := os.read(ours, 1000):
            shown += piece
    except OSError:
        pass
    os.close(ours)
    assert child.wait() == 130
    assert b"sampling" in shown, "live progress is shown on a terminal"
    assert shown.count(b"\x1b[?25l") == shown.count(b"\x1b[?25h") == 1
    assert b"Traceback" not in shown


def test_runs_are_listed_and_shown(probe: Command, wristctl: Command, tmp_path: Path) -> None:
    probe("gen-data")
    (tmp_path / "results" / "20200101T000000Z-tune-x").mkdir()
    listed = wristctl("runs", "ls")
    assert listed.returncode == 0
    rows = [line.split() for line in listed.stdout.splitlines()[2:]]
    assert [row[2] for row in rows] == ["broken", "ok"]
    shown = wristctl("runs", "show", "latest:gen-data")
    assert shown.returncode == 0
    assert "rmse" in shown.stdout
    assert "data/samples.csv" in shown.stdout
    record = json.loads(wristctl("runs", "show", "latest:gen-data", "--json").stdout)
    assert (record["state"], record["metrics"]["rmse"]["unit"]) == ("ok", "rad")
    absent = wristctl("runs", "show", "latest:train")
    assert (absent.returncode, len(absent.stderr.splitlines())) == (2, 1)
