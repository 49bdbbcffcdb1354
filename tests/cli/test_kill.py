"""However a command is killed, no directory looks complete that is not, and none stops the listing."""

from __future__ import annotations

import os
import random
import subprocess
import sys
import time
from pathlib import Path

from wristctl.runs import list_runs

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
KILLS = 50 if THOROUGH else 4
FAST = ("--set", "loops={fast: {plant_segments: 1}}")
MOVE = "{kind: minimum-jerk, duration: 0.3, angle_deg: %s}"
COMMANDS = {
    "gen-data": ("--samples", "1000"),
    "train": ("--data", "latest:gen-data", "--epochs", "5"),
    "tune": (
        *FAST, "--candidates", "4", "--iterations", "3",
        "--set", f"scenarios=[{{loop: fast, reference: {MOVE % 20}}}]",
    ),
    "simulate": ("--set", "horizon=0.5"),
    "compare": (*FAST, "--horizon", "0.5", "--set", "inverses=[none]", "--set", f"references=[{MOVE % 30}]"),
}


def _start(folder: Path, command: str) -> subprocess.Popen[bytes]:
    argv = [sys.executable, "-P", "-m", "wristctl", command, *COMMANDS[command]]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(argv, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _duration(folder: Path, command: str) -> float:
    began = time.monotonic()
    assert _start(folder, command).wait() == 0
    return time.monotonic() - began


def test_killed_at_random_moments_no_run_looks_complete_that_is_not(tmp_path: Path) -> None:
    names = list(COMMANDS) if THOROUGH else ["gen-data"]
    durations = {name: _duration(tmp_path, name) for name in names}
    whole = {run.id for run in list_runs(tmp_path / "results")}
    moments = random.Random(8)
    states = []
    for number in range(KILLS):
        name = names[number % len(names)]
        child = _start(tmp_path, name)
        time.sleep(durations[name] * moments.uniform(0.2, 1.1))
        child.kill()
        ended = child.wait()
        for run in list_runs(tmp_path / "results"):
            if run.id not in whole:
                whole.add(run.id)
                states.append(run.state)
                assert run.state in ("ok", "crashed", "broken")
                if run.state == "ok":
                    assert run.problems() == [], f"{run.path} killed in the end ({ended})"
                else:
                    assert not (run.path / "SHA256SUMS").exists()
    listed = subprocess.run(
        [sys.executable, "-P", "-m", "wristctl", "runs", "ls"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert listed.returncode == 0 and all(name in listed.stdout for name in whole)
    print(f"{KILLS} kills: {({state: states.count(state) for state in set(states)})}")
    assert "crashed" in states
