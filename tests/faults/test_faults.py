"""A sample of the points at which a command may be killed or refused: `make test-trust` tries all."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
SAMPLE = [
    ("--only", "tag,rm,gc,ls,report", "--modes", "kill,ENOSPC", "--every", "3"),
    ("--only", "gen-data", "--modes", "kill,EIO", "--every", "16"),
]


@pytest.mark.skipif(shutil.which("gcc") is None or sys.platform != "linux", reason="needs gcc on Linux")
@pytest.mark.parametrize("sample", [()] if THOROUGH else SAMPLE, ids=lambda sample: sample[1] if sample else "all")
def test_wherever_a_command_is_killed_or_refused_what_is_left_is_right(sample: tuple[str, ...]) -> None:
    command = [sys.executable, "-m", "tests.faults.run", *sample]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True)
    assert done.returncode == 0 and done.stdout.rstrip().endswith("\n0 wrong"), (
        done.stdout[-3000:] + done.stderr[-2000:]
    )
