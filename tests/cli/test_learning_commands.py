"""`gen-data` and `train` as they are typed."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from wristctl.learning import training
from wristctl.learning.network_file import load_network, training_record
from wristctl.runs import list_runs, open_run

QUICK = ("--set", "hidden=[16,8]", "--set", "activation=tanh", "--set", "learning_rate=0.01", "--epochs", "12")


def test_gen_data_leaves_samples_that_read_back_exactly(call) -> None:
    code, out, _ = call("gen-data", "--samples", "200")
    run = open_run("latest:gen-data")
    table, arrays = run.data("samples"), run.array("samples")
    assert code == 0 and out.splitlines()[-1].endswith(run.id)
    assert len(table) == 200 and table[["x", "y"]].to_numpy().tobytes() == arrays["tip"].tobytes()
    assert run.metrics["exact_inverse_max_error_deg"]["value"] < 1e-13
    assert run.metrics["theta_max_deg"]["value"] == pytest.approx(50.0, abs=1.0)
    assert {"coverage.png", "coverage.svg"} == {file.name for file in (run.path / "figures").iterdir()}


def test_train_leaves_a_network_its_errors_and_the_exact_inverse_beside_them(call) -> None:
    call("gen-data", "--samples", "400")
    code, out, _ = call("train", "--data", "latest:gen-data", *QUICK, "--seeds", "2", "--json")
    run, result = open_run("latest:train"), json.loads(out)
    network, metrics = load_network(run.file("models/network.safetensors")), run.metrics
    predictions = run.data("predictions")
    assert code == 0 and result["id"] == run.id
    np.testing.assert_allclose(
        network.angle(predictions[["x", "y"]].to_numpy()), predictions["theta_network"], atol=1e-13
    )
    error = np.degrees(np.abs(predictions["theta_network"] - predictions["theta"]))
    assert metrics["max_error_deg"]["value"] == pytest.approx(error.max())
    assert metrics["max_error_deg"]["unit"] == "deg" and metrics["r2"]["value"] > 0.9
    assert metrics["close_share"]["n"] == len(predictions) == 50
    assert metrics["exact_max_error_deg"]["value"] < 1e-13
    assert metrics["gradient_norm"]["value"] > 0.0
    assert len(run.data("curves")) == 2 * 12
    data = open_run("latest:gen-data")
    assert run.manifest.inputs[0].run == data.id
    record = training_record(run.file("models/network.safetensors"))
    assert record["seed"] == 0 and record["settings"]["epochs"] == 12


def test_the_same_seed_gives_the_same_results(call) -> None:
    hashes = []
    for seed in ("4", "4", "5"):
        call("gen-data", "--samples", "100", "--seed", seed)
        call("train", "--data", "latest:gen-data", *QUICK, "--epochs", "2", "--seed", seed)
        hashes.append((open_run("latest:gen-data").result_hash, open_run("latest:train").result_hash))
    assert hashes[0] == hashes[1]
    assert hashes[0][0] != hashes[2][0] and hashes[0][1] != hashes[2][1]


def test_interrupted_training_keeps_the_network_found_so_far(call, monkeypatch: pytest.MonkeyPatch) -> None:
    call("gen-data", "--samples", "100")
    train = training.train

    def interrupted(samples, split, settings, seeds, progress):
        def report(epoch: training.Epoch) -> None:
            if epoch.epoch == 3:
                raise KeyboardInterrupt
            progress(epoch)

        return train(samples, split, settings, seeds, report)

    monkeypatch.setattr(training, "train", interrupted)
    code, _, _ = call("train", "--data", "latest:gen-data", *QUICK)
    (run,) = (run for run in list_runs(Path("results")) if run.kind == "train")
    assert code == 130 and run.state == "interrupted"
    assert len(run.data("curves")) == 3 and load_network(run.file("models/network.safetensors")).sizes == (2, 16, 8, 1)
    run.check()


def test_dry_runs_write_nothing(call, tmp_path: Path) -> None:
    code, out, _ = call("gen-data", "--dry-run")
    assert code == 0 and "1000 samples" in out and not list(tmp_path.iterdir())
    call("gen-data", "--samples", "100")
    before = sorted(tmp_path.rglob("*"))
    code, out, _ = call("train", "--data", "latest:gen-data", "--dry-run")
    assert code == 0 and "75 samples to train on" in out and sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gen-data", "--set", "stretch=[1.1,0.9]"), "stretch"),
        (("gen-data", "--set", "sampling=sobel"), "sobol"),
        (("train",), "gen-data"),
        (("train", "--data", "latest:gen-data", "--set", "activation=gelu"), "activation"),
        (("train", "--data", "latest:gen-data", "--set", "train_share=0.99"), "train_share"),
        (("train", "--data", "latest:gen-data", "--set", "hidden=[0]"), "hidden"),
    ],
)
def test_what_the_user_got_wrong_is_said_in_one_line_and_leaves_no_run(
    call, tmp_path: Path, arguments, message
) -> None:
    call("gen-data", "--samples", "100")
    code, _, err = call(*arguments)
    assert code == 2 and len(err.splitlines()) == 1 and message in err
    assert len(list((tmp_path / "results").iterdir())) == 1
