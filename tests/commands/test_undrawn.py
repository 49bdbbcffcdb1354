"""A figure that cannot be drawn costs the figure, and nothing that was computed."""

from __future__ import annotations

import ast
import signal
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import wristctl
from tests.commands.conftest import SMALL
from tests.commands.test_face import CHAIN, INPUTS
from wristctl.cli.app import main
from wristctl.commands.results import Findings, StudyResult
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.plotting import page as page_module
from wristctl.plotting.style import figure
from wristctl.records import Run, start_run
from wristctl.records.manifest import Manifest
from wristctl.records.replay import verdicts
from wristctl.records.run_writer import Undrawn

PACKAGE = Path(wristctl.__file__).parent


def _fails(*_: Any, **__: Any) -> Any:
    raise ZeroDivisionError("a drawn fault")


def _with_fault(record: Callable[..., None]) -> Callable[..., None]:
    def figure(findings: Findings, name: str, draw: Any, *of: Any, **options: Any) -> None:
        assert callable(draw)
        record(findings, name, _fails, *of, **options)

    return figure


@pytest.fixture(scope="module")
def found(study: Study, tmp_path_factory: pytest.TempPathFactory) -> dict[str, StudyResult]:
    """Results of the commands that take a moment, each figure of which failed."""
    out, results = tmp_path_factory.mktemp("faulty"), dict[str, StudyResult]()
    plain = [*SMALL, "simulate.gains=hardware", "simulate.reference.inverse=closed-form"]
    with pytest.MonkeyPatch.context() as during:
        during.setattr(Findings, "figure", _with_fault(Findings.figure))
        for name in CHAIN:
            given = {leaf: results[earlier] for leaf, earlier in INPUTS[name].items()}
            results[name] = getattr(wristctl, name)(study, **given, out=out)
        in_two_planes = wristctl.load_study(None, *plain, "simulate.loop.planes=2")
        results["in two planes"] = wristctl.simulate(in_two_planes, out=out)
        swept = wristctl.load_study(None, *plain, "sweep=['simulate.reference.angle_deg=10,20']")
        results["sweep"] = wristctl.simulate(swept, out=out)
    return results


@pytest.mark.parametrize("name", [*CHAIN, "in two planes", "sweep"])
@pytest.mark.slow
def test_a_run_all_of_whose_figures_fail_is_sealed_and_names_them(name: str, found: dict[str, StudyResult]) -> None:
    run = found[name].run
    assert run is not None and run.state == "ok" and run.manifest.exit_code == 0 and run.problems() == []
    assert not (run.path / "figures").exists() and run.metrics
    undrawn = run.manifest.undrawn
    assert set(undrawn.values()) <= {"ZeroDivisionError: a drawn fault"}
    assert {each.removeprefix("figure ") for each in undrawn} <= set(found[name].figures)
    assert undrawn or name == "audit", "which has no figure of so few claims"
    for file in ("README.md", "report.html", "console.log", "events.jsonl"):
        text = run.file(file).read_text()
        assert all(each in text for each in undrawn), file
    assert "](figures/" not in run.file("README.md").read_text(), "no picture that is not there"


def test_every_figure_of_a_run_is_drawn_where_a_fault_costs_the_figure_alone() -> None:
    """No command calls a function that makes a figure: it hands all of them to `Findings.figure`."""
    trees = {
        f"wristctl.{'.'.join(file.relative_to(PACKAGE).with_suffix('').parts)}": ast.parse(file.read_text())
        for room in ("commands", "plotting")
        for file in (PACKAGE / room).rglob("*.py")
    }
    makers = {
        f"{module}.{node.name}"
        for module, tree in trees.items()
        for node in tree.body
        if isinstance(node, ast.FunctionDef) and not node.name.startswith("_")
        if node.returns is not None and ast.unparse(node.returns) == "Figure"
    }
    assert len(makers) > 70
    called, handed = set[str](), set[str]()
    for module, tree in trees.items():
        known = {name.rpartition(".")[2]: name for name in makers if name.startswith(f"{module}.")}
        for node in ast.walk(tree):
            if not isinstance(node, ast.ImportFrom):
                continue
            for alias in node.names:
                within, own = f"{node.module}.{alias.name}", alias.asname or alias.name
                known |= {own: within} if within in makers else {}
                known |= {f"{own}{name.removeprefix(within)}": name for name in makers if name.startswith(f"{within}.")}
        for node in ast.walk(tree):
            if isinstance(node, ast.Call):
                called |= {known[ast.unparse(node.func)]} if ast.unparse(node.func) in known else set()
                handed |= {known[text] for text in map(ast.unparse, node.args[1:2]) if text in known}
    assert {name.rpartition(".")[2] for name in called} == {"gain_sensitivity", "board_page", "marker_page"}
    left = {name.rpartition(".")[2] for name in makers - handed - called}
    assert left == {"directions", "recent", "residuals_over_time", "trends_over_runs"}, "of no run"


def _small() -> Any:
    return figure(width=4.0)[0]


def test_what_fails_between_figures_costs_the_figures_that_were_to_come(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with start_run("simulate", Study(), "", tmp_path) as live:
        recorded, memory = Findings(0, live), Findings(0)
        for findings in (recorded, memory):
            with findings.drawing():
                findings.figure("first", _small)
                findings.metric("rmse", dict[str, float]()["missing"])
            findings.metric("rmse", 1.0)
    run = Run(live.path)
    assert run.manifest.undrawn == {"further figures": "KeyError: 'missing'"} and run.metrics["rmse"]["value"] == 1.0
    assert run.file("figures/first.png").is_file() and memory.metrics["rmse"]["value"] == 1.0
    assert caplog.text.count("further figures could not be drawn: KeyError: 'missing'") == 2, "and in memory too"


@pytest.mark.parametrize("made_another", [False, True], ids=["as it is", "made another error of by a library"])
def test_an_interrupt_while_a_figure_is_drawn_interrupts(tmp_path: Path, made_another: bool) -> None:
    def draw() -> Any:
        try:
            signal.raise_signal(signal.SIGINT)
        except KeyboardInterrupt as error:
            if made_another:
                raise RuntimeError("the library's own") from error
            raise
        return _small()

    with pytest.raises(KeyboardInterrupt), start_run("simulate", Study(), "", tmp_path) as live:
        Findings(0, live).figure("angle", draw)
    run = Run(live.path)
    assert run.state == "interrupted" and run.manifest.exit_code == 130 and run.problems() == []


def test_a_full_disk_under_a_figure_still_fails_the_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(path: Path, content: bytes) -> None:
        raise UserError("cannot write: No space left on device", str(path))

    monkeypatch.setattr("wristctl.records.run_writer.write_bytes", full)
    with pytest.raises(UserError, match="No space left"), start_run("simulate", Study(), "", tmp_path) as live:
        Findings(0, live).figure("angle", _small)
    assert Run(live.path).state == "failed"


@pytest.mark.parametrize("name", ["animation", "_in_space", "lineage_picture", "shown_tables"])
def test_a_part_of_the_page_that_fails_is_named_on_the_page(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    monkeypatch.setattr(page_module, name, _fails)

    def page(path: Path, manifest: Manifest, undrawn: Undrawn) -> str:
        return page_module.page(Run(path), manifest, undrawn=undrawn)

    with start_run("simulate", Study(), "", tmp_path, page=page) as live:
        live.metric("rmse", 1.0)
    run = Run(live.path)
    ((part, reason),) = run.manifest.undrawn.items()
    assert part.startswith("the ") and reason == "ZeroDivisionError: a drawn fault" and run.problems() == []
    assert f"Not drawn: {part}: {reason}" in run.file("report.html").read_text()
    with pytest.raises(ZeroDivisionError):
        page_module.page(run, run.manifest)


def test_listing_showing_and_replaying_say_what_was_not_drawn(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    def made(*draws: Any) -> Run:
        with start_run("simulate", Study(), "", tmp_path) as live:
            for name, draw in zip(("angle", "error"), draws, strict=True):
                Findings(0, live).figure(name, draw)
        return Run(live.path)

    whole, one, none = made(_small, _small), made(_small, _fails), made(_fails, _fails)
    for verb in (["ls"], ["show", one.id]):
        monkeypatch.setattr(sys, "argv", ["wristctl", "runs", *verb, "--out", str(tmp_path)])
        with pytest.raises(SystemExit):
            main()
        assert "figure error" in capsys.readouterr().out
    fault = "(ZeroDivisionError: a drawn fault)"
    now = [line for line in verdicts(none, one) if line.path.startswith(("figures/angle.p", "figure error"))]
    assert now == [
        ("figures/angle.png", "drawn now", f"not drawn {fault} then"),
        ("figure error", "undrawn", "neither then nor now: ZeroDivisionError: a drawn fault"),
    ]
    lost = {line.path: line[1:] for line in verdicts(whole, one)}
    assert lost["figures/error.png"] == ("missing", f"not drawn {fault} this time")


@pytest.mark.slow
def test_a_notebook_shows_the_answer_of_a_result_whose_figure_fails(found: dict[str, StudyResult]) -> None:
    shown = found["gen_data"]._repr_html_()
    assert 'class="sentence"' in shown and "figure coverage could not be drawn: ZeroDivisionError" in shown
