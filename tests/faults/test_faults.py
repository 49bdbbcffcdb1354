"""A sample of the points at which a command may be killed, refused or interrupted: `make test-trust` tries all."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
FAULTS = [
    ("--only", "tag,rm,gc,ls,report", "--modes", "kill,ENOSPC", "--every", "3"),
    ("--only", "gen-data", "--modes", "kill,EIO", "--every", "24"),
]
INTERRUPTS = [("--only", "gen-data", "--moments", "2"), ("--only", "replay", "--moments", "1", "--kill")]
KILLED = "gen-data,train,train-search,tune,compare,audit,replay,report"


def _without_a_fault(*words: str) -> None:
    command = [sys.executable, "-m", *words]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    print(done.stdout)
    assert done.returncode == 0 and done.stdout.rstrip().endswith("0 wrong"), done.stdout[-3000:] + done.stderr[-2000:]


@pytest.mark.skipif(shutil.which("gcc") is None or sys.platform != "linux", reason="needs gcc on Linux")
@pytest.mark.parametrize("sample", [()] if THOROUGH else FAULTS, ids=lambda sample: sample[1] if sample else "all")
@pytest.mark.slow
def test_wherever_a_command_is_killed_or_refused_what_is_left_is_right(sample: tuple[str, ...]) -> None:
    _without_a_fault("tests.faults.run", *sample)


@pytest.mark.skipif(sys.platform != "linux", reason="counts processor time by /proc")
@pytest.mark.parametrize(
    "sample",
    [(), ("--kill", "--only", KILLED, "--moments", "10")] if THOROUGH else INTERRUPTS,
    ids=lambda sample: "-".join(sample) if sample else "all",
)
@pytest.mark.slow
def test_whenever_a_command_is_interrupted_it_ends_soon_and_alone(sample: tuple[str, ...]) -> None:
    _without_a_fault("tests.faults.interrupts", *sample)
