"""The compiled model against vectors made by a rigid-body engine, 40-digit arithmetic and an implicit solver."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

VECTORS = Path(__file__).parents[1] / "data" / "wrist_vectors.json"
SPATIAL = VECTORS.with_name("wrist_spatial_vectors.json")
CHECK = Path(__file__).parents[1] / "check_vectors.py"


def run(path: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([sys.executable, CHECK, path], capture_output=True, text=True)


@pytest.mark.parametrize(("vectors", "quantities"), [(VECTORS, 6), (SPATIAL, 7)], ids=["planar", "spatial"])
@pytest.mark.slow
def test_model_agrees_with_reference_vectors(vectors: Path, quantities: int) -> None:
    done = run(vectors)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.count(" ok") == quantities


@pytest.mark.parametrize("quantity", ["mass matrix", "trajectory"])
@pytest.mark.slow
def test_a_wrong_vector_is_found_and_named(tmp_path: Path, quantity: str) -> None:
    vectors = json.loads(VECTORS.read_text())
    if quantity == "trajectory":
        vectors["trajectories"][2]["theta_rad"][3][1] += 2e-6
    else:
        vectors["cases"][20]["expect"]["mass_matrix"][1][2] *= 1 + 3e-9
    wrong = tmp_path / "wrong.json"
    wrong.write_text(json.dumps(vectors))
    done = run(wrong)
    assert done.returncode == 1
    wrong_lines = [line for line in done.stdout.splitlines() if "TOO LARGE" in line]
    assert len(wrong_lines) == 1 and wrong_lines[0].startswith(quantity)
