"""The command line, in this process and in one of its own."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.cli.probe import COMMANDS
from wristctl.cli import commands
from wristctl.cli.app import main

ROOT = Path(__file__).parents[2]
PROBE = ["-m", "tests.cli.probe"]

Command = Callable[..., subprocess.CompletedProcess[str]]
Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def wristctl(call: Call) -> Command:
    """Runs `wristctl ...` in an empty folder."""

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.CompletedProcess(arguments, *call(*arguments))

    return run


@pytest.fixture
def probe(call: Call, monkeypatch: pytest.MonkeyPatch) -> Command:
    """Runs the stand-in for `wristctl gen-data` and `train` in an empty folder; it behaves as `action` says."""

    def run(*arguments: str, action: str = "") -> subprocess.CompletedProcess[str]:
        with monkeypatch.context() as during:
            during.setenv("PROBE", action)
            for name in list(commands.COMMANDS):
                during.delitem(commands.COMMANDS, name)
            for name, entry in COMMANDS.items():
                during.setitem(commands.COMMANDS, name, entry)
            return subprocess.CompletedProcess(arguments, *call(*arguments))

    return run


@pytest.fixture
def begin(tmp_path: Path) -> Iterator[Callable[..., subprocess.Popen[bytes]]]:
    """Starts the stand-in, which sleeps in the middle of its work."""
    started = []

    def start(*arguments: str, **streams: int) -> subprocess.Popen[bytes]:
        command = [sys.executable, *PROBE, *arguments]
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "PROBE": "sleep", "COLUMNS": "80", "TERM": "xterm"}
        child = subprocess.Popen(command, cwd=tmp_path, env=environment, **streams)  # type: ignore[call-overload]
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
    monkeypatch.setenv("COLUMNS", "80")

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", *arguments])
        with pytest.raises(SystemExit) as ended:
            main()
        out, err = capsys.readouterr()
        return int(ended.value.code or 0), out, err

    return run


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """Runs `wristctl ...` for a whole module, each in a folder that goes on from an earlier one; gives the folder."""

    def run(*arguments: str, after: Path | None = None) -> Path:
        folder = tmp_path_factory.mktemp(arguments[0])
        if after:
            shutil.copytree(after / "results", folder / "results")
        with pytest.MonkeyPatch.context() as during, pytest.raises(SystemExit) as ended:
            during.chdir(folder)
            during.setattr(sys, "argv", ["wristctl", *arguments])
            main()
        assert ended.value.code == 0
        return folder

    return run
