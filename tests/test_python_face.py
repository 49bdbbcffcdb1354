"""wristctl as a library: its functions, what they say of themselves, and what an import costs."""

from __future__ import annotations

import ast
import inspect
import re
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

import wristctl

PACKAGE = Path(wristctl.__file__).parent

FACE = {
    "analyse", "audit", "compare", "gen_data", "hysteresis", "identify", "load_study", "open_run", "recommend", "runs",
    "simulate", "study", "train", "tune",
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
        {name for name in dir(wristctl) if not name.startswith("_")} == FACE == set(wristctl.__all__) - {"__version__"}
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
