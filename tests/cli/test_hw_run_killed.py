"""hw-run stopped, killed and interrupted from outside: the board's own watchdog, and what is left of the run."""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest

from tests.bench.record import is_released, last_step, read
from tests.board.patience import wait_for
from wristctl.records import list_runs

THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
pytestmark = pytest.mark.skipif(not THOROUGH, reason="WRISTCTL_THOROUGH=1 (make test-faults)")

ROOT = Path(__file__).parents[2]
TRIAL = (
    "hw-run", "--set", "directions=[ulnar]", "--set", "push.force=0", "--set", "horizon=1.0", "--set", "back=0.3",
    "--set", "reference={duration: 0.8, angle_deg: 5.0}",
    "--set", "controllers=[{controller: smc-tracking, gains: hardware}]",
    "--set", "homing={move: 1.0e-4, rest: 0.06, frames: 2, slack: 5.0e-4, let_go: 1.0}",
)  # fmt: skip
PATIENT = (
    "--real-time", "--set", "safety={watchdog: 2.0, late: 1.9, stale: 1.9}", "--set", "horizon=30",
    "--set", "reference={duration: 20.0, angle_deg: 20.0}",
)  # fmt: skip
"""A slow motion, and a host that may be as late as others on this computer make it."""
STOPPED_WITHIN = 0.05 + 0.1
"""Seconds from the last that the board heard to its last step: a rate's life, and the ramp."""

Start = Callable[..., subprocess.Popen[str]]


@pytest.fixture
def start(tmp_path: Path) -> Iterator[Start]:
    """Starts hw-run in a process, and a process group, of its own; in real time its bench leaves `record`."""
    started = []

    def begin(*options: str) -> subprocess.Popen[str]:
        recording = [Path(__file__).with_name("real_time_hw_run.py"), tmp_path / "record"]
        argv = [sys.executable, *(recording if "--real-time" in options else ["-m", "wristctl"]), *TRIAL, *options]
        child = subprocess.Popen(
            argv, cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, stderr=subprocess.PIPE,
            stdout=subprocess.PIPE, text=True, start_new_session=True,
        )  # fmt: skip
        started.append(child)
        return child

    yield begin
    for child in started:
        child.kill()
        child.communicate()


def wait_for_motion(child: subprocess.Popen[str], folder: Path) -> None:
    """Until a trial's log has some rows."""

    def moves() -> bool:
        return any(len(log.read_text().splitlines()) > 100 for log in folder.glob("results/*/data/log.csv"))

    wait_for(lambda: child.poll() is not None or moves(), 120.0)
    assert child.stderr is not None
    assert child.returncode is None, child.stderr.read()


def test_a_stopped_host_finds_its_motors_stopped_by_the_board_and_seals_its_run(start: Start, tmp_path: Path) -> None:
    child = start(*PATIENT)
    wait_for_motion(child, tmp_path)
    child.send_signal(signal.SIGSTOP)
    record = wait_for(lambda: is_released(r := read(tmp_path / "record")) and r)
    silence = last_step(record) - record["last_heard"]
    print(f"SIGSTOP: last step {1e3 * silence:.1f} ms after the last command")
    assert silence < STOPPED_WITHIN
    child.send_signal(signal.SIGCONT)
    _, said = child.communicate()
    (run,) = list_runs(tmp_path / "results")
    assert child.returncode == 5 and run.state == "failed" and run.problems() == [], said
    assert "Traceback" not in said and ("no command arrived" in said or "ms late" in said), said
    print(said.splitlines()[-1])


def test_a_killed_host_leaves_its_rows_and_motors_stopped_by_the_board(start: Start, tmp_path: Path) -> None:
    child = start(*PATIENT)
    wait_for_motion(child, tmp_path)
    child.kill()
    record = wait_for(lambda: (r := read(tmp_path / "record"))["ended"] and r)
    silence = last_step(record) - record["last_heard"]
    print(f"SIGKILL: last step {1e3 * silence:.1f} ms after the last command")
    assert is_released(record) and silence < STOPPED_WITHIN
    (run,) = list_runs(tmp_path / "results")
    log = pd.read_csv(run.path / "data" / "log.csv")
    assert run.state == "crashed" and record["last_heard"] - log["clock"].iloc[-1] < 1.9


def test_ctrl_c_on_a_terminal_reaches_every_process_and_only_one_answers(start: Start, tmp_path: Path) -> None:
    child = start(*PATIENT)
    wait_for_motion(child, tmp_path)
    os.killpg(child.pid, signal.SIGINT)
    _, said = child.communicate()
    (run,) = list_runs(tmp_path / "results")
    assert child.returncode == 130 and run.state == "interrupted" and run.problems() == [], said
    assert "Traceback" not in said and "the motors stand" in said and "(p99)" in said and "overruns" in said
    assert not any(read(tmp_path / "record")["energised"])


def test_ctrl_c_at_20_random_moments(start: Start, tmp_path: Path) -> None:
    """In virtual time, from the first import to the last picture."""
    began = time.monotonic()
    child = start()
    _, said = child.communicate()
    assert child.returncode == 0, said
    whole, moments = time.monotonic() - began, random.Random(11)
    known = {run.id for run in list_runs(tmp_path / "results")}
    found = []
    for _ in range(20):
        child = start()
        time.sleep(whole * moments.uniform(0.02, 0.98))
        child.send_signal(signal.SIGINT)
        _, said = child.communicate()
        new = [run for run in list_runs(tmp_path / "results") if run.id not in known]
        known |= {run.id for run in new}
        assert child.returncode in (0, 130, -signal.SIGINT) and "Traceback" not in said, said
        for run in new:  # Python takes no signals in its last moments: the run is sealed by then
            assert run.state in (("interrupted", "ok") if child.returncode == 130 else ("ok",)) and run.problems() == []
        stopped = [(run.path / "data" / "stop.json").exists() for run in new]
        found.append((child.returncode, *(run.state for run in new), *stopped))
        if any(stopped):
            assert "the motors stand" in said
    print({each: found.count(each) for each in found})
    assert sum(code == 130 for code, *_ in found) >= 15
