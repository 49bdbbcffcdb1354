"""The page of a run, and what a browser makes of it."""

from __future__ import annotations

import json
import math
import re
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.commands.compare.csv_data import frame, series
from wristctl.commands.compare.figures import rmse_map, variation_dots
from wristctl.comparison.combinations import ComparedRow
from wristctl.config.learning import TrainSettings
from wristctl.config.study import Study
from wristctl.plotting.page import page
from wristctl.plotting.several_page import several_page
from wristctl.records import InputRun, Run, start_run
from wristctl.records.manifest import OVERVIEW, Overview
from wristctl.simulation.repetitions import Repeated

KEPT = Path(__file__).parents[2] / "build" / "screenshots"

TABLE_ROWS = "[...document.querySelector('table.sortable').tBodies[0].rows]"
MARKUP = "</script><b>bold</b>"


@pytest.fixture(scope="module")
def compared(tmp_path_factory: pytest.TempPathFactory, results: list[ComparedRow]) -> Run:
    """A comparison of six rows on three references, one of which diverged, with the run it was made from."""
    out = tmp_path_factory.mktemp("page") / "results"
    found = [_complete(result) for result in results]
    with start_run("train", Study(), "quick", out) as network:
        network.metric("rmse", 1e-3, "rad", "lower")
    inputs = [InputRun("network", Run(network.path))]
    argv = ["wristctl", "compare", "--label", MARKUP]
    with start_run("compare", Study(), "quick", out, argv, inputs, lambda path, man, _: page(Run(path), man)) as run:
        run.table("data/comparison.csv", frame(found, ()))
        run.arrays("data/trajectories.npz", series(found, every=1))
        run.figure("rmse-default", lambda: rmse_map(found, "loop default"))
        run.figure("tension-variation-default", lambda: variation_dots(found, "loop default"))
        for each in found:
            value = each.simulation.metrics["rmse"]
            run.metric(f"rmse_{each.label}_{each.reference}", value, "rad", "lower", meaning=MARKUP)
        rows: list[Any] = [[each.label, each.reference, each.simulation.metrics["rmse"]] for each in found]
        rows = [[name, reference, None if np.isnan(value) else value] for name, reference, value in rows]
        tables = [{"title": "Loop default", "columns": ["controller", "reference", "RMSE [rad]"], "rows": rows}]
        run.file("tables.json").write_text(json.dumps(tables))
    return Run(run.path)


def _complete(result: ComparedRow) -> ComparedRow:
    metrics = {"settling": 1.0, "steady_state": 1e-4} | result.simulation.metrics
    return replace(result, repeated=Repeated.once(replace(result.simulation, metrics=metrics)))


def test_the_page_is_one_file_that_asks_for_nothing(compared: Run) -> None:
    text = compared.file("report.html").read_text()
    asked = re.findall(r"""(?:src|href|action)\s*=\s*["']([^"']+)|url\(([^)]+)\)|@import""", text)
    assert all(address.startswith(("#", "data:")) for pair in asked for address in pair if address)
    assert "default-src 'none'" in text and len(text) < 5e6


def test_what_users_write_is_text_on_the_page_and_no_markup(compared: Run) -> None:
    text = compared.file("report.html").read_text()
    assert MARKUP not in text and "&lt;b&gt;bold" in text


def test_the_report_does_not_count_as_a_result(compared: Run) -> None:
    assert "report.html" not in {each.path for each in compared.manifest.outputs}
    assert "  report.html\n" in compared.file("SHA256SUMS").read_text()
    compared.check()


def test_figures_share_no_ids(compared: Run) -> None:
    ids = re.findall(r'\sid="([^"]+)"', compared.file("report.html").read_text())
    assert len(ids) == len(set(ids))


def test_a_page_that_fails_costs_nothing_but_itself(tmp_path: Path) -> None:
    with start_run("train", Study(), "", tmp_path, page=lambda *_: str(1 / 0)) as live:
        live.metric("rmse", 1.0)
    run = Run(live.path)
    assert run.state == "ok" and not (run.path / "report.html").exists()
    assert "report.html could not be drawn: ZeroDivisionError" in run.file("console.log").read_text()


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [390, 1280], ids=["phone", "desktop"])
def test_a_browser_shows_the_page_without_an_error_or_a_request(
    browser: Any, compared: Run, width: int, dark: bool
) -> None:
    file = compared.file("report.html")
    browser.open(file, width, dark)
    browser.run(
        "document.getElementById('instant').value = 300;"
        "document.getElementById('instant').dispatchEvent(new Event('input'))"
    )
    browser.screenshot(KEPT / f"compare-{width}-{'dark' if dark else 'light'}.png")
    assert browser.console() == []
    assert set(browser.requests()) == {file.as_uri()}
    assert browser.run("return document.documentElement.scrollWidth") <= width, "nothing but tables scrolls sideways"
    ground = browser.run("return getComputedStyle(document.body).backgroundColor")
    assert (max(map(int, re.findall(r"\d+", ground))) < 64) == dark


CONTRASTS = """
const parse = text => { const c = text.match(/[\\d.]+/g).map(Number); return c.length < 4 ? [...c, 1] : c; };
const light = c => c.slice(0, 3).map(v => v / 255).map(v => v <= .03928 ? v / 12.92 : ((v + .055) / 1.055) ** 2.4)
  .reduce((sum, v, k) => sum + v * [.2126, .7152, .0722][k], 0);
const ground = e => {
  for (; e; e = e.parentElement) { const c = parse(getComputedStyle(e).backgroundColor); if (c[3] === 1) return c; }
};
const written = [...document.querySelectorAll('main *')].filter(e => !e.closest('.drawn, svg, option, script') &&
  [...e.childNodes].some(n => n.nodeType === 3 && n.textContent.trim()) && e.getClientRects().length);
return written.map(e => { const [a, b] = [parse(getComputedStyle(e).color), ground(e)].map(light);
  return [(Math.max(a, b) + .05) / (Math.min(a, b) + .05), e.outerHTML.slice(0, 80)]; });
"""
"""Contrast of each text with its ground, as WCAG 2 reckons it, and the beginning of its element."""

CUT = """
document.querySelectorAll('details').forEach(each => { each.open = true; });
return [...document.querySelectorAll('main *')].filter(e => !e.closest('.wide, pre, svg, select, [hidden]') &&
  getComputedStyle(e).display !== 'inline' && e.scrollWidth > e.clientWidth + 1).map(e => e.outerHTML.slice(0, 120));
"""
"""Elements that hold more than their width, beside those that scroll."""


@pytest.mark.parametrize("dark", [False, True], ids=["light", "dark"])
@pytest.mark.parametrize("width", [400, 1280], ids=["phone", "desktop"])
def test_every_text_is_legible_and_none_is_cut(browser: Any, compared: Run, width: int, dark: bool) -> None:
    """4.5 to 1 is what WCAG 2 asks of text (level AA)."""
    for file, name in ((compared.file("report.html"), "one"), (compared.path.parent / "two.html", "two")):
        if name == "two":
            file.write_text(several_page([compared, compared]))
        browser.open(file, width, dark)
        found = browser.run(CONTRASTS)
        assert len(found) > 10 and min(found)[0] >= 4.5, min(found)
        assert browser.run(CUT) == []
        assert browser.run("return document.documentElement.scrollWidth") <= width, "folded tables too"


@pytest.mark.parametrize("width", [400, 1280])
def test_the_wrist_and_its_angle_fill_the_card_and_figures_scale(browser: Any, compared: Run, width: int) -> None:
    browser.open(compared.file("report.html"), width, False)
    read = "const r = s => document.querySelector(s).getBoundingClientRect(); "
    card, drawings, figure = browser.run(read + "return ['#animation', '#wrists', 'figure img'].map(s => r(s).width)")
    assert drawings > card - 60 and figure <= width
    (cut,) = {
        browser.run("return [...document.querySelectorAll('#wrists .plot')].filter(p => p.clientHeight < 40).length")
    }
    assert cut == 0


@pytest.mark.parametrize("width", [390, 1280], ids=["phone", "desktop"])
def test_a_long_line_of_an_answer_is_not_cut_off_at_the_edge(browser: Any, tmp_path: Path, width: int) -> None:
    with start_run("train", Study(), "", tmp_path, [], page=lambda path, man, _: page(Run(path), man)) as live:
        live.file(OVERVIEW).write_text(Overview(["hardly moves, and why " * 20]).text())
    browser.open(Run(live.path).file("report.html"), width, False)
    wide = "const a = document.querySelector('#answer'); return a.scrollWidth - a.clientWidth"
    assert browser.run(wide) <= 0


def test_a_table_sorts_by_number_and_back(browser: Any, compared: Run) -> None:
    browser.open(compared.file("report.html"), 1280, False)
    press = "document.querySelectorAll('table.sortable')[0].querySelectorAll('th button')[2].click();"
    read = f"return {TABLE_ROWS}.map(row => row.cells[2].dataset.value || '-')"
    rising, falling = browser.run(press + read), browser.run(press + read)
    numbers = [float(text) for text in rising if text != "-"]
    assert numbers == sorted(numbers) and len(numbers) == 17 and falling == rising[::-1]


def test_rows_that_contain_all_words_stay_and_a_keyboard_reaches_everything(browser: Any, compared: Run) -> None:
    browser.open(compared.file("report.html"), 390, False)
    typed = "const i = document.querySelector('.filter input'); i.value = 'jerk smc/tuned 2';"
    typed += "i.dispatchEvent(new Event('input'));"
    typed += f"return {TABLE_ROWS}.filter(row => !row.hidden).map(row => row.textContent)"
    (left,) = browser.run(typed)
    assert "smc/tuned" in left and "minimum jerk 2 s" in left
    unreachable = (
        "return [...document.querySelectorAll('button, input, select, summary, .wide')]"
        ".filter(e => e.tabIndex < 0).map(e => e.outerHTML)"
    )
    assert browser.run(unreachable) == []


def test_the_wrist_bends_as_it_was_logged_and_the_animation_runs(browser: Any, compared: Run) -> None:
    browser.open(compared.file("report.html"), 1280, False)
    groups = browser.run("return [...document.getElementById('group').options].map(option => option.value)")
    references = ("step 30 deg", "minimum jerk 1 s 30 deg", "minimum jerk 2 s 30 deg")
    assert groups == [f"four-segments, {name}" for name in references]
    read = "return [...document.querySelectorAll('#wrists > div')].map(panel => panel.lastChild.textContent)"
    seek = "const s = document.getElementById('instant'); s.value = 1000; s.dispatchEvent(new Event('input'));"
    panels = browser.run(seek + read)
    rested = "29.8°, wanted 30.0°"
    assert panels == [rested, "diverged", *[rested] * 4]
    other = "const g = document.getElementById('group'); g.selectedIndex = 1; g.dispatchEvent(new Event('change'));"
    assert browser.run(other + seek + read) == [rested] * 6
    clock = "return parseFloat(document.getElementById('clock').textContent)"
    pressed = browser.run("document.getElementById('play').click(); return document.getElementById('play').textContent")
    assert pressed == "Pause"
    deadline = time.monotonic() + 30.0  # however slow the machine: it begins anew and goes on
    seen = [browser.run(clock)]
    while min(seen) > 4.5 and time.monotonic() < deadline:
        seen.append(browser.run(clock))
    assert min(seen) <= 4.5
    while seen[-1] <= min(seen) and time.monotonic() < deadline:
        seen.append(browser.run(clock))
    assert seen[-1] > min(seen)
    assert browser.console() == []


@pytest.mark.slow
def test_two_runs_on_one_page_show_only_what_differs(browser: Any, tmp_path: Path) -> None:
    runs = []
    for epochs in (5, 6):
        with start_run("train", Study(train=TrainSettings(epochs=epochs)), f"of-{epochs}", tmp_path) as live:
            live.metric("rmse", 1.0 / epochs, "rad", "lower")
        runs.append(Run(live.path))
    file = tmp_path / "two.html"
    file.write_text(several_page(runs))
    browser.open(file, 1280, False)
    rows = browser.run("return [...document.querySelectorAll('tbody tr')].map(row => row.innerText)")
    told = [["train.epochs", "5", "6"], ["RMSE", "deg", f"{math.degrees(1 / 5):.4g}", f"{math.degrees(1 / 6):.4g}"]]
    assert [row.split("\t") for row in rows[:2]] == told
    assert browser.console() == []
