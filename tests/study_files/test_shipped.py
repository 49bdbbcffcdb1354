"""Experiments have names, wherever one works; files of one's own come first."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import wristctl
from wristctl.errors import UserError
from wristctl.study_files.load import load_study
from wristctl.study_files.shipped import shipped, shipped_names, study_file

ROOT = Path(__file__).parents[2]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("file", sorted((ROOT / "experiments").rglob("*.yaml")), ids=lambda file: file.stem)
@pytest.mark.slow
def test_every_experiment_is_found_by_name_and_path_in_an_empty_folder(file: Path) -> None:
    name = file.relative_to(ROOT / "experiments").with_suffix("").as_posix()
    assert name in shipped_names()
    for given in (name, f"{name}.yaml", f"experiments/{name}", f"./experiments/{name}.yaml"):
        found = study_file(Path(given))
        assert found and found.samefile(file), given
    assert load_study([Path(name)]) == load_study([file])


def test_names_are_in_the_order_of_the_alphabet_and_have_no_ending() -> None:
    names = shipped_names()
    assert names == sorted(names) and {"quick", "paper", "scenarios/camera"} <= set(names)
    assert not any(name.endswith(".yaml") for name in names)


def test_python_knows_the_names_too() -> None:
    assert wristctl.load_study("quick", "seed=4") == load_study([shipped() / "quick.yaml"], ["seed=4"])


def test_a_file_of_ones_own_comes_first_and_a_folder_of_that_name_is_in_nobodys_way(folder: Path) -> None:
    (folder / "paper").mkdir()
    assert study_file(Path("paper")) == shipped() / "paper.yaml"
    for number, name in enumerate(("experiments/paper.yaml", "paper"), start=71):
        (folder / name).parent.mkdir(exist_ok=True)
        if (folder / name).is_dir():
            (folder / name).rmdir()
        (folder / name).write_text(f"seed: {number}")
        assert load_study([Path("paper")]).seed == number
    assert load_study([Path("experiments/paper.yaml")]).seed == 71
    assert load_study([Path("paper.yaml")]).seed == 71


def test_a_study_of_ones_own_includes_experiments_by_name(folder: Path) -> None:
    (folder / "mine").mkdir()
    (folder / "mine" / "camera.yaml").write_text(
        "include: [scenarios/camera, experiments/scenarios/ideal.yaml]\nseed: 9"
    )
    study = load_study([Path("mine/camera.yaml")])
    assert study.seed == 9 and set(study.families) == {"camera", "ideal"}
    (folder / "mine" / "experiments" / "scenarios").mkdir(parents=True)
    (folder / "mine" / "experiments" / "scenarios" / "camera.yaml").write_text("seed: 3")
    assert set(load_study([Path("mine/camera.yaml")]).families) == {"ideal"}


def test_an_include_that_nothing_has_is_told_with_both_places(folder: Path) -> None:
    (folder / "mine.yaml").write_text("seed: 1\ninclude: [scenarios/camra]")
    with pytest.raises(
        UserError, match=r"there is no scenarios/camra to include, nor such an experiment .* mine.yaml:2"
    ):
        load_study([Path("mine.yaml")])


@pytest.mark.parametrize(
    "given, told",
    [
        ("quik", r"fix: did you mean 'quick'\?"),
        ("experiments/papr.yaml", r"fix: did you mean 'paper'\?"),
        ("scenario", r"fix: did you mean 'scenarios/\w+'\?"),
        ("minee.yaml", r"fix: did you mean 'mine.yaml'\?"),
        ("own", "fix: one of .*claims, controllers, "),
        ("../quick", "fix: "),
    ],
)
def test_a_name_that_nothing_has_is_told_with_both_places(folder: Path, given: str, told: str) -> None:
    (folder / "experiments").mkdir()
    (folder / "mine.yaml").touch()
    (folder / "quick.yaml").touch()  # ../quick does not mean it, by way of experiments/
    where = re.escape(str(folder / given))
    with pytest.raises(UserError, match=f"^there is no study file {where}, nor such an experiment of wristctl.*{told}"):
        load_study([Path(given)])
