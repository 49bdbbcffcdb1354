"""From transitions to a network of the dynamics to `learned-mpc` in loops, by the commands."""

from __future__ import annotations

import math
import shutil
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

import wristctl
from wristctl.commands.gen_data.transitions import Moved
from wristctl.commands.perform import redrawn
from wristctl.commands.progress import watched
from wristctl.commands.train.learned_dynamics import TrainedDynamics
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.study_files.load import load_study

DATA = ("gen-data={source: transitions, samples: 600}",)
SMALL = ("train={preset: recommended, hidden: [8], epochs: 10, workers: 1}",)


class Made(NamedTuple):
    """Runs in one folder: transitions and the network of them."""

    moved: Moved
    trained: TrainedDynamics


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Made:
    """A small network of the paper's wrist."""
    out = tmp_path_factory.mktemp("dynamics")
    moved = wristctl.gen_data(load_study([], [*DATA]), out=out)
    assert isinstance(moved, Moved)
    trained = wristctl.train(load_study([], [*SMALL]), data=moved, out=out)
    assert isinstance(trained, TrainedDynamics)
    return Made(moved, trained)


def controller_of(trained: TrainedDynamics, folder: Path) -> str:
    """The controller of a training, copied to where nothing else refers to."""
    assert trained.run is not None
    shutil.copytree(trained.run.path / "code", folder / "code")
    return f"{folder / 'code' / 'learned_mpc.py'}:LEARNED_MPC"


@pytest.mark.slow
def test_the_answer_of_a_training_says_errors_in_motions_that_were_held_out(made: Made) -> None:
    trained, samples = made.trained, made.moved.samples
    seen = np.unique(samples.recording[trained.trials[0].job.split.train])
    assert len(trained.held_out) and not set(trained.held_out) & set(seen)
    rows = {str(row[0]): row[1:] for row in trained.tables[0].rows}
    assert set(rows) == {"network", "one-segment model", "linear model"}
    for row in rows.values():
        after_20_ms, after_200_ms, largest = (float(value) for value in row[1:])
        assert 0.0 < after_20_ms < after_200_ms < largest < 5.0
    assert trained.metrics["network_after_200_ms"] == rows["network"][2]
    assert trained.metrics["network_after_20_ms"] == rows["network"][1]
    meanings = {name: known["meaning"] for name, known in trained.findings.metrics.items()}
    assert meanings["network_after_20_ms"] == "network: RMSE of the bend after 0.02 s in held-out motions"
    assert "largest error of the bend after 0.2 s" in meanings["network_largest_then"]
    still = np.degrees(np.ptp(samples.bend[trained.held_out], axis=1)).max()
    assert math.isfinite(float(rows["network"][3])) and float(rows["network"][3]) < 0.1 * still
    assert made.moved.frame().shape == (600, 6)


@pytest.mark.slow
def test_a_loop_under_a_trained_controller_is_repeated_without_the_training(made: Made, tmp_path: Path) -> None:
    place = controller_of(made.trained, tmp_path / "elsewhere")
    study = load_study([], ["simulate.horizon=0.5", "simulate.reference.duration=0.3", f"simulate.controller={place}"])
    done = wristctl.simulate(study, out=tmp_path)
    assert done.run is not None and done.metrics["rmse"] < np.radians(0.1)
    copies = {path.name: path for path in (done.run.path / "code").rglob("*") if path.is_file()}
    weights = (tmp_path / "elsewhere" / "code" / "dynamics.safetensors").read_bytes()
    assert set(copies) == {"learned_mpc.py", "dynamics.safetensors"}
    assert copies["dynamics.safetensors"].read_bytes() == weights
    shutil.rmtree(tmp_path / "elsewhere")
    again = redrawn(done.run, watched(None))
    assert again.metrics["rmse"] == done.metrics["rmse"]
    copies["dynamics.safetensors"].write_bytes(weights[:-1] + b"\0")
    assert Run(done.run.path).problems()


@pytest.mark.slow
def test_a_training_draws_its_own_transitions_and_is_the_same_each_time(tmp_path: Path) -> None:
    study = load_study([], [*DATA, *SMALL])
    runs = [wristctl.train(study, out=tmp_path).run for _ in range(2)]
    files = [(run.path / "code" / "dynamics.safetensors").read_bytes() for run in runs if run]
    assert len(files) == 2 and files[0] == files[1]


@pytest.mark.parametrize("change", ["search=true", "inputs=tip", "split=sample", "rows=[{name: a}]"])
def test_settings_of_networks_of_tips_are_refused_before_anything_is_drawn(change: str) -> None:
    key = change.partition("=")[0]
    with pytest.raises(UserError) as refused:
        wristctl.train(load_study([], [*DATA, "train={hidden: [8]}", f"train.{change}"]))
    assert refused.value.where == f"load_study(..., 'train.{change}'): train.{key}"


def test_a_network_that_is_too_large_for_a_controller_is_refused() -> None:
    with pytest.raises(UserError, match="too large"):
        wristctl.train(load_study([], [*DATA]))


def test_a_loop_is_no_setting_of_other_samples() -> None:
    with pytest.raises(UserError, match="a loop is for source: transitions"):
        load_study([], ["gen-data.loop.plant_segments=2"])


def test_without_a_network_the_two_commands_that_make_one_are_named() -> None:
    with pytest.raises(UserError) as missing:
        load_study([], ["simulate.controller=learned-mpc"])
    assert all(f"wristctl {command} " in str(missing.value) for command in ("gen-data", "train"))
    from wristctl.control.table import controller

    with pytest.raises(UserError, match="needs a network"):
        controller("learned-mpc")
