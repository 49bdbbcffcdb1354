"""Runs made by strangers: nothing in them runs in a report, and nothing moves a terminal's cursor."""

from __future__ import annotations

import json
import sys
import tempfile
from pathlib import Path
from typing import Any

import pytest

from tests.plotting.browser import Browser
from wristctl.cli.app import main
from wristctl.config.study import Study
from wristctl.plotting.page import page
from wristctl.plotting.several_page import several_page
from wristctl.records import InputRun, Run, start_run
from wristctl.records.seal import write_seal

DO = "document.title='PWNED';window.PWNED=1"
STRINGS = [
    text.replace("DO", DO) for text in json.loads((Path(__file__).parents[1] / "data" / "injections.json").read_text())
]
SVG = f"""<svg xmlns="http://www.w3.org/2000/svg" onload="{DO}" viewBox="0 0 9 9"><script>{DO}</script>
<foreignObject width="9" height="9"><body xmlns="http://www.w3.org/1999/xhtml"><script>{DO}</script></body>
</foreignObject>
<image href="x" onerror="{DO}"/><text>shown</text></svg>"""


@pytest.fixture(scope="module")
def foreign(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A sealed run in which every text that its maker chooses is one of the strings."""
    out = tmp_path_factory.mktemp("foreign") / "results"
    with start_run("gen-data", Study(), "", out) as data:
        pass
    with start_run("tune", Study(), "", out, ["wristctl", *STRINGS[:5]], [InputRun("data", Run(data.path))]) as live:
        live.metric("rmse", 1.0, "rad", "lower")
        live.file("tables.json").write_text("[]")
        live.file("figures/plot.svg").write_text(SVG)
    clean = [text.replace("\x00", "").replace("\ud83d", "") for text in STRINGS]
    manifest = json.loads((live.path / "run.json").read_text())
    manifest.update(label=clean[0], argv=clean, error={"type": clean[3], "what": clean[4], "where": clean[5]})
    manifest["numerics"] = {text: text for text in clean}
    manifest["environment"]["cpu"] = manifest["code"]["commit"] = clean[9]
    manifest["timing"]["started"] = clean[10]
    names = [text.replace("..", "").lstrip("/") for text in clean]
    manifest["outputs"] += [{"path": name, "sha256": "0" * 64, "bytes": 1} for name in names]
    metrics = {text: {"value": 1.0, "unit": text, "better": text, "n": 1, "meaning": text} for text in clean}
    tables = [{"title": text, "columns": [text], "rows": [[text]]} for text in clean]
    for name, content in (("run.json", manifest), ("metrics.json", metrics), ("tables.json", tables)):
        (live.path / name).write_text(json.dumps(content))
    (live.path / "figures" / f"<img onerror={DO.replace('/', '')}>.svg").write_text(SVG)
    (live.path / "figures" / "\x1b[2J\nforged.svg").write_text(SVG)
    write_seal(live.path, {})
    return Run(live.path)


@pytest.mark.parametrize("many", [False, True], ids=["one run", "several runs"])
def test_no_script_of_a_foreign_run_runs_in_a_report(
    browser: Browser, foreign: Run, tmp_path: Path, many: bool
) -> None:
    assert len(STRINGS) >= 50
    file = tmp_path / "report.html"
    text = several_page([foreign, foreign]) if many else page(foreign, foreign.manifest)
    file.write_text(text, encoding="utf-8")
    browser.open(file, 1280, False)
    press = "for (const each of document.querySelectorAll('button, summary')) each.click();"
    found: Any = browser.run(f"{press} return [window.PWNED || 0, document.title, document.images.length]")
    assert found[0] == 0 and found[1] != "PWNED" and found[2] >= 3
    loaded = browser.run("return [...document.images].filter(each => each.naturalWidth > 0).length")
    assert loaded == found[2], "the figures are shown all the same"
    assert {each for each in browser.requests() if not each.startswith("data:")} == {file.as_uri()}


def test_a_script_that_is_not_the_pages_own_would_not_run(browser: Browser, foreign: Run, tmp_path: Path) -> None:
    """The second line of defence: even markup that got into the page."""
    file = tmp_path / "report.html"
    text = page(foreign, foreign.manifest).replace("<main>", f"<main><script>{DO}</script><img src=x onerror={DO}>")
    file.write_text(text, encoding="utf-8")
    browser.open(file, 1280, False)
    assert browser.run("return window.PWNED || 0") == 0


@pytest.mark.parametrize("many", [False, True], ids=["one run", "several runs"])
def test_a_page_that_is_looked_at_in_a_terminal_moves_nothing(foreign: Run, many: bool) -> None:
    text = several_page([foreign, foreign]) if many else page(foreign, foreign.manifest)
    assert {each for each in text if not each.isprintable()} == {"\n"}


VERBS = [
    ["ls"], ["ls", "--columns", "id,about,label,started"], ["show", "RUN"], ["table", "RUN"],
    ["table", "RUN", "--latex"],
    ["lineage", "RUN"], ["diff", "RUN", "DATA"], ["diff", "DATA", "RUN"], ["verify"], ["replay", "RUN"],
    ["tag", "RUN", "a\x1bb"], ["rm", "\x1b[2J"], ["gc"], ["report", "\x1b[2J\n"],
]  # fmt: skip


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
@pytest.mark.slow
def test_no_verb_prints_a_control_character(
    foreign: Run, verb: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    (data,) = (each.name for each in foreign.path.parent.iterdir() if "gen-data" in each.name)
    names = {"RUN": foreign.id, "DATA": data}
    given = [names.get(each, each) for each in verb]
    monkeypatch.setattr(sys, "argv", ["wristctl", "runs", *given, "--out", str(foreign.path.parent)])
    with pytest.raises(SystemExit) as ended:
        main()
    out, err = capsys.readouterr()
    assert ended.value.code in (0, 2, 3), err
    assert "bug in wristctl" not in err and (out or err)
    assert [each for each in out + err if not each.isprintable() and each != "\n"] == []
