"""Controllers that are written for a firmware of one's own answer as the loop that they were tuned in."""

from __future__ import annotations

import importlib.util
import re
import shutil
import subprocess
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

from wristctl.commands.export.law import export_law
from wristctl.errors import UserError
from wristctl.plugins.trust import asking
from wristctl.records import start_run
from wristctl.study_files.load import load_study

CAMERA = ("loop.actuator.level=tendon", "loop.sensor.level=camera", "loop.control_period=0.01", "horizon=1.0")
OWN_LAW = """
from wristctl.control.law import Controller, Gain
from wristctl.control.model import one_segment
from wristctl.lanes.functions import tanh
from wristctl.lanes.lane import where

SHAPE = (0.5, 0.25)

def law(now, wrist, gains, memory):
    _, load = one_segment(wrist, now.theta_ref, 0.0 * now.rate)
    error = now.theta - now.theta_ref
    memory[0] = where(abs(error) < 0.2, memory[0] + now.period * error, memory[0])
    torque = load - gains.lambda_ * memory[0]
    for k in range(len(SHAPE)):
        torque = torque - SHAPE[k] * tanh(error) - gains.D * now.rate
    return torque

OWN = Controller(
    name="my-own", law=law, source="a test", memory=1,
    gains={"lambda": Gain("N m/(rad s)", "integral gain", 1e-2, 1e2), "D": Gain("N m s/rad", "damping", 1e-3, 1e1)},
    presets={"default": {"lambda": 3.0, "D": 0.02}},
)
"""


def difference_in_c(folder: Path, vectors: str = "vectors.csv") -> float:
    """Largest difference that the compiled test prints, which is what it exits by."""
    compiler = shutil.which("gcc")
    assert compiler is not None, "these tests compile C"
    sources = sorted(path.name for path in folder.glob("*.c"))
    flags = ["-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror"]
    subprocess.run([compiler, *flags, *sources, "-lm", "-o", "law_test"], cwd=folder, check=True)
    ended = subprocess.run([folder / "law_test", vectors], cwd=folder, capture_output=True, text=True)
    said = re.fullmatch(r"(\d+) ticks, largest difference (\S+)\n", ended.stdout)
    assert said and int(said[1]) == len((folder / vectors).read_text().splitlines()) - 1
    assert ended.returncode == (0 if float(said[2]) <= 1e-9 else 1)
    return float(said[2])


def module_of(folder: Path) -> ModuleType:
    """The module of NumPy in a folder."""
    (file,) = folder.glob("*.py")
    spec = importlib.util.spec_from_file_location(file.stem, file)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def vectors_in(folder: Path) -> Any:
    return np.loadtxt(folder / "vectors.csv", delimiter=",", skiprows=1)


@pytest.mark.parametrize(
    ("controller", "overrides"),
    [
        ("pid-ff", ()),
        ("ct-dob/hardware", (*CAMERA, "loop.sensor.dropped=0.3")),
        ("pid-ff/hardware", (*CAMERA, "loop.actuator.level=servo", "loop.actuator.resolution=1e-5")),
        ("adrc/hardware", (*CAMERA, "loop.planes=2", "wrist.tendons=three", "loop.actuator.tendon_stiffness=30e3")),
    ],
)
@pytest.mark.slow
def test_compiled_c_and_numpy_answer_as_the_recorded_loop(
    tmp_path: Path, controller: str, overrides: tuple[str, ...]
) -> None:
    paths = export_law([controller], [*overrides, "reference.duration=0.4"], tmp_path / "law", tmp_path)
    assert {path.suffix for path in paths} == {".h", ".c", ".py", ".csv", ".md"}
    rows, module = vectors_in(tmp_path / "law"), module_of(tmp_path / "law")
    assert np.ptp(rows[:, -2:]) > 0.0, "something is asked of the motors"
    assert difference_in_c(tmp_path / "law") <= 1e-9
    assert module.largest_difference(rows) <= 1e-9
    columns = (tmp_path / "law" / "vectors.csv").read_text().splitlines()[0].split(",")
    wanted = next(k for k, name in enumerate(columns) if name.startswith("wanted"))
    rows[len(rows) // 2, wanted] += 1e-6  # which both must notice
    np.savetxt(tmp_path / "law" / "wrong.csv", rows, delimiter=",", fmt="%.17g", header="wrong")
    assert difference_in_c(tmp_path / "law", "wrong.csv") == pytest.approx(1e-6, rel=1e-3)
    ended = subprocess.run([sys.executable, module.__file__ or "", tmp_path / "law" / "wrong.csv"])
    assert ended.returncode == 1


@pytest.mark.slow
@pytest.mark.parametrize(
    "overrides",
    [
        ("reference.kind=circumduction", "loop.actuator.level=tendon"),
        ("loop.actuator.level=servo", "loop.sensor.level=camera"),
        CAMERA,
    ],
)
def test_the_page_says_of_every_constant_what_it_is(overrides: tuple[str, ...], tmp_path: Path) -> None:
    export_law(["pid-ff"], [*overrides, "horizon=0.1"], tmp_path / "law", tmp_path)
    rows = re.findall(r"^\| `([A-Z]\w+)` \| (\S+) \| (.*) \|$", (tmp_path / "law" / "README.md").read_text(), re.M)
    assert len(rows) > 15 and not [name for name, _, meaning in rows if not meaning.strip()]


@pytest.mark.slow
def test_a_law_of_ones_own_is_written_and_its_gains_are_constants(tmp_path: Path) -> None:
    own = tmp_path / "my_own.py"
    own.write_text(OWN_LAW)
    for folder, gains in (("one", "default"), ("other", "lambda=3.5,D=0.03")):
        export_law([f"{own}:OWN/{gains}" if gains == "default" else f"{own}:OWN"], [
            "reference.duration=0.4", "horizon=0.5", *([f"gains={gains}"] if gains != "default" else []),
        ], tmp_path / folder, tmp_path)  # fmt: skip
        assert difference_in_c(tmp_path / folder) <= 1e-9
    one, other = (tmp_path / folder / "my_own_law.c" for folder in ("one", "other"))
    assert "my_own.py:13: torque = load - gains.lambda_ * memory[0]" in one.read_text()
    changed = (
        one.read_text().replace("GAIN_lambda = 3.0;", "GAIN_lambda = 3.5;").replace("GAIN_D = 0.02;", "GAIN_D = 0.03;")
    )
    assert changed.splitlines()[1:] == other.read_text().splitlines()[1:], "nothing but the gains differs"
    shutil.copy(tmp_path / "other" / "vectors.csv", tmp_path / "one" / "vectors.csv")
    assert difference_in_c(tmp_path / "one") > 1e-6, "with the gains of another loop it answers otherwise"


def test_a_law_that_branches_or_learns_is_refused_at_its_line(tmp_path: Path) -> None:
    own = tmp_path / "branches.py"
    own.write_text(OWN_LAW.replace("    torque = load", "    if error > 0.1:\n        return load\n    torque = load"))
    with pytest.raises(UserError, match="branches on a value") as refused:
        export_law([f"{own}:OWN"], [], tmp_path / "law", tmp_path)
    assert str(refused.value.where).endswith("branches.py:13")
    own.write_text(OWN_LAW.replace("memory=1,", "memory=1, plain=True,"))
    with pytest.raises(UserError, match="plain Python, of which no C is written"):
        export_law([f"{own}:OWN"], [], tmp_path / "law", tmp_path)
    with pytest.raises(UserError, match="ilc learns over 8 repetitions"):
        export_law(["ilc"], [], tmp_path / "law", tmp_path)
    assert not (tmp_path / "law").exists()


@pytest.mark.slow
def test_the_observer_goes_on_without_pictures_and_refuses_those_that_are_out_of_order(tmp_path: Path) -> None:
    export_law(["pid-ff/hardware"], [*CAMERA], tmp_path / "law", tmp_path)
    rows, module = vectors_in(tmp_path / "law"), module_of(tmp_path / "law")
    told, alone = module.Law(), module.Law()
    remembered = len(alone.counts)
    for row in rows[: 4 * remembered]:
        told.frame(None, 0.0)  # a picture that shows no wrist brings nothing new
        first, second = told.tick(row[2:5]), alone.tick(row[2:5])
        assert np.allclose(first.wanted, second.wanted, rtol=0.0, atol=1e-12)
    assert alone.tick_number - alone.fused_tick == remembered
    assert alone.frame([0.1], 0.0) and abs(alone.now[0] - told.now[0]) > 1e-4
    before = alone.now.copy()
    assert not alone.frame([0.5], 0.02) and np.array_equal(alone.now, before), "older than the last one"


def test_runs_hand_over_the_controller_that_they_have(tmp_path: Path) -> None:
    study = load_study([], ["simulate.controller=pd-ff", "simulate.gains=Kp=2,Kd=0.05", "simulate.horizon=0.1"])
    with start_run("simulate", study, "", tmp_path / "results") as simulated:
        pass
    export_law([simulated.path.name], [], tmp_path / "law", tmp_path / "results")
    assert "GAIN_Kp = 2.0;" in (tmp_path / "law" / "pd_ff_law.c").read_text()
    with pytest.raises(UserError, match="a file is in the way"):
        export_law([simulated.path.name], [], tmp_path / "law", tmp_path / "results")
    with start_run("tune", study, "", tmp_path / "results") as tuned:
        for name, gain in (("pd-ff", 3.0), ("feedforward", None)):
            text = f"simulate: {{controller: {name}, gains: {{Kp: {gain}, Kd: 0.1}}}}\n"
            kept = tuned.file(f"data/controllers/{name}.yaml")
            kept.write_text(text if gain else f"simulate: {{controller: {name}, gains: default}}\n")
    with pytest.raises(UserError, match="has 2 controllers") as several:
        export_law([tuned.path.name], [], tmp_path / "tuned", tmp_path / "results")
    assert "feedforward, pd-ff" in str(several.value)
    export_law([tuned.path.name, "pd-ff"], [], tmp_path / "tuned", tmp_path / "results")
    assert "GAIN_Kp = 3.0;" in (tmp_path / "tuned" / "pd_ff_law.c").read_text()
    with pytest.raises(UserError, match="is no controller, no study file and no run") as unknown:
        export_law(["pd-fff"], [], None, tmp_path / "results")
    assert "did you mean 'pd-ff'?" in str(unknown.value)
    with pytest.raises(UserError, match="'pidff' is no controller") as beside_a_study:
        export_law(["pidff", "mywrist.yaml"], [], None, tmp_path / "results")
    assert "did you mean 'pid-ff'?" in beside_a_study.value.fix


def test_a_run_hands_over_a_controller_of_ones_own_by_the_name_that_it_is_kept_by(tmp_path: Path) -> None:
    with start_run("tune", load_study(), "", tmp_path / "results") as tuned:
        own = tuned.file("data/my_own.py")
        own.write_text(OWN_LAW)
        for name, controller, gains in (("pid-ff", "pid-ff", "default"), ("my-own", f"{own}:OWN", "lambda=3.5,D=0.03")):
            kept = tuned.file(f"data/controllers/{name}.yaml")
            kept.write_text(f"simulate: {{controller: '{controller}', gains: '{gains}', horizon: 0.1}}\n")
    with asking(lambda shown: True):
        export_law([tuned.path.name, "my-own"], [], tmp_path / "law", tmp_path / "results")
    assert "GAIN_lambda = 3.5;" in (tmp_path / "law" / "my_own_law.c").read_text()
    with pytest.raises(UserError, match="has no my-owm") as mistyped:
        export_law([tuned.path.name, "my-owm"], [], None, tmp_path / "results")
    assert "my-own" in mistyped.value.fix
    for too_many in (("my-own", "pid-ff"), ("pid-ff", "mywrist.yaml")):
        with pytest.raises(UserError, match="one controller is exported at a time"):
            export_law([tuned.path.name, *too_many], [], None, tmp_path / "results")
