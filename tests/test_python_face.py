"""wristctl as a library, and how its packages may depend on each other."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import wristctl

PACKAGE = Path(wristctl.__file__).parent
LAYERS = (
    "cli", "studies", "report", "comparison", "tuning", "learning", "identification", "trial", "bench", "vision",
    "board", "simulation", "control", "wrist", "lanes", "records", "config", "interrupt", "seeds",
)  # fmt: skip


def test_a_notebook_can_simulate_from_overrides() -> None:
    study = wristctl.load_study(None, "simulate.controller=computed-torque", "simulate.gains=default")
    done = wristctl.simulate(study)
    frame = done.trajectory.frame()
    assert done.metrics["rmse"] < 1e-4 and not done.failed
    assert frame["theta"].iloc[-1] == pytest.approx(frame["theta_desired"].iloc[-1], abs=1e-3)


def test_import_is_light() -> None:
    heavy = "{'torch', 'scipy', 'pandas', 'matplotlib', 'cv2', 'numba', 'numpy'}"
    code = f"import sys, wristctl; assert not {heavy} & set(sys.modules), {heavy} & set(sys.modules)"
    subprocess.run([sys.executable, "-c", code], check=True, cwd=PACKAGE.parent)


def test_imports_between_packages_point_down_only() -> None:
    for file in PACKAGE.rglob("*.py"):
        own = file.relative_to(PACKAGE).parts[0]
        if file.parent == PACKAGE:
            continue
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("wristctl."):
                other = str(node.module).split(".")[1]
                assert LAYERS.index(other) >= LAYERS.index(own), f"{file}: {own} imports {other}"


def test_every_public_name_has_a_docstring() -> None:
    missing = []
    for file in PACKAGE.rglob("*.py"):
        tree = ast.parse(file.read_text())
        names = [n for n in tree.body if isinstance(n, ast.FunctionDef | ast.ClassDef)]
        for parent in [n for n in names if isinstance(n, ast.ClassDef) and not n.name.startswith("_")]:
            names += [n for n in parent.body if isinstance(n, ast.FunctionDef)]
        missing += [f"{file.name}:{n.name}" for n in names if not n.name.startswith("_") and not ast.get_docstring(n)]
        assert ast.get_docstring(tree), file
    assert not missing
