"""What is told of the kept network: the course of its trainings, errors beside the baselines, cost, and its file."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of, known_of, session
from wristctl.commands.results import Findings
from wristctl.commands.train import results
from wristctl.commands.train.results import best_row, error_table, keep_network, timing_table, trial_table
from wristctl.learning.dataset import Samples, Split, draw_samples
from wristctl.learning.evaluation import ANGLE_MEASURES, Place, places
from wristctl.learning.training_result import Epoch
from wristctl.records import Run, start_run
from wristctl.wrist.kinematics import exact_angle

SPLIT = Split(np.arange(30), np.arange(30, 35), np.arange(35, 40))
ROW = ("inverse", "inputs", "R^2", "RMSE [deg]", "max error [deg]", "within 0.5 deg [share]", "parameters")


def samples(off: float = 0.0, others: bool = False) -> Samples:
    """40 samples of single arcs, whose angles are so far off those of the arcs [deg]."""
    study = wristctl.load_study(None, "gen-data.samples=40")
    made = draw_samples(study.gen_data, study.wrist, np.random.default_rng(0))
    more = (np.linspace(0.0, 1.0, 40)[:, None], ("pose",)) if others else (made.others, made.names)
    theta = made.theta + np.radians(off)
    return Samples(made.tip, theta, made.arc_length, made.domain, *more, made.held_out, 1)


def result(off: float = 0.0, trial: int = 0, loss: float = 1.0, columns: int = 2) -> Any:
    """A training whose network is so far off [deg]; its epochs' losses are squares of 4, 3, ... deg."""
    epochs = tuple(Epoch(trial, k, math.radians(5.0 - k) ** 2, math.radians(6.0 - k) ** 2) for k in range(1, 3 + trial))
    network = SimpleNamespace(
        angle=lambda x: exact_angle(x[..., :2]) + np.radians(off),
        sizes=(columns, 8, 1),
        parameters=33,
        multiply_adds=24,
    )
    job = SimpleNamespace(trial=trial)
    return SimpleNamespace(job=job, epochs=epochs, network=network, validation_loss=loss, gradient_norm=0.125)


def test_the_row_of_the_best_training_is_kept_and_what_diverged_is_not() -> None:
    trials = {"a": [result(loss=3.0), result(loss=2.0)], "b": [result(loss=math.nan), result(loss=1.0)]}
    assert best_row(trials) == ("b", trials["b"])
    trials["b"] = [result(loss=math.nan), result(loss=math.inf)]
    assert best_row(trials) == ("a", trials["a"])


def test_each_training_is_told_by_its_last_epoch(tmp_path: Path) -> None:
    trials = [result(trial=0, loss=math.radians(1.5) ** 2), result(trial=1, loss=math.radians(0.5) ** 2)]
    with start_run("train", wristctl.load_study(None), "", tmp_path) as live:
        findings = Findings(0, live)
        table = trial_table(findings, trials, trials[1])
    assert table.title == "Trials"
    assert table.columns == ("trial", "epochs", "training RMSE [deg]", "validation RMSE [deg]", "kept")
    assert [row[-1] for row in table.rows] == [False, True]
    np.testing.assert_allclose([row[:-1] for row in table.rows], [(0, 2, 3.0, 1.5), (1, 3, 2.0, 0.5)])
    assert findings.metrics["gradient_norm"]["value"] == 0.125
    assert known_of(findings, "gradient_norm") == [("", "lower", 1)] and list(findings.figures) == ["learning-curves"]
    run = Run(live.path)
    assert list(run.data("curves")["trial"]) == [0, 0, 1, 1, 1]
    assert columns_of(run, "data/curves.csv")["train_loss"][0] == "rad^2"


def told(off: float, made: Samples, columns: int = 2, where: list[Place] | None = None) -> tuple[Any, Findings]:
    findings = Findings(0)
    return error_table(findings, result(off, columns=columns), made, SPLIT, where or places(made, SPLIT)), findings


def test_errors_of_each_inverse_in_each_place_are_rows_and_metrics() -> None:
    table, findings = told(0.25, samples())
    assert table.title == "Errors of the bending angle" and table.columns == (*ROW, "multiply-adds")
    names = [
        (name, place)
        for name in ("network", "polynomial", "exact inverse")
        for place in ("test samples", "whole workspace")
    ]
    assert [row[:2] for row in table.rows] == names
    for row, prefix in zip(table.rows[:2], ("", "workspace_"), strict=True):
        assert row[3:] == pytest.approx((0.25, 0.25, 1.0, 33, 24))
        metrics = [findings.metrics[prefix + name]["value"] for name in list(ANGLE_MEASURES)[:4]]
        assert row[2:6] == tuple(metrics) and prefix + "rmse_ulnar_deg" not in findings.metrics
    assert table.rows[-1][2:] == pytest.approx((1.0, 0.0, 0.0, 1.0, 0, 0), abs=1e-9)
    known = findings.metrics
    assert known["polynomial_rmse_deg"]["value"] == table.rows[2][3]
    assert known["polynomial_workspace_rmse_deg"]["value"] == table.rows[3][3]
    assert known["exact_workspace_max_error_deg"]["value"] == pytest.approx(0.0, abs=1e-9)
    assert known_of(findings, "rmse_deg", "r2", "close_share") == [
        ("deg", "lower", 5), ("", "higher", 5), ("1", "higher", 5),
    ]  # fmt: skip
    assert known["workspace_rmse_deg"]["n"] > 100
    assert known["rmse_deg"]["meaning"] == "network, test samples: root mean squared error of the angle"
    assert (known["network_parameters"]["value"], known["network_multiply_adds"]["value"]) == (33, 24)
    assert known["exact_inverse_parameters"]["value"] == 0
    assert known_of(findings, "network_parameters", "polynomial_multiply_adds") == [("", "lower", 1)] * 2
    assert list(findings.figures) == ["predicted-angles", "error-map"]
    assert not any("over_exact" in name for name in known), "the exact inverse is exact there"


@pytest.mark.parametrize(("ratio", "said"), [(0.1, "at most a tenth of"), (0.125, "NOT down to a tenth of")])
def test_where_arcs_are_not_exact_the_network_is_told_beside_them(tmp_path: Path, ratio: float, said: str) -> None:
    made = samples(off=4.0, others=True)
    held = Place("held-out poses", made.inputs[:8], made.theta[:8])
    with start_run("train", wristctl.load_study(None), "", tmp_path) as live:
        findings = Findings(0, live)
        where = [places(made, SPLIT)[0], held]
        table = error_table(findings, result(4.0 - 3.999999 * ratio, columns=3), made, SPLIT, where)
    run, known = Run(live.path), findings.metrics
    assert [row[1] for row in table.rows[:2]] == ["test samples", "held-out poses"]
    assert known["rmse_over_exact_test_samples"]["value"] == pytest.approx(ratio, rel=1e-5)
    assert known_of(findings, "rmse_over_exact_held_out_poses") == [("1", "lower", 8)]
    assert known["held_out_poses_rmse_deg"]["value"] == pytest.approx(4.0 * ratio, rel=1e-5)
    assert known["polynomial_held_out_poses_rmse_deg"]["n"] == 8
    text = f"On held-out poses the network's RMSE is {said} the exact inverse's ({ratio:.3g} of it)."
    assert text in run.file("README.md").read_text()
    predicted = run.data("predictions")
    np.testing.assert_allclose(predicted["theta"], made.theta[SPLIT.test])
    np.testing.assert_allclose(predicted["theta_exact"], exact_angle(made.tip[SPLIT.test]))
    np.testing.assert_allclose(predicted["theta_network"] - predicted["theta"], np.radians(-4.0 * ratio), rtol=1e-4)
    assert not (run.path / "data/error_map.npz").exists()
    (dots,) = findings.figures["error-map"].axes[0].collections
    np.testing.assert_allclose(np.asarray(dots.get_array()), 4.0 * ratio, rtol=1e-4)


def test_a_run_keeps_the_map_of_errors(tmp_path: Path) -> None:
    with start_run("train", wristctl.load_study(None), "", tmp_path) as live:
        made = samples()
        error_table(Findings(0, live), result(0.25), made, SPLIT, places(made, SPLIT))
    found = Run(live.path).array("error_map")
    assert set(found) == {"tip", "theta", "error"}
    np.testing.assert_allclose(np.degrees(found["error"]), 0.25)
    np.testing.assert_allclose(exact_angle(found["tip"]), found["theta"], atol=1e-9)


def test_time_is_taken_of_each_inverse_on_its_own_inputs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for at, name in enumerate(("network", "polynomial"), start=1):
        monkeypatch.setattr(results, f"compiled_{name}", lambda _of, at=at: at)
    monkeypatch.setattr(results, "compiled_exact", 3)

    def microseconds(code: int, inputs: Any) -> float:
        return float(100 * code + 10 * inputs.shape[1] + len(inputs))

    monkeypatch.setattr(results, "microseconds", microseconds)
    with start_run("train", wristctl.load_study(None), "", tmp_path) as live:
        table = timing_table(Findings(0, live), result(), samples(others=True), SPLIT, 7.5)
    assert table.columns == ("inverse", "median [us]")
    assert table.rows == [("network", 125.0), ("polynomial", 235.0), ("exact inverse, 2 atan2(y, x)", 325.0)]
    kept = json.loads(Run(live.path).file("timing.json").read_text())
    assert kept == {"training_s": 7.5, "compiled_us_per_angle": dict(table.rows)}


def test_the_networks_file_says_how_it_was_trained(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    saved: list[Any] = []

    def save(*given: Any) -> None:
        saved.append(given)
        given[1].write_bytes(b"network")

    monkeypatch.setattr(results, "save_network", save)
    network: Any = "network"
    row = "train.rows=[{name: tan, activation: tanh}]"
    digest = {}
    with start_run("gen-data", wristctl.load_study(None), "", tmp_path) as live:
        live.file("data/samples.npz").write_bytes(b"earlier")
    data = Run(live.path)
    cases: list[tuple[tuple[str, ...], dict[str, Any], str]] = [((), {}, ""), ((row,), {"data": data}, "cheapest")]
    for settings, inputs, reason in cases:
        study = wristctl.load_study(None, "seed=6", *settings)
        with start_run("train", study, "", tmp_path) as live:
            live.file("data/samples.npz").write_bytes(b"own")
            keep_network(session(study, live, inputs), network, "tan", reason)
        digest[reason] = live.path / "models/network.safetensors"
    keep_network(session(wristctl.load_study(None)), network, "tan", "")
    (_, first_file, first), (_, _, second) = saved
    assert first_file == digest[""] and first["seed"] == 6
    assert "row" not in first and "reason" not in first
    assert (second["row"], second["reason"]) == ("tan", "cheapest")
    digests = [hashlib.sha256(text).hexdigest() for text in (b"own", b"earlier")]
    assert [first["samples_sha256"], second["samples_sha256"]] == digests
    assert "hidden" in first["settings"] and not {"data", "resume", "workers"} & set(first["settings"])
