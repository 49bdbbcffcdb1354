"""Runs are found by what they are, and quickly."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run, open_run, start_run
from wristctl.records.index import INDEX
from wristctl.records.query import entries, in_order, select
from wristctl.records.tags import change_tags

Make = Callable[..., Run]


def _labels(found: list) -> list[str]:
    return [each.label for each in found]


def test_filters_and_order_choose_what_they_say(make: Make, results: Path) -> None:
    make("train", 3e-3, "a")
    make("train", 5e-4, "b")
    make("tune", 1e-5, "c")
    with pytest.raises(RuntimeError), start_run("tune", Study(), "failed", results):
        raise RuntimeError("by hand")
    found = entries(results)
    assert _labels(select(found, kind="train")) == ["a", "b"]
    assert _labels(select(found, label="f*")) == _labels(select(found, state="failed")) == ["failed"]
    assert _labels(select(found, where=["rmse<1e-3"])) == ["b", "c"]
    assert _labels(select(found, where=["rmse < 1e-3", "rmse>=5e-4"])) == ["b"]
    assert _labels(in_order(found, "rmse")) == ["c", "b", "a", "failed"]
    assert len(select(found, newer="1h")) == 4 and len(select(found, older="1h")) == 0


@pytest.mark.parametrize(
    ("condition", "said"),
    [("rmse", "not a condition"), ("rmse<small", "not a condition"), ("rmes<1", "did you mean 'rmse'")],
)
def test_a_condition_that_cannot_be_meant_is_an_error(make: Make, results: Path, condition: str, said: str) -> None:
    make()
    with pytest.raises(UserError, match=said):
        select(entries(results), where=[condition])


@pytest.mark.parametrize("age", ["yesterday", "2", "1.2.3h", ".d", "99999999w"])
def test_an_age_that_cannot_be_meant_is_an_error(make: Make, results: Path, age: str) -> None:
    make()
    with pytest.raises(UserError, match="not an age"):
        select(entries(results), newer=age)


def test_the_index_changes_no_answer_and_may_be_lost_or_damaged(make: Make, results: Path) -> None:
    make(label="a")
    first = entries(results)
    assert (results / INDEX).is_file()
    for content in (None, b"", b"{", b'{"schema": "other"}', b"[]"):
        (results / INDEX).unlink() if content is None else (results / INDEX).write_bytes(content)
        assert entries(results) == first
    (results / INDEX).unlink()
    (results / INDEX).mkdir()
    assert entries(results) == first


def test_a_run_that_is_damaged_after_it_was_indexed_is_seen_as_damaged(make: Make, results: Path) -> None:
    run, torn = make(label="a"), make(label="b")
    entries(results)
    (run.path / "SHA256SUMS").unlink()
    (torn.path / "run.json").write_text("{")
    assert [each.state for each in entries(results)] == ["crashed", "broken"]


def test_a_sealed_run_is_listed_without_being_read_again(make: Make, results: Path) -> None:
    run = make(label="a")
    indexed, latest = entries(results), open_run("latest:gen-data", results)
    for name in ("run.json", "metrics.json", "SHA256SUMS"):
        file, about = run.path / name, (run.path / name).stat()
        file.write_bytes(bytes(about.st_size))
        os.utime(file, ns=(0, about.st_mtime_ns))
    assert entries(results) == indexed and open_run("latest:gen-data", results).id == latest.id
    os.utime(run.path / "run.json", ns=(0, about.st_mtime_ns + 1_000_000_000))
    assert [each.state for each in entries(results)] == ["broken"]


@pytest.mark.skipif(not os.environ.get("WRISTCTL_THOROUGH"), reason="long: make test-trust")
def test_ten_thousand_runs_list_in_the_time_a_person_waits(make: Make, results: Path) -> None:
    run, count = make(), 10_000
    texts = {name: run.file(name).read_text() for name in ("run.json", "SHA256SUMS", "metrics.json")}
    for number in range(1, count):
        path = results / f"20260101T000000Z-gen-data-{number:06d}"
        path.mkdir()
        for name, text in texts.items():
            (path / name).write_text(text)

    def seconds(ask: Callable[[Path], object]) -> float:
        began = time.process_time()
        found = ask(results)
        took = time.process_time() - began
        assert isinstance(found, Run) or len(found) == count  # type: ignore[arg-type]
        return took

    without = seconds(entries)
    listed = min(seconds(entries) for _ in range(3))
    latest = min(seconds(lambda folder: open_run("latest:gen-data", folder)) for _ in range(3))
    print(f"{count} runs: {without:.2f} s without the index, {listed:.2f} s with it, {latest:.2f} s for the latest")
    assert without < 20.0 and max(listed, latest) < 2.0


def test_tags_stand_beside_the_sealed_run(make: Make, results: Path) -> None:
    run = make()
    assert change_tags(results, run.id, ["paper", "best"]) == ["best", "paper"]
    assert change_tags(results, run.id, remove=["best"]) == ["paper"]
    assert [each.tags for each in select(entries(results), tag="paper")] == [["paper"]]
    assert run.problems() == []
    assert json.loads((results / "tags.json").read_text()) == {run.id: ["paper"]}
    with pytest.raises(UserError, match="a tag holds"):
        change_tags(results, run.id, ["two words"])
