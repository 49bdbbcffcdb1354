"""The command line as a real process."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from wristctl.cli.app import main

ROOT = Path(__file__).parents[2]
WRISTCTL = ["-c", "from wristctl.cli.app import main; main()"]
PROBE = [str(Path(__file__).parent / "probe.py")]

Command = Callable[..., subprocess.CompletedProcess[str]]
Call = Callable[..., tuple[int, str, str]]


def _environment(probe: str) -> dict[str, str]:
    return {**os.environ, "PYTHONPATH": str(ROOT), "PROBE": probe, "COLUMNS": "80", "TERM": "xterm"}


@pytest.fixture
def wristctl(tmp_path: Path) -> Command:
    """Runs `wristctl ...` in an empty folder."""

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        command = [sys.executable, *WRISTCTL, *arguments]
        return subprocess.run(command, cwd=tmp_path, env=_environment(""), capture_output=True, text=True)

    return run


@pytest.fixture
def probe(tmp_path: Path) -> Command:
    """Runs the stand-in for `wristctl gen-data` and `train` in an empty folder; it behaves as `action` says."""

    def run(*arguments: str, action: str = "") -> subprocess.CompletedProcess[str]:
        command = [sys.executable, *PROBE, *arguments]
        return subprocess.run(command, cwd=tmp_path, env=_environment(action), capture_output=True, text=True)

    return run


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Starts the stand-in, which sleeps in the middle of its work."""
    started = []

    def start(*arguments: str, **streams: int) -> subprocess.Popen[bytes]:
        command = [sys.executable, *PROBE, *arguments]
        child = subprocess.Popen(command, cwd=tmp_path, env=_environment("sleep"), **streams)  # type: ignore[call-overload]
        started.append(child)
        return child

    yield start
    for child in started:
        child.kill()
        child.communicate()


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Runs `wristctl ...` in this process, in an empty folder: exit code, stdout, stderr."""
    monkeypatch.chdir(tmp_path)

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run
