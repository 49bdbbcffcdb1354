"""Processes that are begun in a folder run none of the files that are called there like Python's own modules."""

from __future__ import annotations

import multiprocessing
import os
import subprocess
import sys
from concurrent.futures.process import BrokenProcessPool
from pathlib import Path
from types import SimpleNamespace
from typing import Any, NoReturn

import pytest

import wristctl
from tests.doors.carrier import MARKING
from tests.doors.conftest import ROOT
from wristctl.bench import frame_process as film
from wristctl.bench import real_time_bench
from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning import training_processes
from wristctl.processes import safe_path

PROGRAM = """
import os
from wristctl.work.executors import Workers

if __name__ == "__main__":
    for named in ("processes:1", "own_pool:made"):
        with Workers.of(named).open() as pool:
            assert pool.executor.submit(os.getpid).result() != os.getpid()
    import colorsys, wave  # which nobody has needed before
    assert os.environ.get("PYTHONSAFEPATH") is None, "and other programs begin as they did"
"""
POOL = """
import multiprocessing
from concurrent.futures import ProcessPoolExecutor

def made():
    return ProcessPoolExecutor(1, multiprocessing.get_context("spawn"))
"""


@pytest.mark.slow
def test_workers_and_factories_run_no_module_of_the_working_directory(tmp_path: Path) -> None:
    folder, marks = tmp_path / "run", tmp_path / "marks"
    for place in (folder, marks, tmp_path / "elsewhere"):
        place.mkdir()
    (tmp_path / "elsewhere" / "program.py").write_text(PROGRAM)
    (folder / "own_pool.py").write_text(POOL)
    for name in ("threading", "socket", "pickle", "signal", "colorsys", "wave", "numpy"):
        (folder / f"{name}.py").write_text(MARKING.format(mark=str(marks / name)))
    own = {name: value for name, value in os.environ.items() if name != "PYTHONSAFEPATH"} | {"PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(tmp_path / "elsewhere" / "program.py")]
    done = subprocess.run(command, cwd=folder, env=own, capture_output=True, text=True)
    assert list(marks.iterdir()) == [] and done.returncode == 0, done.stderr


class Begun:
    """Stands in for what begins processes: notes how they would begin."""

    def __init__(self) -> None:
        self.safely: list[bool] = []

    def note(self, *given: Any, **more: Any) -> None:
        """A process begins."""
        self.safely.append(os.environ.get("PYTHONSAFEPATH") == "1")

    def context(self, method: str) -> Any:
        """As `multiprocessing.get_context`."""
        end = SimpleNamespace(close=lambda: None, recv=lambda: UserError("enough", "here", "none"))
        process = lambda **given: SimpleNamespace(start=self.note)  # noqa: E731
        made = dict.fromkeys(("SimpleQueue", "Event"), multiprocessing.get_context(method).Event)
        return SimpleNamespace(Pipe=lambda: (end, end), Process=process, **made)

    def pool(self, *given: Any) -> NoReturn:
        """As a pool, which may begin processes whenever it likes."""
        self.note()
        raise BrokenProcessPool


def test_trainings_and_the_emulated_bench_begin_safely_too(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("PYTHONSAFEPATH", raising=False)
    begun = Begun()
    monkeypatch.setattr(training_processes, "ProcessPoolExecutor", begun.pool)
    jobs: Any = [None, None]
    with pytest.raises(UserError, match="worker process died"):
        training_processes.train_all(None, jobs, workers=2)  # type: ignore[arg-type]
    for module in (film, real_time_bench):
        monkeypatch.setattr(module, "multiprocessing", SimpleNamespace(get_context=begun.context))
    with pytest.raises(UserError, match="enough"):
        real_time_bench.connect(BenchSettings(), WristParameters(), 1)
    assert begun.safely == [True, True, True] and "PYTHONSAFEPATH" not in os.environ


def test_whatever_begins_processes_does_so_safely() -> None:
    package = Path(wristctl.__file__).parent
    texts = {file: file.read_text(encoding="utf-8") for file in package.rglob("*.py")}
    begins = {file for file, text in texts.items() if "get_context(" in text or "ProcessPoolExecutor(" in text}
    assert len(begins) >= 4 and [file for file in begins if "with safe_path()" not in texts[file]] == []


@pytest.mark.parametrize("before", [None, "", "1"])
def test_what_was_said_of_the_path_before_holds_again(monkeypatch: pytest.MonkeyPatch, before: str | None) -> None:
    monkeypatch.setenv("PYTHONSAFEPATH", before) if before is not None else monkeypatch.delenv(
        "PYTHONSAFEPATH", raising=False
    )
    with pytest.raises(KeyError), safe_path():
        assert os.environ["PYTHONSAFEPATH"] == "1"
        raise KeyError
    assert os.environ.get("PYTHONSAFEPATH") == before
