"""What a run directory holds: everything needed to read, check and repeat it, the same bytes each time."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pandas as pd
import pytest

import wristctl
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, start_run, stream
from wristctl.study_files.load import load_study

if TYPE_CHECKING:
    from matplotlib.figure import Figure

Make = Callable[..., Run]


def test_the_same_results_have_the_same_hash_and_other_results_another(make: Make) -> None:
    first, again, other = make(label="a"), make(label="b"), make(value=0.4)
    assert first.result_hash == again.result_hash
    assert first.result_hash != other.result_hash
    assert first.manifest.fingerprint == again.manifest.fingerprint


def test_volatile_files_stand_outside_the_result_hash(results: Path) -> None:
    hashes = []
    for wall in ("1.0", "2.0"):
        with start_run("tune", Study(), "", results) as run:
            run.file("data/gains.json").write_text("{}")
            run.file("timing.json").write_text(wall)
            run.file("data/timing.csv").write_text(wall)
            run.volatile("data/timing.csv")
        hashes.append(Run(run.path).result_hash)
    assert hashes[0] == hashes[1]


def test_sealed_files_pass_sha256sum(make: Make) -> None:
    run = make()
    done = subprocess.run(["sha256sum", "-c", "SHA256SUMS"], cwd=run.path, capture_output=True, text=True)
    assert done.returncode == 0
    files = {path.relative_to(run.path).as_posix() for path in run.path.rglob("*") if path.is_file()}
    assert {line.rpartition(": ")[0] for line in done.stdout.splitlines()} == files - {"SHA256SUMS"}


def test_a_missing_file_is_found(make: Make) -> None:
    run = make()
    (run.path / "metrics.json").unlink()
    with pytest.raises(UserError, match=r"missing.*metrics\.json"):
        run.check()


def test_tables_and_arrays_read_back_exactly(results: Path) -> None:
    rng = np.random.default_rng(1)
    values = np.concatenate([rng.standard_normal(1000) * 10.0 ** rng.integers(-300, 300, 1000), [0.1, 1 / 3, 5e-324]])
    with start_run("tune", Study(), "", results) as run:
        run.table("data/values.csv", pd.DataFrame({"value": values}))
        run.arrays("data/values.npz", {"value": values, "whole": np.arange(3)})
    read = Run(run.path)
    assert np.array_equal(read.data("values")["value"], values)
    assert np.array_equal(read.array("values")["value"], values)
    assert read.array("values")["whole"].dtype == np.arange(3).dtype
    with zipfile.ZipFile(run.path / "data/values.npz") as archive:
        assert {each.date_time[:3] for each in archive.infolist()} == {(1980, 1, 1)}, "whenever they were written"


def test_a_table_of_columns_or_of_a_frame_is_what_pandas_would_write(results: Path) -> None:
    columns = {
        "time": np.array([0.0, 0.1, 1e-300]), "angle": np.array([1 / 3, np.nan, -np.inf]), "tick": np.arange(3),
        "failed": np.array([True, False, True]), "what": np.array(["a,b", 'say "c"', ""], dtype=object),
    }  # fmt: skip
    frame = pd.DataFrame(columns)
    with start_run("tune", Study(), "", results) as run:
        run.table("data/columns.csv", columns)
        run.table("data/frame.csv", frame)
    written = [(Run(run.path).path / f"data/{name}.csv").read_text() for name in ("columns", "frame")]
    assert written == 2 * [frame.to_csv(index=False, lineterminator="\n")]


def _line(values: list[float]) -> Figure:
    """A line with a legend."""
    from matplotlib.figure import Figure

    figure = Figure()
    axes = figure.subplots()
    axes.plot([0, 1], values, label="line")
    axes.legend()
    return figure


@pytest.mark.painted
def test_figures_are_the_same_bytes_each_time(tmp_path: Path) -> None:
    digests = []
    for folder in ("a", "b"):
        with start_run("tune", Study(), "", tmp_path / folder) as run:
            run.figure("line", partial(_line, [0, 1]))
        digests.append(
            [hashlib.sha256((run.path / f"figures/line.{end}").read_bytes()).hexdigest() for end in ("png", "svg")]
        )
    assert digests[0] == digests[1]


def test_the_manifest_says_what_was_run_on_what_by_which_code(make: Make, results: Path) -> None:
    data = make()
    study = load_study([], ["seed=5"])
    with start_run("train", study, "quick", results, ["wristctl", "train"], [InputRun("data", data)]) as run:
        assert run.stream("weights") == stream(5, "weights")
        run.numerics(dtype="float64", step=np.float64(1e-3))
        run.metric("accuracy", float("nan"), better="higher")
        run.event("checkpoint", loss=np.float32(0.5))
    manifest = json.loads((run.path / "run.json").read_bytes())
    assert manifest["schema"] == "wristctl.run/1"
    assert (manifest["kind"], manifest["label"], manifest["seed"], manifest["state"]) == ("train", "quick", 5, "ok")
    assert manifest["argv"] == ["wristctl", "train"]
    assert manifest["inputs"][0]["run"] == data.id
    assert manifest["inputs"][0]["result_sha256"] == data.result_hash
    assert manifest["streams"] == {"weights": list(stream(5, "weights"))}
    assert manifest["numerics"] == {"dtype": "float64", "step": 1e-3}
    assert manifest["environment"]["packages"]["numpy"] == np.__version__
    assert manifest["timing"]["wall_s"] > 0
    assert manifest["code"]["version"] == wristctl.__version__
    assert len(manifest["code"]["tree_sha256"]) == 64
    assert Run(run.path).metrics["accuracy"]["value"] is None
    events = [json.loads(line) for line in (run.path / "events.jsonl").read_text().splitlines()]
    assert [event["event"] for event in events] == ["start", "checkpoint", "end"]
    assert events[1]["loss"] == 0.5


def test_columns_carry_units_into_manifest_and_readme(make: Make) -> None:
    run = make()
    output = next(each for each in run.manifest.outputs if each.path == "data/samples.csv")
    assert [(column.name, column.unit, column.meaning) for column in output.columns] == [
        ("x", "m", "tip"),
        ("name", "", ""),
    ]
    assert "`x` [m]: tip" in (run.path / "README.md").read_text()


def test_warnings_go_to_console_log_and_events(results: Path) -> None:
    with start_run("tune", Study(), "", results) as run:
        logging.getLogger("wristctl.wrist").warning("the wrist buckles at %.1f N", 60.0)
    assert "warning: the wrist buckles at 60.0 N" in (run.path / "console.log").read_text()
    assert '"event": "warning"' in (run.path / "events.jsonl").read_text()


def test_the_config_fed_back_is_the_same_study(results: Path) -> None:
    study = load_study([], ["seed=5", "epochs=3", "wrist.length=0.1"], "train")
    with start_run("train", study, "", results) as run:
        pass
    assert Run(run.path).config == study


@pytest.mark.parametrize("name", ["../outside", "/outside", "data/../../outside", "run.json", "SHA256SUMS"])
def test_outputs_stay_inside_the_run_and_off_its_records(results: Path, name: str) -> None:
    with pytest.raises(ValueError, match="no name for an output"), start_run("tune", Study(), "", results) as run:
        run.file(name)


def test_a_full_disk_is_an_error_of_the_user(results: Path) -> None:
    if not Path("/dev/full").exists():
        pytest.skip("no /dev/full")
    with pytest.raises(UserError, match="No space left"), start_run("tune", Study(), "", results) as run:
        run.file("data/.x.npz.part").symlink_to("/dev/full")
        run.arrays("data/x.npz", {"x": np.zeros(100_000)})
    assert Run(run.path).state == "failed"
    assert not (run.path / "data" / "x.npz").exists()


@pytest.mark.slow
def test_uncommitted_changes_are_kept_as_a_patch(tmp_path: Path) -> None:
    package = Path(__file__).parents[2] / "wristctl"
    clone = tmp_path / "clone"
    shutil.copytree(package, clone / "wristctl", ignore=shutil.ignore_patterns("__pycache__"))
    git = ["git", "-C", str(clone), "-c", "user.name=a", "-c", "user.email=a@b"]
    for command in (["init", "-q"], ["add", "."], ["commit", "-q", "-m", "all"]):
        subprocess.run([*git, *command], check=True, capture_output=True)
    ask = (
        "import sys; sys.path.insert(0, sys.argv[1]); from wristctl.records.provenance import code_state; "
        "code, patch, _ = code_state(); print(code.commit, code.dirty, code.tree_sha256); "
        "sys.stdout.write(patch.decode())"
    )
    writing = {name: value for name, value in os.environ.items() if name != "PYTHONDONTWRITEBYTECODE"}

    def state() -> list[str]:
        command = [sys.executable, "-c", ask, str(clone)]
        return subprocess.run(command, check=True, capture_output=True, text=True, env=writing).stdout.splitlines()

    def ask_git(*arguments: str) -> str:
        return subprocess.run([*git, *arguments], check=True, capture_output=True, text=True).stdout.strip()

    head = ask_git("rev-parse", "HEAD")
    (clean,) = state()
    assert clean.startswith(f"{head} False ")
    (clone / "wristctl" / "__pycache__").mkdir(exist_ok=True)
    (clone / "wristctl" / "__pycache__" / "more.pyc").write_bytes(b"compiled")
    assert state() == [clean], "what Python compiles is no part of the code"
    (clone / "wristctl" / "new.py").write_text("NEW = 1\n")
    (clone / "wristctl" / "__init__.py").write_text('__version__ = "9"\n')
    objects = ask_git("count-objects")
    first, *patch = state()
    assert first.startswith(f"{head} True ") and first.split()[2] != clean.split()[2]
    assert "+NEW = 1" in patch
    assert '+__version__ = "9"' in patch
    assert "?? wristctl/new.py" in ask_git("status", "--porcelain"), "the user's index is untouched"
    assert ask_git("count-objects") == objects, "nothing is written to the user's repository"
