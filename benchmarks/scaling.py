"""How units of work spread over a cluster's workers: `python benchmarks/scaling.py [--out FILE]`, some two minutes.

Units that only wait, so that cores are no limit: on 1 to 8 worker processes of a Dask scheduler on this machine, and on
up to 1,000 simulated workers, whose units end by a clock while the part that hands them out and keeps what they give is
the program's own; no network lies between. What is told is the share of the workers' time that units fill, after the
first of each worker. `docs/cost.py` tells by the same units what an executor adds to each.
"""

from __future__ import annotations

import argparse
import heapq
import json
import os
import tempfile
import threading
import time
from collections.abc import Callable, Iterator, Mapping
from concurrent.futures import Executor, Future
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from wristctl.work.executors import Pool, Workers
from wristctl.work.fan_out import perform_units
from wristctl.work.worker import Unit

HERE = Path(__file__).resolve().parent
DASK, SIMULATED = (1, 2, 4, 8), (1, 2, 4, 8, 64, 250, 1000)
TAKES, WAVES = 2.0, 4
"""Seconds of a unit, and units for each worker."""
HURRIED = 2000
"""Units that take no time, by which the most in a second is told."""


def waited(spec: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """A unit that waits, and gives what a unit of tests of 8,000 rollouts does, by size."""
    time.sleep(spec["takes"])
    return {"errors": np.full(8000, float(spec["number"]))}


class Clock(Executor):
    """Workers that are simulated: each unit ends so many seconds after it was handed out."""

    def __init__(self, takes: float) -> None:
        self._takes, self._given = takes, 0
        self._ending: list[tuple[float, int, Future[Any], Callable[[], Any]]] = []
        self._changed = threading.Condition()
        threading.Thread(target=self._run, daemon=True).start()

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """As of any executor; the work itself is done when its time is over."""
        future: Future[Any] = Future()
        with self._changed:
            self._given += 1
            end = time.monotonic() + self._takes
            heapq.heappush(self._ending, (end, self._given, future, lambda: fn(*args, **kwargs)))
            self._changed.notify()
        return future

    def _run(self) -> None:
        while True:
            with self._changed:
                while not self._ending or (left := self._ending[0][0] - time.monotonic()) > 0.0:
                    self._changed.wait(left if self._ending else None)
                *_, future, work = heapq.heappop(self._ending)
            future.set_result(work())


def simulated(many: int, takes: float) -> Workers:
    """So many workers by the clock."""

    @contextmanager
    def opened() -> Iterator[Pool]:
        yield Pool(Clock(takes), lambda: many, apart=False)

    return Workers("simulated", many, opened)


@contextmanager
def on_dask(many: int) -> Iterator[Workers]:
    """So many worker processes of a Dask scheduler on this machine."""
    from distributed import LocalCluster

    with LocalCluster(n_workers=many, threads_per_worker=1, dashboard_address=None) as cluster:
        yield Workers.of("dask://" + str(cluster.scheduler_address).removeprefix("tcp://"))


def help_workers_find_this() -> None:
    """Worker processes import the units' function from this folder."""
    os.environ["PYTHONPATH"] = os.pathsep.join([str(HERE), str(HERE.parent), os.environ.get("PYTHONPATH", "")])


def ends(workers: Workers, count: int, takes: float) -> list[float]:
    """When each of so many units was done and kept, sorted [s]."""
    units, done = [Unit("scaling:waited", {"number": k, "takes": takes}) for k in range(count)], list[float]()
    with tempfile.TemporaryDirectory() as folder:
        perform_units(units, workers, None, Path(folder), report=lambda *_: done.append(time.perf_counter()))
    return done


def busy(workers: Workers, many: int, waiting: float) -> float:
    """Share of the workers' time that goes to units of TAKES, after the first of each.

    `waiting` is how long a unit waits by itself [s]: simulated workers wait in its place.
    """
    done = ends(workers, (WAVES + 1) * many, waiting)
    return (len(done) - many) * TAKES / (many * (done[-1] - done[many - 1]))


def a_second(done: list[float]) -> float:
    """Units that were done in a second, on average."""
    return (len(done) - 1) / (done[-1] - done[0])


def main() -> None:
    """Measure, and print."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    help_workers_find_this()
    found: dict[str, Any] = {"date": time.strftime("%Y-%m-%d"), "takes": TAKES, "dask": {}, "simulated": {}, "most": {}}
    for many in DASK:
        with on_dask(many) as workers:
            ends(workers, many, 0.0)  # what a worker does once
            found["dask"][many] = busy(workers, many, TAKES)
            if many == max(DASK):
                found["most"]["dask"] = a_second(ends(workers, HURRIED, 0.0))
        print(f"Dask, {many} workers: {found['dask'][many]:.4f}", flush=True)
    for many in SIMULATED:
        found["simulated"][many] = busy(simulated(many, TAKES), many, 0.0)
        print(f"simulated, {many} workers: {found['simulated'][many]:.4f}", flush=True)
    found["most"]["simulated"] = a_second(ends(simulated(max(SIMULATED), 0.0), HURRIED, 0.0))
    print(f"units a second at most: {found['most']}")
    if options.out:
        options.out.write_text(json.dumps(found, indent=1) + "\n")


if __name__ == "__main__":
    main()
