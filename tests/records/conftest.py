"""Runs to look at, and real processes that make them."""

from __future__ import annotations

import os
import subprocess
import sys
import tarfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pandas as pd
import pytest

from wristctl.config.study import Study
from wristctl.records import Run, start_run

ROOT = Path(__file__).parents[2]


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """A results folder that does not exist yet."""
    return tmp_path / "results"


@pytest.fixture
def make(results: Path) -> Callable[..., Run]:
    """Makes a small run of a kind that has a table and a metric."""

    def made(kind: str = "gen-data", value: float = 1 / 3, label: str = "") -> Run:
        with start_run(kind, Study(), label, results, ["wristctl", kind]) as run:
            frame = pd.DataFrame({"x": [value, 2.0], "name": ["a", "b"]})
            run.table("data/samples.csv", frame, units={"x": "m"}, meaning={"x": "tip"})
            run.metric("rmse", value, unit="rad", better="lower")
        return Run(run.path)

    return made


@pytest.fixture(scope="session")
def earlier(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A results folder of sealed runs made by version 0.1.0, one of every kind; not to be written to."""
    folder = tmp_path_factory.mktemp("earlier") / "results"
    with tarfile.open(ROOT / "tests" / "data" / "runs" / "0.1.0.tar.xz") as archive:
        archive.extraction_filter = getattr(tarfile, "data_filter", None)  # which Python 3.11.2 lacks
        archive.extractall(folder)
    return folder


@pytest.fixture
def process() -> Iterator[Callable[[str, Path], subprocess.Popen[str]]]:
    """Starts Python code in a process of its own; `begun` in the code prints that it may be disturbed."""
    started = []

    def start(code: str, out: Path) -> subprocess.Popen[str]:
        head = (
            "import sys, time; from pathlib import Path; from wristctl.config.study import Study\n"
            "from wristctl.records import start_run\n"
            f"out = Path({str(out)!r})\n"
            "def begun(run): print(run.id, flush=True)\n"
        )
        environment = {**os.environ, "PYTHONPATH": str(ROOT)}
        child = subprocess.Popen(
            [sys.executable, "-c", head + code],
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            text=True,
            env=environment,
        )
        started.append(child)
        return child

    yield start
    for child in started:
        child.kill()
        child.communicate()
