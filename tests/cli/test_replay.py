"""A run repeated is the same to the byte, or the verdict says where it differs and why."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.study import Study
from wristctl.records import InputRun, Run, start_run
from wristctl.records.replay import causes, verdicts

ROOT = Path(__file__).parents[2]
Command = Callable[..., tuple[int, str]]


@pytest.fixture(scope="module")
def code(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A copy of the package, to be changed."""
    folder = tmp_path_factory.mktemp("code")
    shutil.copytree(ROOT / "wristctl", folder / "wristctl", ignore=shutil.ignore_patterns("__pycache__"))
    return folder


@pytest.fixture(scope="module")
def wristctl(code: Path, tmp_path_factory: pytest.TempPathFactory) -> Command:
    """Runs `wristctl ...` from the copy in a folder of its own: exit code, stdout."""
    folder = tmp_path_factory.mktemp("work")

    def run(*arguments: str, before: Path | None = None) -> tuple[int, str]:
        paths = [str(path) for path in (before, code) if path]
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(paths), "TMPDIR": str(folder)}
        command = [sys.executable, "-P", "-m", "wristctl", *arguments]
        done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True)
        assert "Traceback" not in done.stderr, done.stderr
        return done.returncode, done.stdout

    return run


@pytest.fixture(scope="module")
def data(wristctl: Command) -> str:
    """The id of a gen-data run made by the copy."""
    status, out = wristctl("gen-data", "--samples", "10", "--set", "sampling=uniform")
    assert status == 0
    return Path(out.splitlines()[-1]).name


def _verdict(wristctl: Command, *arguments: str, before: Path | None = None) -> tuple[int, dict[str, Any]]:
    status, out = wristctl("runs", "replay", *arguments, "--json", before=before)
    return status, json.loads(out)


@pytest.mark.slow
def test_a_repetition_is_identical_to_the_byte(wristctl: Command, data: str) -> None:
    status, found = _verdict(wristctl, data)
    assert status == 0 and found["same"] and found["causes"] == [] and found["scratch"] is None
    each = {file["path"]: file["verdict"] for file in found["files"]}
    assert each.pop("tables.json") == each.pop("overview.json") == "volatile"
    assert set(each.values()) == {"identical"} and {"data/samples.npz", "figures/coverage.svg"} <= set(each)


LOOP = ("--set", "loops={fast: {plant_segments: 1}}", "--set", "horizon=0.4")
ROW = "controllers=[{controller: smc, gains: tuned}, {controller: feedforward, gains: default}]"
SEARCH = "grid={depths: [1, 2], activations: [tanh], widths: [8], folds: 2}"
CLAIM = "{id: A, says: A, evidence: comparison, controller: smc, gains: exchanged, metric: rmse, value: 1e-3}"
CHAIN = (
    ("gen-data", "--source", "plant", "--samples", "60"),
    ("simulate", "--set", "horizon=0.3"),
    ("analyse", "--controller", "smc-tracking", "--gains", "default", "--set", "horizon=0.3", "--over", "k"),
    ("gen-data", "--source", "run", "--run", "latest:simulate", "--samples", "50"),
    ("train", "--search", "--epochs", "3", "--set", SEARCH, "--set", "gen-data.samples=80"),
    ("train", "--epochs", "3", "--set", "hidden=[8]", "--set", "gen-data.samples=80"),
    ("tune", *LOOP, "--candidates", "4", "--iterations", "2", "--set", "scenarios=[{loop: fast}]"),
    (
        "compare", *LOOP, "--network", "latest:train", "--tuned", "latest:tune", "--set", ROW,
        "--set", "references=[{kind: step}]",
    ),
    (
        "analyse", "--of", "hysteresis", "--set", "hysteresis.frequencies=[1, 5]",
        "--set", "hysteresis.ranges_deg=[[0, 20], [5, 15]]", "--set", "hysteresis.angles_deg=[10]",
    ),
    ("audit", "--set", f"claims=[{CLAIM}]", "--set", "horizon=0.3"),
)  # fmt: skip


@pytest.mark.skipif(not os.environ.get("WRISTCTL_THOROUGH"), reason="long: make test-trust")
def test_a_run_of_every_kind_is_repeated_to_the_byte(wristctl: Command) -> None:
    for typed in CHAIN:
        status, out = wristctl(*typed, "-q")
        assert status == 0, typed
        run = Path(out.splitlines()[-1]).name
        assert wristctl("runs", "verify", run)[0] == 0
        status, found = _verdict(wristctl, run)
        differing = [each for each in found["files"] if each["verdict"] not in ("identical", "volatile")]
        assert status == 0 and not differing, (typed, found["causes"], differing)


@pytest.mark.slow
def test_a_changed_setting_is_named(wristctl: Command, data: str) -> None:
    status, found = _verdict(wristctl, data, "--set", "samples=11")
    assert status == 3 and found["causes"] == ["config: gen-data.samples: 10 -> 11"]
    samples = next(file for file in found["files"] if file["path"] == "data/samples.csv")
    assert samples["verdict"] == "differs" and samples["detail"].startswith("10 rows")
    assert Path(found["scratch"]).is_dir()


@pytest.mark.slow
def test_a_changed_line_of_code_is_named_by_its_file(wristctl: Command, code: Path, data: str) -> None:
    file = code / "wristctl" / "commands" / "gen_data" / "command.py"
    text = file.read_text()
    file.write_text(text.replace("count = len(samples.theta)", "count = len(samples.theta) + 1"))
    status, found = _verdict(wristctl, data)
    file.write_text(text)
    assert status == 3 and all(cause.startswith("code: ") for cause in found["causes"])
    assert any(cause.startswith("code: commands/gen_data/command.py: ") for cause in found["causes"])
    differing = {each["path"]: each["detail"] for each in found["files"] if each["verdict"] == "differs"}
    assert differing["metrics.json"].endswith("10 before, 11 now") and "data/samples.csv" not in differing


@pytest.mark.slow
def test_a_changed_package_is_named_with_its_version(wristctl: Command, data: str, tmp_path: Path) -> None:
    (tmp_path / "numpy-9.9.9.dist-info").mkdir()
    (tmp_path / "numpy-9.9.9.dist-info" / "METADATA").write_text("Name: numpy\nVersion: 9.9.9\n")
    (tmp_path / "sitecustomize.py").write_text(
        "import numpy as np; r = np.random; first = r.default_rng; "
        "r.default_rng = lambda seed: first([*np.atleast_1d(seed), 9])"
    )
    status, found = _verdict(wristctl, data, before=tmp_path)
    assert status == 3 and found["causes"] == [f"environment: numpy: {np.__version__} -> 9.9.9"]


@pytest.mark.slow
def test_a_changed_input_is_named_by_its_file_and_nothing_is_run(wristctl: Command, data: str) -> None:
    results = Path(wristctl("runs", "show", data)[1].splitlines()[-1]).parent
    with start_run("train", Study(), "", results, inputs=[InputRun("data", Run(results / data))]) as live:
        live.metric("rmse", 1.0)
    file = results / data / "data" / "samples.npz"
    whole = file.read_bytes()
    file.write_bytes(whole[:-1] + bytes([whole[-1] ^ 1]))
    status, found = _verdict(wristctl, live.id)
    file.write_bytes(whole)
    assert status == 3 and found["files"] == []
    assert found["causes"] == [f"input: data: hash does not match what was sealed ({file})"]


def test_without_another_cause_a_difference_is_nondeterminism(tmp_path: Path) -> None:
    runs = []
    for value in (1.0, 2.0):
        with start_run("train", Study(), "", tmp_path) as live:
            live.metric("rmse", value)
            if value == 1.0:
                live.file("data/first.txt").write_text("only then")
        runs.append(Run(live.path))
    assert causes(*runs) == ["nondeterminism: configuration, code, inputs and environment are the same"]
    assert [each[:2] for each in verdicts(*runs)] == [("data/first.txt", "missing"), ("metrics.json", "differs")]


def test_many_changes_are_counted_and_each_output_of_either_run_has_a_verdict(tmp_path: Path) -> None:
    runs = []
    for name in ("before", "now"):
        with start_run("train", Study(), "", tmp_path) as live:
            live.metric("rmse", 1.0)
            live.file(f"data/{name}.txt").write_text("here")
            live.file("timing.json").write_text(name)
        runs.append(Run(live.path))
    runs[1].manifest.code.tree_sha256 = 64 * "0"
    (runs[1].path / "code.txt").write_text("".join(f"{64 * 'a'}  new{number}.py\n" for number in range(3)))
    (runs[0].path / "code.txt").write_text("".join(f"{64 * 'b'}  old{number}.py\n" for number in range(4)))
    why = causes(*runs)
    assert [cause.split(":")[0] for cause in why] == 7 * ["code"] and why[-1] == "code: and 2 more"
    assert why[1:3] == [f"code: old{number}.py: {12 * 'b'} -> absent" for number in range(2)]
    assert {each.path: each.verdict for each in verdicts(*runs)} == {
        "data/before.txt": "missing",
        "data/now.txt": "added",
        "metrics.json": "identical",
        "timing.json": "volatile",
    }


def test_another_result_of_an_input_is_a_cause(tmp_path: Path) -> None:
    runs = []
    for value in (1.0, 2.0):
        with start_run("gen-data", Study(), "", tmp_path) as data:
            data.metric("rmse", value)
        with start_run("train", Study(), "", tmp_path, inputs=[InputRun("data", Run(data.path))]) as live:
            live.metric("rmse", value)
        runs.append(Run(live.path))
    assert causes(*runs) == ["input: data"]
