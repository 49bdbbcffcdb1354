"""Whoever reads a command's messages may leave: the work goes on, and its run is whole."""

from __future__ import annotations

import os
import shlex
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from tests.cli.conftest import PROBE, ROOT
from wristctl.config.study import Study
from wristctl.records import list_runs, start_run

PYTHON = shlex.quote(sys.executable)
STREAMS = ["2>&1 |", "2>/dev/null |", "2> >(exec true) |"]


@pytest.mark.parametrize("streams", STREAMS if os.environ.get("WRISTCTL_THOROUGH") else STREAMS[:1])
@pytest.mark.slow
def test_a_closed_pipe_costs_no_run(tmp_path: Path, streams: str) -> None:
    """Closed before a word is said: the first that is, is lost."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = f"{PYTHON} {' '.join(PROBE)} gen-data -v {streams} true; sleep 0.1"
    subprocess.run(["bash", "-c", command], cwd=tmp_path, env=environment, timeout=120)
    deadline = time.monotonic() + 60.0
    while not (runs := list_runs(tmp_path / "results")) or runs[0].state == "running":
        assert time.monotonic() < deadline
        time.sleep(0.05)
    (run,) = runs
    assert run.state == "ok" and run.metrics["rmse"]["value"] == 1e-3
    run.check()


@pytest.mark.slow
def test_a_reader_of_results_may_leave(tmp_path: Path) -> None:
    """Before anything is written, or amid output of more than a pipe holds."""
    with start_run("tune", Study(), "", tmp_path / "results") as live:
        for number in range(3000):
            live.metric(f"a_metric_of_a_long_name_{number}", float(number))
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    for reader in ("true", "head -1"):
        command = f"{PYTHON} -m wristctl runs show {live.id} --metrics | {reader}; echo ${{PIPESTATUS[0]}}"
        asked = ["bash", "-c", command]
        done = subprocess.run(asked, cwd=tmp_path, env=environment, capture_output=True, text=True, timeout=120)
        assert done.stdout.splitlines()[-1] in ("0", "141") and done.stderr == ""


@pytest.mark.slow
def test_an_interrupted_search_names_how_to_go_on(tmp_path: Path) -> None:
    """As typed, for a search that is long enough to be stopped."""
    searched = ("tune", "--candidates", "4", "--iterations", "100000", "--set", "loops={fast: {plant_segments: 1}}",
                "--set", "scenarios=[{loop: fast, reference: {angle_deg: 20}}]", "--set", "horizon=0.5")  # fmt: skip
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    child = subprocess.Popen(
        [sys.executable, "-m", "wristctl", *searched], cwd=tmp_path, env=environment, stderr=subprocess.PIPE
    )
    deadline = time.monotonic() + 120.0
    while not list((tmp_path / "results").glob("*/events.jsonl")) or "iterations" not in _events(tmp_path):
        assert time.monotonic() < deadline and child.poll() is None
        time.sleep(0.1)
    child.send_signal(signal.SIGINT)
    _, said = child.communicate(timeout=120)
    (run,) = list_runs(tmp_path / "results")
    assert child.returncode == 130 and (
        f"go on: wristctl tune results/{run.id}/config.yaml --resume results/{run.id}" in said.decode()
    )


def _events(folder: Path) -> str:
    (events,) = (folder / "results").glob("*/events.jsonl")
    return events.read_text() + ("iterations" if '"tuning smc"' in events.read_text() else "")
