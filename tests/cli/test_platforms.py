"""A system without locks on files or limits of processes: one plain sentence, by every command and in Python."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.cli.commands import COMMANDS

_CALLS = """
import json, sys
hidden, calls = json.loads(sys.argv[1])
sys.modules[hidden] = None  # as on a system whose Python has no such module
from wristctl.__main__ import main
for typed in calls:
    sys.argv = ["wristctl", *typed]
    try:
        main()
    except SystemExit as ended:
        print(ended.code, file=sys.stderr, flush=True)
"""


def _run(folder: Path, code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, "-c", code, *arguments], cwd=folder, capture_output=True, text=True)


@pytest.mark.parametrize("hidden", ["fcntl", "resource"])
def test_every_command_says_on_what_system_it_runs_and_writes_nothing(hidden: str, tmp_path: Path) -> None:
    calls = [[], ["--help"], *([name] for name in COMMANDS), ["runs", "ls"], ["hw", "check"]]
    said = _run(tmp_path, _CALLS, json.dumps([hidden, calls])).stderr.splitlines()
    sentences, codes = said[::2], said[1::2]
    assert len(sentences) == len(calls) > 20 and set(codes) == {"2"}
    (sentence,) = set(sentences)
    assert "runs on Linux" in sentence and f"no {hidden}" in sentence and "WSL" in sentence and "bug" not in sentence
    assert not list(tmp_path.iterdir())


def test_with_json_the_sentence_is_an_object(tmp_path: Path) -> None:
    done = _run(tmp_path, _CALLS, json.dumps(["fcntl", [["simulate", "--json"]]]))
    shown = json.loads(done.stdout)
    assert shown["schema"] == "wristctl.error/1" and shown["exit_code"] == 2 and "Linux" in shown["what"]


def test_python_says_it_as_well(tmp_path: Path) -> None:
    done = _run(tmp_path, "import sys; sys.modules['fcntl'] = None; import wristctl; wristctl.simulate")
    assert done.returncode == 1 and "wristctl.errors.UserError: wristctl runs on Linux" in done.stderr
