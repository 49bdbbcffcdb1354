"""Tables and BibTeX of runs as LaTeX reads them, in an IEEE paper of two columns."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path
from typing import Any

import pytest

from tests.cli.conftest import ROOT, Call
from tests.plotting.many_runs import many_runs, run_name
from wristctl.cli.runs.latex import PACKAGES, SOFTWARE, latex_table
from wristctl.commands.printed_table import Table
from wristctl.commands.results import Findings
from wristctl.config.study import Study
from wristctl.records import Run, start_run
from wristctl.records.manifest import TABLES as TABLES_OF_RUNS

ODD = "50 % & more_of #1 {x} ~ ^ \\\\ $y$ <z> |"
TABLES = {
    "intervals": Table(
        "RMSE, 95 %; * best, = tied", ("controller", "ideal (8) [deg]", "push (8)", "camera"),
        [("pid/printed", "<0.001 =", "swings 0.42 deg in 7 of 8", "3: 0.364"),
         ("ct-dob", "0.00464 [0.0034, 0.0061] *", "0.386 [-0.31, 0.46]", "12: -1.5")],
    ),
    "wide": Table("", [f"column number {k} [N m/rad]" for k in range(14)], [[k * 1.2345 for k in range(14)]] * 3),
    "words": Table(
        "Words", ("what", "why", "n"),
        [("a sentence that goes on " * 4, "another one " * 9, 3), ("[b]", "*", None)],
    ),
    "odd": Table(ODD, (ODD, "x"), [(ODD, 1.0), (ODD * 4, None), ("", True)]),
    "large and small": Table("S", ("a", "b [deg]"), [(1.5e12, 1e-12), (-3.0, 2.5), (123456, 0.001)]),
    "powers": Table("P", ("a [rad/s^2]", "b [N m s^0.5]", "c [s^-1]"), [(1.5, 2.5, 3.5)]),
    "no rows": Table("None", ("a", "b"), []),
    "one long word": Table("L", ("file",), [("x" * 90,)]),
}  # fmt: skip


def tabulars(text: str) -> list[list[list[str]]]:
    """Cells of the rows of each tabular, without heads."""
    bodies = re.findall(r"\\midrule\n(.*?)\\bottomrule", text, re.DOTALL)
    rows = [[line.removesuffix(r" \\").split(" & ") for line in body.strip().split("\n")] for body in bodies]
    return [[[cell.strip("{} ") for cell in row] for row in body] for body in rows]


def test_each_cell_holds_one_quantity() -> None:
    text = latex_table(TABLES["intervals"], "compare-1")
    assert "\\label{tab:compare-1}" in text and "\\caption{RMSE, 95 \\%; * best, = tied}" in text
    parts = {tuple(row) for body in tabulars(text) for row in body}
    assert all("[" not in cell and ":" not in cell for row in parts for cell in row)
    cells = [cell for row in parts for cell in row]
    for one in ("<0.001", "0.00464", "0.0034", "0.0061", "-0.31", "0.46", "0.364", "12", "-1.5", "="):
        assert one in cells, one
    assert "swings 0.42 deg in 7 of 8" in cells, "what is no quantity stays as it is"
    assert r"ideal (8) [\unit{\degree}]" in text
    heads = latex_table(TABLES["powers"])
    assert all(rf"[\unit{{{unit}}}]" in heads for unit in ("rad/s^{2}", "N.m.s^{0.5}", "s^{-1}"))


def test_every_row_has_as_many_cells_as_its_layout_has_columns() -> None:
    for name, table in TABLES.items():
        text = latex_table(table)
        layouts = re.findall(r"begin\{tabular\}\{@\{\}(.*)@\{\}\}", text)
        for layout, body in zip(layouts, tabulars(text), strict=True):
            bare = re.sub(r"\[.*?\]|>\{.*?\}|p\{.*?\}", lambda part: "p" * part[0].startswith("p"), layout)
            assert name == "odd" or not table.rows or {len(row) for row in body} == {len(bare)}, (name, layout)


@pytest.mark.parametrize(
    ("names", "repeated"),
    [(("a", "b", "c"), 1), (("a", "a", "b"), 2), (("a", "a", "a"), 2), (("a much longer name than others",) * 3, 1)],
)
def test_words_that_tell_rows_apart_stand_beside_every_part_of_a_table(names: tuple[str, ...], repeated: int) -> None:
    """Of a sweep over two settings: the second one too, unless the first is enough, or there is no room."""
    rows = [(name, f"kind {k} of motion", *(0.1 * k + j for j in range(4))) for k, name in enumerate(names)]
    text = latex_table(Table("T", ("controller", "motion", *(f"quantity {j} [deg]" for j in range(4))), rows))
    heads = re.findall(r"toprule\n(.*) ", text)
    assert len(heads) > 1 and all(head.startswith("{controller}") for head in heads)
    assert all(("{motion}" in head) == (repeated == 2) for head in heads[1:]) and "{motion}" in heads[0]


def test_the_table_of_an_answer_has_its_sentence_for_a_caption(call: Call, tmp_path: Path) -> None:
    with start_run("simulate", Study(), "", tmp_path / "results") as live:
        findings = Findings(0, live)
        findings.overview.answer[:] = [
            "simulate at 2 points: lowest RMSE 1 deg",
            "at 100 % of it.",
            "",
            "RMSE, * best",
            "x  y",
        ]
        findings.keep_overview()
        tables = [{"title": title, "columns": ["x"], "rows": [[1.0]]} for title in ("", "RMSE, * best", "T")]
        live.file(TABLES_OF_RUNS).write_text(json.dumps(tables), encoding="utf-8")
    text = call("runs", "table", "latest:simulate", "--latex")[1]
    name = live.path.name.replace("_", r"\_")
    captions = re.findall(r"caption\{(.*)\}", text)
    sentence = r"Simulate at 2 points: lowest RMSE 1 deg at 100 \% of it."
    assert captions == [
        f"{sentence} Run {name}.", f"{sentence} RMSE, * best. Run {name}.", f"T. Run {name}."
    ]  # fmt: skip


@pytest.mark.parametrize(
    "begins", ["ct-dob/w=35 in two planes:", "smc: error 1 deg", "lib/my.py:MINE/default:", "pid-ff with its gains"]
)
def test_a_caption_leaves_a_controllers_name_as_it_is(begins: str, call: Call, tmp_path: Path) -> None:
    with start_run("hw-run", Study(), "", tmp_path / "results") as live:
        findings = Findings(0, live)
        findings.overview.answer[:] = [begins]
        findings.keep_overview()
        live.file(TABLES_OF_RUNS).write_text(json.dumps([{"title": "", "columns": ["x"], "rows": [[1.0]]}]))
    assert rf"\caption{{{begins} Run" in call("runs", "table", "latest:hw-run", "--latex")[1]


def test_bibtex_names_the_run_by_its_result_and_wristctl_as_the_readme_does(call: Call, tmp_path: Path) -> None:
    many_runs(tmp_path / "results", 2)
    code, out, _ = call("runs", "cite", run_name(1))
    run = Run(tmp_path / "results" / run_name(1))
    assert code == 0 and f"@misc{{{run.id}," in out and f"SHA-256 {run.result_hash}" in out and "year = {2026}" in out
    assert out.rstrip().endswith(SOFTWARE) and SOFTWARE in (ROOT / "README.md").read_text()


@pytest.mark.slow
def test_a_paper_of_two_columns_sets_them_without_a_box_beyond_its_column(call: Call, tmp_path: Path) -> None:
    if not shutil.which("pdflatex"):
        pytest.skip("needs Debian's texlive-latex-recommended, texlive-publishers and texlive-science")
    many_runs(tmp_path / "results", 1)
    (tmp_path / "own.bib").write_text(call("runs", "cite", run_name(0))[1])
    parts: list[Any] = [latex_table(table, f"own-{k}", "A run") for k, table in enumerate(TABLES.values())]
    used = f"\\usepackage{{{','.join(PACKAGES)}}}"
    cited = (
        f"See Table~\\ref{{tab:own-0}} \\cite{{{run_name(0)}}}.\n\\bibliographystyle{{IEEEtran}}\\bibliography{{own}}"
    )
    begin, end = f"\\documentclass[journal]{{IEEEtran}}{used}\\begin{{document}}\\sloppy", "\\end{document}"
    (tmp_path / "paper.tex").write_text("\n\n".join([begin, cited, *parts, end]))
    for command in (["pdflatex"], ["bibtex"], ["pdflatex"], ["pdflatex"]):
        options = ["-interaction=nonstopmode", "-halt-on-error", "paper.tex"] if command == ["pdflatex"] else ["paper"]
        done = subprocess.run([*command, *options], cwd=tmp_path, capture_output=True, text=True, errors="replace")
        assert done.returncode == 0, done.stdout[-3000:]
    log = (tmp_path / "paper.log").read_text(errors="replace")
    tables = log.partition("paper.bbl")[0] if "paper.bbl" in log else log
    assert not re.findall(r"^Overfull \\hbox.*", tables, re.MULTILINE)
    assert not re.findall(r"(?:Reference|Citation) .*", log) and (tmp_path / "paper.pdf").exists()
