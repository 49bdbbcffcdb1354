"""Notebooks run as they stand where the wheel alone is installed, and show what the documentation says they show."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from tests.documented import script_of_docs

ROOT = Path(__file__).parents[1]
PAGES = sorted((ROOT / "docs" / "notebooks").glob("*.md"))
SHOWN = {
    "my-controller": ["my-pd", "computed-torque", "Kp"],
    "my-log": ["gain", "tendon", "in ms?", "identified wrist"],
    "my-wrist": ["No trial ended", "did you mean &#x27;length&#x27;?", "bend_flexion", "2000"],
    "two-controllers": ["ct-dob", "peak_tension", "pid-ff"],
}
"""Words of outputs."""


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The content of the wheel, by itself."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)]
    subprocess.run(command, cwd=ROOT, check=True, capture_output=True)
    (wheel,) = folder.glob("*.whl")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder / "site")
    return folder / "site"


def environment(installed: Path) -> dict[str, str]:
    """One in which Python finds the wheel and not the clone."""
    return os.environ | {"PYTHONPATH": str(installed), "OMP_NUM_THREADS": "1", "MPLBACKEND": "Agg"}


@pytest.mark.slow
@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.stem)
def test_a_notebook_runs_from_the_wheel_alone(page: Path, installed: Path, tmp_path: Path) -> None:
    script = tmp_path / "execute_notebooks.py"
    script.write_bytes((ROOT / "docs" / "execute_notebooks.py").read_bytes())
    copy = tmp_path / page.name
    copy.write_bytes(page.read_bytes())
    command = [sys.executable, str(script), str(copy), str(tmp_path / "out")]
    done = subprocess.run(
        command, cwd=tmp_path, env=environment(installed), capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    notebook = json.loads((tmp_path / "out" / f"{page.stem}.ipynb").read_text(encoding="utf-8"))
    outputs = [output for cell in notebook["cells"] for output in cell.get("outputs", [])]
    shown = "".join("".join(output.get("text", output.get("data", {}).get("text/html", ""))) for output in outputs)
    assert not [word for word in SHOWN[page.stem] if word not in shown.replace("'", "&#x27;")]
    assert "data:image/png;base64," in shown
    with_outputs = (tmp_path / "out" / page.name).read_text(encoding="utf-8")
    assert with_outputs.count("{raw} html") > 1 and f"{page.stem}.ipynb" in with_outputs


def test_every_notebook_of_the_four_is_tried() -> None:
    assert [page.stem for page in PAGES] == sorted(SHOWN)


@pytest.mark.slow
def test_the_first_example_of_the_page_on_python_is_ten_lines_that_run(installed: Path, tmp_path: Path) -> None:
    text = (ROOT / "docs" / "python.md").read_text(encoding="utf-8")
    code = re.findall(r"^```python\n(.*?)^```", text, re.DOTALL | re.MULTILINE)[0]
    assert len([line for line in code.splitlines() if line]) <= 10
    command = [sys.executable, "-c", code]
    done = subprocess.run(command, cwd=tmp_path, env=environment(installed), capture_output=True, text=True, check=True)
    assert "ct-dob" in done.stdout and "RMSE [deg]" in done.stdout
    assert (tmp_path / "errors.png").stat().st_size > 5_000


def test_cells_share_names_print_show_their_last_value_and_draw_below() -> None:
    script = script_of_docs("execute_notebooks")
    page = (
        "# Title\n\nWords.\n\n```python\nx = 2\nprint('<b>')\n```\n\n```python\nx + 1\n```\n\n"
        "```python\nimport matplotlib.pyplot as plt\n\n_ = plt.plot([x, 1])\n```\n\n```text\nno cell\n```\n"
    )
    outputs = script.execute(page, "page.md")
    assert [output.printed for output in outputs] == ["<b>\n", "", ""]
    assert "&lt;b&gt;" in outputs[0].html and outputs[1].shown == ("<pre>3</pre>",)
    assert len(outputs[2].shown) == 1 and "image/png" in outputs[2].shown[0]
    notebook = script.notebook(page, outputs)
    kinds = [cell["cell_type"] for cell in notebook["cells"]]
    assert kinds == ["markdown", "code", "code", "code", "markdown"]
    assert "".join(notebook["cells"][3]["source"]).endswith("_ = plt.plot([x, 1])")
    assert script.with_outputs(page, outputs, "page").count("```python") == 3


def test_an_error_in_a_cell_names_the_page_and_the_cell() -> None:
    script = script_of_docs("execute_notebooks")
    with pytest.raises(ZeroDivisionError) as raised:
        script.execute("# T\n\n```python\nx = 0\n```\n\n```python\n1 / x\n```\n", "page.md")
    assert "page.md, cell 2" in [str(entry.path) for entry in raised.traceback]
