"""Wherever a command is killed, no directory looks complete that is not, and none stops the listing."""

from __future__ import annotations

import inspect
import os
import random
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.cli.app import typer_of
from wristctl.cli.commands import COMMANDS
from wristctl.records import list_runs

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
FAST = ("--set", "loops={fast: {plant_segments: 1}}")
MOVE = "{kind: minimum-jerk, duration: 0.3, angle_deg: %s}"
LOOPS = (
    "--of", "hysteresis", "--set", "hysteresis.ranges_deg=[[0, 5]]", "--set", "hysteresis.frequencies=[5]",
    "--set", "hysteresis.angles_deg=[]", "--set", "hysteresis.sheaths=[1]",
)  # fmt: skip
QUICK = ("--epochs", "5", "--set", "hidden=[8]", "--set", "gen-data.samples=100")
GRID = "grid={depths: [1, 2], activations: [tanh], widths: [8], folds: 2}"
BUDGET = "{candidates: 3, iterations: 1, finalists: 1, draws: 1, validation: 1, worlds: 8, noises: 1}"
CLAIM = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
QUICKLY: dict[str, tuple[tuple[str, ...], ...]] = {
    "gen-data": (("--samples", "1000"), ("--source", "plant", "--samples", "50")),
    "train": (("--data", "latest:gen-data", *QUICK), ("--search", *QUICK, "--set", GRID)),
    "tune": ((
        *FAST, "--candidates", "4", "--iterations", "3",
        "--set", f"scenarios=[{{loop: fast, reference: {MOVE % 20}}}]",
    ),),
    "simulate": (("--set", "horizon=0.5"),),
    "analyse": (("--controller", "gvsc", "--gains", "default"), LOOPS),
    "compare": ((*FAST, "--horizon", "0.5", "--set", "inverses=[none]", "--set", f"references=[{MOVE % 30}]"),),
    "study": (("scenarios/ideal", "--set", "controllers=[pd-ff]", "--set", f"budgets.small={BUDGET}"),),
    "recommend": ((
        "--set", "controllers=[pid-ff]", "--set", "loop={plant_segments: 1, control_period: 5.0e-3}",
        "--set", "draw={plant.stiffness: x0.7..1.3}", "--set", "draws=2", "--set", "validation=2", "--set", "tests=8",
        "--set", "candidates=4", "--set", "iterations=1", "--set", "frequencies=[1.0]",
        "--set", "payloads=[0.2]", "--set", "rehearsed=0",
    ),),
    "audit": (("--set", f"claims=[{CLAIM}]", "--set", "horizon=0.1"),),
}  # fmt: skip
"""The commands that need nothing but a study, or the run of one before them, and what makes them quick."""


def _that_write() -> list[str]:
    """The commands that make a run."""
    apps = {name: typer_of(entry) for name, entry in COMMANDS.items()}
    return [
        name
        for name, app in apps.items()
        if any(
            "dry_run" in inspect.signature(each.callback).parameters
            for each in app.registered_commands
            if each.callback
        )
    ]


_TOLD = """
import os, signal, sys
at, results, told = int(sys.argv.pop(1)), os.path.abspath("results"), 0
def tell(event, given):
    global told
    writes = event == "open" and given[2] & (os.O_WRONLY | os.O_RDWR)
    path = given[0] if writes or event in ("os.mkdir", "os.rename", "os.remove") else ""
    if isinstance(path, str | os.PathLike) and os.path.abspath(path).startswith(results + os.sep):
        told += 1
        if told == at:
            os.kill(os.getpid(), signal.SIGKILL)
        name = given[1] if event == "os.rename" else path
        os.write(2, f"{event} {os.path.basename(name)}\\n".encode())
sys.addaudithook(tell)
from wristctl.cli.app import main
main()
"""
"""wristctl, which tells each file it is about to change in results/, and is killed before the change number `at`."""


def _told(folder: Path, at: int, *arguments: str) -> tuple[int, list[str]]:
    """Exit code, and the changes made."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, "-P", "-c", _TOLD, str(at), *arguments, "-q"]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    return done.returncode, [line for line in done.stderr.splitlines() if line.startswith(("os.", "open "))]


def test_every_command_that_makes_a_run_is_known() -> None:
    assert set(QUICKLY) | {"identify", "hw", "hw-run", "track", "validate"} == set(_that_write())


@pytest.mark.slow
def test_killed_before_any_change_of_a_file_no_run_looks_complete_that_is_not(tmp_path: Path) -> None:
    everything = [(name, *options) for name, ways in QUICKLY.items() for options in ways]
    drawn = random.Random(8)
    (tmp_path / "results").mkdir()
    known: set[str] = set()
    states = []
    for each in everything if THOROUGH else everything[:1]:
        code, changes = _told(tmp_path, 0, *each)
        assert code == 0, each
        known |= {run.id for run in list_runs(tmp_path / "results")}
        sealing = changes.index("os.rename SHA256SUMS") + 1
        moments = [2, *(drawn.sample(range(3, len(changes)), 6) if THOROUGH else ())]
        for at in (*moments, sealing, sealing + 1):
            code, changes = _told(tmp_path, at, *each)
            assert code == -signal.SIGKILL and len(changes) == at - 1
            new = [run for run in list_runs(tmp_path / "results") if run.id not in known]
            known |= {run.id for run in new}
            states += [run.state for run in new]
            assert [run.state for run in new].count("ok") == changes.count("os.rename SHA256SUMS")
            for run in new:
                if run.state == "ok":
                    assert run.problems() == []
                else:
                    assert run.state == ("crashed" if (run.path / "run.json").exists() else "broken")
                    assert not (run.path / "SHA256SUMS").exists()
    assert set(states) == {"broken", "crashed", "ok"}
    listed = subprocess.run(
        [sys.executable, "-P", "-m", "wristctl", "runs", "ls"],
        cwd=tmp_path, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True,
    )  # fmt: skip
    assert listed.returncode == 0 and all(name in listed.stdout for name in known)
