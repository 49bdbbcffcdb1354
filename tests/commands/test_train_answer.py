"""The answer of a training: errors where it was not trained, beside the closed form, as the metrics have them."""

from __future__ import annotations

from pathlib import Path

import pytest

import wristctl
from wristctl.commands.printed_table import Table
from wristctl.commands.train.command import Trained
from wristctl.commands.train.results import answer_of

SMALL = ("seed=3", "gen-data.samples=40", "train={hidden: [4], activation: tanh, epochs: 3, workers: 1}")


@pytest.fixture(scope="module")
def trained(tmp_path_factory: pytest.TempPathFactory) -> Trained:
    """A network of a moment, in a run directory."""
    result = wristctl.train(wristctl.load_study(None, *SMALL), out=tmp_path_factory.mktemp("trained"))
    assert isinstance(result, Trained)
    return result


def test_errors_are_those_of_the_metrics_in_degrees_and_fit_a_screen(trained: Trained) -> None:
    lines, table, run = trained.summary, trained.answer.table, trained.run
    assert table is not None and run is not None and len(lines) <= 32
    assert all(len(line) <= 100 for line in lines if str(run.path) not in line)
    errors = {row[:2]: dict(zip(table.columns, row, strict=True)) for row in table.rows}
    network, closed = (errors[inverse, "test samples"] for inverse in ("network", "exact inverse"))
    assert network["RMSE [deg]"] == trained.metrics["rmse_deg"] and network["R^2"] == trained.metrics["r2"]
    assert network["max error [deg]"] == trained.metrics["max_error_deg"] and network["parameters"] > 0
    (shown,) = (line.split() for line in lines if line.startswith("exact inverse  test samples"))
    assert closed["RMSE [deg]"] == trained.metrics["exact_rmse_deg"] < 1e-3 and shown[5:7] == ["<0.001", "<0.001"]
    assert not any(each.columns == table.columns for each in trained.tables), "it is told once"
    assert " ".join(lines).startswith(f"On {len(trained.split.test)} samples")
    (file,) = (Path(word) for line in lines for word in line.split() if word.endswith(".safetensors"))
    assert file.is_file()


@pytest.mark.parametrize("networks", [1, 3])
def test_of_several_networks_the_kept_one_is_named(networks: int) -> None:
    rows = [("network", "test samples", 0.9, 0.5, 2.0), ("exact inverse", "test samples", 0.9, 3.0, float("inf"))]
    words = " ".join(answer_of(Table("", "abcde", rows), 8, ("tan-8", networks), "").lines())
    assert ("tan-8" in words) == ("of 3 networks" in words) == (networks == 3)
    assert "RMSE of 0.5 deg, at most 2 deg" in words and "one of 3 deg, at most - deg" in words
