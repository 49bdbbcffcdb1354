"""Trainings one after the other: what each is given, and what is left after Ctrl-C."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.learning import training_processes
from wristctl.learning.dataset import Samples
from wristctl.learning.training_processes import train_all
from wristctl.learning.training_result import Epoch, Job, TrainingResult


class Trainings:
    """Stands in for a training: remembers what it was given, and is interrupted where it should be."""

    def __init__(self, done: TrainingResult, begun: int | None = None, before: int | None = None) -> None:
        self.done, self.begun, self.before = done, begun, before
        self.given: list[tuple[Samples, int, str, Path | None]] = []

    def __call__(
        self, samples: Samples, job: Job, device: str, checkpoints: Path | None, report: Any
    ) -> TrainingResult:
        if job.trial == self.before:
            raise KeyboardInterrupt
        self.given.append((samples, job.trial, device, checkpoints))
        report(Epoch(job.trial, 1, 0.5, 0.25))
        return replace(self.done, job=job, interrupted=job.trial == self.begun)


def jobs(trained: TrainingResult, count: int = 3) -> list[Job]:
    return [replace(trained.job, name=f"job-{k}", trial=k, seed=np.random.SeedSequence(k)) for k in range(count)]


def told(
    monkeypatch: pytest.MonkeyPatch, trainings: Trainings, samples: Samples, count: int = 3, **more: Any
) -> tuple[list[int], list[int]]:
    """Trials that came back, and jobs that reported."""
    monkeypatch.setattr(training_processes, "train_one", trainings)
    seen: list[int] = []
    found = train_all(samples, jobs(trainings.done, count), report=lambda job, epoch: seen.append(job), **more)
    return [each.job.trial for each in found], seen


def test_each_job_is_done_in_turn_on_the_same_samples_and_reports_by_its_number(
    monkeypatch: pytest.MonkeyPatch, trained: TrainingResult, samples: Samples, tmp_path: Path
) -> None:
    trainings = Trainings(trained)
    assert told(monkeypatch, trainings, samples, device="meta", checkpoints=tmp_path) == ([0, 1, 2], [0, 1, 2])
    assert all(each[0] is samples for each in trainings.given)
    assert [each[1:] for each in trainings.given] == [(k, "meta", tmp_path) for k in range(3)]
    assert told(monkeypatch, plain := Trainings(trained), samples) == ([0, 1, 2], [0, 1, 2])
    assert [each[2:] for each in plain.given] == [("cpu", None)] * 3


def test_one_job_needs_no_other_process_however_many_there_may_be(
    monkeypatch: pytest.MonkeyPatch, trained: TrainingResult, samples: Samples
) -> None:
    assert told(monkeypatch, Trainings(trained), samples, count=1, workers=8) == ([0], [0])


def test_after_an_interruption_those_that_had_begun_come_back(
    monkeypatch: pytest.MonkeyPatch, trained: TrainingResult, samples: Samples
) -> None:
    assert told(monkeypatch, Trainings(trained, begun=1), samples) == ([0, 1], [0, 1])
    assert told(monkeypatch, Trainings(trained, before=2), samples) == ([0, 1], [0, 1])
    with pytest.raises(KeyboardInterrupt):
        told(monkeypatch, Trainings(trained, before=0), samples)
