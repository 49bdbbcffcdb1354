"""wristctl as a library: its functions, what they say of themselves, and what an import costs."""

from __future__ import annotations

import ast
import inspect
import math
import os
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import pytest

import wristctl
from tests.documented import script_of_docs
from wristctl.arguments import PushKeys, WristKeys
from wristctl.errors import UserError

PACKAGE = Path(wristctl.__file__).parent

FACE = {
    "analyse", "audit", "compare", "gen_data", "hw_run", "identify", "load_study", "open_run", "recommend",
    "runs", "simulate", "study", "train", "tune",
}  # fmt: skip

SMALL = """
seed: 1
gen-data: {samples: 40}
train: {hidden: [4], epochs: 2, workers: 1}
tune:
  controllers: [smc, pid]
  candidates: 2
  iterations: 1
  horizon: 0.2
  loops: {fast: {plant_segments: 1}}
  scenarios: [{loop: fast, reference: {kind: step, angle_deg: 20}}]
compare:
  horizon: 0.2
  loops: {fast: {plant_segments: 1}}
  references: [{duration: 0.1}]
  inverses: [network]
  controllers: [{controller: pid, gains: tuned}]
simulate: {horizon: 0.2}
"""
"""As the documented study, in a moment."""


def test_a_notebook_can_simulate_from_overrides() -> None:
    study = wristctl.load_study(None, "simulate.controller=computed-torque", "simulate.gains=default")
    done = wristctl.simulate(study)
    frame = done.trajectory.frame()
    assert done.metrics["rmse"] < 1e-4 and not done.failed
    assert frame["theta"].iloc[-1] == pytest.approx(frame["theta_desired"].iloc[-1], abs=1e-3)


@pytest.mark.slow
def test_the_documented_notebook_runs_as_it_stands(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    text = (PACKAGE.parent / "docs" / "commands.md").read_text(encoding="utf-8")
    (code,) = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    file = tmp_path / "experiments" / "paper.yaml"
    file.parent.mkdir()
    file.write_text(SMALL)
    assert re.findall(r"experiments/[\w-]+\.yaml", code) == ["experiments/paper.yaml"]
    monkeypatch.chdir(tmp_path)
    wristctl.train(wristctl.load_study(file), out="results")
    known: dict[str, Any] = {}
    exec(code, known)
    assert wristctl.runs()["kind"].tolist() == ["train", "tune"] and known["tuned"].run.state == "ok"
    assert known["done"].trajectory.label == "smc/tuned" and (tmp_path / "angle.png").is_file()
    assert known["compared"].rows[0].inverse == "network"


def test_dir_shows_the_face_and_every_function_of_it_is_explained() -> None:
    assert (
        {name for name in dir(wristctl) if not name.startswith("_")}
        == {*FACE, "UserError"}
        == set(wristctl.__all__) - {"__version__"}
    )
    for name in FACE:
        function = getattr(wristctl, name)
        text, given = inspect.getdoc(function), inspect.signature(function).parameters
        assert text and "Raises UserError" in " ".join(text.split()), name
        missing = [each for each in given if f"`{each}" not in text and each not in ("study", "file")]
        assert not missing, f"{name} does not explain {missing}"
    assert str(inspect.getdoc(wristctl.api)).startswith("The functions that")
    with pytest.raises(AttributeError, match="no attribute 'simulat'"):
        wristctl.__getattr__("simulat")


@pytest.mark.slow
def test_import_is_light() -> None:
    heavy = "{'torch', 'scipy', 'pandas', 'matplotlib', 'cv2', 'numba', 'numpy'}"
    for code in ("import wristctl; dir(wristctl)", "import wristctl.api, wristctl; wristctl.load_study()"):
        code = f"import sys; {code}; assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
        subprocess.run([sys.executable, "-c", code], check=True, cwd=PACKAGE.parent)


@pytest.mark.slow
def test_a_simulation_waits_for_no_library_that_it_does_not_use() -> None:
    unused = "{'pandas', 'scipy.optimize', 'torch', 'wristctl.trial'} & set(sys.modules)"
    code = f"import sys, wristctl; wristctl.simulate(horizon=0.02); assert not {unused}, {unused}"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=PACKAGE.parent)


@pytest.mark.slow
def test_every_public_name_has_a_docstring() -> None:
    missing = []
    for file in PACKAGE.rglob("*.py"):
        tree = ast.parse(file.read_text())
        names = [n for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
        for parent in [n for n in names if isinstance(n, ast.ClassDef) and not n.name.startswith("_")]:
            names += [n for n in parent.body if isinstance(n, ast.FunctionDef)]
        names = [n for n in names if "overload" not in map(ast.unparse, n.decorator_list)]  # signatures alone
        missing += [f"{file.name}:{n.name}" for n in names if not n.name.startswith("_") and not ast.get_docstring(n)]
        assert ast.get_docstring(tree), file
    assert not missing


THREE: WristKeys = {"tendons": "three", "length": 0.095, "stiffness": 1.1}


@pytest.mark.slow
def test_what_load_study_is_given_is_a_file_and_overrides() -> None:
    for given in list[Any]([(None, {"simulate": {"horizon": 2}}), ({"wrist": {}},)]):
        with pytest.raises(wristctl.UserError, match=r"a dict is neither .*fix: text, \"simulate\.horizon=2\""):
            wristctl.load_study(*given)


def test_what_a_command_is_given_for_a_study_is_one() -> None:
    given: Any = {"wrist": {"length": 0.09}}
    with pytest.raises(UserError, match=r"a dict is no study - simulate - fix: .*wrist={\.\.\.}"):
        wristctl.simulate(given)
    with pytest.raises(UserError, match=r"0.003 s hold fewer than 5 control periods .*at least 0.005 s"):
        wristctl.simulate(horizon=0.003)


def test_a_kind_of_run_that_there_is_none_of_is_refused(tmp_path: Path) -> None:
    assert not len(wristctl.runs(kind="simulat", out=tmp_path)), "where there are no runs there is nothing to say"
    wristctl.simulate(horizon=0.05, out=tmp_path)
    assert len(wristctl.runs(kind="simulat*", out=tmp_path)) == 1
    with pytest.raises(UserError, match=r"unknown kind 'simulat' .*did you mean 'simulate'"):
        wristctl.runs(kind="simulat", out=tmp_path)


def test_a_wrist_in_plain_arguments_moves_as_that_of_a_study_file(tmp_path: Path) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text("wrist: {tendons: three, length: 0.095, stiffness: 1.1}\nsimulate: {horizon: 1.2}\n")
    typed = wristctl.simulate(wrist=THREE, controller="ct-dob", horizon=1.2)
    for other in (
        wristctl.simulate(file, controller="ct-dob"),
        wristctl.simulate(wristctl.load_study(file), controller="ct-dob"),
        wristctl.simulate(wrist=file, controller="ct-dob", horizon=1.2),
        wristctl.simulate(wristctl.load_study(file, "simulate.controller=ct-dob")),
    ):
        pd.testing.assert_frame_equal(typed.course, other.course, check_exact=True)
    assert list(typed.course) == [
        "time", "bend_ulnar", "bend_flexion", "reference_ulnar", "reference_flexion", "torque_ulnar", "torque_flexion",
        "tension_1", "tension_2", "tension_3", "tip_x", "tip_y", "tip_z",
    ]  # fmt: skip
    end = typed.course.iloc[-1]
    assert end["bend_ulnar"] == pytest.approx(math.radians(30), abs=1e-3) and abs(end["bend_flexion"]) < 1e-9
    assert math.hypot(end["tip_x"], end["tip_y"]) == pytest.approx(0.095 * math.sin(x := math.pi / 12) / x, rel=2e-2)


@pytest.mark.parametrize(("direction", "sign"), [("ulnar", 1.0), ("radial", -1.0)])
def test_a_course_in_one_plane_has_the_sense_of_its_motion(direction: Any, sign: float) -> None:
    done = wristctl.simulate(controller="computed-torque", gains="default", direction=direction, horizon=1.5)
    course, trajectory = done.course, done.trajectory
    assert list(course) == [
        "time", "bend", "reference", "torque", "tension_plus", "tension_minus", "tip_x", "tip_y"
    ]  # fmt: skip
    assert course["bend"].iloc[-1] == pytest.approx(sign * math.radians(30), abs=1e-3)
    assert math.copysign(1.0, course["tip_y"].iloc[-1]) == sign
    moving = course.iloc[len(course) // 10]
    assert math.copysign(1.0, moving["tension_plus"] - moving["tension_minus"]) == sign
    np.testing.assert_array_equal(course["reference"], trajectory.theta_ref)
    np.testing.assert_array_equal(course["torque"], trajectory.torque)


def test_a_result_shows_its_sentence_its_table_and_its_figure() -> None:
    done = wristctl.simulate(wrist={"stiffness": 0.9}, controller="pid-ff", horizon=1.5)
    shown = done._repr_html_()
    assert re.search(r'<p class="sentence">30 deg ulnar in 1 s .*pid-ff', shown)
    value = re.escape(f"{math.degrees(done.metrics['rmse']):.4g}")
    assert re.search(rf"<td>RMSE</td><td>{value}</td><td>deg</td>", shown)
    assert shown.count('src="data:image/png;base64,') == 1
    assert "--all" not in shown and str(done.answer).startswith("30 deg ulnar")


@pytest.mark.slow
def test_a_result_in_two_planes_shows_the_table_of_its_answer() -> None:
    done = wristctl.simulate(wrist=THREE, controller="ct-dob", horizon=1.2)
    shown, table = done._repr_html_(), done.answer.table
    assert table is not None and "<td>peak tension</td>" not in shown
    assert shown.count("<tr>") == 1 + len(table.rows) and all(f"<td>{row[0]}</td>" in shown for row in table.rows)


@pytest.mark.slow
def test_emulated_trials_have_a_course_of_the_same_columns_and_a_sealed_run(tmp_path: Path) -> None:
    push: PushKeys = {"force": 0.0}
    done = wristctl.hw_run(
        controllers=["pid-ff"], directions=["ulnar", "radial"], push=push, horizon=1.5, out=tmp_path
    )  # fmt: skip
    course = done.course
    assert done.run is not None and done.run.kind == "hw-run" and done.run.state == "ok"
    assert list(course) == [
        "trial", "time", "bend", "reference", "torque", "tension_1", "tension_2", "tension_4", "tension_5", "tip_x",
        "tip_y",
    ]  # fmt: skip
    assert set(course["trial"]) == {0, 1} == set(done.frame()["trial"])
    for number, direction in zip(done.frame()["trial"], done.frame()["direction"], strict=True):
        of_trial = course[course["trial"] == number]
        end, sign = of_trial.iloc[-1], 1.0 if direction == "ulnar" else -1.0
        assert of_trial["time"].iloc[0] == 0.0 and of_trial["time"].is_monotonic_increasing
        assert end["bend"] == pytest.approx(sign * math.radians(30), abs=math.radians(0.3))
        half = end["bend"] / 2  # the chord of an arc turns by half its angle
        assert math.atan2(end["tip_y"], end["tip_x"]) == pytest.approx(half, abs=1e-12)
        assert math.hypot(end["tip_x"], end["tip_y"]) == pytest.approx(0.080 * math.sin(half) / half)
        assert (of_trial.filter(like="tension") >= 2.0 - 1e-9).all(axis=None)


def test_motors_that_are_real_are_left_to_the_command_line() -> None:
    with pytest.raises(UserError, match="wristctl hw-run"):
        wristctl.hw_run(port="/dev/ttyACM0")


SCRIPT = """
import wristctl
import wristctl.arguments

wrist: wristctl.arguments.WristKeys = {"tendons": "three", "length": 0.095, "stiffness": 1.1}
done = wristctl.simulate(wrist=wrist, controller="ct-dob", reference={"kind": "sine", "offset_deg": 3.0})
done.course["bend"].max()
rows: list[wristctl.arguments.RowKeys | str] = ["pid-ff", {"controller": "my.py:LAW", "gains": {"Kp": 1.0}}]
compared = wristctl.compare(controllers=rows, wrist="mine.yaml")
compared.frame()
wristctl.hw_run(controllers=["pid-ff"], wrist=wrist, push={"force": 0.0}).trials
wristctl.simulate("quick", from_identified=wristctl.identify(runs="my.csv", wrist=wrist))
"""


@pytest.mark.slow
def test_a_users_script_passes_mypy_and_a_wrong_key_in_it_does_not(tmp_path: Path) -> None:
    (tmp_path / "right.py").write_text(SCRIPT)
    wrong = {"length": "lenght", "controller=": "contoller=", '"three"': '"treee"', '"offset_deg"': '"ofset_deg"'}
    for number, (right, mistaken) in enumerate(wrong.items()):
        assert right in SCRIPT
        (tmp_path / f"wrong_{number}.py").write_text(SCRIPT.replace(right, mistaken, 1))
    command = [sys.executable, "-m", "mypy", "--strict", "--cache-dir", str(tmp_path / "cache"), str(tmp_path)]
    environment = os.environ | {"MYPYPATH": str(PACKAGE.parent)}
    said = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False).stdout
    faulty = set(re.findall(r"(\w+)\.py:\d+: error", said))
    assert faulty == {f"wrong_{number}" for number in range(len(wrong))}, said


def test_help_names_every_key_that_a_function_takes() -> None:
    for name, keys in (
        ("simulate", {"controller", "loop", "sweep", "wrist"}),
        ("hw_run", {"payload", "planes", "seed"}),
        ("study", {"controllers", "families", "budgets", "wrist"}),
    ):
        told = (getattr(wristctl, name).__doc__ or "").partition("Keys: ")[2].partition(";")[0]
        assert keys <= set(told.replace("\n", " ").split(", "))


def test_a_study_of_controllers_takes_its_keys_as_arguments() -> None:
    """Each reaches its setting: what is refused of it is named by it."""
    with pytest.raises(UserError, match=r"pdi.* - study\(controllers=.* did you mean 'pid'"):
        wristctl.study(controllers=["pid", "pdi"])
    with pytest.raises(UserError, match=r"unknown family of worlds 'camera' - study\(families="):
        wristctl.study(controllers="pid", families=["camera"], wrist={"length": 0.095})
    with pytest.raises(UserError, match=r"unknown argument 'controler' - study\("):
        wristctl.study(controler="pid")  # type: ignore[call-arg]


def test_the_types_of_arguments_are_those_of_the_schema() -> None:
    script = script_of_docs("argument_types")
    here = ast.dump(ast.parse(script.FILE.read_text(encoding="utf-8")))  # which ruff has laid out
    assert here == ast.dump(ast.parse(script.written())), "python docs/argument_types.py"
