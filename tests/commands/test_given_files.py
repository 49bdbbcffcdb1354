"""Files that a study names: found beside it, sealed into the run, and read from there ever after."""

from __future__ import annotations

import shutil
from pathlib import Path

import numpy as np
import pytest

import wristctl
from wristctl.commands.simulate.results import Simulated
from wristctl.errors import UserError
from wristctl.records import Run
from wristctl.study_files.load import load_study

QUICK = ("simulate.controller=computed-torque", "simulate.gains=default", "simulate.loop.plant_segments=1")
FILE = "time [s],angle [deg]\n" + "".join(f"{t / 20},{10 * (t / 20) ** 2}\n" for t in range(21))


def simulated(folder: Path, *overrides: str, file: Path | None = None) -> Simulated:
    return wristctl.simulate(wristctl.load_study(file, *QUICK, *overrides), out=folder)


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Run]:
    """A results folder, and a run on a recording in it whose original is gone."""
    folder = tmp_path_factory.mktemp("given")
    (folder / "study").mkdir()
    (folder / "study" / "walk.csv").write_text(FILE)
    study = "simulate: {horizon: 1.2, reference: {kind: recording, file: walk.csv}}"
    (folder / "study" / "own.yaml").write_text(study)
    done = simulated(folder / "results", file=folder / "study" / "own.yaml")
    assert done.run is not None
    shutil.rmtree(folder / "study")
    return folder, done.run


@pytest.mark.slow
def test_a_course_that_was_simulated_is_followed_as_a_recording_of_it(tmp_path: Path) -> None:
    """Its table has units in run.json, not in its header; what is followed is that motion to 1e-9 rad."""
    first = simulated(tmp_path, "simulate.reference.duration=0.8", "simulate.horizon=1.5")
    assert first.run is not None
    for column, wanted in (("theta", first.trajectory.theta), ("theta_ref", first.trajectory.theta_ref)):
        named = f"simulate.reference.file={first.run.path / 'data/trajectory.csv'}"
        given = (named, "simulate.reference.kind=recording", f"simulate.reference.column={column}")
        again = simulated(tmp_path, *given, "simulate.horizon=1.5")
        assert np.abs(again.trajectory.theta_ref - wanted).max() < 1e-9
    assert np.abs(again.trajectory.theta - first.trajectory.theta).max() < 1e-5  # its derivatives are a spline's


def test_the_file_is_sealed_and_the_configuration_names_it_within_the_run(made: tuple[Path, Run]) -> None:
    _, run = made
    (kept,) = run.path.glob("inputs/*/walk.csv")
    assert kept.read_text() == FILE and run.problems() == []
    assert f"file: {kept.relative_to(run.path).as_posix()} " in (run.path / "config.yaml").read_text()
    assert run.config.simulate.reference.file == str(kept)


def test_the_run_moved_elsewhere_gives_the_same_again_without_the_original(
    made: tuple[Path, Run], tmp_path: Path
) -> None:
    _, run = made
    moved = tmp_path / "elsewhere" / run.id
    shutil.copytree(run.path, moved)
    done = wristctl.simulate(load_study([moved / "config.yaml"]), out=tmp_path)
    assert done.run is not None and done.run.result_hash == run.result_hash
    assert done.run.manifest.config_sha256 == run.manifest.config_sha256


def test_another_content_is_another_configuration(made: tuple[Path, Run], tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(FILE.replace(",10.0\n", ",9.99\n"))
    named = f"simulate.reference.file={tmp_path / 'walk.csv'}"
    done = simulated(tmp_path, "simulate.horizon=1.2", "simulate.reference.kind=recording", named)
    assert done.run is not None and done.run.manifest.config_sha256 != made[1].manifest.config_sha256


def test_a_sealed_file_that_was_changed_is_found(made: tuple[Path, Run], tmp_path: Path) -> None:
    moved = tmp_path / made[1].id
    shutil.copytree(made[1].path, moved)
    (kept,) = moved.glob("inputs/*/walk.csv")
    kept.write_text(FILE.replace("10.0", "9.0"))
    ((name, what),) = Run(moved).problems()
    assert name == kept.relative_to(moved).as_posix() and "hash does not match" in what


def test_a_table_of_a_run_that_was_changed_has_no_units(tmp_path: Path) -> None:
    first = simulated(tmp_path, "simulate.horizon=0.2")
    assert first.run is not None
    table = first.run.path / "data/trajectory.csv"
    table.write_text(table.read_text().replace("0.001,", "0.0011,", 1))
    named = f"simulate.reference.file={table}"
    with pytest.raises(UserError, match="column 'time' has no unit"):
        simulated(tmp_path, "simulate.reference.kind=recording", named)


@pytest.mark.parametrize(
    ("text", "what"),
    [
        (FILE.replace("angle [deg]", "angle"), "has no unit"),
        (FILE.replace(",10.0\n", ",10.0\n0.9,10.0\n"), "time repeats"),
        (FILE.replace("[deg]", "[rad]"), "the angle jumps by"),
        ("time [s],angle [deg]\n" + "".join(f"{t / 20},{6 * t}\n" for t in range(11)), "bends by 60 deg, beyond"),
    ],
)
def test_what_is_wrong_with_it_leaves_no_run(text: str, what: str, tmp_path: Path) -> None:
    (tmp_path / "walk.csv").write_text(text)
    named = f"simulate.reference.file={tmp_path / 'walk.csv'}"
    with pytest.raises(UserError, match=what) as caught:
        simulated(tmp_path / "results", "simulate.reference.kind=recording", named)
    assert caught.value.exit_code == 2 and "walk.csv" in caught.value.where and caught.value.fix
    assert not (tmp_path / "results").exists()
