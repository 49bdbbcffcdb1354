"""Files to begin from run as they stand, and a certificate says what a law is and is not."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

import wristctl as face
from tests.doors.conftest import LAW, ROOT, wristctl
from wristctl.commands.law_certificate import LawCheck, certificate

OWN = "my_controller.py:MY_CONTROLLER"
THOROUGH = os.environ.get("WRISTCTL_THOROUGH") == "1"
PAGE = (ROOT / "docs" / "your-own-controller.md").read_text(encoding="utf-8")


def asked(name: str, board: bool = False) -> dict[str, LawCheck]:
    return {each.asked: each for each in certificate(name, {}, board)}


@pytest.mark.slow
def test_new_files_run_as_they_stand_in_one_study(tmp_path: Path) -> None:
    for kind, name in (("controller", "my-law"), ("reference", "my-move"), ("optimiser", "my-search")):
        done = wristctl(tmp_path, "new", kind, name)
        assert done.returncode == 0 and f"{name.replace('-', '_')}.py is written" in done.stdout
    (tmp_path / "study.yaml").write_text(
        """
tune:
  controllers: [my_law.py:MY_LAW]
  optimiser: my_search.py:MySearch
  candidates: 3
  iterations: 2
  horizon: 0.3
  finalists: 1
  loops: {fast: {plant_segments: 1}}
  scenarios: [{loop: fast, reference: {kind: my_move.py:MY_MOVE, angle_deg: 20, time_constant: 0.05}}]
"""
    )
    tuned = face.tune(face.load_study(tmp_path / "study.yaml"), out=tmp_path / "results")
    (search,) = tuned.searches.values()
    assert set(tuned.gains) == {"my-law"} and search.tried.values.shape == (2, 3) and search.objective < 0.0
    assert tuned.run is not None
    assert {each.split("/")[1] for each in tuned.run.manifest.code.foreign} == {"my_law", "my_move", "my_search"}
    found = asked(f"{tmp_path}/my_law.py:MY_LAW")
    assert not [each for each in found.values() if each.passed is False] and found["compiles"].passed


@pytest.mark.slow
def test_new_writes_over_nothing_and_takes_no_name_that_is_taken(tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text("mine")
    for name, told in (
        ("mine", "there is such a file already"),
        ("pid", "already"),
        ("My Law", "is no name"),
        ("class", "Python"),
    ):
        done = wristctl(tmp_path, "new", "controller", name)
        assert done.returncode == 2 and told in done.stderr
    done = wristctl(tmp_path, "new", "reference", "import")
    assert done.returncode == 2 and "Python" in done.stderr
    assert [each.name for each in tmp_path.iterdir()] == ["mine.py"] and (tmp_path / "mine.py").read_text() == "mine"


@pytest.mark.slow
def test_a_law_that_pushes_the_wrong_way_gets_no_certificate(stranger: Path) -> None:
    place = f"{stranger}/strange.py:STRANGE"
    assert asked(place)["bends the wrist back"].passed
    (stranger / "strange.py").write_text(LAW.replace("load - scaled", "load + scaled"))
    assert asked(place)["bends the wrist back"].passed is False
    done = wristctl(stranger, "check-controller", "strange.py:STRANGE", "--no-board")
    assert done.returncode == 3 and "FAILS bends the wrist back" in done.stdout and "is fit" not in done.stdout


@pytest.mark.parametrize(
    ("place", "told"),
    [("strange.py", "strange.py should name its controller: strange.py:NAME"), ("pidd", "did you mean 'pid'?")],
)
@pytest.mark.slow
def test_a_law_that_is_not_named_is_asked_for_by_name(stranger: Path, place: str, told: str) -> None:
    done = wristctl(stranger, "check-controller", place, "--no-board")
    assert done.returncode == 2 and told in done.stderr and not done.stdout


@pytest.mark.slow
def test_a_certificate_names_sources_gains_and_cost(stranger: Path) -> None:
    found = list(certificate(f"{stranger}/strange.py:STRANGE", {}, False))
    sources = [each.found for each in found if each.asked == "source"]
    assert [each.split()[0] for each in sources] == ["strange.py", "helper.py"]
    own = {each.asked: each.found for each in found}
    assert "Kp [N m/rad] 0.01 to 100" in own["gains"] and "presets default, rig" in own["gains"]
    assert float(own["time per tick"].split()[0]) > 0.0
    assert "the same bits" in own["compiles"]


@pytest.mark.skipif(not THOROUGH, reason="takes minutes: WRISTCTL_THOROUGH=1")
def test_the_emulated_board_passes_a_law_made_for_it_and_fails_one_that_shakes_it(stranger: Path) -> None:
    assert asked(f"{stranger}/strange.py:STRANGE", True)["emulated board"].passed
    (stranger / "strange.py").write_text(LAW.replace('"Kp": 0.3, "Kd": 0.02', '"Kp": 90.0, "Kd": 9.0'))
    assert asked(f"{stranger}/strange.py:STRANGE", True)["emulated board"].passed is False


def commands() -> Iterator[list[str]]:
    """What the page tells a stranger to type, up to the first trial."""
    for language, block in re.findall(r"^```(\w*)\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE):
        for line in block.splitlines() if not language else ():
            yield line.partition("#")[0].split()[1:]


def test_the_page_names_commands_that_there_are() -> None:
    typed = list(commands())
    assert [each[0] for each in typed] == ["tune", "compare", "hw-run"]


@pytest.mark.skipif(not THOROUGH, reason="takes minutes: WRISTCTL_THOROUGH=1")
def test_a_stranger_who_types_the_page_gets_a_row_in_compare_and_a_trial_in_hw_run(tmp_path: Path) -> None:
    (study,) = [each for each in re.findall(r"^```yaml\n(.*?)^```", PAGE, re.DOTALL | re.MULTILINE) if "hw-run" in each]
    (tmp_path / "mine.yaml").write_text(study)
    for typed in (
        ["new", "controller", "my-controller"],
        ["simulate", "--controller", OWN, "--gains", "default"],
        *commands(),
    ):
        done = wristctl(tmp_path, *typed)
        assert done.returncode == 0, (typed, done.stderr)
    runs = face.runs(out=tmp_path / "results")
    assert runs["kind"].tolist() == ["simulate", "tune", "compare", "hw-run"] and set(runs["state"]) == {"ok"}
    compared = face.open_run("latest:compare", tmp_path / "results").data("comparison")
    assert {"my-controller"} < set(compared["controller"])
    trials = face.open_run("latest:hw-run", tmp_path / "results").data("trials")
    assert set(trials["controller"]) == {"my-controller"} and set(trials["outcome"]) == {"ok"}
    (tmp_path / "my_controller.py").unlink()
    for kind in ("simulate", "compare", "hw-run"):
        done = wristctl(tmp_path, "runs", "replay", f"latest:{kind}", "--trust-code")
        assert done.returncode == 0 and "identical" in done.stdout.splitlines()[-1], done.stderr


@pytest.mark.slow
def test_the_law_with_filters_in_the_page_is_fit_and_rests_where_it_should(tmp_path: Path) -> None:
    (text,) = (block for block in re.findall(r"```python\n(.*?)```", PAGE, re.DOTALL) if "PD_NOTCH" in block)
    (tmp_path / "notched.py").write_text(text)
    place = f"{tmp_path}/notched.py:PD_NOTCH"
    assert not [check for check in asked(place).values() if check.passed is False]
    study = face.load_study(None, f"simulate.controller={place}", "simulate.gains=default", "simulate.horizon=2.0")
    done = face.simulate(study)
    assert done.metrics["missing"] < 0.01 and done.metrics["oscillation"] < 1e-3 and not done.marks
