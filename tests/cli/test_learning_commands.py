"""`gen-data` and `train` as they are typed."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from tests.cli.conftest import Call
from wristctl.learning import training, training_processes
from wristctl.learning.dataset import Samples
from wristctl.learning.network_file import load_network, training_record
from wristctl.learning.training_result import Epoch, Job, TrainingResult
from wristctl.records import list_runs, open_run

LEAVES = ("hidden=[16,8]", "activation=tanh", "learning_rate=0.01", "workers=1", "epochs=12")
QUICK = tuple(word for leaf in LEAVES for word in ("--set", leaf))
TRAIN = ("train", "--data", "latest:gen-data", *QUICK, "--seeds", "2")


@pytest.mark.painted
@pytest.mark.slow
def test_gen_data_leaves_samples_that_read_back_exactly(call: Call) -> None:
    code, out, _ = call("gen-data", "--samples", "200")
    run = open_run("latest:gen-data")
    table, arrays = run.data("samples"), run.array("samples")
    assert code == 0 and out.splitlines()[-1].endswith(run.id)
    assert len(table) == 200 and table[["x", "y"]].to_numpy().tobytes() == arrays["tip"].tobytes()
    assert run.metrics["exact_inverse_max_error_deg"]["value"] < 1e-13
    assert run.metrics["theta_max_deg"]["value"] == pytest.approx(50.0, abs=1.0)
    names = {f"{name}.{kind}" for name in ("coverage", "workspace") for kind in ("png", "svg")}
    assert names == {file.name for file in (run.path / "figures").iterdir()}


@pytest.fixture(scope="module")
def sampled(made: Callable[..., Path]) -> Path:
    """A folder with a gen-data run."""
    return made("gen-data", "--samples", "400")


@pytest.fixture(scope="module")
def trained(made: Callable[..., Path], sampled: Path) -> Path:
    """The same with a train run."""
    return made(*TRAIN, after=sampled)


@pytest.fixture
def data(call: Call, sampled: Path, tmp_path: Path) -> str:
    """The id of the gen-data run, in the folder of this test."""
    shutil.copytree(sampled / "results", tmp_path / "results")
    return open_run("latest:gen-data").id


@pytest.mark.slow
def test_train_leaves_a_network_its_errors_and_the_exact_inverse_beside_them(trained: Path) -> None:
    run = open_run("latest:train", trained / "results")
    network, metrics = load_network(run.file("models/network.safetensors")), run.metrics
    predictions = run.data("predictions")
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
    assert run.manifest.inputs[0].run == open_run("latest:gen-data", trained / "results").id
    record: dict[str, Any] = training_record(run.file("models/network.safetensors"))
    assert record["seed"] == 0 and record["settings"]["epochs"] == 12


@pytest.mark.slow
def test_the_same_seed_gives_the_same_results(call: Call, data: str, trained: Path) -> None:
    def hashes(seed: str) -> tuple[str, ...]:
        sampled = call("gen-data", "--samples", "400", "--seed", seed, "--json")
        trained = call(*TRAIN, "--data", data, "--seed", seed, "--json")
        return tuple(json.loads(out)["result_sha256"] for _, out, _ in (sampled, trained))

    before = tuple(open_run(f"latest:{kind}", trained / "results").result_hash for kind in ("gen-data", "train"))
    same, other = hashes("0"), hashes("5")
    assert same == before and other[0] != before[0] and other[1] != before[1]


def interrupt_at(epoch: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the first training be interrupted in this epoch."""

    def interrupted(
        samples: Samples, job: Job, device: str, checkpoints: Path | None, report: Callable[[Epoch], None]
    ) -> TrainingResult:
        def stop(done: Epoch) -> None:
            if done.epoch == epoch:
                raise KeyboardInterrupt
            report(done)

        return training.train_one(samples, job, device, checkpoints, stop)

    monkeypatch.setattr(training_processes, "train_one", interrupted)


def test_interrupted_training_keeps_the_network_found_so_far(
    call: Call, data: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    interrupt_at(3, monkeypatch)
    code, _, _ = call("train", "--data", "latest:gen-data", *QUICK)
    (run,) = (run for run in list_runs(Path("results")) if run.kind == "train")
    assert code == 130 and run.state == "interrupted"
    assert len(run.data("curves")) == 3 and load_network(run.file("models/network.safetensors")).sizes == (2, 16, 8, 1)
    run.check()


@pytest.mark.slow
def test_a_training_that_was_stopped_resumes_to_the_same_result(
    call: Call, data: str, trained: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(training, "SAVE_EVERY", 0.0)
    with monkeypatch.context() as stopping:
        interrupt_at(5, stopping)
        call(*TRAIN)
    (stopped,) = (run for run in list_runs(Path("results")) if run.kind == "train")
    assert (stopped.path / "checkpoints" / "network-0.pt").is_file()
    code, _, _ = call(*TRAIN, "--resume", stopped.id)
    resumed, whole = open_run("latest:train"), open_run("latest:train", trained / "results")
    assert code == 0 and resumed.result_hash == whole.result_hash
    assert not (resumed.path / "checkpoints").exists()
    code, _, err = call("train", "--data", "latest:gen-data", *QUICK, "--seed", "9", "--resume", stopped.id)
    assert code == 2 and "other settings, data or seed" in err


@pytest.mark.slow
def test_without_a_data_run_train_draws_what_gen_data_would(call: Call) -> None:
    call("gen-data", "--samples", "100", "--seed", "3")
    call("train", *QUICK, "--seed", "3", "--set", "gen-data.samples=100")
    drawn, own = open_run("latest:gen-data"), open_run("latest:train")
    assert own.file("data/samples.npz").read_bytes() == drawn.file("data/samples.npz").read_bytes()
    assert "samples: 100" in own.file("config.yaml").read_text()


@pytest.mark.slow
def test_a_search_killed_outright_resumes_to_the_same_bytes(call: Call, tmp_path: Path) -> None:
    grid = "grid={depths: [1, 2], activations: [tanh, relu], widths: [8], folds: 5}"
    search = ("train", "--search", *QUICK, "--epochs", "40", "--set", grid, "--set", "gen-data.samples=80")
    command = [sys.executable, "-P", "-m", "wristctl", *search]
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2])}
    child = subprocess.Popen(command, cwd=tmp_path, env=environment, stderr=subprocess.DEVNULL)
    while len(list(tmp_path.glob("results/*/checkpoints/grid-*.pt"))) < 3:
        assert child.poll() is None, "it ended before it could be killed"
        time.sleep(0.005)
    child.kill()
    child.wait()
    (killed,) = list_runs(Path("results"))
    done = len(list((killed.path / "checkpoints").glob("grid-*.pt")))
    assert killed.state == "crashed" and 3 <= done < 20
    code, _, _ = call(*search, "--resume", killed.id)
    resumed = open_run("latest:train")
    call(*search)
    whole = open_run("latest:train")
    assert code == 0 and resumed.id != whole.id and resumed.result_hash == whole.result_hash


@pytest.mark.painted
@pytest.mark.slow
def test_rows_are_ranked_with_intervals_beside_the_paper(call: Call, tmp_path: Path) -> None:
    study = tmp_path / "rows.yaml"
    rows = "".join(
        f"    - {{name: {name}-{form}, preset: t1-{name}, hidden: [8], epochs: 3{more}}}\n"
        for form, more in (("printed", ""), ("scaled", ", optimiser: adamw, standardise: true"))
        for name in ("relu", "sigmoid")
    )
    study.write_text(f"gen-data: {{samples: 60}}\ntrain:\n  seeds: 3\n  workers: 1\n  rows:\n{rows}")
    code, out, _ = call("train", str(study), "--json")
    metrics, result = open_run("latest:train").metrics, json.loads(out)
    assert code == 0 and len(open_run("latest:train").data("trials")) == 4 * 3
    low, high = metrics["relu-scaled_mean_rmse_deg"]["interval"]
    assert low < metrics["relu-scaled_mean_rmse_deg"]["value"] < high
    assert {metrics[f"{name}-printed_rank_adam-raw"]["value"] for name in ("relu", "sigmoid")} == {1, 2}
    assert metrics["c16_sigmoid-printed_is_best"]["value"] == 0, "three seeds cannot support it"
    seeds = next(table for table in result["tables"] if table["title"].startswith("Over 3 seeds"))
    assert [row[-1] for row in seeds["rows"] if row[:2] == ["sigmoid-printed", "gradient_norm"]] == [0.0012]


@pytest.mark.painted
@pytest.mark.slow
def test_a_search_chooses_by_cross_validation_and_says_why(call: Call) -> None:
    grid = "grid={depths: [1, 3], activations: [tanh], widths: [8], folds: 2}"
    call("train", "--search", *QUICK, "--epochs", "3", "--set", grid, "--set", "gen-data.samples=80")
    run = open_run("latest:train")
    record: dict[str, Any] = training_record(run.file("models/network.safetensors"))
    depth = run.metrics["c15_chosen_depth"]["value"]
    assert depth in (1, 3) and "cheapest network" in str(record["reason"])
    assert len(load_network(run.file("models/network.safetensors")).sizes) == depth + 2
    assert len(run.data("grid")) == 2 and run.file("figures/accuracy-against-cost.svg").is_file()


@pytest.mark.slow
def test_a_network_of_the_plant_is_judged_on_what_was_held_out_and_knows_its_wrist(call: Call) -> None:
    plant = ("--source", "plant", "--set", "segments=2", "--set", "held_out_poses=[45]", "--samples", "120")
    call("gen-data", *plant)
    call("train", "--data", "latest:gen-data", *QUICK, "--epochs", "2")
    metrics = open_run("latest:train").metrics
    assert metrics["held_out_poses_rmse_deg"]["n"] + metrics["held_out_payloads_rmse_deg"]["n"] == metrics["r2"]["n"]
    assert metrics["rmse_over_exact_test_samples"]["value"] > 0.0
    code, _, err = call("simulate", "--network", "latest:train", "--set", "reference.inverse=network")
    assert code == 2 and "2 segments, the loop has 4" in err


def test_samples_of_an_earlier_run_are_its_course(call: Call) -> None:
    call("simulate", "--set", "horizon=0.5")
    code, _, _ = call("gen-data", "--source", "run", "--run", "latest:simulate", "--samples", "50")
    table, course = open_run("latest:gen-data").data("samples"), open_run("latest:simulate").data("trajectory")
    assert code == 0 and len(table) == 50
    known = set(zip(course["tip_x"], course["tip_y"], course["theta"], strict=True))
    assert set(zip(table["x"], table["y"], table["theta"], strict=True)) <= known


def test_dry_runs_write_nothing(call: Call, data: str, tmp_path: Path) -> None:
    before = sorted(tmp_path.rglob("*"))
    code, out, _ = call("train", "--data", "latest:gen-data", "--dry-run")
    assert code == 0 and "300 samples to train on" in out
    code, out, _ = call("gen-data", "--dry-run")
    assert code == 0 and "1000 samples" in out and sorted(tmp_path.rglob("*")) == before


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (("gen-data", "--set", "stretch=[1.1,0.9]"), "stretch"),
        (("gen-data", "--set", "sampling=sobel"), "sobol"),
        (("gen-data", "--source", "run"), "source run needs a run"),
        (("gen-data", "--source", "run", "--run", "latest:gen-data"), "no course"),
        (("gen-data", "--run", "latest:gen-data"), "--source run"),
        (("train", "--preset", "t1-selu"), "t1-relu"),
        (("train", "--resume", "latest:gen-data"), "train run is needed"),
        (("train", "--search", "--set", "rows=[{name: a}]"), "not both"),
        (("train", "--data", "latest:gen-data", "--set", "activation=gelu"), "activation"),
        (("train", "--data", "latest:gen-data", "--set", "train_share=0.999"), "train_share"),
        (("train", "--data", "latest:gen-data", "--set", "hidden=[0]"), "hidden"),
    ],
)
def test_what_the_user_got_wrong_is_said_in_one_line_and_leaves_no_run(
    call: Call, data: str, tmp_path: Path, arguments: tuple[str, ...], message: str
) -> None:
    code, _, err = call(*arguments)
    assert code == 2 and len(err.splitlines()) == 1 and message in err
    assert len(list((tmp_path / "results").iterdir())) == 1


@pytest.mark.slow
def test_three_tendons_go_from_samples_to_a_network_behind_a_reference(call: Call, tmp_path: Path) -> None:
    own = tmp_path / "mywrist.yaml"
    own.write_text("wrist: {tendons: three, length: 0.095, stiffness: 1.1}\n")
    code, out, err = call("gen-data", str(own), "--samples", "300")
    assert code == 0 and "bend in two planes" in out and "tip, toward ulnar" in out, err
    data = out.splitlines()[-1]
    small = ("--preset", "recommended", "--set", "hidden=[8]", "--epochs", "40")
    code, out, err = call("train", str(own), "--data", data, *small)
    assert code == 0 and "over both planes" in out, err
    network = out.splitlines()[-1]
    over, ulnar = (open_run(network).metrics[name]["value"] for name in ("rmse_deg", "rmse_ulnar_deg"))
    assert 0.0 < ulnar < over < 0.5
    motion = ("--reference", "circumduction", "--controller", "ct-dob", "--set", "reference.inverse=network")
    code, out, err = call("simulate", str(own), *motion, "--network", network)
    assert code == 0, err
    bends = open_run(out.splitlines()[-1]).data("bends")
    wanted = np.deg2rad(30.0)
    followed = np.hypot(bends["bend_ref_ulnar"], bends["bend_ref_flexion"])[-1000:]
    assert 0.0 < np.abs(followed - wanted).max() < np.deg2rad(2.0), "by the network's own error, not the wanted bend"
    code, _, err = call("simulate", str(own), *motion)
    assert code == 2 and "none is given" in err
    plain = ("--set", "wrist.tendons=four", "--set", "reference.inverse=network", "--network", network)
    code, _, err = call("simulate", *plain)
    assert code == 2 and "learned bends in two planes, and the loop bends in one plane" in err
