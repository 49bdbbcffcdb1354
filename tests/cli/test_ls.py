"""The listing of `wristctl runs ls`: its columns, and which runs it shows."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from tests.cli.conftest import Call
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, start_run
from wristctl.records.tags import change_tags


def _made(kind: str, label: str, chief: str = "", **metrics: float) -> Run:
    with start_run(kind, Study(), label) as live:
        for name, value in metrics.items():
            live.metric(name, value)
        if chief:
            live.file("overview.json").write_text(json.dumps({"cards": [chief]}))
    return Run(live.path)


@pytest.fixture
def runs(call: Call) -> list[Run]:
    """Three runs in results/, oldest first."""
    return [_made("tune", "a", rmse=2.0, bias=5.0), _made("train", "b", rmse=1.0), _made("tune", "c", rmse=3.0)]


def _rows(out: str) -> list[list[str]]:
    head, _, *rows = out.splitlines()
    return [head.replace("wall [s]", "wall").split(), *(row.split() for row in rows)]


def test_columns_are_those_that_hold_something_and_those_asked_for(call: Call, runs: list[Run]) -> None:
    plain = ["id", "kind", "state", "wall"]
    rows = _rows(call("runs", "ls")[1])
    assert rows[0] == plain and [row[:3] for row in rows[1:]] == [[run.id, run.kind, "ok"] for run in runs]
    assert "wall [s]" in call("runs", "ls")[1] and all(0.0 < float(row[3]) < 60.0 for row in rows[1:])
    assert _rows(call("runs", "ls", "--where", "rmse<9", "--where", "bias>1")[1])[0] == [*plain, "bias", "rmse"]
    rows = _rows(call("runs", "ls", "--sort", "rmse", "--reverse")[1])
    assert rows[0] == [*plain, "rmse"] and [row[-1] for row in rows[1:]] == ["3", "2", "1"]
    change_tags(Path("results"), runs[1].id, ["old", "best"])
    rows = _rows(call("runs", "ls")[1])
    assert rows[0] == [*plain, "tags"] and rows[2][4:] == ["best,", "old"]
    with pytest.raises(UserError), start_run("tune", Study(), "d"):
        raise UserError("buckled")
    assert _rows(call("runs", "ls")[1])[0] == [*plain, "tags", "note"]
    assert "buckled" in call("runs", "ls", "--state", "failed")[1]


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        ((), {"chief": ["rmse 0.5", "best 7"]}),
        (("--where", "rmse<2"), {"rmse": ["0.5"]}),
        (("--where", "rmse<2", "--where", "rmse>0"), {"rmse": ["0.5"]}),
        (("--where", "rmse<2", "--sort", "rmse"), {"rmse": ["0.5"]}),
        (("--sort", "rmse"), {"chief": ["best 7"], "rmse": ["0.5", "-"]}),
        (("--where", "rmse_move<2"), {"chief": ["rmse 0.5"], "rmse_move": ["1.5"]}),
        (("--sort", "kind"), {"chief": ["best 7", "rmse 0.5"]}),
        (("--columns", "rmse,best,rmse"), {"rmse": ["0.5", "-"], "best": ["-", "7"]}),
    ],
)
def test_a_metric_stands_once_in_each_row(call: Call, asked: tuple[str, ...], shown: dict[str, list[str]]) -> None:
    """In the column that was asked for, else as the chief metric of its run."""
    _made("simulate", "a", "rmse", rmse=0.5, rmse_move=1.5)
    _made("compare", "b", "best", best=7.0)
    head, rule, *rows = call("runs", "ls", *asked)[1].splitlines()
    spans = [found.span() for found in re.finditer("-+", rule)]
    table = {head[a:b].strip(): [text for row in rows if (text := row[a:b].strip())] for a, b in spans}
    shown_there = {name.removesuffix(" metric"): column for name, column in table.items()}
    assert {name: column for name, column in shown_there.items() if name not in PLAIN} == shown
    assert len(table) == len(spans), "no head stands twice"


PLAIN = ("id", "kind", "state", "wall [s]")


def test_metrics_stand_in_the_units_that_people_read(call: Call) -> None:
    for label, unit in (("angle", "rad"), ("time", "s")):
        with start_run("tune", Study(), label) as live:
            live.metric("best", 0.1, unit)
            live.metric("rmse", 0.1, "rad")
            live.metric("tip_mm", 0.1, "mm")
            live.metric("missing", 0.1, "1")
            live.file("overview.json").write_text(json.dumps({"cards": ["rmse"]}))
    assert [line[-13:] for line in call("runs", "ls")[1].splitlines()[2:]] == ["rmse 5.73 deg"] * 2
    listed = [
        line.split() for line in call("runs", "ls", "--columns", "label,best,rmse,tip_mm,missing")[1].splitlines()
    ]
    assert listed[0] == ["label", "best", "rmse", "[deg]", "tip_mm", "missing"]
    assert [row[1:] for row in listed[2:]] == [
        ["5.73", "deg", "5.73", "0.1", "0.1"],
        ["0.1", "s", "5.73", "0.1", "0.1"],
    ]
    assert call("runs", "ls", "--where", "rmse<5.7")[1] == "no runs in results that meet this\n"
    for asked in ("rmse<5.8", "rmse<5.8deg", "rmse<0.11rad"):
        head, *_ = call("runs", "ls", "--where", asked)[1].splitlines()
        assert head.endswith("rmse [deg]"), asked
    _, out, _ = call("runs", "ls", "--where", "rmse<5.8", "--json")
    (kept, _) = json.loads(out)["runs"]
    assert kept["metrics"]["rmse"] == 0.1 and kept["units"]["rmse"] == "rad", "programs read what files hold"


@pytest.mark.parametrize(
    ("asked", "shown"),
    [
        (("--kind", "tune"), [0, 2]),
        (("--label", "b"), [1]),
        (("--kind", "tune", "--label", "c"), [2]),
        (("--where", "rmse>=2"), [0, 2]),
        (("--reverse",), [2, 1, 0]),
        (("--newer", "1h", "--kind", "t*"), [0, 1, 2]),
    ],
)
def test_runs_are_chosen_by_what_was_asked(
    call: Call, runs: list[Run], asked: tuple[str, ...], shown: list[int]
) -> None:
    assert [row[0] for row in _rows(call("runs", "ls", *asked)[1])[1:]] == [runs[k].id for k in shown]


@pytest.mark.parametrize("columns", [60, 110])
def test_a_long_note_is_cut_to_the_terminal(call: Call, columns: int, monkeypatch: pytest.MonkeyPatch) -> None:
    """Where there is room; those that were asked for by name are whole, and so is what fits."""
    long, short = "the wrist buckles " * 20, "a tendon is slack"
    for label, why in (("a", long.strip()), ("b", short)):
        with pytest.raises(UserError), start_run("tune", Study(), label):
            raise UserError(why)
    monkeypatch.setenv("COLUMNS", str(columns))
    _, rule, first, second = call("runs", "ls")[1].splitlines()
    at = rule.rindex(" ") + 1
    assert max(len(rule), len(first), len(second)) == max(columns, at + 48)
    assert first.endswith("...") and long.startswith(first[at:-3]) and second[at:] == short
    assert long.strip() in call("runs", "ls", "--columns", "id,note")[1]
    monkeypatch.setenv("COLUMNS", "1000")
    assert long.strip() in call("runs", "ls")[1]


def test_where_there_is_none_that_is_said(call: Call) -> None:
    assert call("runs", "ls") == (0, "no runs in results\n", "")
    for asked in (("--kind", "x"), ("--label", "x"), ("--state", "failed"), ("--tag", "x"), ("--newer", "1h")):
        assert call("runs", "ls", *asked, "--out", "other") == (0, "no runs in other that meet this\n", ""), asked
