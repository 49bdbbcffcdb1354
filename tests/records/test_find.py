"""Runs are found by what people type, and what is not a run is said to be none."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import Run, list_runs, open_run, require, start_run
from wristctl.records.index import INDEX, indexed

Make = Callable[..., Run]


def test_a_run_is_found_by_path_id_prefix_and_kind(make: Make, results: Path) -> None:
    first, last = make(label="first"), make(label="last")
    assert open_run(first.path, results).path == first.path
    assert open_run(first.path / "run.json", results).path == first.path
    assert open_run(first.id, results).path == first.path
    assert open_run(first.id[: first.id.index("first") + 2], results).path == first.path
    assert open_run("latest:gen-data", results).path == last.path


def test_latest_passes_over_runs_that_did_not_end_well(make: Make, results: Path) -> None:
    good = make()
    with pytest.raises(RuntimeError), start_run("gen-data", Study(), "", results):
        raise RuntimeError
    assert open_run("latest:gen-data", results).path == good.path


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
    with pytest.raises(UserError, match="a gen-data run where a train run is needed"):
        require(run.id, "train", results)
    (run.path / "data" / "samples.csv").write_text("x\n1\n")
    with pytest.raises(UserError, match="hash does not match"):
        require(run.id, "gen-data", results)
    with pytest.raises(RuntimeError), start_run("train", Study(), "", results):
        raise RuntimeError
    failed = list_runs(results)[-1]
    with pytest.raises(UserError, match="run is failed, not ok"):
        require(failed.id, "train", results)
