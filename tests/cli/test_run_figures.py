"""Figures and tables of a run that has ended: drawn anew beside it, as wide as a column, and as LaTeX."""

from __future__ import annotations

import hashlib
import json
import re
import shutil
import struct
from collections.abc import Callable
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.cli.runs.latex import latex_table
from wristctl.commands.printed_table import Table
from wristctl.records import open_run

COMPARE = (
    "compare", "--set", "loops={fast: {plant_segments: 1}}", "--set", "horizon=0.4", "--set", "inverses=[none]",
    "--set", "references=[{kind: minimum-jerk, duration: 0.2}, {kind: step, angle_deg: 10}]",
    "--set", "controllers=[{controller: computed-torque}, {controller: feedforward}]", "--label", "small",
)  # fmt: skip


@pytest.fixture(scope="module")
def comparison(made: Callable[..., Path]) -> Path:
    """A folder with a compare run."""
    return made(*COMPARE)


@pytest.fixture(autouse=True)
def before(call: Call, comparison: Path, tmp_path: Path) -> None:
    """The run in the folder of this test."""
    shutil.copytree(comparison / "results", tmp_path / "results")


def files() -> dict[str, str]:
    """Hashes of all files of the run."""
    run = open_run("latest:compare")
    return {str(each): hashlib.sha256(each.read_bytes()).hexdigest() for each in run.path.rglob("*") if each.is_file()}


@pytest.mark.slow
def test_figures_are_as_wide_as_asked_and_stand_beside_the_sealed_run(call: Call) -> None:
    sealed, run = files(), open_run("latest:compare")
    assert {each.stem for each in (run.path / "figures").iterdir()} == {"answer", "overlay-sampled"}
    names = ("answer", "tension-variation-fast")
    code, out, error = call("runs", "figures", run.id, *names, "--format", "pdf", "--width", "88mm")
    assert code == 0, error
    folder = Path(out.strip())
    assert code == 0 and folder.parent == Path("results").resolve() and files() == sealed
    for name in names:
        box = re.search(rb"/MediaBox \[\s*0 0 ([\d.]+) ([\d.]+)", (folder / f"{name}.pdf").read_bytes())
        assert box is not None and float(box[1]) == pytest.approx(88.0 / 25.4 * 72.0, abs=0.1), name
    call("runs", "figures", run.id, "answer", "--format", "png", "--width", "18 cm", "--to", "own")
    head = Path("own/answer.png").read_bytes()[16:24]
    assert struct.unpack(">II", head)[0] == pytest.approx(180.0 / 25.4 * 300.0, abs=2)
    assert call("runs", "ls")[1].count("-compare-") == 1, "a folder of figures is no run"
    assert call("runs", "verify")[0] == 0


@pytest.mark.slow
def test_a_figure_that_cannot_be_drawn_is_named_and_the_others_are_drawn(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("wristctl.commands.compare.figures.variation_dots", lambda *_: 1 / 0)
    code, out, error = call("runs", "figures", "latest:compare", "tension-variation-fast", "answer")
    assert code == 1 and "bug" not in error, error
    assert (Path(out.strip()) / "answer.pdf").is_file()
    assert "1 of 2 figures could not be drawn: tension-variation-fast" in error and "ZeroDivisionError" in error
    code, out, error = call("runs", "report", "latest:compare", "--all-figures")
    assert code == 0 and "figure tension-variation-fast could not be drawn: ZeroDivisionError" in error
    assert Path(out.strip()).read_text().count("<figure>") > 5


def test_a_report_with_all_figures_shows_those_left_for_later(call: Call) -> None:
    sealed, run = files(), open_run("latest:compare")
    code, out, _ = call("runs", "report", run.id, "--all-figures")
    text = Path(out.strip()).read_text()
    assert code == 0 and files() == sealed and text.count("<figure>") == len(re.findall("<figcaption>", text))
    assert text.count("<figure>") > 5 > run.file("report.html").read_text().count("<figure>")
    assert "--all-figures" in run.file("report.html").read_text() and "--all-figures" not in text


@pytest.mark.parametrize(
    ("asked", "said"),
    [
        (("figures", "latest:compare", "answre"), "did you mean 'answer'?"),
        (("figures", "latest:compare", "--width", "88"), "--width 88mm"),
        (("figures", "latest:compare", "--width", "8800mm"), "4 to 100 cm"),
        (("table", "latest:compare", "-n", "9"), "1 to 6"),
        (("show", "latest:compare:smal"), "did you mean 'small'?"),
        (("show", "latest:tune"), "run `wristctl tune` first"),
        (("ls", "--columns", "id,rsme"), "unknown column 'rsme'"),
        (("ls", "--kind", "comprae"), "did you mean 'compare'?"),
        (("ls", "--state", "okk"), "did you mean 'ok'?"),
        (("show", "x" * 30), "`wristctl runs ls` shows"),
    ],
)
def test_what_cannot_be_is_refused_in_few_words(call: Call, asked: tuple[str, ...], said: str) -> None:
    code, _, error = call("runs", *asked)
    assert code == 2 and said in error and len(error) < 500
    there = [each.name for each in Path("results").iterdir() if not each.name.startswith(".")]
    assert there == [open_run("latest:compare").id]


def test_a_run_of_another_result_is_not_drawn(call: Call) -> None:
    run = open_run("latest:compare")
    metrics = json.loads(run.file("metrics.json").read_text())
    metrics["best_sampled"]["value"] *= 1.001
    run.file("metrics.json").write_text(json.dumps(metrics))
    code, _, error = call("runs", "figures", run.id, "answer")
    assert code == 3 and "best_sampled" in error and not list(Path("results").glob("figures-*"))


def test_the_latest_of_a_label_is_found_and_told_apart(call: Call) -> None:
    first = open_run("latest:compare:small")
    out = call("runs", "ls")[1]
    assert "computed-torque/default, feedforward/default" in out and "best_sampled" in out
    shown = call("runs", "ls", "--columns", "id,label,best_sampled")[1].splitlines()
    assert shown[0].split() == ["id", "label", "best_sampled", "[deg]"] and shown[2].split()[:2] == [first.id, "small"]


def test_a_table_is_printed_whole_or_as_latex(call: Call) -> None:
    plain = call("runs", "table", "latest:compare")[1]
    assert plain.count("Loop fast") == 2 and "Control step" in plain
    whole = call("runs", "table", "latest:compare", "--latex")[1]
    assert whole.count("\\begin{table}") == 6 and "overshoot [\\unit{\\percent}]" in whole
    answer = call("runs", "table", "latest:compare", "-n", "1", "--latex")[1]
    assert whole.startswith(answer.rstrip()) and "\\label{tab:compare-1}" in answer, "the answer comes first"
    assert answer.index("sampled (1)") < answer.index("sampled (steps) (1)"), "a column for moves and one for steps"


def test_latex_writes_out_what_it_would_read_and_aligns_numbers() -> None:
    text = latex_table(Table("50 % & more_", ("a_b", "x"), [("p & q", 1.23456), ("r", None)]))
    less = latex_table(Table("<1", ("RMSE > 0",), [("<0.001",)]))
    assert "\\caption{\\textless{}1}" in less and "{RMSE \\textgreater{} 0}" in less
    assert "S[table-format=<1.3]" in less and "\n<0.001 " in less, "siunitx sets what compares"
    assert (
        "50 \\% \\& more\\_" in text
        and "p \\& q & 1.235" in text
        and "lS[table-format=1.3]" in text
        and "a\\_b" in text
    )
