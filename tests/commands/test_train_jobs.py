"""A study's trainings: one job for each network and seed, over how many processes, with checkpoints that carry on."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import session
from wristctl import processes as cores
from wristctl.commands.progress import watched
from wristctl.commands.train.command import checkpoints_of, chosen_by_folds, networks, train_networks
from wristctl.errors import UserError
from wristctl.learning import selection, training_processes
from wristctl.learning.dataset import Split
from wristctl.learning.training_result import Epoch
from wristctl.records import Run, start_run

SPLIT = Split(np.arange(12), np.arange(12, 16), np.arange(16, 20))
ROWS = "train={seeds: 2, workers: 3, rows: [{name: wide-net, hidden: [8], epochs: 5}, {name: tan, epochs: 7}]}"


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """What was asked to be trained; each job is told of one epoch and comes out in order."""
    found: list[Any] = []

    def train_all(samples: Any, jobs: Any, workers: int, device: str, checkpoints: Any, report: Any) -> list[Any]:
        found.append((samples, jobs, workers, device, checkpoints))
        for number in range(len(jobs)):
            report(number, Epoch(0, number + 2, 9.0, np.radians(3.0) ** 2))
        return [SimpleNamespace(job=job, interrupted=False) for job in jobs]

    monkeypatch.setattr(training_processes, "train_all", train_all)
    monkeypatch.setattr(cores, "cores", lambda: 11)
    return found


def trained(*settings: str, told: list[Any] | None = None) -> dict[str, Any]:
    study = wristctl.load_study(None, "seed=5", *settings)
    made = replace(session(study), show=watched(None if told is None else lambda *each: told.append(each)))
    samples: Any = "samples"
    return dict(train_networks(made, samples, SPLIT, networks(study.train), Path("kept")))


def test_every_network_is_trained_from_every_seed(asked: list[Any]) -> None:
    told: list[Any] = []
    found = trained(ROWS, told=told)
    ((samples, jobs, workers, device, checkpoints),) = asked
    assert (samples, workers, checkpoints) == ("samples", 3, Path("kept")) and device in ("cpu", "cuda")
    assert [(job.name, job.trial) for job in jobs] == [
        ("wide-net-0", 0), ("wide-net-1", 1), ("tan-0", 0), ("tan-1", 1),
    ]  # fmt: skip
    assert [job.settings.epochs for job in jobs] == [5, 5, 7, 7] and all(job.split is SPLIT for job in jobs)
    assert jobs[0].seed is jobs[2].seed and jobs[0].seed.entropy != jobs[1].seed.entropy
    assert {name: [each.job.name for each in own] for name, own in found.items()} == {
        "wide-net": ["wide-net-0", "wide-net-1"], "tan": ["tan-0", "tan-1"],
    }  # fmt: skip
    assert [each[:3] for each in told[1:]] == [("training", count, 24) for count in (2, 5, 9, 14)]
    assert told[-1][3] == {"rmse_deg": pytest.approx(3.0)}


def test_without_a_number_of_processes_there_is_one_a_core(asked: list[Any]) -> None:
    trained(
        "train={workers: null, device: cpu}" if wristctl.load_study(None).train.workers is None else "train.workers=0"
    )
    (one,) = asked
    assert one[2] == 11 and [job.name for job in one[1]] == ["network-0"]


@pytest.mark.parametrize(("there", "device"), [(True, "cuda"), (False, "cpu")])
def test_the_device_is_chosen_where_it_is_left_open(
    asked: list[Any], monkeypatch: pytest.MonkeyPatch, there: bool, device: str
) -> None:
    import torch

    monkeypatch.setattr(torch.cuda, "is_available", lambda: there)
    trained("train.device=auto")
    trained("train.device=cpu")
    assert [each[3] for each in asked] == [device, "cpu"]


@pytest.mark.parametrize("cut", ["", "short", "interrupted"])
def test_a_grid_is_chosen_from_by_whole_folds(asked: list[Any], monkeypatch: pytest.MonkeyPatch, cut: str) -> None:
    whole: Any = training_processes.train_all

    def train_all(*given: Any) -> list[Any]:
        found: list[Any] = list(whole(*given))
        found[-1].interrupted = cut == "interrupted"
        return found[:-1] if cut == "short" else found

    monkeypatch.setattr(training_processes, "train_all", train_all)
    monkeypatch.setattr(selection, "candidates", lambda trials, folds: (len(trials), folds))
    monkeypatch.setattr(selection, "choose", lambda found: found)
    grid = "train={search: true, grid: {depths: [1, 2], widths: [4], activations: [tanh], folds: 4}}"
    study, samples = wristctl.load_study(None, "seed=5", grid), "samples"
    if cut:
        with pytest.raises(KeyboardInterrupt):
            chosen_by_folds(session(study), samples, SPLIT, None)  # type: ignore[arg-type]
        return
    assert chosen_by_folds(session(study), samples, SPLIT, None) == (8, 4)  # type: ignore[arg-type,comparison-overlap]
    assert all(len(job.split.validation) == 4 for job in asked[0][1])


def test_checkpoints_of_a_stopped_training_are_carried_on(tmp_path: Path) -> None:
    study = wristctl.load_study(None)
    with start_run("train", study, "", tmp_path) as live:
        (live.path / "checkpoints").mkdir()
        (live.path / "checkpoints" / "network-0.pt").write_text("half way")
    stopped = Run(live.path)
    with start_run("train", study, "", tmp_path) as live:
        kept = checkpoints_of(session(study, live, {"resume": stopped}))
        assert kept == live.path / "checkpoints" and (kept / "network-0.pt").read_text() == "half way"
    with start_run("train", study, "", tmp_path) as live:
        fresh = checkpoints_of(session(study, live))
        assert fresh == live.path / "checkpoints" and not fresh.exists()
    bare = Run(live.path)
    with start_run("train", study, "", tmp_path) as live:
        assert checkpoints_of(session(study, live, {"resume": bare})) == live.path / "checkpoints"
    assert checkpoints_of(session(study)) is None
    with pytest.raises(UserError, match="resumed in a run directory"):
        checkpoints_of(session(study, inputs={"resume": stopped}))
