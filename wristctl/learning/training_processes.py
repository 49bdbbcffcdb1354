"""Many trainings over processes. Each depends on its own job alone, so their number changes no byte."""

import math
import multiprocessing
import time
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from wristctl.errors import UserError
from wristctl.interrupt import deferred
from wristctl.learning.dataset import Samples
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Epoch, Job, TrainingResult
from wristctl.learning.transitions import Transitions
from wristctl.processes import safe_path, serve_parent

# Told the job's number and its last epoch.
Report = Callable[[int, Epoch], None]

_given: dict[str, Any] = {}
# Seconds in which trainings that are interrupted come to the end of an epoch; their checkpoints stay in any case.
_TO_END = 0.35


def train_all(
    samples: Samples | Transitions,
    jobs: Sequence[Job],
    workers: int = 1,
    device: str = "cpu",
    checkpoints: Path | None = None,
    report: Report = lambda job, epoch: None,
) -> list[TrainingResult]:
    """Do all jobs, `workers` at once, and give their trials in order; after Ctrl-C those that had begun."""
    if min(workers, len(jobs)) > 1:
        with safe_path():
            return _over_processes(samples, jobs, min(workers, len(jobs)), device, checkpoints, report)
    trials: list[TrainingResult] = []
    for number, job in enumerate(jobs):
        try:
            trial = train_one(samples, job, device, checkpoints, partial(report, number))
        except KeyboardInterrupt:
            if not trials:
                raise
            break
        trials.append(trial)
        if trial.interrupted:
            break
    return trials


def _over_processes(
    samples: Samples | Transitions,
    jobs: Sequence[Job],
    workers: int,
    device: str,
    checkpoints: Path | None,
    report: Report,
) -> list[TrainingResult]:
    context = multiprocessing.get_context("spawn")
    progress, stop, begun = context.SimpleQueue(), context.Event(), context.Event()
    setup: dict[str, Any] = {"samples": samples, "device": device, "checkpoints": checkpoints}
    setup |= {"told": progress, "stop": stop, "begun": begun}
    interrupted = False
    try:
        with ProcessPoolExecutor(workers, context, _begin, (setup,)) as pool, _ended():
            with deferred():  # the workers' too, which begin with it
                futures = [pool.submit(_work, number, job) for number, job in enumerate(jobs)]
            pending: set[Future[TrainingResult | None]] = set(futures)
            until = math.inf
            while pending and time.monotonic() < until:
                try:
                    _, pending = wait(pending, timeout=0.2)
                    while not progress.empty():
                        report(*progress.get())
                except KeyboardInterrupt:
                    interrupted, until = True, time.monotonic() + _TO_END * begun.is_set()
                    stop.set()  # what had not begun comes back with nothing
            trials = [future.result() for future in futures if not interrupted or _came_back(future)]
    except BrokenProcessPool as error:
        if interrupted:
            raise KeyboardInterrupt from error
        raise UserError(
            "a worker process died", "train.workers", "train again with resume: RUN and fewer workers"
        ) from error
    finished = [trial for trial in trials if trial is not None]
    if interrupted and not finished:
        raise KeyboardInterrupt
    return finished


def _came_back(future: Future[TrainingResult | None]) -> bool:
    return future.done() and future.exception() is None


@contextmanager
def _ended() -> Iterator[None]:
    """At the block's end all workers end at once: their pool would wait for all that it was given."""
    try:
        yield
    finally:
        for worker in multiprocessing.active_children():
            worker.kill()  # a milder signal waits there, as it does here while they are begun


def _begin(setup: dict[str, Any]) -> None:
    _given.update(setup)
    setup["begun"].set()
    serve_parent()


def _work(number: int, job: Job) -> TrainingResult | None:
    def report(epoch: Epoch) -> None:
        if _given["stop"].is_set():
            raise KeyboardInterrupt
        _given["told"].put((number, epoch))

    if _given["stop"].is_set():
        return None
    return train_one(_given["samples"], job, _given["device"], _given["checkpoints"], report)
