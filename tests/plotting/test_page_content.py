"""What stands on the page of a run: its headline, its metrics, its figures, where it comes from."""

from __future__ import annotations

import base64
import html
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.commands.answer import Answer
from wristctl.commands.compare.csv_data import frame
from wristctl.commands.printed_table import Table
from wristctl.comparison.combinations import ComparedRow
from wristctl.config.learning import TrainSettings
from wristctl.config.study import Study
from wristctl.plotting.page import LARGEST, blocks, figures, inline_figure, page
from wristctl.plotting.page_tables import shown_tables, tables
from wristctl.plotting.several_page import several_page
from wristctl.records import InputRun, Run, start_run
from wristctl.records.manifest import OVERVIEW, Overview, read_overview
from wristctl.simulation.repetitions import Repeated


def made(tmp_path: Path, metrics: dict[str, Any], unit: str = "N", better: Any = "lower", **files: Any) -> Run:
    with start_run("train", Study(), "", tmp_path, ["wristctl", "train", "--label", "a b"]) as live:
        for name, value in metrics.items():
            live.metric(name, value, unit if name != "other" else "s", better, meaning=f"says {name}")
        for name, content in files.items():
            live.file(f"{name}.json").write_text(json.dumps(content))
    return Run(live.path)


def page_of(run: Run) -> str:
    return page(run, run.manifest)


def cards(run: Run) -> list[tuple[str, str]]:
    found = re.findall(r'<div class="card"><p>(.*?)</p><p class="value">(\S+)', page_of(run))
    return [(name, value) for name, value in found]


def rows(text: str) -> list[list[str]]:
    """Cells of all rows of all tables."""
    lines = re.findall(r"<tr>(.*?)</tr>", text, re.DOTALL)
    cells = [re.findall(r"<td.*?>(.*?)</td>", line, re.DOTALL) for line in lines]
    return [[re.sub(r"<.*?>", "", cell).strip() for cell in each] for each in cells]


def test_a_command_says_which_metrics_head_its_page(tmp_path: Path) -> None:
    run = made(tmp_path, {f"m_{k}": float(k) for k in range(20)} | {"none": float("nan")})
    overview = Overview(cards=["m_7", "gone", "none", "m_3"])
    (run.path / OVERVIEW).write_text(overview.text())
    assert cards(run) == [("m 7", "7"), ("m 3", "3")], "what is not known is none"


def test_a_card_does_not_repeat_the_unit_beside_its_value_in_its_name(tmp_path: Path) -> None:
    run = made(tmp_path, {"tip_rmse_mm": 2.0, "r2": 0.5, "mm_of_it": 1.0}, "mm")
    assert cards(run) == [("tip RMSE", "2"), ("R^2", "0.5"), ("mm of it", "1")]


def test_every_table_has_a_name_of_its_own_and_every_head_a_word(tmp_path: Path) -> None:
    """Who cannot see the page goes through it by these names."""
    stored = [{"title": title, "columns": ["a", ""], "rows": [[k, "b"]]} for k, title in enumerate(("", "B", "C"))]
    run = made(tmp_path, {"x": 1.0}, tables=stored)
    answer = ["One.", "", "a  b", "-  -", "1  2", "", "a  b", "-  -", "3  4"]
    (run.path / OVERVIEW).write_text(Overview(answer).text())
    text = page_of(run)
    names = re.findall(r'role="region" aria-label="(.*?)"', text)
    assert len(names) >= 7 and len(set(names)) == len(names) and all(names)
    assert "></button>" not in text and '<th scope="col"></th>' not in text


def test_where_none_is_chosen_the_first_that_may_be_better_or_worse_head_it(tmp_path: Path) -> None:
    run = made(tmp_path, {"none": float("nan")} | {f"m_{k}": 12.0 - k for k in range(11)})
    assert cards(run) == [(f"m {k}", f"{12 - k}") for k in range(6)]
    plain = made(tmp_path / "b", {f"m_{k}": float(k) for k in range(20, 0, -1)}, better=None)
    assert [name for name, _ in cards(plain)] == [f"m {k}" for k in range(20, 14, -1)]


def test_the_answer_begins_the_page_then_metrics_overlays_and_one_table_before_all_else(tmp_path: Path) -> None:
    stored = [{"title": title, "columns": ["a"], "rows": [["b"]]} for title in ("All", "Folded")]
    run = made(tmp_path, {"rmse": 1.0}, tables=stored)
    folder = run.path / "figures"
    folder.mkdir()
    for name in ("alone", "b-late", "a-early", "first", "overlay-ideal", "angle"):
        (folder / f"{name}.svg").write_text(SVG)
    captions = {"first": "the answer drawn", "b-late": "comes <second>", "a-early": "", "undrawn": "drawn later"}
    captions |= {"overlay-ideal": "two courses", "angle": "the angle"}
    (run.path / OVERVIEW).write_text(Overview(["smc < pid", "", "holds"], "first", ["rmse"], captions).text())
    text = page_of(run)
    order = [
        "smc &lt; pid", "holds", 'class="card"', "the answer drawn", "two courses", "the angle", ">All<", "Folded",
        "comes &lt;second&gt;", "a early", "alone", "drawn later",
    ]  # fmt: skip
    places = [text.index(mark) for mark in order]
    assert places == sorted(places) and "<summary>Folded (1 row)</summary>" in text and "<summary>All" not in text
    assert f"wristctl runs report --all-figures {run.id}" in text
    assert [name for name, *_ in figures(run)] == ["first", "b-late", "a-early", "overlay-ideal", "angle", "alone"]


def badge(run: Run) -> tuple[str, str]:
    """Classes and words of the badge at the top of the page."""
    ((classes, words),) = re.findall(r'<span class="(state.*?)">(.*?)</span>', page_of(run))
    return classes, words


def test_the_badge_is_the_verdict_and_ok_only_where_nothing_is_wrong(tmp_path: Path) -> None:
    run = made(tmp_path, {"rmse": 1.0})
    (run.path / OVERVIEW).write_text(Overview().text())
    assert badge(run) == ("state ok", "ok")
    (run.path / OVERVIEW).write_text(Overview(marks=["does not arrive", "chatters"]).text())
    classes, words = badge(run)
    assert "ok" not in classes.split() and words == "does not arrive, chatters"
    run.manifest.state = "failed"
    assert badge(run) == ("state failed", "failed"), "what was not done has no verdict"


@pytest.mark.parametrize(
    "content", ["", "[]", "{", '{"answer": 3, "captions": [1], "cards": {"a": 1}}', '{"answer": [1], "marks": [2]}']
)
def test_an_overview_that_cannot_be_read_costs_nothing(tmp_path: Path, content: str) -> None:
    run = made(tmp_path, {"rmse": 1.0})
    (run.path / OVERVIEW).write_text(content)
    assert read_overview(run.path) == Overview() and cards(run) == [("RMSE", "1")]


def test_all_metrics_stand_in_a_table_with_unit_direction_and_meaning(tmp_path: Path) -> None:
    found = rows(page_of(made(tmp_path, {"rmse": 0.123456, "none": float("nan")})))
    assert ["rmse", "0.1235", "N", "lower", "1", "says rmse"] in found
    assert ["none", "-", "N", "lower", "1", "says none"] in found


def test_angles_are_in_degrees_in_cards_and_metrics_and_nothing_else_is(tmp_path: Path) -> None:
    for unit, factor, shown in (
        ("rad", 180.0 / np.pi, "deg"),
        ("rad s", 180.0 / np.pi, "deg s"),
        ("rad/s", 1.0, "rad/s"),
    ):
        run = made(tmp_path / shown.replace("/", ""), {"rmse": 0.25}, unit)
        text = page_of(run)
        assert cards(run) == [("RMSE", f"{0.25 * factor:.4g}")] and f"<small>{shown}</small>" in text
        assert ["rmse", f"{0.25 * factor:.4g}", shown, "lower", "1", "says rmse"] in rows(text)
        assert run.metrics["rmse"]["value"] == 0.25


def test_an_answer_is_paragraphs_a_table_by_its_rule_and_commands_to_copy() -> None:
    answer = Answer(
        "The first controller is best. " * 6,
        Table("", ("condition", "error [deg]", "not to be used"), [("on a rig", 0.5, "a, b"), ("ideal", None, "")]),
        ["Do not use b. " * 9, "$ wristctl tune a.yaml --set x=1"],
        "See report.html.",
    )
    sentence, table, note, command, more = blocks(answer.lines())
    assert sentence == {"kind": "text", "text": " ".join(("The first controller is best. " * 6).split())}
    assert table["columns"] == ["condition", "error [deg]", "not to be used"]
    assert table["rows"] == [["on a rig", "0.5", "a, b"], ["ideal", "-", ""]]
    assert note == {"kind": "text", "text": ("Do not use b. " * 9).strip()}
    assert command == {"kind": "command", "text": "wristctl tune a.yaml --set x=1"}
    assert more["text"] == "See report.html." and blocks([]) == [] and blocks(["", " "]) == []
    assert blocks(["a: 1", "    b"]) == [{"kind": "lines", "text": "a: 1\n    b"}], "indented lines stay lines"


def test_a_table_that_was_too_wide_for_a_terminal_is_one_on_a_page() -> None:
    wide = Table("", ("who", "first of them", "second of them", "third of them"), [("a", 1, 2, 3), ("b", 4, 5, 6)])
    text = wide.text(width=24)
    assert text.count("who") == 2, "it goes on below"
    (table,) = blocks(text.splitlines())
    assert table["columns"] == list(wide.columns)
    assert table["rows"] == [["a", "1", "2", "3"], ["b", "4", "5", "6"]]
    other = "\nc".join(text.rsplit("\nb", 1))
    assert [len(each["rows"]) for each in blocks(other.splitlines())] == [2, 2], "other rows are another table"


def test_heads_in_several_lines_are_those_of_one_table() -> None:
    lines = ["             feedforward's", "controller   [deg]", "----------  --------------", "pid-ff      0.22"]
    (table,) = blocks(lines)
    assert table == {"kind": "table", "columns": ["controller", "feedforward's [deg]"], "rows": [["pid-ff", "0.22"]]}


def test_a_page_shows_no_option_of_the_command_line_in_its_answer_or_titles(tmp_path: Path) -> None:
    told = [
        "It follows.",
        "",
        "All tables: --all. The gains, each a file:",
        "/x/gains/",
        "",
        "RMSE [deg]; * best, = tied; 4 more controllers: --all",
        "",
        "Every rank: `--all`, or",
        "/x/report.html.",
    ]
    stored = [{"title": "Ranks; ideal and push: --all", "columns": ["a"], "rows": [[1.0]]}]
    run = made(tmp_path, {"rmse": 1.0}, tables=stored)
    (run.path / OVERVIEW).write_text(Overview(told).text())
    text = page_of(run)
    answer = text[text.index('<section id="answer">') : text.index("<section", text.index('id="answer"'))]
    kept = ["It follows.", "The gains, each a file: /x/gains/", "RMSE [deg]; * best, = tied"]
    assert re.findall(r"<p.*?>(.*?)</p>", answer) == kept
    assert ">Ranks</caption>" in text


def test_a_table_of_the_answer_stands_once_and_a_long_one_is_folded(tmp_path: Path) -> None:
    answered = Answer("It follows.", Table("", ("who", "error [deg]"), [("a", 0.123456), ("b", 2.0)]), [], "")
    stored: list[dict[str, Any]] = [
        {"title": "", "columns": ["who", "error [deg]"], "rows": [["a", 0.123456], ["b", 2.0]]},
        {"title": "Others", "columns": ["who", "tension [N]"], "rows": [["a", 7.25], ["b", 3.0]]},
        {"title": "Long", "columns": ["k"], "rows": [[k] for k in range(13)]},
    ]
    run = made(tmp_path, {}, tables=stored)
    (run.path / OVERVIEW).write_text(Overview(answered.lines()).text())
    text = page_of(run)
    assert [row for row in rows(text) if row and row[0] == "a"] == [["a", "0.123"], ["a", "7.25"]]
    assert "<summary>Long (13 rows)</summary>" in text
    (run.path / OVERVIEW).write_text(Overview(["It follows."]).text())
    assert ["b", "2"] in rows(page_of(run)), "what the answer lacks stands below"


def test_errors_of_the_angle_come_before_delays_at_the_head_of_a_page(tmp_path: Path) -> None:
    with start_run("hw-run", Study(), "", tmp_path) as live:
        for name, unit, better in (("late", "s", "lower"), ("angle", "rad", ""), ("rmse", "rad", "lower")):
            live.metric(name, 0.5, unit, better)  # type: ignore[arg-type]
    assert [name for name, _ in cards(Run(live.path))] == ["RMSE", "late"]


def test_a_run_that_stopped_has_no_metrics_at_its_head(tmp_path: Path) -> None:
    run = made(tmp_path, {"late": 1.0})
    assert cards(run) == [("late", "1")]
    run.manifest.state = "interrupted"
    assert cards(run) == []


def test_an_angle_that_nobody_can_measure_is_small_in_every_place(tmp_path: Path) -> None:
    stored = [{"title": "T", "columns": ["metric", "value", "unit"], "rows": [["x", 1e-17, "rad"], ["y", 1e-17, "N"]]}]
    run = made(tmp_path, {"rmse": 1e-17}, "rad", tables=stored)
    assert cards(run) == [("RMSE", "&lt;0.001")]
    found = rows(page_of(run))
    assert ["x", "&lt;0.001", "deg"] in found and ["y", "1e-17", "N"] in found
    stored = [{"title": "T", "columns": ["quantity", "greatest"], "rows": [["error [deg]", 1e-17], ["x [mm]", 1e-17]]}]
    found = rows(page_of(made(tmp_path, {}, tables=stored)))
    assert ["error [deg]", "&lt;0.001"] in found and ["x [mm]", "1e-17"] in found, "a unit in the row's own name too"


def test_cells_are_words_whole_numbers_four_digits_or_a_dash(tmp_path: Path) -> None:
    cells: list[Any] = ["a<b", 123456, 1.23456, True, False, None]
    run = made(tmp_path, {}, tables=[{"title": "T", "columns": list("abcdef"), "rows": [cells]}])
    assert [html.unescape(each) for each in next(r for r in rows(page_of(run)) if "123456" in r)] == [
        "a<b", "123456", "1.235", "yes", "no", "-",
    ]  # fmt: skip


def test_the_page_says_what_the_run_came_from(tmp_path: Path) -> None:
    before = made(tmp_path, {"rmse": 1.0})
    with start_run("tune", Study(), "", tmp_path, ["wristctl", "tune", "a b"], [InputRun("network", before)]) as live:
        live.metric("rmse", 1.0)
    run = Run(live.path)
    text = page_of(run)
    found = {row[0]: html.unescape(row[1]) for row in rows(text) if len(row) == 2}
    manifest = run.manifest
    assert found["command"] == "wristctl tune 'a b'"
    assert found["input network"] == f"{before.id}, result {before.result_hash[:12]}"
    assert (found["configuration"], found["fingerprint"]) == (manifest.config_sha256, manifest.fingerprint)
    assert found["result"] == manifest.result_sha256 and found["python"] == manifest.environment.python
    assert manifest.code.tree_sha256[:12] in found["code"] and f"wristctl {manifest.code.version}" in found["code"]
    assert ("uncommitted changes" in found["code"]) == bool(manifest.code.commit and manifest.code.dirty)
    assert f"{manifest.environment.cores} cores" in found["machine"]
    assert re.fullmatch(r"\d+ MB, \d+\.\d s", found["memory, processor time"])
    assert f"numpy {manifest.environment.packages['numpy']}" in found["packages"] and found["numerics"] == "-"
    hashes = {row[0]: row for row in rows(text) if len(row) == 4}
    for each in manifest.outputs:
        assert hashes[each.path] == [each.path, str(each.bytes), each.sha256, "no" if each.volatile else "yes"]
    assert 'class="lineage"' in text and f"wristctl tune --config {run.id}/config.yaml" in text


SVG = (
    '<?xml version="1.0"?><!DOCTYPE svg PUBLIC "x"><svg width="9" xmlns="http://www.w3.org/2000/svg">'
    '<metadata>who</metadata><defs><style type="text/css">*{x}</style></defs><g id="one"><path id="p" '
    'd="M 1.23456 2.5\nL 0.125 3.1415926"/><use xlink:href="#p" y="1.23456"/><rect clip-path="url(#one)"/></g></svg>'
)


def shown(url: str) -> str:
    """The content of a data URL."""
    return base64.b64decode(url.partition("base64,")[2]).decode()


def test_a_figure_within_the_page_is_a_picture_with_two_decimals(tmp_path: Path) -> None:
    file = tmp_path / "a.svg"
    file.write_text(SVG)
    url = inline_figure(file)
    assert url.startswith("data:image/svg+xml;base64,")
    assert 'd="M 1.23 2.5 L 0.12 3.14"' in shown(url) and 'y="1.23456"' in shown(url)


@pytest.mark.parametrize(("more", "picture", "small"), [(0, True, True), (1, True, False), (1, False, True)])
def test_a_figure_that_is_too_large_is_shown_as_its_picture(
    tmp_path: Path, more: int, picture: bool, small: bool
) -> None:
    file = tmp_path / "a-b.svg"
    empty = "<svg ></svg>"
    file.write_text(f"<svg >{'x' * (LARGEST - len(empty) + more)}</svg>")
    if picture:
        file.with_suffix(".png").write_bytes(b"picture")
    data = base64.b64encode(b"picture").decode()
    found = inline_figure(file)
    assert shown(found).startswith("<svg") if small else found == f"data:image/png;base64,{data}"


def test_figures_come_by_name_and_a_link_is_no_figure(tmp_path: Path) -> None:
    run = made(tmp_path, {"rmse": 1.0})
    (run.path / "figures").mkdir(exist_ok=True)
    for name in ("b-c", "a"):
        (run.path / "figures" / f"{name}.svg").write_text(f"<svg >{name}</svg>")
    (run.path / "figures" / "secret.svg").symlink_to("/etc/hostname")
    assert [(caption, shown(url)) for _, caption, url in figures(run)] == [
        ("a", "<svg >a</svg>"),
        ("b c", "<svg >b-c</svg>"),
    ]


def test_several_runs_are_told_apart_from_the_first_in_columns_of_their_own(tmp_path: Path) -> None:
    runs = []
    for number, (epochs, rate) in enumerate([(5, 0.1), (6, 0.1), (5, 0.2)]):
        settings = Study(train=TrainSettings(epochs=epochs, learning_rate=rate))
        with start_run("train", settings, f"n{number}" if number else "", tmp_path) as live:
            live.metric("rmse", float(epochs), "rad", "lower")
        (live.path / "figures").mkdir(exist_ok=True)
        (live.path / "figures" / f"{'b' if number == 2 else 'a'}.svg").write_text(f"<svg >{number}</svg>")
        runs.append(Run(live.path))
    text = several_page(runs)
    found = rows(text)
    assert ["train.epochs", "5", "6", "5"] in found and ["train.learning_rate", "0.1", "0.1", "0.2"] in found
    assert ["RMSE", "deg", *(f"{np.degrees(value):.4g}" for value in (5, 6, 5))] in found
    assert (
        0 < text.index(">What differs<") < text.index(">Settings<") < text.index(">Metrics<") < text.index(">Findings<")
    )
    assert f"{runs[0].id} | n1 | n2" in text
    assert [row[:2] for row in found if row][-3:] == [[name, run.id] for name, run in zip("ABC", runs, strict=True)]
    assert [shown(url) for url in re.findall(r'src="(data:image/svg[^"]*)"', text)] == [
        "<svg >0</svg>",
        "<svg >1</svg>",
        "<svg >2</svg>",
    ]


def test_beside_each_other_headlines_come_first_and_settings_have_the_digits_that_people_read(tmp_path: Path) -> None:
    runs = []
    for rate in (0.1, 0.1 + 0.2):
        with start_run("train", Study(train=TrainSettings(learning_rate=rate)), "", tmp_path) as live:
            for name in ("ticks", "tip_rmse_mm", "late"):
                live.metric(name, rate, "mm")
            live.file(OVERVIEW).write_text(Overview(cards=["tip_rmse_mm"]).text())
        runs.append(Run(live.path))
    found = rows(several_page(runs))
    assert ["train.learning_rate", "0.1", "0.3"] in found
    names = [row[0] for row in found if row and row[1:2] == ["mm"]]
    assert names == ["tip RMSE", "ticks", "late"]


def test_tables_are_in_degrees_by_their_heads_and_by_their_rows_units(tmp_path: Path) -> None:
    stored: list[dict[str, Any]] = [
        {"title": "A", "columns": ["who", "RMSE [rad]", "rate [rad/s]"], "rows": [["a", 0.5, 2.0], ["b", None, 1.0]]},
        {"title": "B", "columns": ["metric", "value", "unit"], "rows": [["rmse", 0.5, "rad"], ["peak", 9.5, "N"]]},
        {
            "title": "C",
            "columns": ["name", "95 %", "unit"],
            "rows": [["turn", "-0.5 to 1e-3", "rad"], ["x", "-", "m"]],
        },
        {
            "title": "Told",
            "columns": ["recording", "value", "95 %", "unit"],
            "rows": [["7", "0.05825", "0.04951 to 0.06699", "rad"], ["8", "not identifiable", "", "rad"]],
        },
    ]
    run = made(tmp_path, {}, tables=stored)
    first, second, third, told = shown_tables(run)
    (printed,) = re.findall(r"^7 +(\S+) +(\S+) to (\S+) +deg", Table(*stored[-1].values()).text(), re.MULTILINE)
    (on_page,) = [cells[1:3] for cells in rows(page_of(run)) if cells[:1] == ["7"]]
    for value, low, high in (printed, (on_page[0], *on_page[1].split(" to "))):
        assert float(low) < float(value) < float(high), "a value lies within its interval"
    assert told["rows"][1] == ["8", "not identifiable", "", "deg"]
    assert told["rows"][0] == ["7", "3.337", "2.837 to 3.838", "deg"], "a value in words is in the unit of its interval"
    assert third["rows"] == [["turn", "-28.65 to 0.0573", "deg"], ["x", "-", "m"]], "a range is in its row's unit"
    assert first["columns"] == ["who", "RMSE [deg]", "rate [rad/s]"]
    assert first["rows"] == [["a", pytest.approx(90.0 / np.pi), 2.0], ["b", None, 1.0]]
    assert second["rows"] == [["rmse", pytest.approx(90.0 / np.pi), "deg"], ["peak", 9.5, "N"]]


def test_a_comparison_has_one_table_whose_rows_are_its_files(tmp_path: Path, results: list[ComparedRow]) -> None:
    """In place of one for each loop and motion, also of a loop with a comma in its name."""
    first, *others = [
        replace(
            row, repeated=Repeated.once(replace(row.simulation, metrics={"settling": 0.8} | row.simulation.metrics))
        )
        for row in results
    ]
    compared_rows = [replace(first, loop="camera, tendons"), *others]
    csv = frame(compared_rows, ())
    keys = list(dict.fromkeys(zip(csv.loop, csv.reference, strict=True)))
    stored = [
        {
            "title": f"Loop {loop}, {motion}",
            "columns": ["controller", "inverse", "RMSE [rad]", "fate"],
            "rows": [
                [f"{row.controller}/{row.gains}", row.inverse, row.rmse, f"{row.controller} on {loop}"]
                for row in csv[(csv.loop == loop) & (csv.reference == motion)].itertuples()
            ],
        }
        for loop, motion in keys
    ]
    stored.append({"title": "Control step", "columns": ["controller"], "rows": [["smc"]]})
    plain = json.loads(json.dumps(stored, default=float).replace("NaN", "null"))
    with start_run("compare", Study(), "", tmp_path, page=lambda path, man, _: page(Run(path), man)) as live:
        live.table("data/comparison.csv", csv, units={"rmse": "rad", "settling": "s"})
        live.file("tables.json").write_text(json.dumps(plain))
    one, step = shown_tables(Run(live.path))
    assert tables(Run(live.path)) == plain, "what is printed stays as it was stored"
    assert step == stored[-1] and one["columns"][:3] == ["loop", "motion", "controller"]
    assert len(keys) > 2 and len(one["rows"]) == len(csv) == len(results)
    by_head = [dict(zip(one["columns"], row, strict=True)) for row in one["rows"]]
    for shown, row in zip(by_head, csv.to_dict("records"), strict=True):
        assert (shown["loop"], shown["motion"]) == (row["loop"], row["reference"])
        assert shown["controller"] == f"{row['controller']}/{row['gains']}"
        assert shown["RMSE [deg]"] == pytest.approx(np.degrees(row["rmse"]), nan_ok=True)
        assert shown["settling [s]"] == 0.8 and shown["verdict"] == f"{row['controller']} on {row['loop']}"
    text = Run(live.path).file("report.html").read_text()
    place = one["columns"].index("RMSE [deg]") - 3  # after three columns of words
    lines = [line for line in re.findall(r"<tr>(.*?)</tr>", text, re.DOTALL) if " on " in line]
    on_page = [float(re.findall('data-value="(.*?)"', line)[place]) for line in lines]
    np.testing.assert_allclose(on_page, np.degrees(csv.rmse), rtol=1e-12)


def test_an_angle_that_nobody_can_measure_is_less_than_a_thousandth_of_a_degree(tmp_path: Path) -> None:
    heads = ["RMSE [rad]", "time [s]"]
    stored = [{"title": "T", "columns": heads, "rows": [[1e-7, 1e-7], [-1e-7, 0.5], [0.0, 1.0], [1e-3, 2.0]]}]
    found = rows(page_of(made(tmp_path, {}, tables=stored)))
    shown = [[html.unescape(cell) for cell in row] for row in found if len(row) == 2][:4]
    assert shown == [["<0.001", "1e-07"], ["<0.001", "0.5"], ["0", "1"], ["0.0573", "2"]]
