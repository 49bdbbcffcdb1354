"""Units on a real Dask cluster: a scheduler and two workers, each a process of its own."""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tests.work.walks import at, contents, golden, walks
from wristctl.errors import UserError
from wristctl.work.executors import Workers
from wristctl.work.fan_out import UnitsDone, perform_units
from wristctl.work.worker import Golden

pytest.importorskip("distributed")
PATIENCE = 60.0


class Cluster:
    """A scheduler and its workers."""

    def __init__(self, folder: Path) -> None:
        self._file = folder / "scheduler.json"
        self.scheduler = self._start("dask_scheduler", "--port", "0", "--no-dashboard")
        self._wait(self._file.exists)
        self.address: str = json.loads(self._file.read_text())["address"].removeprefix("tcp://")
        self.workers: list[subprocess.Popen[bytes]] = []

    @property
    def named(self) -> str:
        return f"dask://{self.address}"

    def add(self, count: int = 1, **environment: str) -> None:
        """Workers, each with a process that looks after it, as on a cluster."""
        options = ("--nthreads", "1", "--no-dashboard", "--local-directory", str(self._file.parent))
        self.workers += [self._start("dask_worker", *options, **environment) for _ in range(count)]

    def _start(self, tool: str, *options: str, **environment: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.{tool}", "--scheduler-file", str(self._file), *options]
        with (self._file.parent / f"{tool}.log").open("ab") as log:
            return subprocess.Popen(command, env={**os.environ, **environment}, stdout=log, stderr=log)

    def _wait(self, ready: Callable[[], bool]) -> None:
        begun = time.monotonic()
        while not ready():
            assert time.monotonic() - begun < PATIENCE
            time.sleep(0.05)

    def end(self) -> None:
        for each in [*self.workers, self.scheduler]:
            each.terminate()
        for each in [*self.workers, self.scheduler]:
            try:
                each.wait(10)
            except subprocess.TimeoutExpired:
                each.kill()


@contextmanager
def cluster(folder: Path) -> Iterator[Cluster]:
    made = Cluster(folder)
    try:
        yield made
    finally:
        made.end()


@pytest.fixture(scope="module")
def two(tmp_path_factory: pytest.TempPathFactory, importable: None) -> Iterator[Cluster]:
    with cluster(tmp_path_factory.mktemp("cluster")) as made:
        made.add(2)
        yield made


@pytest.mark.slow
def test_a_worker_killed_and_a_unit_poisoned_leave_the_bytes_of_all_others_as_they_are(
    two: Cluster, tmp_path: Path
) -> None:
    far, here = tmp_path / "far", tmp_path / "here"
    far.mkdir()
    here.mkdir()
    units = [*walks(24, takes=0.2), at(tmp_path, "fail")]
    ended: list[str] = []

    def told(unit: object, computed: object) -> None:
        ended.append(str(unit))
        if len(ended) == 4:
            two.workers[0].send_signal(signal.SIGKILL)

    done = perform_units(units, Workers.of(two.named), golden(), far, report=told)
    beside = perform_units(walks(24, takes=0.2), Workers.of("processes:2"), golden(), here)
    assert [each.unit.name for each in done.poisoned] == ["the fail"]
    assert len(ended) == 24 and contents(far) == contents(here) and len(contents(here)) == 24
    assert all(
        np.array_equal(a["walk"], b["walk"]) for a, b in zip(done.arrays, beside.arrays, strict=False) if a and b
    )


@pytest.mark.slow
def test_what_one_executor_began_another_ends(two: Cluster, tmp_path: Path) -> None:
    begun, whole = tmp_path / "begun", tmp_path / "whole"
    begun.mkdir()
    whole.mkdir()
    perform_units(walks(4), Workers.of("serial"), folder=begun)
    done = perform_units(walks(8), Workers.of(two.named), golden(), begun)
    perform_units(walks(8), Workers.of("processes:2"), golden(), whole)
    assert done.found == 4 and contents(begun) == contents(whole)


@pytest.mark.slow
def test_a_cluster_that_vanishes_is_named_and_what_was_done_is_kept(tmp_path: Path) -> None:
    kept = tmp_path / "kept"
    kept.mkdir()
    told_so = r"the Dask cluster at tcp://.* is gone - .* - fix: go on with --resume"
    with cluster(tmp_path) as made, pytest.raises(UserError, match=told_so) as raised:
        made.add()

        def told(*_: object) -> None:
            for each in [made.scheduler, *made.workers]:
                each.kill()

        perform_units(walks(30, takes=0.2), Workers.of(made.named), golden(), kept, report=told)
    assert raised.value.exit_code == 3 and contents(kept)
    done = perform_units(walks(30), Workers.of("serial"), folder=kept)
    assert _whole(done)


@pytest.mark.slow
def test_a_dask_worker_of_other_numbers_computes_nothing(tmp_path: Path) -> None:
    with cluster(tmp_path) as made:
        made.add(1)
        other = Golden.here("piecework:process", {})
        with pytest.raises(UserError, match="computes other numbers") as raised:
            perform_units(walks(2), Workers.of(made.named), other)
    assert raised.value.exit_code == 3


@pytest.mark.slow
def test_where_no_scheduler_answers_that_is_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("wristctl.work.executors._ANSWERS", 1.0)
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    with pytest.raises(UserError, match=f"no Dask scheduler answers at tcp://127.0.0.1:{port}") as raised:
        perform_units(walks(1), Workers.of(f"dask://127.0.0.1:{port}"))
    assert raised.value.exit_code == 2


def _whole(done: UnitsDone) -> bool:
    return all(each is not None for each in done.arrays)
