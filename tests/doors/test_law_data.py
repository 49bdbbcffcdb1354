"""What a law reads beside itself, such as weights, is part of it; and a run's own code is trusted from Python too."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import wristctl as face
from tests.doors.conftest import LAW, elsewhere, wristctl
from wristctl.commands.adoption import adopt, adopted, adoption
from wristctl.errors import UserError
from wristctl.plugins.places import load
from wristctl.records import Run
from wristctl.study_files.load import load_study

READS = """
import numpy as np
from wristctl.plugins.import_hook import data_file
SPRING = float(np.load(data_file(__file__, "{name}"))[0])
"""
STUDY = "simulate: {controller: strange.py:STRANGE, gains: default, horizon: 0.3, loop: {plant_segments: 1}}\n"


@pytest.fixture
def learned(stranger: Path) -> Path:
    """A folder with a law whose spring stands in a file beside it, and a study of it."""
    law = READS.format(name="nets/weights.npy") + LAW.replace("scaled(gains.Kp,", "scaled(SPRING * gains.Kp,")
    (stranger / "strange.py").write_text(law)
    (stranger / "nets").mkdir()
    weigh(stranger, 1.0)
    (stranger / "study.yaml").write_text(STUDY)
    return stranger


def weigh(folder: Path, spring: float) -> None:
    np.save(folder / "nets" / "weights.npy", np.array([spring]))


def rmse(study: Path, trust_code: bool = False) -> float:
    found = face.simulate(face.load_study(study, trust_code=trust_code)).metrics["rmse"]
    assert isinstance(found, float)
    return found


def run_of(folder: Path) -> Run:
    """A run of the law from elsewhere, whose original is gone, and to whose code nobody has agreed."""
    with elsewhere(folder):
        done = face.simulate(face.load_study(folder / "study.yaml"), out=folder / "results")
    for name in ("strange.py", "helper.py", "nets/weights.npy"):
        (folder / name).unlink()
    assert done.run is not None
    return Run(done.run.path)


@pytest.mark.painted
@pytest.mark.slow
def test_weights_are_sealed_and_a_run_replays_when_they_are_gone(learned: Path) -> None:
    run = run_of(learned)
    assert {each for each in run.manifest.code.foreign if each.endswith(".npy")} == {"code/strange/nets/weights.npy"}
    assert run.problems() == []
    done = wristctl(learned, "runs", "replay", run.id, "--trust-code")
    assert done.returncode == 0 and f"{run.id}: identical" in done.stdout, done.stderr
    assert "nets/weights.npy" in done.stderr, "shown before it is loaded"


@pytest.mark.slow
def test_other_weights_are_another_law(learned: Path) -> None:
    first, origin = rmse(learned / "study.yaml"), load(f"{learned}/strange.py:STRANGE")[1]
    weigh(learned, 2.0)
    assert rmse(learned / "study.yaml") < 0.8 * first, "a stiffer spring follows better"
    assert load(f"{learned}/strange.py:STRANGE")[1].files != origin.files


@pytest.mark.slow
def test_weights_that_are_not_as_they_were_sealed_are_refused_even_to_who_trusts_them(learned: Path) -> None:
    run = run_of(learned)
    np.save(run.path / "code/strange/nets/weights.npy", np.array([3.0]))
    with pytest.raises(UserError, match="not as it was sealed"):
        rmse(run.path / "config.yaml", trust_code=True)


@pytest.mark.parametrize(
    ("name", "told"), [("wieghts.npy", "no file wieghts.npy beside strange.py"), ("../far.npy", "outside its folder")]
)
def test_data_that_is_not_beside_a_law_is_refused(learned: Path, name: str, told: str) -> None:
    folder = learned / "laws"
    folder.mkdir()
    np.save(learned / "far.npy", np.array([1.0]))
    (folder / "strange.py").write_text(READS.format(name=name) + LAW)
    with pytest.raises(UserError, match=told):
        load(f"{folder}/strange.py:STRANGE")


def test_data_that_is_asked_for_only_later_is_refused_and_not_left_behind(learned: Path) -> None:
    late = "\ndef later(name):\n    return data_file(__file__, name)\n"
    (learned / "strange.py").write_text((learned / "strange.py").read_text() + late)
    np.save(learned / "nets" / "more.npy", np.array([1.0]))
    law, _ = load(f"{learned}/strange.py:STRANGE")
    later = law.law.__globals__["later"]
    assert later("nets/weights.npy") == learned / "nets" / "weights.npy", "which was named while it was imported"
    with pytest.raises(UserError, match=r"more\.npy is asked for when strange.py has been imported"):
        later("nets/more.npy")


@pytest.mark.slow
def test_a_worker_tells_files_of_one_name_apart(learned: Path) -> None:
    more = READS.format(name="first/weights.npy").replace("SPRING", "FIRST")
    (learned / "strange.py").write_text(more + (learned / "strange.py").read_text())
    (learned / "first").mkdir()
    np.save(learned / "first" / "weights.npy", np.array([1.0]))
    spec = adoption(adopted(load_study([learned / "study.yaml"]), "simulate").study, "simulate")
    assert {name for name in spec["sources"] if name.endswith("npy")} == {
        "strange/first/weights.npy", "strange/nets/weights.npy"
    }  # fmt: skip
    for folder in ("first", "nets"):
        before = (learned / folder / "weights.npy").read_bytes()
        np.save(learned / folder / "weights.npy", np.array([4.0]))
        with pytest.raises(UserError, match=rf"strange/{folder}/weights\.npy is another text here"):
            adopt(spec)
        (learned / folder / "weights.npy").write_bytes(before)


@pytest.mark.slow
def test_in_python_too_a_runs_code_runs_only_once_it_is_trusted(learned: Path) -> None:
    expected, run = rmse(learned / "study.yaml"), run_of(learned)
    with pytest.raises(UserError, match="nobody has said that it may run") as refused:
        rmse(run.path / "config.yaml")
    assert "trust_code" in str(refused.value)
    assert rmse(run.path / "config.yaml", trust_code=True) == expected
