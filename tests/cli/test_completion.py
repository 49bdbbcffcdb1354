"""The shell completes runs, study files and controllers, and nothing heavy is loaded for it."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.cli.options import MOST, controllers, run_ids, study_files
from wristctl.config.choices import CONTROLLERS
from wristctl.config.study import Study
from wristctl.records import start_run
from wristctl.study_files.shipped import shipped_names

ROOT = Path(__file__).parents[2]
SHIPPED = [name for name in shipped_names() if name.startswith("s")]
HEAVY = {"torch", "scipy", "pandas", "matplotlib", "cv2", "numba", "numpy", "jinja2"}
CODE = """
import contextlib, io, json, os, sys
from wristctl.cli.app import main
for typed in json.loads(sys.argv[1]):
    words = f"wristctl {typed}"
    os.environ |= {"COMP_WORDS": words, "COMP_CWORD": str(len(words.split(" ")) - 1)}
    sys.argv = ["wristctl"]
    with contextlib.redirect_stdout(io.StringIO()) as offered, contextlib.suppress(SystemExit):
        main()
    print(json.dumps([offered.getvalue().split(), sorted({name.split(".")[0] for name in sys.modules})]))
"""


def _completed(folder: Path, *typed: str) -> list[list[str]]:
    """What is offered for each of these, typed one after the other."""
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "_WRISTCTL_COMPLETE": "complete_bash"}
    command = [sys.executable, "-c", CODE, json.dumps(typed)]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
    answers = [json.loads(line) for line in done.stdout.splitlines()]
    assert len(answers) == len(typed), done.stderr
    assert not HEAVY & {name for _, loaded in answers for name in loaded}
    return [offered for offered, _ in answers]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "experiments").mkdir()
    for name in ("paper.yaml", "quick.yaml", "notes.txt"):
        (tmp_path / "experiments" / name).touch()
    with start_run("gen-data", Study(), "a", tmp_path / "results"):
        pass
    return tmp_path


@pytest.mark.slow
def test_runs_are_completed_by_id_and_as_the_latest(folder: Path) -> None:
    (run,) = [path.name for path in (folder / "results").iterdir() if path.is_dir()]
    latest = [f"{typed} lat" for typed in ("train --data", "audit --table1", "hw-run --optics", "identify")]
    shown, compared, *offered = _completed(folder, "runs show ", f"runs diff x {run[:5]}", *latest)
    assert shown == [run, "latest:gen-data"] and compared == [run]
    assert offered == [["latest:gen-data"]] * len(latest)


@pytest.mark.slow
def test_study_files_controllers_and_commands_are_completed(folder: Path) -> None:
    typed = ("train ", "compare experiments/q", "simulate --controller sm", "hw-run --controller sm", "runs rep")
    studies, one, laws, on_a_rig, verbs, both, lists = _completed(folder, *typed, "compare pid-ff s", "list con")
    assert both == [name for name in sorted(CONTROLLERS) if name.startswith("s")] + SHIPPED
    assert lists == ["controllers", "conditions"]
    assert studies == ["experiments/paper.yaml", "experiments/quick.yaml"] and one == ["experiments/quick.yaml"]
    assert laws == on_a_rig == ["smc", "smc-dob", "smc-tracking"] and verbs == ["replay", "report"]


def test_runs_are_the_newest_first_and_kinds_in_order(folder: Path) -> None:
    for name in ("20200101T000000Z-tune-x", "20990101T000000Z-train-x", "no-run-tune-"):
        (folder / "results" / name).mkdir()
        if "Z" in name:
            (folder / "results" / name / "run.json").touch()
    context = SimpleNamespace(params={"out": folder / "results"})
    found = run_ids(context, "")  # type: ignore[arg-type]
    assert [name[:4] for name in (found[0], found[2])] == ["2099", "2020"] and "-gen-data-a-" in found[1]
    assert found[3:] == ["latest:gen-data", "latest:train", "latest:tune"]
    context.params["out"] = folder / "absent"
    assert run_ids(context, "") == []  # type: ignore[arg-type]


def test_folders_and_files_below_what_is_typed_are_in_order(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(folder)
    for name in ("z.yml", "a.yaml", "experiments/more/b.yaml", "exp.txt"):
        Path(name).parent.mkdir(exist_ok=True)
        Path(name).touch()
    listed = [f"experiments/{name}" for name in ("more/", "paper.yaml", "quick.yaml")]
    assert study_files("") == study_files("experiments/") == listed
    assert study_files("ex") == ["experiments/"] and study_files("z") == ["z.yml"]
    assert study_files("experiments/more") == ["experiments/more/"] and study_files("absent/") == []


def test_controllers_are_in_order() -> None:
    assert controllers("") == sorted(CONTROLLERS) and controllers("no such") == []


def test_of_very_many_runs_the_newest_are_offered(tmp_path: Path) -> None:
    for number in range(MOST + 50):
        folder = tmp_path / f"20260101T{number:06}Z-tune-abcdef"
        folder.mkdir()
        (folder / "run.json").touch()
    context: Any = SimpleNamespace(params={"out": str(tmp_path)})
    offered = run_ids(context, "2026")
    assert len(offered) == MOST and offered[0] == f"20260101T{MOST + 49:06}Z-tune-abcdef"
    assert run_ids(context, "20260101T000007Z") == ["20260101T000007Z-tune-abcdef"]
    assert run_ids(context, "lat") == ["latest:tune"]
