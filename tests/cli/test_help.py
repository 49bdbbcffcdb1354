"""Help is quick and complete."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.cli.app import COMMANDS

ROOT = Path(__file__).parents[2]
HEAVY = ("torch", "scipy", "pandas", "matplotlib", "cv2", "numba", "numpy", "llvmlite")


def _python(code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "COLUMNS": "100"}
    return subprocess.run([sys.executable, "-c", code, *arguments], capture_output=True, text=True, env=environment)


_LOADED = """
import sys
sys.argv = ["wristctl", *sys.argv[1:]]
from wristctl.cli.app import main
try:
    main()
finally:
    print("loaded:", *sorted({name.split(".")[0] for name in sys.modules}), file=sys.stderr)
"""


_LIGHT = [["--help"], [], ["--version"], ["runs", "--help"], ["runs", "ls"], ["hw", "calibrate", "camera", "--help"]]


@pytest.mark.parametrize("arguments", _LIGHT)
def test_help_and_listing_load_no_heavy_package(arguments: list[str]) -> None:
    done = _python(_LOADED, *arguments)
    assert "Traceback" not in done.stderr
    loaded = set(done.stderr.split("loaded:")[1].split())
    assert not loaded & set(HEAVY)


@pytest.mark.parametrize("name", list(COMMANDS))
def test_help_of_each_command_loads_no_heavy_package(name: str) -> None:
    done = _python(_LOADED, name, "--help")
    assert done.returncode == 0, done.stderr
    assert not set(done.stderr.split("loaded:")[1].split()) & set(HEAVY)


def test_help_comes_within_a_quarter_of_a_second() -> None:
    code = "from wristctl.cli.app import main; main()"
    took = []
    for _ in range(5):
        began = os.times()
        assert _python(code, "--help").returncode == 0
        ended = os.times()  # processor time: what else the machine does is not the command's
        took.append(ended.children_user - began.children_user + ended.children_system - began.children_system)
    assert min(took) <= 0.25


def test_wristctl_alone_shows_help_with_examples() -> None:
    done = _python("from wristctl.cli.app import main; main()")
    assert done.returncode == 0
    for name in COMMANDS:
        assert f" {name} " in done.stdout
    assert "wristctl gen-data experiments/quick.yaml" in done.stdout
    assert "--set controllers=[smc,pid]" in done.stdout
