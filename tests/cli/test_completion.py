"""The shell completes runs, study files and controllers, and nothing heavy is loaded for it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.records import start_run

ROOT = Path(__file__).parents[2]
HEAVY = {"torch", "scipy", "pandas", "matplotlib", "cv2", "numba", "numpy", "jinja2"}
CODE = """
import sys
sys.argv = ["wristctl"]
from wristctl.cli.app import main
try:
    main()
finally:
    print("loaded:", *sorted({name.split(".")[0] for name in sys.modules}), file=sys.stderr)
"""


def _completed(folder: Path, typed: str) -> list[str]:
    words = f"wristctl {typed}"
    environment = {
        **os.environ,
        "PYTHONPATH": str(ROOT),
        "_WRISTCTL_COMPLETE": "complete_bash",
        "COMP_WORDS": words,
        "COMP_CWORD": str(len(words.split(" ")) - 1),
    }
    done = subprocess.run([sys.executable, "-c", CODE], cwd=folder, env=environment, capture_output=True, text=True)
    assert not HEAVY & set(done.stderr.split("loaded:")[1].split())
    return done.stdout.split()


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "experiments").mkdir()
    for name in ("paper.yaml", "quick.yaml", "notes.txt"):
        (tmp_path / "experiments" / name).touch()
    with start_run("gen-data", Study(), "a", tmp_path / "results"):
        pass
    return tmp_path


def test_runs_are_completed_by_id_and_as_the_latest(folder: Path) -> None:
    (run,) = [path.name for path in (folder / "results").iterdir() if path.is_dir()]
    assert _completed(folder, "runs show ") == [run, "latest:gen-data"]
    assert _completed(folder, f"runs diff x {run[:5]}") == [run]
    for typed in ("train --data", "audit --table1", "hw-run --optics", "identify"):
        assert _completed(folder, f"{typed} lat") == ["latest:gen-data"]


def test_study_files_controllers_and_commands_are_completed(folder: Path) -> None:
    assert _completed(folder, "train ") == ["experiments/paper.yaml", "experiments/quick.yaml"]
    assert _completed(folder, "compare experiments/q") == ["experiments/quick.yaml"]
    assert _completed(folder, "simulate --controller sm") == ["smc", "smc-tracking"]
    assert _completed(folder, "runs rep") == ["replay", "report"]
