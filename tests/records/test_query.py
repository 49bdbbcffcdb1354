"""Runs are found by what they are, and quickly."""

from __future__ import annotations

import json
import os
import re
import resource
import subprocess
import sys
import time
from collections.abc import Callable
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, open_run, start_run
from wristctl.records.find import entries, in_order, select
from wristctl.records.index import INDEX, IndexEntry
from wristctl.records.tags import change_tags

Make = Callable[..., Run]


def _labels(found: list[IndexEntry]) -> list[str]:
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


def _entry(label: str, ago: timedelta | None = None, **more: Any) -> IndexEntry:
    started = (datetime.now(UTC) - ago).isoformat(timespec="microseconds") if ago else ""
    facts = {"kind": "tune", "state": "ok", "wall_s": 1.0, "note": "", **more}
    return IndexEntry(f"id-{label}", label=label, started=started, **facts)


@pytest.mark.parametrize(
    ("age", "unit"),
    [
        ("90s", timedelta(seconds=90)),
        ("30m", timedelta(minutes=30)),
        ("12h", timedelta(hours=12)),
        ("2d", timedelta(days=2)),
        ("1.5w", timedelta(days=10.5)),
    ],
)
def test_newer_runs_are_those_begun_since_and_older_ones_those_begun_before(age: str, unit: timedelta) -> None:
    found = [_entry("old", unit * 1.1), _entry("new", unit * 0.9), _entry("broken", state="broken")]
    assert _labels(select(found, newer=age)) == ["new"]
    assert _labels(select(found, older=age)) == ["old"]
    assert _labels(select(found, newer=age, older=age)) == []
    between = [*found, _entry("ancient", unit * 100)]
    assert _labels(select(between, older="1s", newer=age)) == ["new"]


@pytest.mark.parametrize(
    ("sign", "chosen"),
    [("<", "a"), ("<=", "ab"), (">", "c"), (">=", "bc"), ("=", "b"), ("==", "b"), ("!=", "ac")],
)
def test_a_condition_means_what_its_sign_says(sign: str, chosen: str) -> None:
    values = {"a": -1e-3, "b": 2e-3, "c": 3.0, "none": None}
    found = [_entry(name, metrics={"rmse": value}) for name, value in values.items()]
    for text in (f"rmse{sign}2e-3", f"rmse {sign} 0.002"):
        assert _labels(select(found, where=[text])) == list(chosen)


def test_a_condition_holds_for_wall_time_too_and_never_for_text() -> None:
    found = [_entry("a", wall_s=1.0), _entry("b", wall_s=3.0), _entry("c", wall_s=None)]
    assert _labels(select(found, where=["wall_s>2"])) == ["b"]
    assert _labels(select(found, where=["kind>0"])) == []


def test_runs_are_sorted_by_rising_value_with_those_that_have_none_last() -> None:
    metrics = {"a": {"rmse": 2.0}, "b": {"rmse": -1.0}, "c": {"rmse": None}, "d": {}, "e": {"rmse": 0.0}}
    walls = {"a": 1.0, "b": 0.0, "c": 30.0, "d": None, "e": 4.0}
    found = [_entry(name, wall_s=walls[name], metrics=metrics[name]) for name in "abcde"]
    assert _labels(in_order(found, "rmse")) == ["b", "e", "a", "c", "d"]
    assert _labels(in_order(found, "wall_s")) == ["b", "a", "e", "c", "d"]
    assert _labels(in_order(found[::-1], "id")) == _labels(in_order(found[::-1], "label")) == list("abcde")
    with pytest.raises(UserError, match=r"no run has a metric 'rmes' - --sort rmes - fix: did you mean 'rmse'"):
        in_order(found, "rmes")


def test_tags_kinds_labels_and_states_choose_together() -> None:
    found = [_entry("a1", tags=["paper"]), _entry("a2"), _entry("b1", tags=["paper", "x"], kind="train")]
    assert _labels(select(found, tag="paper")) == ["a1", "b1"]
    assert _labels(select(found, tag="pape")) == []
    assert _labels(select(found, tag="paper", label="a*")) == ["a1"]
    assert _labels(select(found, kind="tr*")) == _labels(select(found, tag="x", state="ok")) == ["b1"]
    assert _labels(select(found, tag="x", state="failed")) == []


@pytest.mark.parametrize(
    ("condition", "typed", "chosen"),
    [
        ("rmse<0.05", False, "abc"),
        ("rmse<0.05", True, "ac"),
        ("rmse<0.05deg", False, "a"),
        ("rmse < 0.05 deg", True, "a"),
        ("rmse<1e-3rad", True, "a"),
        ("rmse>1e-3rad", False, "b"),
        ("wall_s>=1s", True, "abcd"),
    ],
)
def test_a_number_is_in_its_unit_or_else_in_that_of_files_or_of_what_is_read(
    condition: str, typed: bool, chosen: str
) -> None:
    """Of c, the metric has no unit."""
    units = {"rmse": "rad"}
    found = [_entry("a", metrics={"rmse": 5e-4}, units=units), _entry("b", metrics={"rmse": 2e-2}, units=units)]
    found += [_entry("c", metrics={"rmse": 3e-2}), _entry("d")]
    assert _labels(select(found, where=[condition], typed=typed)) == list(chosen)


@pytest.mark.parametrize(
    ("condition", "said"),
    [
        ("rmse", "not a condition"),
        ("rmse<small", "not a condition"),
        ("rmse<1.2.3", "not a condition"),
        ("rmse<1E-3 m", "no run has rmse in m .*rad or deg"),
        ("rmes<1", "did you mean 'rmse'"),
    ],
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


def test_a_damaged_run_that_is_restored_with_its_dates_is_listed_as_it_was(make: Make, results: Path) -> None:
    file = make().path / "run.json"
    whole, changed = file.read_bytes(), file.stat().st_mtime_ns
    for content, state in ((bytes(len(whole)), "broken"), (whole, "ok")):
        file.write_bytes(content)
        os.utime(file, ns=(0, changed))
        assert [each.state for each in entries(results)] == [state]


@pytest.mark.skipif(not os.environ.get("WRISTCTL_THOROUGH"), reason="long: make test-trust")
def test_twenty_thousand_runs_list_in_the_time_a_person_waits(make: Make, results: Path) -> None:
    run, count = make(), 20_000
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
    assert without < 40.0 and max(listed, latest) < 4.0

    command = [sys.executable, "-m", "wristctl", "runs", "verify", "--out", str(results)]
    began = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(command, capture_output=True, text=True)
    ended = resource.getrusage(resource.RUSAGE_CHILDREN)
    took = ended.ru_utime + ended.ru_stime - began.ru_utime - began.ru_stime
    print(f"verify of {count}: {took:.1f} s, at most {ended.ru_maxrss / 1024:.0f} MB")
    assert done.returncode == 3 and f"{count - 1} of {count} runs" in done.stderr  # made of one, by other names
    assert ended.ru_maxrss < 200 * 1024
    assert re.search(r"verifying: \d+ of 20000 runs, changed \d+, about \d+ (s|min) left", done.stderr)


def test_tags_stand_beside_the_sealed_run(make: Make, results: Path) -> None:
    run = make()
    assert change_tags(results, run.id, ["paper", "best"]) == ["best", "paper"]
    assert change_tags(results, run.id, remove=["best"]) == ["paper"]
    assert [each.tags for each in select(entries(results), tag="paper")] == [["paper"]]
    assert run.problems() == []
    assert json.loads((results / "tags.json").read_text()) == {run.id: ["paper"]}
    with pytest.raises(UserError, match="a tag holds"):
        change_tags(results, run.id, ["two words"])
