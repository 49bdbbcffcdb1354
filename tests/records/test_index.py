"""One line about each run, from the runs or from what was noted of them."""

from __future__ import annotations

import json
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, start_run
from wristctl.records.index import INDEX, IndexEntry, indexed, run_names

Make = Callable[..., Run]


def test_a_line_says_what_a_run_is_how_it_ended_and_what_it_read(make: Make, results: Path) -> None:
    data = make(value=0.5, label="a")
    with pytest.raises(UserError), start_run("train", Study(), "b", results, inputs=[InputRun("data", data)]) as live:
        raise UserError("the wrist buckles")
    for _ in range(2):  # read from the runs, then from the index
        first, last = indexed(results)
        timing = data.manifest.timing
        assert first == IndexEntry(
            data.id, "gen-data", "a", "ok", timing.started, timing.wall_s, "", {"rmse": 0.5}, units={"rmse": "rad"}
        )
        assert (last.id, last.kind, last.label, last.state) == (live.id, "train", "b", "failed")
        assert (last.note, last.metrics, last.inputs) == ("the wrist buckles", {}, [data.id])
    assert (first.value("rmse"), first.value("kind"), first.value("none")) == (0.5, "gen-data", None)


def test_the_index_holds_the_runs_that_have_ended_and_is_written_when_they_change(make: Make, results: Path) -> None:
    run = make()
    (results / "20200101T000000Z-tune-broken").mkdir()
    with start_run("tune", Study(), "", results):
        assert [each.state for each in indexed(results)] == ["broken", "ok", "running"]
        assert list(json.loads((results / INDEX).read_text())["runs"]) == [run.id]
    (results / INDEX).write_text((results / INDEX).read_text() + " ")
    assert len(indexed(results, renew=False)) == 3 and (results / INDEX).read_text().endswith(" ")
    indexed(results)
    written = (results / INDEX).read_text()
    assert len(json.loads(written)["runs"]) == 2
    (results / INDEX).write_text(written + " ")
    indexed(results)
    assert (results / INDEX).read_text() == written + " ", "nothing has changed: nothing is written"


def test_an_index_of_another_make_is_not_believed(make: Make, results: Path) -> None:
    make(label="a")
    indexed(results)
    index = json.loads((results / INDEX).read_text())
    ((_, entry),) = index["runs"].values()
    entry["label"] = "noted"
    (results / INDEX).write_text(json.dumps(index))
    assert [each.label for each in indexed(results)] == ["noted"], "a sealed run is not read again"
    for other in ({"schema": "wristctl.index/0"}, {"fields": ["id"]}):
        (results / INDEX).write_text(json.dumps({**index, **other}))
        assert [each.label for each in indexed(results)] == ["a"]


@pytest.mark.parametrize(
    "put",
    [lambda file: file.write_text("[" * 100_000), os.mkfifo, lambda file: file.symlink_to("/dev/zero"), Path.mkdir],
    ids=["nested", "a pipe", "a device", "a folder"],
)
def test_an_index_that_cannot_be_read_costs_nothing(make: Make, results: Path, put: Callable[[Path], object]) -> None:
    run = make()
    put(results / INDEX)
    assert [entry.id for entry in indexed(results)] == [run.id]


def test_a_run_that_cannot_be_read_is_dated_by_its_name(results: Path) -> None:
    for name in ("20260102T030405Z-tune-x", "20260102T030405-tune", "mine"):
        (results / name).mkdir(parents=True)
    assert [(each.started, each.kind, each.state, each.wall_s) for each in indexed(results)] == [
        ("", "-", "broken", None),
        ("2026-01-02T03:04:05+00:00", "-", "broken", None),
        ("", "-", "broken", None),
    ]


WRONG = ('"value": "1"', '"value": 1, "unit": 3', '"value": 1, "better": [1]', '"value": 1, "interval": [0, 1, 2]')
DAMAGED = ['{"a": 1}', *(f'{{"b": {{"value": 1, "unit": "s"}}, "a": {{{entry}}}}}' for entry in WRONG)]


@pytest.mark.parametrize(
    ("metrics", "note"), [*((text, "no table of metrics") for text in DAMAGED), ("{", "not valid JSON")]
)
def test_a_run_with_damaged_metrics_is_broken_and_says_so(make: Make, results: Path, metrics: str, note: str) -> None:
    (make().path / "metrics.json").write_text(metrics)
    (entry,) = indexed(results)
    assert entry.state == "broken" and note in entry.note


def test_runs_are_folders_that_are_not_hidden_in_the_order_of_their_names(results: Path) -> None:
    assert run_names(results) == []
    for name in ("c", ".b", "a", "d", "b"):
        (results / name).mkdir(parents=True)
    (results / "file").touch()
    assert run_names(results) == ["a", "b", "c", "d"]
    with pytest.raises(UserError, match="cannot read the results folder"):
        run_names(results / "file")
