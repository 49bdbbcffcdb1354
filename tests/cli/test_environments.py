"""A result does not know where it was computed: the same hash whatever the folder, language, time zone and threads."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from wristctl.records import list_runs

ROOT = Path(__file__).parents[2]
THOROUGH = bool(os.environ.get("WRISTCTL_THOROUGH"))
MOVE = "{kind: minimum-jerk, duration: 0.2, angle_deg: 20}"
COMMANDS = {
    "simulate": (
        "simulate", "--set", "loop={actuator: {level: tendon}, sensor: {level: camera}}", "--set", "horizon=0.3",
    ),
    "train": ("train", "--epochs", "3", "--set", "hidden=[8, 8]", "--set", "gen-data.samples=500"),
    "tune": (
        "tune", "--candidates", "4", "--iterations", "3", "--set", f"scenarios=[{{loop: fast, reference: {MOVE}}}]",
        "--set", "loops={fast: {plant_segments: 1}}",
    ),
}  # fmt: skip
PLACES: dict[str, dict[str, str]] = {
    "one thread": {"OMP_NUM_THREADS": "1", "NUMBA_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1"},
    "three threads": {"OMP_NUM_THREADS": "3", "NUMBA_NUM_THREADS": "2", "OPENBLAS_NUM_THREADS": "3"},
    "another home": {"HOME": "HOME"},
    "a folder with a space and an umlaut": {"CWD": "ein Ordner für alles"},
    "no language": {"LC_ALL": "C"},
    "a language with commas": {"LC_ALL": "de_DE.UTF-8", "LANG": "de_DE.UTF-8"},
    "Kathmandu": {"TZ": "Asia/Kathmandu"},
    "other hashes of strings": {"PYTHONHASHSEED": "17"},
    "no git": {"PATH": "/nonexistent"},
}
PROCESSORS: dict[str, dict[str, str]] = {
    "optimised twice": {"PYTHONOPTIMIZE": "2"},
    "a plain processor": {"NUMBA_CPU_NAME": "generic"},
    "numpy without AVX2": {"NPY_DISABLE_CPU_FEATURES": "AVX2 FMA3"},
    "an old BLAS": {"OPENBLAS_CORETYPE": "Prescott"},
}
"""What chooses between ways of computing: torch has its own there, which a network's bits depend on."""


def result(folder: Path, command: str, **environment: str) -> str:
    """The result hash of a command in this environment; its numbers, and no picture of them, are in it."""
    work = folder / environment.pop("CWD", "work")
    shutil.rmtree(work, ignore_errors=True)
    work.mkdir()
    if "HOME" in environment:
        environment["HOME"] = str(folder)
    words = [sys.executable, "-P", "-m", "wristctl", *COMMANDS[command], "-q"]
    done = subprocess.run(
        words, cwd=work, env={**os.environ, "PYTHONPATH": str(ROOT), **environment}, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stderr
    (run,) = list_runs(work / "results")
    assert run.state == "ok" and run.problems() == []
    return run.result_hash


def _everywhere() -> Iterator[tuple[str, str]]:
    for command in COMMANDS:
        for place in (*PLACES, *(PROCESSORS if command == "simulate" else ())):
            yield command, place


@pytest.mark.parametrize("command", COMMANDS if THOROUGH else ["simulate"])
@pytest.mark.slow
def test_the_same_result_whatever_the_surroundings(tmp_path: Path, command: str) -> None:
    here = result(tmp_path, command)
    known = PLACES | PROCESSORS
    places = [(place,) for which, place in _everywhere() if which == command]
    for together in places if THOROUGH else [("Kathmandu", "a folder with a space and an umlaut")]:
        there = {name: value for place in together for name, value in known[place].items()}
        assert result(tmp_path, command, **there) == here, together
