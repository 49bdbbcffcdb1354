"""Every command but `train` runs where PyTorch is not installed, networks of earlier trainings included."""

from __future__ import annotations

import json
import subprocess
import sys
import tarfile
from pathlib import Path

import pytest

from wristctl.cli.commands import COMMANDS
from wristctl.records import open_run

RUNS = Path(__file__).parents[1] / "data" / "runs" / "0.1.0.tar.xz"
WITHOUT = """
import json, sys

class Without:
    def __init__(self, finder):
        self.finder = finder

    def find_spec(self, name, path=None, target=None):
        return None if name.partition(".")[0] == "torch" else self.finder.find_spec(name, path, target)

    def __getattr__(self, name):
        return getattr(self.finder, name)

sys.meta_path[:] = [Without(finder) for finder in sys.meta_path]
try:
    import torch
except ModuleNotFoundError:
    pass
from wristctl.cli.app import main

for command in json.loads(sys.argv[1]):
    sys.argv = ["wristctl", *command]
    try:
        main()
    except SystemExit as ended:
        print(command[0], "ended with", ended.code or 0, file=sys.stderr, flush=True)
assert "torch" not in sys.modules
"""


@pytest.fixture(name="earlier", scope="module")
def _earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Runs of every kind that an earlier version sealed."""
    folder = tmp_path_factory.mktemp("earlier") / "results"
    with tarfile.open(RUNS) as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # which Python 3.11.2 lacks
        archive.extractall(folder)
    return folder


def ended(folder: Path, *commands: tuple[str, ...]) -> tuple[list[str], str]:
    """The commands in one process that has no torch: how each ended, and all that they said."""
    call = [sys.executable, "-P", "-c", WITHOUT, json.dumps(commands)]
    done = subprocess.run(call, cwd=folder, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [line.rpartition(" ")[2] for line in done.stderr.splitlines() if " ended with " in line], done.stderr


@pytest.mark.slow
def test_every_command_but_train_runs_without_torch(earlier: Path, tmp_path: Path) -> None:
    runs = {kind: str(open_run(f"latest:{kind}", earlier).path) for kind in ("train", "tune", "hw-run", "identify")}
    network, short = ("--network", runs["train"]), ("--set", "horizon=0.05")
    tuned = ("--set", "controllers=[{controller: smc, gains: tuned}]", "--set", "inverses=[network]")
    small = ("--set", "candidates=2", "--set", "iterations=1")
    commands: tuple[tuple[str, ...], ...] = (
        ("gen-data", "--set", "samples=50"),
        ("simulate", *short, "--set", "reference.inverse=network", *network),
        ("tune", *short, *small),
        ("compare", *short, *tuned, *network, "--tuned", runs["tune"]),
        ("analyse", "--controller", "pid-ff", "--gains", "default"),
        ("identify", runs["hw-run"], "--dry-run"),
        ("export-model", runs["identify"], "--to", "mujoco"),
        ("runs", "report", runs["train"], "--to", "page.html"),
        *((name, "--help") for name in COMMANDS),
    )
    codes, said = ended(tmp_path, *commands)
    assert codes == ["0"] * len(commands), said


@pytest.mark.slow
def test_train_says_how_to_have_torch(tmp_path: Path) -> None:
    codes, said = ended(tmp_path, ("train", "--epochs", "1"))
    assert codes == ["2"] and "pip install torch" in said and not list(tmp_path.iterdir())
