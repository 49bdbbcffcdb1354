"""Metrics, figures and files of a study: kept in memory, and in the run where there is one."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import wristctl
from tests.commands.conftest import columns_of
from wristctl.commands.results import Figures, Findings
from wristctl.plotting.style import figure
from wristctl.records import Run, start_run


def test_a_figure_is_drawn_when_first_asked_for_and_anew_once_replaced() -> None:
    figures, drawn = Figures(), list[str]()

    def draw(name: str) -> Any:
        drawn.append(name)
        return name

    figures.add("a", lambda: draw("first"))
    assert "a" in figures and "b" not in figures
    assert not drawn and figures["a"] == figures["a"] == "first" and drawn == ["first"]  # type: ignore[comparison-overlap]
    figures.add("a", lambda: draw("second"))
    assert figures["a"] == "second" and list(figures) == ["a"] and repr(figures) == "figures a"  # type: ignore[comparison-overlap]


def test_a_metric_is_of_one_unless_said_and_the_same_in_the_run(tmp_path: Path) -> None:
    with start_run("compare", wristctl.load_study(None, "seed=7"), "", tmp_path) as live:
        recorded, memory = Findings(7, live), Findings(7)
        for each in (recorded, memory):
            each.metric("plain", 2.5)
            each.metric("known", 1.0, "rad", "lower", 9, (0.5, 1.5), "meant")
            each.figure("shown", lambda width: figure(width=width)[0], width=4.0)
            each.table("data/t.csv", {"a": np.arange(3.0)}, {"a": "m"}, {"a": "what"})
            each.arrays("data/a.npz", {"b": np.arange(2.0)})
            each.plain("data/plain.json", {"c": 1})
            each.plain("data/loose.json", [1], volatile=True)
            assert each.stream("noise") == recorded.stream("noise") != each.stream("other")
    run = Run(live.path)
    assert memory.metrics == recorded.metrics
    assert memory.metrics["plain"] == {
        "value": 2.5, "unit": "", "better": "", "n": 1, "interval": None, "meaning": "",
    }  # fmt: skip
    assert memory.metrics["known"]["n"] == 9 and memory.figures["shown"].get_figwidth() == pytest.approx(4.0)
    assert run.metrics["plain"]["n"] == 1 and run.metrics["known"]["value"] == 1.0
    assert columns_of(run, "data/t.csv") == {"a": ("m", "what")} and list(run.array("a")["b"]) == [0.0, 1.0]
    assert json.loads(run.file("data/plain.json").read_text()) == {"c": 1}
    volatile = {each.path: each.volatile for each in run.manifest.outputs}
    assert volatile["data/loose.json"] and not volatile["data/plain.json"]
    assert run.file("figures/shown.png").is_file()


def test_a_figure_without_a_caption_is_captioned_by_the_first_line_of_what_draws_it() -> None:
    def draw() -> Any:
        """Error [deg] over time [s].

        Further words.
        """

    findings = Findings(7)
    findings.figure("said", draw, caption="What it is")
    findings.figure("told", draw)
    findings.figure("silent", lambda: figure()[0])
    assert findings.overview.captions == {"said": "What it is", "told": "Error [deg] over time [s]", "silent": ""}
