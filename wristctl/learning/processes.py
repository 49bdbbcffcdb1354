"""Many trainings over processes. Each depends on its own job alone, so their number changes no byte."""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from functools import partial
from pathlib import Path
from typing import Any

from wristctl.config.errors import UserError
from wristctl.learning.dataset import Samples
from wristctl.learning.training import train_one
from wristctl.learning.training_result import Epoch, Job, TrainingResult

Report = Callable[[int, Epoch], None]
"""Told the job's number and its last epoch."""

_given: dict[str, Any] = {}


def train_all(
    samples: Samples,
    jobs: Sequence[Job],
    workers: int = 1,
    device: str = "cpu",
    checkpoints: Path | None = None,
    report: Report = lambda job, epoch: None,
) -> list[TrainingResult]:
    """Do all jobs, `workers` at once, and give their trials in order; after Ctrl-C those that had begun."""
    if min(workers, len(jobs)) > 1:
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
    samples: Samples, jobs: Sequence[Job], workers: int, device: str, checkpoints: Path | None, report: Report
) -> list[TrainingResult]:
    context = multiprocessing.get_context("spawn")
    told, stop = context.SimpleQueue(), context.Event()
    given = {"samples": samples, "device": device, "checkpoints": checkpoints, "told": told, "stop": stop}
    interrupted = False
    try:
        with ProcessPoolExecutor(workers, context, _begin, (given,)) as pool:
            futures = [pool.submit(_work, number, job) for number, job in enumerate(jobs)]
            pending: set[Future[TrainingResult | None]] = set(futures)
            while pending:
                try:
                    _, pending = wait(pending, timeout=0.2)
                    while not told.empty():
                        report(*told.get())
                except KeyboardInterrupt:
                    interrupted = True
                    stop.set()
                    for future in futures:
                        future.cancel()
            trials = [future.result() for future in futures if not future.cancelled()]
    except BrokenProcessPool as error:
        raise UserError(
            "a worker process died", "train.workers", "train again with resume: RUN and fewer workers"
        ) from error
    begun = [trial for trial in trials if trial is not None]
    if interrupted and not begun:
        raise KeyboardInterrupt
    return begun


def _begin(given: dict[str, Any]) -> None:
    """Leave Ctrl-C to the parent, and end with it: a parent that was killed tells nobody."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    _given.update(given)
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)


def _work(number: int, job: Job) -> TrainingResult | None:
    def report(epoch: Epoch) -> None:
        if _given["stop"].is_set():
            raise KeyboardInterrupt
        _given["told"].put((number, epoch))

    if _given["stop"].is_set():
        return None
    return train_one(_given["samples"], job, _given["device"], _given["checkpoints"], report)
