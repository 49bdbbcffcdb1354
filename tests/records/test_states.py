"""How a run ends is what its directory says, whichever way the process went."""

from __future__ import annotations

import json
import signal
import subprocess
from collections.abc import Callable
from datetime import datetime, tzinfo
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, list_runs, start_run

Start = Callable[[str, Path], subprocess.Popen[str]]

_SLEEPS = """
with start_run("tune", Study(), "", out) as run:
    run.file("data/found.txt").write_text("so far")
    begun(run)
    time.sleep(60)
"""


def _begun(child: subprocess.Popen[str], results: Path) -> Run:
    assert child.stdout is not None
    return Run(results / child.stdout.readline().strip())


@pytest.mark.slow
def test_a_killed_run_reads_as_crashed_and_a_living_one_as_running(process: Start, results: Path) -> None:
    child = process(_SLEEPS, results)
    run = _begun(child, results)
    alive = run.state
    child.send_signal(signal.SIGKILL)
    child.wait()
    assert (alive, run.state) == ("running", "crashed")
    assert json.loads((run.path / "run.json").read_bytes())["state"] == "running"
    assert not (run.path / "SHA256SUMS").exists()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.slow
def test_an_interrupted_run_keeps_and_seals_what_it_wrote(
    process: Start, results: Path, number: signal.Signals
) -> None:
    child = process(_SLEEPS, results)
    run = _begun(child, results)
    child.send_signal(number)
    child.wait()
    assert run.state == "interrupted"
    assert run.manifest.exit_code == 130
    assert run.file("data/found.txt").read_text() == "so far"
    run.check()


@pytest.mark.slow
def test_a_second_interrupt_does_not_disturb_the_sealing(process: Start, results: Path) -> None:
    code = """
import os, signal
def page(path, manifest, undrawn):
    for number in (signal.SIGTERM, signal.SIGINT):
        os.kill(os.getpid(), number)
    return "page"
with start_run("tune", Study(), "", out, page=page) as run:
    begun(run)
    os.kill(os.getpid(), signal.SIGINT)
"""
    child = process(code, results)
    run = _begun(child, results)
    child.wait()
    assert run.state == "interrupted"
    assert run.file("report.html").read_text() == "page"
    run.check()


def test_a_failed_run_says_why_and_raises_again(results: Path) -> None:
    with pytest.raises(ZeroDivisionError), start_run("tune", Study(), "", results) as run:
        run.file("data/found.txt").write_text("so far")
        raise ZeroDivisionError("by hand")
    with pytest.raises(UserError), start_run("tune", Study(), "", results):
        raise UserError("the wrist buckles", "wrist.hand_mass", "a lighter hand")
    first, second = list_runs(results)
    assert (first.state, second.state) == ("failed", "failed")
    assert first.manifest.error is not None and second.manifest.error is not None
    assert (first.manifest.error.type, first.manifest.error.what) == ("ZeroDivisionError", "by hand")
    assert (second.manifest.error.where, second.manifest.exit_code) == ("wrist.hand_mass", 2)
    first.check()


def test_runs_of_the_same_second_have_directories_of_their_own(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    class Stopped(datetime):
        @classmethod
        def now(cls, tz: tzinfo | None = None) -> Stopped:
            return cls(2026, 1, 1, tzinfo=tz)

    monkeypatch.setattr("wristctl.records.start.datetime", Stopped)
    for _ in range(3):
        with start_run("tune", Study(), "", results):
            pass
    ids = [run.id for run in list_runs(results)]
    assert len(set(ids)) == 3 and {name[:16] for name in ids} == {"20260101T000000Z"}


@pytest.mark.slow
def test_processes_at_the_same_time_do_not_share_a_directory(process: Start, results: Path) -> None:
    code = 'with start_run("tune", Study(), "", out) as run: begun(run)'
    children = [process(code, results) for _ in range(4)]
    ids = {child.communicate()[0].strip() for child in children}
    assert len(ids) == 4
    assert {run.id for run in list_runs(results) if run.state == "ok"} == ids


def test_a_folder_that_cannot_be_written_is_an_error_of_the_user(tmp_path: Path) -> None:
    file = tmp_path / "file"
    file.write_text("in the way")
    for out in (file, file / "below", Path("/proc/results")):
        with (
            pytest.raises(UserError, match="cannot create a run directory") as caught,
            start_run("tune", Study(), "", out),
        ):
            pass
        assert str(out) in str(caught.value)


def test_a_label_with_path_characters_is_refused(results: Path) -> None:
    with pytest.raises(UserError, match="a label holds"), start_run("tune", Study(), "../x", results):
        pass
    assert not results.exists()
