"""What a run writes while it goes on, and how it ends."""

from __future__ import annotations

import errno
import hashlib
import json
import logging
import os
import resource
import shutil
import sys
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import Run, start_run, stream
from wristctl.records.files import sha256_of_list, write_text
from wristctl.records.journal import jsonable
from wristctl.records.lock import RunLock, is_locked
from wristctl.records.manifest import Manifest, TakenOver


def test_a_stream_is_the_seed_and_eight_bytes_of_the_names_hash() -> None:
    digest = hashlib.sha256(b"weights").hexdigest()
    assert stream(5, "weights") == (5, int(digest[:16], 16))


def test_a_metric_is_one_number_unless_more_is_said(results: Path) -> None:
    with start_run("tune", Study(), "", results) as live:
        live.metric("plain", 2.0)
        live.metric("full", 3.0, "rad", "lower", 9, (2.5, float("inf")), "tip")
        live.metric("none", None)
    nothing = {"unit": "", "better": "", "n": 1, "interval": None, "meaning": ""}
    assert Run(live.path).metrics == {
        "plain": {"value": 2.0, **nothing},
        "full": {"value": 3.0, "unit": "rad", "better": "lower", "n": 9, "interval": [2.5, None], "meaning": "tip"},
        "none": {"value": None, **nothing},
    }


def test_units_or_meaning_may_be_left_out(results: Path) -> None:
    columns = {"x": np.array([1.0]), "y": np.array([2.0])}
    with start_run("tune", Study(), "", results) as live:
        live.table("data/a.csv", columns, units={"x": "m"})
        live.table("data/b.csv", columns, meaning={"y": "angle"})
        live.arrays("deep/er/c.npz", columns)
    outputs = {each.path: each for each in Run(live.path).manifest.outputs}
    noted = {name: [(c.name, c.unit, c.meaning) for c in each.columns] for name, each in outputs.items()}
    assert noted["data/a.csv"] == [("x", "m", ""), ("y", "", "")]
    assert noted["data/b.csv"] == [("x", "", ""), ("y", "", "angle")]
    assert (
        noted["deep/er/c.npz"] == [] and outputs["deep/er/c.npz"].bytes == (live.path / "deep/er/c.npz").stat().st_size
    )


@pytest.mark.parametrize(("platform", "megabytes"), [("linux", 3072.0), ("darwin", 3.0)])
def test_times_begin_with_the_run_and_memory_is_in_the_systems_own_unit(
    results: Path, monkeypatch: pytest.MonkeyPatch, platform: str, megabytes: float
) -> None:
    walls, processors = iter((10.0, 13.5)), iter((100.0, 101.25))
    clock = SimpleNamespace(perf_counter=lambda: next(walls), process_time=lambda: next(processors))
    monkeypatch.setattr("wristctl.records.run_writer.time", clock)
    monkeypatch.setattr(resource, "getrusage", lambda _: SimpleNamespace(ru_maxrss=3 * 2**20))
    monkeypatch.setattr("wristctl.records.run_writer.sys", SimpleNamespace(platform=platform))
    with start_run("tune", Study(), "", results) as live:
        pass
    timing = Run(live.path).manifest.timing
    assert (timing.wall_s, timing.cpu_s, timing.max_rss_mb) == (3.5, 1.25, megabytes)


def test_a_page_is_made_of_the_ended_run_and_may_fail(results: Path) -> None:
    def page(path: Path, manifest: Manifest, undrawn: object) -> str:
        return f"{path.name} {manifest.id} {manifest.state} {manifest.exit_code}"

    with start_run("tune", Study(), "", results, page=page) as live:
        pass
    assert Run(live.path).file("report.html").read_text() == f"{live.id} {live.id} ok 0"

    def broken(*_: object) -> str:
        raise KeyError("colour")

    with start_run("tune", Study(), "", results, page=broken) as live:
        pass
    run = Run(live.path)
    assert run.state == "ok" and not (run.path / "report.html").exists() and run.problems() == []
    said = "report.html could not be drawn: KeyError: 'colour'"
    assert f"warning: {said}\n" in run.file("console.log").read_text()
    events = [json.loads(line) for line in run.file("events.jsonl").read_text().splitlines()]
    assert [(each["event"], each.get("message")) for each in events[1:]] == [("end", None), ("warning", said)]


def test_what_the_program_says_is_logged_and_from_warnings_on_an_event(results: Path) -> None:
    log = logging.getLogger("wristctl.probe")
    log.setLevel(logging.INFO)
    with start_run("tune", Study(), "", results) as live:
        log.info("as ever")
        log.warning("too warm")
        log.error("too hot")
        live.console("two\nlines\n")
    log.error("after the end")
    run = Run(live.path)
    assert run.file("console.log").read_text() == "as ever\nwarning: too warm\nerror: too hot\ntwo\nlines\n"
    events = [json.loads(line) for line in run.file("events.jsonl").read_text().splitlines()]
    assert [each["event"] for each in events] == ["start", "warning", "error", "end"]
    assert (events[0]["kind"], events[1]["message"], events[1]["logger"]) == ("tune", "too warm", "wristctl.probe")
    assert events[3]["state"] == "ok"


def test_anything_becomes_what_json_can_say() -> None:
    given = {1: np.float32(0.5), "a": [np.nan, (np.inf, -1)], "b": np.arange(2), "c": None, "d": True, "e": Path("x")}
    assert jsonable(given) == {"1": 0.5, "a": [None, [None, -1]], "b": [0, 1], "c": None, "d": True, "e": "x"}
    assert jsonable(np.array([0.5, np.nan])) == [0.5, None] and jsonable(np.int64(3)) == 3


@pytest.mark.parametrize(
    ("error", "state", "code"),
    [(KeyboardInterrupt(), "interrupted", 130), (ValueError("by hand"), "failed", 1), (None, "ok", 0)],
)
def test_the_end_decides_state_and_exit_code(results: Path, error: BaseException | None, state: str, code: int) -> None:
    live = None
    try:
        with start_run("tune", Study(), "", results / "below" / "that") as live:
            if error:
                raise error
    except (KeyboardInterrupt, ValueError) as raised:
        assert raised is error
    assert live is not None
    manifest = Run(live.path).manifest
    assert (manifest.state, manifest.exit_code, manifest.argv) == (state, code, sys.argv)
    assert (manifest.error is None) == (state != "failed") and not list(live.path.glob(".*"))


def test_a_lock_is_a_living_runs_and_its_user_may_write_it(tmp_path: Path) -> None:
    assert not is_locked(tmp_path), "there is none"
    lock = RunLock(tmp_path)
    mode = (tmp_path / ".lock").stat().st_mode & 0o777
    assert is_locked(tmp_path) and mode & 0o600 == 0o600 and mode & 0o133 == 0
    lock.release()
    assert not is_locked(tmp_path) and not list(tmp_path.iterdir())
    (tmp_path / ".lock").touch()
    assert not is_locked(tmp_path), "left behind by one that was killed"


def test_the_result_hash_is_of_names_and_hashes_as_in_every_earlier_run(results: Path) -> None:
    with start_run("tune", Study(), "", results) as live:
        live.file("data/a.txt").write_text("a")
        live.file("timing.json").write_text("{}")
    assert Run(live.path).result_hash == sha256_of_list([("data/a.txt", hashlib.sha256(b"a").hexdigest())])


def test_a_run_whose_folder_is_gone_listens_no_longer(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="removed, moved or replaced"), start_run("tune", Study(), out=tmp_path) as run:
        shutil.rmtree(run.path)
    assert not logging.getLogger("wristctl").handlers


@pytest.mark.parametrize("odd", ["link to a file", "link to a folder", "dangling link", "fifo"])
def test_a_run_with_anything_but_files_fails_and_says_so(results: Path, tmp_path: Path, odd: str) -> None:
    (tmp_path / "elsewhere").mkdir()
    (tmp_path / "elsewhere/x").write_text("x")
    with pytest.raises(UserError) as caught, start_run("tune", Study(), "", results) as live:
        live.metric("rmse", 1.0)
        place = live.file("data/odd.bin")
        if odd == "fifo":
            os.mkfifo(place)
        else:
            names = {"link to a file": "elsewhere/x", "link to a folder": "elsewhere", "dangling link": "gone"}
            place.symlink_to(tmp_path / names[odd])
    assert caught.value.exit_code == 3 and caught.value.where == str(place)
    run = Run(live.path)
    assert run.state == "failed" and run.manifest.error is not None and run.manifest.error.where == str(place)
    assert [each.path for each in run.manifest.outputs] == ["metrics.json"]
    assert [name for name, _ in run.problems()] == ["data/odd.bin"], "and nothing else is wrong with it"


def test_what_was_computed_elsewhere_stands_in_manifest_and_readme(results: Path) -> None:
    with start_run("study", Study(), "", results) as live:
        live.took_over("20260101T000000Z-study-1", 4, 1)
        live.took_over("20260101T000000Z-study-1", 3, 1)
    units = Run(live.path).manifest.units
    assert units == TakenOver(run="20260101T000000Z-study-1", taken_over=7, computed_again=2)
    (line,) = [each for each in (live.path / "README.md").read_text().splitlines() if each.startswith("7 units")]
    assert "20260101T000000Z-study-1" in line and "2 more" in line


def test_a_new_file_whose_folder_cannot_be_synced_is_absent_and_an_old_one_is_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refused(path: Path) -> None:
        if path == tmp_path:
            raise OSError(errno.EIO, os.strerror(errno.EIO))

    old, new = tmp_path / "old", tmp_path / "new"
    old.write_text("before")
    monkeypatch.setattr("wristctl.records.files.sync", refused)
    for file in (old, new):
        with pytest.raises(UserError, match="Input/output error"):
            write_text(file, "after")
    assert [each.name for each in tmp_path.iterdir()] == ["old"]
