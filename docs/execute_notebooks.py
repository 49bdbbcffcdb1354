"""Run the cells of a page of docs/notebooks: `python docs/execute_notebooks.py docs/notebooks/my-wrist.md FOLDER`.

Each fence of Python is a cell. In FOLDER, where the cells run, are then the page with what they print and show, and the
same as a Jupyter notebook, `my-wrist.ipynb`. Only wristctl is needed, and no file of a clone.
"""

from __future__ import annotations

import ast
import base64
import html
import io
import json
import os
import re
import sys
from contextlib import redirect_stdout
from dataclasses import dataclass
from pathlib import Path
from typing import Any

CELL = re.compile(r"^```python\n(.*?)^```\n", re.DOTALL | re.MULTILINE)
STYLE = """\
<style>
.cell { border-left: 3px solid #8aa; padding-left: 1em; margin-bottom: 1.5em; overflow-x: auto; }
.cell pre { white-space: pre-wrap; overflow-wrap: anywhere; }
.cell td, .cell th { padding: 0.1em 0.7em; text-align: right; }
.cell td:first-child, .cell th:first-child { text-align: left; }
</style>
"""


@dataclass(frozen=True)
class Output:
    """What a cell leaves: what it prints, and HTML of its last value and of the figures that it draws."""

    printed: str
    shown: tuple[str, ...]

    @property
    def html(self) -> str:
        """All of it below the cell; empty where it leaves nothing."""
        parts = [f"<pre>{html.escape(self.printed)}</pre>"] * bool(self.printed) + list(self.shown)
        return f'<div class="cell" tabindex="0">{"".join(parts)}</div>' if parts else ""


def run_cell(source: str, names: dict[str, Any], place: str) -> Output:
    """Execute a cell among `names`. An error in it is raised, with `place` as its file."""
    import matplotlib.pyplot as plt

    value: Any = None
    tree, printed = ast.parse(source, place), io.StringIO()
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    with redirect_stdout(printed):
        exec(compile(tree, place, "exec"), names)
        if isinstance(last, ast.Expr):
            value = eval(compile(ast.Expression(last.value), place, "eval"), names)
    shown = [picture(plt.figure(number)) for number in plt.get_fignums()]
    plt.close("all")
    if hasattr(value, "_repr_html_"):
        shown.insert(0, str(value._repr_html_()))
    elif hasattr(value, "savefig"):
        shown.append(picture(value))
    elif value is not None and not shown:
        shown.append(f"<pre>{html.escape(repr(value))}</pre>")
    return Output(printed.getvalue(), tuple(shown))


def picture(figure: Any) -> str:
    """A matplotlib figure as HTML."""
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=100)
    text = base64.b64encode(content.getvalue()).decode("ascii")
    return f'<img alt="what the cell draws" style="max-width: 100%" src="data:image/png;base64,{text}">'


def execute(text: str, place: str) -> list[Output]:
    """The outputs of all cells of a page, run one after the other here."""
    names: dict[str, Any] = {"__name__": "__main__"}
    return [run_cell(cell[1], names, f"{place}, cell {number}") for number, cell in enumerate(CELL.finditer(text), 1)]


def with_outputs(text: str, outputs: list[Output], name: str) -> str:
    """The page, each cell followed by its output, and a link to the notebook."""
    left = iter(outputs)

    def below(cell: re.Match[str]) -> str:
        output = next(left).html
        return cell[0] + f"\n````{{raw}} html\n{output}\n````\n" * bool(output)

    title, rest = CELL.sub(below, text).split("\n", 1)
    link = f"{{download}}`This page as a Jupyter notebook <{name}.ipynb>`"
    return f"{title}\n\n````{{raw}} html\n{STYLE}````\n\n{link}\n{rest}"


def notebook(text: str, outputs: list[Output]) -> dict[str, Any]:
    """The page as a Jupyter notebook, format 4.5, with its outputs."""
    cells: list[dict[str, Any]] = []
    for number, part in enumerate(CELL.split(text)):
        name, source = f"cell-{number}", part.strip("\n").splitlines(keepends=True)
        if number % 2 == 0:
            cells += [{"cell_type": "markdown", "id": name, "metadata": {}, "source": source}] * bool(source)
            continue
        output, shown = outputs[number // 2], list[dict[str, Any]]()
        if output.printed:
            lines = output.printed.splitlines(keepends=True)
            shown.append({"output_type": "stream", "name": "stdout", "text": lines})
        shown += [
            {"output_type": "display_data", "metadata": {}, "data": {"text/html": each.splitlines(keepends=True)}}
            for each in output.shown
        ]
        cell: dict[str, Any] = {
            "cell_type": "code",
            "id": name,
            "metadata": {},
            "source": source,
            "execution_count": number // 2 + 1,
        }
        cells.append({**cell, "outputs": shown})
    kernel = {"display_name": "Python 3", "language": "python", "name": "python3"}
    return {"cells": cells, "metadata": {"kernelspec": kernel}, "nbformat": 4, "nbformat_minor": 5}


def main() -> None:
    """Run one page."""
    page, folder = Path(sys.argv[1]).resolve(), Path(sys.argv[2]).resolve()
    import matplotlib

    matplotlib.use("Agg")
    folder.mkdir(parents=True, exist_ok=True)
    text = page.read_text(encoding="utf-8")
    os.chdir(folder)
    sys.path.insert(0, "")  # a notebook finds modules beside it
    outputs = execute(text, page.name)
    Path(page.name).write_text(with_outputs(text, outputs, page.stem), encoding="utf-8")
    content = json.dumps(notebook(text, outputs), indent=1) + "\n"
    Path(f"{page.stem}.ipynb").write_text(content, encoding="utf-8")


if __name__ == "__main__":
    main()
