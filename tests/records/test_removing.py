"""Runs and what killed processes leave are deleted, and nothing else."""

from __future__ import annotations

import errno
import os
import shutil
import tempfile
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from threading import Thread
from typing import Any

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import InputRun, Run, open_run, start, start_run
from wristctl.records.find import entries
from wristctl.records.lock import LOCK, RunLock, delete_folder, lock
from wristctl.records.removal import Leftover, clear, foreign, leftovers, lost_repetitions, lost_tags, removable, remove
from wristctl.records.tags import change_tags, read_tags

Make = Callable[..., Run]


def test_of_a_link_to_a_run_the_link_is_deleted(make: Make, results: Path, tmp_path: Path) -> None:
    precious = tmp_path / "archive" / "precious"
    shutil.copytree(make().path, precious)
    (results / "precious").symlink_to(precious)
    assert "precious" in [entry.id for entry in entries(results)]
    change_tags(results, "precious", add=["mine"])
    (run,) = removable([open_run("precious", results)])
    remove(run)
    assert precious.is_dir() and not (results / "precious").is_symlink() and read_tags(results) == {}


def test_a_run_that_was_used_or_deleted_while_the_user_thought_is_not_deleted(make: Make, results: Path) -> None:
    run = make()
    asked = removable([run])
    with start_run("train", Study(), "", results, inputs=[InputRun("data", run)]) as user:
        pass
    with pytest.raises(UserError, match="runs were made from it"):
        removable(asked)
    remove(Run(user.path))
    remove(*removable(asked))
    with pytest.raises(UserError, match="gone meanwhile"):
        removable(asked)


def test_what_others_put_into_a_run_is_named_before_it_goes(make: Make) -> None:
    run = make()
    (run.path / "my notes.txt").write_text("keep me")
    assert foreign(run) == ["my notes.txt"]


def test_an_index_that_another_process_is_writing_is_no_leftover(results: Path) -> None:
    results.mkdir(exist_ok=True)
    unfinished = results / ".index-abcd1234"
    with unfinished.open("w") as file:
        lock(file.fileno())
        assert list(leftovers(results)) == []
    assert [leftover.path for leftover in leftovers(results)] == [unfinished]


def test_leftovers_of_every_kind_are_found_and_runs_are_not(make: Make, results: Path) -> None:
    run, crashed = make(), make("tune")
    change_tags(results, "20250101T000000Z-tune-123456", add=["old"])
    (crashed.path / "SHA256SUMS").unlink()
    manifest = crashed.path / "run.json"
    manifest.write_text(manifest.read_text().replace('"state": "ok"', '"state": "running"'))
    begun = results / "20260101T000000Z-tune-abcdef"
    mine = results / "20260101T000000Z-notes"
    for folder in (results / ".20250101T000000Z-tune-123456.removed", begun, mine, results / "figures"):
        folder.mkdir()
    left = [begun / LOCK, begun / "config.yaml", begun / ".environment.txt.part", results / ".index-abcd1234"]
    left += [results / ".tags.json.part", crashed.path / ".reserve", crashed.path / "data" / ".samples.csv.part"]
    for file in (*left, mine / "thesis.txt"):
        file.write_bytes(bytes(100))
    found = list(leftovers(results))
    assert {each.path.name for each in found} == {
        ".20250101T000000Z-tune-123456.removed", begun.name, ".index-abcd1234", ".tags.json.part", ".reserve",
        ".samples.csv.part",
    }  # fmt: skip
    assert {each.path.name: each.size for each in found}[begun.name] == 300
    assert lost_tags(results) == {"20250101T000000Z-tune-123456": ["old"]}
    for each in found:
        clear(each)
    assert list(leftovers(results)) == []
    assert {each.name for each in results.iterdir() if not each.name.startswith(".")} == {
        run.id, crashed.id, mine.name, "figures", "tags.json",
    }  # fmt: skip
    run.check()


def test_an_empty_dated_folder_is_a_leftover_and_a_folder_within_one_is_somebodys(results: Path) -> None:
    empty, own = results / "20260101T000000Z-tune-abcdef", results / "20260101T000001Z-tune-abcdef"
    (own / "config.yaml").mkdir(parents=True)
    empty.mkdir()
    assert [each.path for each in leftovers(results)] == [empty]


def test_the_scratch_folders_of_killed_replays_are_found_and_no_others(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    killed, alive, kept, strange = (tmp_path / f"wristctl-replay-{name}" for name in ("a", "b", "c", "d"))
    for each in (killed, alive, kept):
        each.mkdir()
    strange.symlink_to(kept)
    (killed / LOCK).write_text("")
    held = RunLock(alive)
    assert [each.path for each in lost_repetitions()] == [killed]
    held.release()
    clear(next(lost_repetitions()))
    assert not killed.exists() and list(lost_repetitions()) == []


def test_a_killed_signing_changes_nothing_and_is_cleared_away(make: Make, results: Path) -> None:
    run = make()
    left = run.path / ".SHA256SUMS.sig.part"
    left.write_bytes(b"half a signature")
    assert run.problems() == [] and foreign(run) == []
    (found,) = leftovers(results)
    clear(found)
    assert not left.exists() and run.problems() == []
    (run.path / "data" / left.name).write_bytes(b"elsewhere it is an added file")
    assert [name for name, _ in run.problems()] == [f"data/{left.name}"] and not list(leftovers(results))


def test_of_two_who_delete_a_folder_the_second_leaves_it_to_the_first(tmp_path: Path) -> None:
    folder = tmp_path / ".run.removed"
    (folder / "data").mkdir(parents=True)
    held = RunLock(folder)
    delete_folder(folder)
    assert folder.is_dir() and list(leftovers(tmp_path)) == []
    held.release()
    clear(next(leftovers(tmp_path)))
    assert not folder.exists()


@pytest.mark.parametrize("room", [True, False], ids=["with room for its lock", "on a full disk"])
def test_whoever_deletes_a_folder_keeps_nothing_of_it_open(
    tmp_path: Path, room: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder, original = tmp_path / ".run.removed", os.open
    (folder / "data").mkdir(parents=True)
    (folder / "run.json").touch()

    def opened(path: Any, flags: int, *given: Any, **named: Any) -> int:
        if not room and flags & os.O_CREAT:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(path))
        return original(path, flags, *given, **named)

    monkeypatch.setattr("wristctl.records.lock.os.open", opened)
    before = len(os.listdir("/dev/fd"))
    delete_folder(folder)
    assert not folder.exists() and len(os.listdir("/dev/fd")) <= before
    delete_folder(folder)
    assert not folder.exists(), "one that is gone stays so"


def test_a_run_begins_although_its_empty_folder_was_taken_away(results: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made: list[Path] = []
    original = start._new_directory

    def taken_away(*given: str) -> Path:
        made.append(original(*given))  # type: ignore[arg-type]
        if len(made) == 1:
            clear(next(leftovers(results)))
        return made[-1]

    monkeypatch.setattr(start, "_new_directory", taken_away)
    with start_run("tune", Study(), "", results) as run:
        run.metric("rmse", 1.0)
    assert len(made) == 2 and [each.state for each in entries(results)] == ["ok"]


def test_many_who_delete_the_same_folders_are_in_nobodys_way(tmp_path: Path) -> None:
    folders = [tmp_path / f".{number}.removed" for number in range(60)]
    for folder in folders:
        (folder / "data").mkdir(parents=True)
        for name in ("run.json", "data/a.csv", "data/b.csv"):
            (folder / name).write_text("x")

    def clear_all(_: int) -> None:
        for folder in folders:
            delete_folder(folder)

    with ThreadPoolExecutor(6) as pool:
        list(pool.map(clear_all, range(6)))
    assert list(leftovers(tmp_path)) == []
    for folder in folders:
        delete_folder(folder)
    assert list(tmp_path.iterdir()) == []


def test_gc_takes_nothing_from_who_is_writing_tags_and_passes_over_what_is_gone_meanwhile(
    make: Make, results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    run = make()
    found: list[Leftover] = []

    def written(path: Path, text: str) -> None:
        part = path.with_name(f".{path.name}.part")
        part.write_text(text)
        found.extend(leftovers(results))
        clearing.append(Thread(target=clear, args=(found[0],)))
        clearing[0].start()
        clearing[0].join(0.05)
        part.rename(path)

    clearing: list[Thread] = []
    with monkeypatch.context() as patch:
        patch.setattr("wristctl.records.tags.write_text", written)
        assert change_tags(results, run.id, add=["x"]) == ["x"]
    clearing[0].join()
    assert [each.path.name for each in found] == [".tags.json.part"] and read_tags(results) == {run.id: ["x"]}
    monkeypatch.setattr("wristctl.records.removal._size", lambda path: path.with_name("gone").stat().st_size)
    (results / ".old.removed").mkdir()
    assert list(leftovers(results)) == []
