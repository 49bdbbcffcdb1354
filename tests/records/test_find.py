"""Runs are found by what people type, and what is not a run is said to be none."""

from __future__ import annotations

import logging
import shutil
from collections.abc import Callable
from pathlib import Path

import pandas as pd
import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, list_runs, open_run, require, start_run
from wristctl.records.find import Content
from wristctl.records.index import INDEX, indexed

Make = Callable[..., Run]


def test_a_run_is_found_by_path_id_prefix_and_kind(make: Make, results: Path) -> None:
    first, last = make(label="first"), make(label="last")
    assert open_run(first.path, results).path == first.path
    assert open_run(first.path / "run.json", results).path == first.path
    assert open_run(first.id, results).path == first.path
    assert open_run(first.id[: first.id.index("first") + 2], results).path == first.path
    assert open_run("latest:gen-data", results).path == last.path


def test_latest_alone_is_the_last_run_of_any_kind_that_ended_ok(
    make: Make, results: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with pytest.raises(UserError, match="no run that ended ok"):
        open_run("latest", results)
    make()
    with start_run("train", Study(), "", results) as other:
        pass
    assert open_run("latest", results).path == require("latest", "train", results).path == other.path
    with pytest.raises(RuntimeError), start_run("tune", Study(), "", results):
        raise RuntimeError
    with caplog.at_level(logging.INFO, "wristctl.records.find"):
        assert open_run("latest", results).path == other.path
    assert "the last tune run" in caplog.text
    assert make().path == open_run("latest", results).path


def test_latest_passes_over_runs_that_did_not_end_well(make: Make, results: Path) -> None:
    good = make()
    with pytest.raises(RuntimeError), start_run("gen-data", Study(), "", results):
        raise RuntimeError
    assert open_run("latest:gen-data", results).path == good.path


TIPS = Content("data/tips.csv", "table of tips")


def test_latest_is_the_last_that_holds_what_is_wanted_and_says_why_not_the_very_last(
    make: Make, results: Path, caplog: pytest.LogCaptureFixture
) -> None:
    def told() -> list[str]:
        with caplog.at_level(logging.INFO, "wristctl.records.find"):
            caplog.clear()
            found.append(require("latest:gen-data", "gen-data", results, TIPS).id)
        return caplog.messages

    found: list[str] = []
    make()
    with pytest.raises(
        UserError, match=r"no gen-data run that ended ok holds a table of tips .data/tips\.csv."
    ) as caught:
        require("latest:gen-data", "gen-data", results, TIPS)
    assert str(caught.value).endswith("fix: run `wristctl gen-data` again")
    with start_run("gen-data", Study(), "tips", results) as full:
        full.table("data/tips.csv", pd.DataFrame({"x": [1.0]}), units={"x": "m"}, meaning={"x": "tip"})
    assert told() == []
    without = make()
    assert told() == [f"the last gen-data run, {without.id}, holds no table of tips: {full.id} is taken"]
    with pytest.raises(RuntimeError), start_run("gen-data", Study(), "", results) as failed:
        raise RuntimeError("no light")
    assert told() == [f"the last gen-data run, {failed.id}, is failed (no light): {full.id} is taken"]
    assert found == [full.id] * 3
    with pytest.raises(UserError, match=f"the run holds no table of tips .data/tips.csv. - .*{without.id}"):
        require(without.id, "gen-data", results, TIPS)
    with pytest.raises(UserError, match=f"run is failed, not ok: no light - .*{failed.id}"):
        require(failed.id, "gen-data", results, TIPS)
    assert require(str(full.path), "gen-data", results, TIPS).id == full.id


def test_where_none_ended_well_the_last_that_did_not_is_named(make: Make, results: Path) -> None:
    make(label="other")
    for label in ("mine", "yours"):
        with pytest.raises(RuntimeError), start_run("gen-data", Study(), label, results):
            raise RuntimeError
    failed = {run.id.split("-")[3]: run.id for run in list_runs(results) if run.state == "failed"}
    for label, found in failed.items():
        with pytest.raises(UserError) as caught:
            open_run(f"latest:gen-data:{label}", results)
        assert str(caught.value).endswith(f"{found} (state: failed)")


def test_the_latest_is_the_one_that_began_last_whatever_it_is_called(make: Make, results: Path) -> None:
    first, last = make(label="a"), make(label="b")
    last.path.rename(results / "20200101T000000Z-gen-data-b")
    first.path.rename(results / "renamed")
    assert open_run("latest:gen-data", results).id == "20200101T000000Z-gen-data-b"


def test_the_latest_is_right_whatever_the_index_says(make: Make, results: Path) -> None:
    older, newer = make(label="older"), make(label="newer")

    def latest() -> str:
        return open_run("latest:gen-data", results).id

    assert latest() == newer.id and not (results / INDEX).exists(), "to look writes nothing"
    indexed(results)
    stale = (results / INDEX).read_bytes()
    newest = make(label="newest")
    assert latest() == newest.id
    shutil.rmtree(newest.path)
    assert latest() == newer.id
    for content in (stale, b"{", b'{"schema": "wristctl.index/1", "fields": [], "runs": 3}', None):
        (results / INDEX).unlink() if content is None else (results / INDEX).write_bytes(content)
        assert latest() == newer.id
    (newer.path / "SHA256SUMS").unlink()
    assert latest() == older.id
    (results / "tags.json").write_text("damaged")
    assert latest() == older.id


def test_what_cannot_be_found_is_named_with_a_cure(make: Make, results: Path) -> None:
    run = make()
    cases = {
        run.id[:4]: None,
        run.id[:-1] + "_": "did you mean",
        "latest:gen-dat": "did you mean 'gen-data'",
        "latest:tune": "no tune run",
        "results/absent": "no such run",
        "": "no such run",
    }
    make()
    for ref, said in cases.items():
        with pytest.raises(UserError) as caught:
            open_run(ref, results)
        assert (said or "begin like this") in str(caught.value)


def test_a_foreign_folder_or_manifest_is_refused(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="not a run directory"):
        open_run(tmp_path)
    for content in ("{", '{"schema": "other/1"}', "[]", "\xff"):
        (tmp_path / "run.json").write_text(content, encoding="latin-1")
        with pytest.raises(UserError, match="not a manifest"):
            open_run(tmp_path)


def test_a_broken_directory_is_listed_and_stops_nothing(make: Make, results: Path) -> None:
    run = make()
    (results / "20200101T000000Z-tune-broken").mkdir()
    (results / "20200101T000000Z-tune-torn").mkdir()
    (results / "20200101T000000Z-tune-torn" / "run.json").write_text('{"schema": "wristctl.run/1", ')
    assert [each.state for each in list_runs(results)] == ["broken", "broken", "ok"]
    assert open_run("latest:gen-data", results).path == run.path


def test_require_refuses_wrong_kind_bad_state_and_changed_files(make: Make, results: Path) -> None:
    run = make()
    assert require(run.id, "gen-data", results).path == run.path
    for kind, needed in (("train", "a train run"), ("analyse", "an analyse run")):
        with pytest.raises(UserError, match=f"a gen-data run where {needed} is needed"):
            require(run.id, kind, results)
    (run.path / "data" / "samples.csv").write_text("x\n1\n")
    with pytest.raises(UserError, match="hash does not match"):
        require(run.id, "gen-data", results)
    with pytest.raises(RuntimeError), start_run("train", Study(), "", results):
        raise RuntimeError
    failed = list_runs(results)[-1]
    with pytest.raises(UserError, match="run is failed, not ok"):
        require(failed.id, "train", results)


def _named(run: Run, stamp: str, kind: str = "gen-data", damaged: bool = False) -> str:
    """Gives the run's directory another name and date; returns the name."""
    name = f"{stamp}-{kind}-x"
    run.path.rename(run.path.with_name(name))
    if damaged:
        file = run.path.with_name(name) / "run.json"
        file.write_bytes(file.read_bytes()[:-9])
    return name


def test_a_damaged_run_is_the_latest_where_it_is_newer_and_of_that_kind(make: Make, results: Path) -> None:
    good = _named(make(), "20260102T000000Z")
    _named(make(), "20260101T000000Z", damaged=True)
    _named(make(), "20260103T000000Z", "tune", damaged=True)
    unsealed = _named(make(), "20260104T000000Z", damaged=True)
    (results / unsealed / "SHA256SUMS").unlink()
    assert open_run("latest:gen-data", results).id == good, "older, of another kind, or never sealed"
    damaged = _named(make(), "20260105T000000Z", damaged=True)
    assert open_run("latest:gen-data", results).id == damaged
    with pytest.raises(UserError, match="hash does not match"):
        require("latest:gen-data", "gen-data", results)


def test_the_only_run_of_a_kind_is_the_latest_though_it_is_damaged(make: Make, results: Path) -> None:
    damaged = _named(make(), "20260101T000000Z", damaged=True)
    assert open_run("latest:gen-data", results).id == damaged


def test_of_a_damaged_run_of_the_same_second_it_is_told(make: Make, results: Path) -> None:
    good = make()
    stamp = good.id.partition("-")[0]
    good.path.rename(results / f"{stamp}-gen-data-y")
    assert open_run("latest:gen-data", results).id == f"{stamp}-gen-data-y"
    damaged = _named(make(), stamp, damaged=True)
    assert open_run("latest:gen-data", results).id == damaged


def test_in_an_empty_folder_nothing_is_meant_and_of_many_three_are_named(make: Make, results: Path) -> None:
    with pytest.raises(UserError, match=r"no such run - x in .* - fix: name a path, or the results folder with"):
        open_run("x", results)
    ids = [_named(make(), f"2026010{day}T000000Z") for day in range(1, 5)]
    with pytest.raises(UserError) as caught:
        open_run("2026", results)
    assert str(caught.value) == f"4 runs begin like this - 2026 - fix: write more of it: {', '.join(ids[:3])}"
    with pytest.raises(UserError, match=f"no such run - .* - fix: did you mean '{ids[0]}'"):
        open_run(f"{ids[0]}y", results)


def test_what_has_no_latest_run_is_made_or_named_rightly(make: Make, results: Path) -> None:
    with pytest.raises(UserError, match="fix: run `wristctl train` first"):
        open_run("latest:train", results)
    make()
    for kind, command in {"tune": "tune", "identify": "identify LOG", "audit": "paper audit"}.items():
        with pytest.raises(UserError, match=f"no {kind} run .* - fix: run `wristctl {command}` first"):
            open_run(f"latest:{kind}", results)
    with pytest.raises(UserError, match=r"no wrist run .* - fix: one of gen-data"):
        open_run("latest:wrist", results)
    with pytest.raises(UserError, match=r"no gen-dta run that ended ok - latest:gen-dta in .* mean 'gen-data'"):
        open_run("latest:gen-dta", results)


def test_any_kind_will_do_where_none_is_asked_for(make: Make, results: Path) -> None:
    run = make()
    assert require(run.id, None, results).id == run.id


def test_the_last_run_that_is_passed_over_is_the_last_in_time_though_ids_are_of_a_second(
    make: Make, results: Path, caplog: pytest.LogCaptureFixture
) -> None:
    good = make()
    for label in ("z", "m", "a", "k"):
        with pytest.raises(RuntimeError), start_run("gen-data", Study(), label, results):
            raise RuntimeError(label)
    with caplog.at_level(logging.INFO, "wristctl.records.find"):
        assert open_run("latest:gen-data", results).path == good.path
    assert "-k-" in caplog.messages[0]
