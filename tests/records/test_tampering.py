"""What is done to a run while it goes on, and to its files afterwards, does not go unnoticed."""

from __future__ import annotations

import json
import os
import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, list_runs, require, start_run
from wristctl.records.files import sha256_of
from wristctl.records.seal import write_seal

Make = Callable[..., Run]


def removed_while_running(results: Path, what: Callable[[Path], object], exist: bool = True) -> UserError:
    with pytest.raises(UserError) as caught, start_run("tune", Study(), "", results) as live:
        live.metric("rmse", 1.0)
        live.table("data/samples.csv", {"x": np.ones(1)})
        what(live.path)
        live.arrays("data/after.npz", {}) if exist else None
    return caught.value


@pytest.mark.parametrize("more", [False, True], ids=["at its end", "before its next file"])
@pytest.mark.parametrize("whole", [False, True], ids=["the run", "the results folder"])
def test_a_run_whose_folder_is_removed_fails_and_does_not_come_back(results: Path, whole: bool, more: bool) -> None:
    error = removed_while_running(results, lambda path: shutil.rmtree(path.parent if whole else path), more)
    assert "removed, moved or replaced while it ran" in error.what and error.exit_code == 2
    assert list_runs(results) == []


def test_a_run_whose_folder_is_moved_or_replaced_is_not_sealed(results: Path, tmp_path: Path) -> None:
    removed_while_running(results, lambda path: path.rename(tmp_path / path.name))
    assert list_runs(results) == []
    assert [Run(each).state for each in tmp_path.iterdir() if each != results] == ["crashed"]

    def replace(path: Path) -> None:
        shutil.copytree(path, path.with_suffix(".copy"))
        shutil.rmtree(path)
        path.with_suffix(".copy").rename(path)

    removed_while_running(results, replace)
    (copy,) = list_runs(results)
    assert copy.state == "crashed"


@pytest.mark.parametrize("name", ["data/samples.csv", "config.yaml", "environment.txt", "code.txt"])
def test_a_run_that_lost_a_file_while_it_ran_is_not_ok(results: Path, name: str) -> None:
    error = removed_while_running(results, lambda path: (path / name).unlink())
    assert "removed or changed while it ran" in error.what and name in error.where
    (run,) = list_runs(results)
    assert run.state == "failed"


def test_provenance_that_was_changed_while_it_ran_is_told(results: Path) -> None:
    removed_while_running(results, lambda path: (path / "config.yaml").write_text("seed: 7\n"))


def _altered(run: Run, sums: str | None) -> None:
    """Twice as much data, under other sums; without any given, sealed anew."""
    file = run.path / "data/samples.csv"
    file.write_text(file.read_text() * 2)
    if sums is None:
        write_seal(run.path, {})
    else:
        (run.path / "SHA256SUMS").write_text(sums)


@pytest.mark.parametrize(
    ("tamper", "said"),
    [
        (lambda run: _altered(run, ""), "is not among what was sealed"),
        (lambda run: _altered(run, None), "hash in SHA256SUMS is not that in run.json"),
        (lambda run: (run.path / "SHA256SUMS").write_text(_without(run, "data/samples.csv")), "output of run.json"),
        (lambda run: _rewrite(run, "result_sha256", "0" * 64), "result_sha256 is not that of the outputs"),
        (lambda run: _rewrite(run, "id", "20200101T000000Z-tune-0"), "is that of run 20200101T000000Z-tune-0"),
        (lambda run: _linked(run, "data/samples.csv"), "is a link"),
        (lambda run: (run.path / "data/samples.csv").unlink(), "sealed file is missing"),
    ],
    ids=["no sums", "other sums", "fewer sums", "result hash", "id", "link", "missing"],
)
def test_what_was_tampered_with_is_no_input(make: Make, tamper: Callable[[Run], object], said: str) -> None:
    run = make()
    tamper(run)
    assert any(said in what for _, what in Run(run.path).problems())
    with pytest.raises(UserError):
        require(run.path, "gen-data")


def _without(run: Run, name: str) -> str:
    lines = (run.path / "SHA256SUMS").read_text().splitlines()
    return "".join(f"{line}\n" for line in lines if not line.endswith(name))


def _rewrite(run: Run, key: str, value: str) -> None:
    """Another value in run.json, and its hash in the sums."""
    content = json.loads((run.path / "run.json").read_text())
    (run.path / "run.json").write_text(json.dumps({**content, key: value}))
    sums = run.path / "SHA256SUMS"
    sums.write_text(
        re.sub(r"[0-9a-f]{64}  run\.json", f"{sha256_of(run.path / 'run.json')}  run.json", sums.read_text())
    )


def _linked(run: Run, name: str) -> None:
    """A link to an equal file elsewhere in the place of the file."""
    other = run.path.parent.parent / "elsewhere.csv"
    shutil.copy(run.path / name, other)
    (run.path / name).unlink()
    (run.path / name).symlink_to(other)


def test_whatever_is_added_to_a_sealed_run_is_named(make: Make, tmp_path: Path) -> None:
    run = make()
    (run.path / ".hidden").write_text("x")
    (run.path / "empty").mkdir()
    os.mkfifo(run.path / "pipe")
    (run.path / "dangling").symlink_to("nowhere")
    (run.path / "folder").symlink_to(tmp_path)
    assert [name for name, _ in run.problems()] == [".hidden", "dangling", "empty", "folder", "pipe"]
