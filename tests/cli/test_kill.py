"""However a command is killed, no directory looks complete that is not, and none stops the listing."""

from __future__ import annotations

import importlib
import inspect
import os
import random
import subprocess
import sys
import time
from pathlib import Path

from wristctl.cli.app import COMMANDS
from wristctl.records import list_runs

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
KILLS = 50 if THOROUGH else 3
FAST = ("--set", "loops={fast: {plant_segments: 1}}")
MOVE = "{kind: minimum-jerk, duration: 0.3, angle_deg: %s}"
QUICK = ("--epochs", "5", "--set", "hidden=[8]", "--set", "gen-data.samples=100")
GRID = "grid={depths: [1, 2], activations: [tanh], widths: [8], folds: 2}"
CLAIM = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
QUICKLY: dict[str, tuple[tuple[str, ...], ...]] = {
    "gen-data": (("--samples", "1000"), ("--source", "plant", "--samples", "50")),
    "train": (("--data", "latest:gen-data", *QUICK), ("--search", *QUICK, "--set", GRID)),
    "tune": ((
        *FAST, "--candidates", "4", "--iterations", "3",
        "--set", f"scenarios=[{{loop: fast, reference: {MOVE % 20}}}]",
    ),),
    "simulate": (("--set", "horizon=0.5"),),
    "compare": ((*FAST, "--horizon", "0.5", "--set", "inverses=[none]", "--set", f"references=[{MOVE % 30}]"),),
    "audit": (("--set", f"claims=[{CLAIM}]", "--set", "horizon=0.1"),),
}  # fmt: skip
"""The commands that need nothing but a study, or the run of one before them, and what makes them quick."""


def _that_write() -> list[str]:
    """The commands that make a run."""
    apps = {name: importlib.import_module(module).app for name, (module, *_) in COMMANDS.items()}
    return [
        name
        for name, app in apps.items()
        if any("dry_run" in inspect.signature(each.callback).parameters for each in app.registered_commands)
    ]


def _start(folder: Path, *arguments: str) -> subprocess.Popen[bytes]:
    argv = [sys.executable, "-P", "-m", "wristctl", *arguments]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    return subprocess.Popen(argv, cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def _duration(folder: Path, *arguments: str) -> float:
    """How long the command takes once its loops are compiled [s]."""
    took = []
    for _ in range(2 if THOROUGH else 1):
        began = time.monotonic()
        assert _start(folder, *arguments).wait() == 0, arguments
        took.append(time.monotonic() - began)
    return took[-1]


def test_every_command_that_makes_a_run_is_known() -> None:
    assert set(QUICKLY) | {"identify", "hw-run", "track"} == set(_that_write())


def test_killed_at_random_moments_no_run_looks_complete_that_is_not(tmp_path: Path) -> None:
    everything = [(name, *options) for name, ways in QUICKLY.items() for options in ways]
    typed = everything if THOROUGH else everything[:1]
    durations = {each: _duration(tmp_path, *each) for each in typed}
    whole = {run.id for run in list_runs(tmp_path / "results")}
    moments = random.Random(8)
    states = []
    for number in range(5 * KILLS):
        if number >= KILLS and "crashed" in states:
            break
        each = typed[number % len(typed)]
        child = _start(tmp_path, *each)
        time.sleep(durations[each] * moments.uniform(0.2, 1.0))
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
    print(f"{number} kills of {len(typed)} commands: { ({state: states.count(state) for state in set(states)}) }")
    assert "crashed" in states
