"""Runs in one archive, and out of it: as sealed, all or none, and nowhere but in the results folder."""

from __future__ import annotations

import errno
import io
import json
import os
import stat
import tempfile
import zipfile
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.config.study import Study
from wristctl.errors import UserError, fix_of, fix_to_read
from wristctl.records import InputRun, Run, start_run
from wristctl.records.archive import PACK, SCHEMA, pack, unpack
from wristctl.records.lock import LOCK, delete_folder
from wristctl.records.removal import clear, leftovers

Make = Callable[..., Run]
Entries = dict[str, bytes]
ID = "20250101T000000Z-tune-abc"


@pytest.fixture
def packed(make: Make, tmp_path: Path) -> tuple[list[Run], Path]:
    """A run that was made from one that was made from another, and its archive."""
    chain = [make("gen-data")]
    for kind in ("train", "compare"):
        with start_run(kind, Study(), "", tmp_path / kind, inputs=[InputRun("data", chain[-1])]) as live:
            live.metric("rmse", 0.5)
        chain.append(Run(live.path))
    file = tmp_path / "mail.zip"
    assert [each.id for each in pack(chain[-1], file)] == [each.id for each in chain]
    return chain, file


def rewritten(file: Path, change: Callable[[Entries], Entries], mode: int = 0) -> Path:
    """A copy of an archive with other entries."""
    with zipfile.ZipFile(file) as archive:
        entries = change({name: archive.read(name) for name in archive.namelist()})
    other = file.with_name("other.zip")
    with zipfile.ZipFile(other, "w") as archive:
        for name, content in entries.items():
            entry = zipfile.ZipInfo(name)
            entry.external_attr = (mode if content == b"/etc/passwd" else stat.S_IFREG | 0o644) << 16
            archive.writestr(entry, content)
    return other


def test_a_run_arrives_with_all_that_it_was_made_from_as_it_was_sealed(
    packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    chain, file = packed
    found = unpack(file, tmp_path / "colleague")
    assert [each.id for each in found.new] == [each.id for each in chain] and not found.known
    assert found.run.id == chain[-1].id and found.run.state == "ok"
    for here, there in zip(found.new, chain, strict=True):
        assert here.problems() == [] and here.result_hash == there.result_hash
    assert sorted(os.listdir(tmp_path / "colleague")) == sorted(each.id for each in chain)
    again = unpack(file, tmp_path / "colleague")
    assert not again.new and [each.id for each in again.known] == [each.id for each in chain]


def test_files_may_stand_in_an_archive_in_any_order(packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    """Of one that others packed anew, those deepest in folders first."""
    chain, file = packed
    deepest = rewritten(file, lambda entries: dict(sorted(entries.items(), key=lambda entry: -entry[0].count("/"))))
    assert [each.problems() for each in unpack(deepest, tmp_path / "colleague").new] == [[]] * len(chain)


def test_the_same_runs_are_the_same_archive(packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    chain, file = packed
    pack(chain[-1], tmp_path / "twice.zip")
    assert (tmp_path / "twice.zip").read_bytes() == file.read_bytes()
    with pytest.raises(UserError, match="a file is in the way"):
        pack(chain[-1], file)


def test_what_was_added_to_a_run_stays_at_home(packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    chain, _ = packed
    (chain[0].path / "private.txt").write_text("mine")
    pack(chain[0], tmp_path / "clean.zip")
    assert not any("private" in name for name in zipfile.ZipFile(tmp_path / "clean.zip").namelist())


def test_a_run_that_is_not_as_sealed_or_whose_input_is_gone_is_not_packed(
    packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    chain, _ = packed
    (chain[0].path / "data/samples.csv").write_text("x\n")
    with pytest.raises(UserError, match="hash does not match"):
        pack(chain[-1], tmp_path / "a.zip")
    chain[0].path.rename(tmp_path / "gone")
    with pytest.raises(UserError, match="the data run is gone"):
        pack(chain[-1], tmp_path / "a.zip")
    assert not (tmp_path / "a.zip").exists()


HOSTILE = (
    "../evil",
    "/tmp/evil",
    "ID/../../evil",
    "ID/./evil",
    "ID//evil",
    "ID\\..\\evil",
    "other/run.json",
    "evil",
    "C:/x",
)


@pytest.mark.parametrize("name", HOSTILE)
def test_a_name_that_leads_elsewhere_is_refused_before_anything_is_written(
    name: str, packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    chain, file = packed
    named = name.replace("ID", chain[0].id)
    other = rewritten(file, lambda entries: entries | {named: b"evil"})
    before = set(tmp_path.rglob("*"))
    with pytest.raises(UserError, match="a name that leads elsewhere") as caught:
        unpack(other, tmp_path / "colleague")
    assert caught.value.exit_code == 2
    assert set(tmp_path.rglob("*")) == before


@pytest.mark.parametrize("mode", [stat.S_IFLNK | 0o777, stat.S_IFIFO | 0o644, stat.S_IFCHR | 0o644])
def test_links_and_devices_are_refused(mode: int, packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    chain, file = packed
    other = rewritten(file, lambda entries: entries | {f"{chain[0].id}/data/link": b"/etc/passwd"}, mode)
    with pytest.raises(UserError, match="no plain file"):
        unpack(other, tmp_path / "colleague")


def changed(entries: Entries, end: str, content: bytes) -> Entries:
    (name,) = [each for each in entries if each.endswith(end)]
    return entries | {name: content}


@pytest.mark.parametrize(
    ("change", "what"),
    [
        (lambda e: changed(e, "samples.csv", b"x,name\n9,a\n"), "hash does not match what was sealed"),
        (lambda e: {n: c for n, c in e.items() if not n.endswith("samples.csv")}, "sealed file is missing"),
        (lambda e: e | {next(n for n in e if n.endswith("samples.csv")) + ".py": b"import os"}, "file was added"),
        (lambda e: {n: c for n, c in e.items() if "gen-data" not in n}, "is not in it"),
    ],
)
def test_a_run_that_is_not_as_it_was_sealed_does_not_arrive_nor_do_the_others(
    change: Callable[[Entries], Entries], what: str, packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    with pytest.raises(UserError, match=what) as caught:
        unpack(rewritten(packed[1], change), tmp_path / "colleague")
    assert caught.value.exit_code == 3 and os.listdir(tmp_path / "colleague") == []


def test_another_run_of_the_same_id_is_not_written_over(packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    chain, file = packed
    here = tmp_path / "colleague" / chain[0].id
    here.mkdir(parents=True)
    (here / "notes.txt").write_text("mine")
    with pytest.raises(UserError, match="a run of this id is here already") as caught:
        unpack(file, tmp_path / "colleague")
    assert caught.value.exit_code == 3 and os.listdir(tmp_path / "colleague") == [chain[0].id]
    assert (here / "notes.txt").read_text() == "mine"


@pytest.mark.parametrize(
    ("told", "what"),
    [
        (None, f"it has no {PACK}"),
        (b"{", "is not valid JSON"),
        (b"[" * 100_000, "is not valid JSON"),
        (b'{"runs": ["a"]}', "names no runs"),
        (json.dumps({"schema": "wristctl.pack/9", "run": ID, "runs": [ID]}).encode(), "by another wristctl"),
        (json.dumps({"schema": SCHEMA, "run": "..", "runs": [".."]}).encode(), "a name that is no run's id"),
        (json.dumps({"schema": SCHEMA, "run": "a/b", "runs": ["a/b"]}).encode(), "a name that is no run's id"),
        (json.dumps({"schema": SCHEMA, "run": 3, "runs": [3]}).encode(), "a name that is no run's id"),
        *(
            (json.dumps({"schema": SCHEMA, "run": name, "runs": [name]}).encode(), "a name that is no run's id")
            for name in ("tags.json", "figures-x", "latest", "20259901T000000Z-tune-abc", "20250101T000000Z", ID + "/x")
        ),
        (json.dumps({"schema": SCHEMA, "run": ID, "runs": [ID, ID]}).encode(), "a name that is no run's id"),
    ],
)
def test_what_is_no_archive_of_runs_is_said(told: bytes | None, what: str, tmp_path: Path) -> None:
    file = tmp_path / "mail.zip"
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr(PACK if told else "other", told or b"")
    with pytest.raises(UserError, match=what):
        unpack(file, tmp_path / "colleague")


@pytest.mark.slow
def test_no_zip_a_broken_one_and_one_that_swells_are_refused(packed: tuple[list[Run], Path], tmp_path: Path) -> None:
    _, file = packed
    with pytest.raises(UserError, match="cannot be read"):
        unpack(tmp_path / "gone.zip", tmp_path / "colleague")
    (tmp_path / "text.zip").write_text("no zip")
    (tmp_path / "half.zip").write_bytes(file.read_bytes()[:-400])
    for name in ("text.zip", "half.zip"):
        with pytest.raises(UserError, match="no archive of runs"):
            unpack(tmp_path / name, tmp_path / "colleague")
    with zipfile.ZipFile(tmp_path / "bomb.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(PACK, json.dumps({"schema": SCHEMA, "run": ID, "runs": [ID]}))
        archive.writestr(f"{ID}/zeros", bytes(50_000_000))
    with pytest.raises(UserError, match="far more than its size"):
        unpack(tmp_path / "bomb.zip", tmp_path / "colleague")
    assert not (tmp_path / "colleague").exists()


@pytest.mark.parametrize("faulty", [0, 2], ids=["an ancestor's copy", "its own copy"])
def test_a_run_that_is_here_already_is_checked(packed: tuple[list[Run], Path], tmp_path: Path, faulty: int) -> None:
    chain, file = packed
    here = unpack(file, tmp_path / "colleague")
    damaged = here.new[faulty].path / "metrics.json"
    damaged.write_text(damaged.read_text().replace("0", "1"))
    with pytest.raises(UserError) as caught:
        unpack(file, tmp_path / "colleague")
    assert caught.value.exit_code == 3 and str(damaged) in str(caught.value)
    assert sorted(os.listdir(tmp_path / "colleague")) == sorted(each.id for each in chain)


def test_a_signed_archive_signs_the_copy_that_is_here_and_replaces_no_signature(
    packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    chain, file = packed
    first, signed = unpack(file, tmp_path / "colleague").new, "SHA256SUMS.sig"
    (first[1].path / signed).write_bytes(b"ours")
    for run in chain[1:]:
        (run.path / signed).write_bytes(b"theirs")
    pack(chain[-1], tmp_path / "signed.zip")
    again = unpack(tmp_path / "signed.zip", tmp_path / "colleague")
    assert [each.id for each in again.signed] == [chain[2].id]
    assert (first[1].path / signed).read_bytes() == b"ours" and (first[2].path / signed).read_bytes() == b"theirs"
    assert not (first[0].path / signed).exists() and all(each.problems() == [] for each in first)


def test_an_archive_of_too_many_files_is_neither_written_nor_begun(
    packed: tuple[list[Run], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    chain, file = packed
    with zipfile.ZipFile(file) as archive:
        count = len(archive.namelist())
    monkeypatch.setattr("wristctl.records.archive.MOST_FILES", count)
    assert unpack(file, tmp_path / "first").new and pack(chain[-1], tmp_path / "same.zip")
    monkeypatch.setattr("wristctl.records.archive.MOST_FILES", count - 1)
    with pytest.raises(UserError, match=f"{count - 1}"):
        unpack(file, tmp_path / "second")
    with pytest.raises(UserError, match=f"{count - 1}"):
        pack(chain[-1], tmp_path / "other.zip")
    assert not (tmp_path / "second").exists() and not (tmp_path / "other.zip").exists()


def test_gc_leaves_a_running_unpack_alone_and_clears_away_a_killed_one(
    packed: tuple[list[Run], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    results, seen = tmp_path / "colleague", []

    def hashed(run: Run) -> list[tuple[str, str]]:
        seen.append(list(leftovers(results)))
        return []

    monkeypatch.setattr(Run, "problems", hashed)
    assert len(unpack(packed[1], results).new) == 3
    assert seen == [[], [], []] and not list(results.glob(".*"))
    killed = results / ".unpack-abc.part"
    killed.mkdir()
    (killed / LOCK).touch()
    (found,) = leftovers(results)
    clear(found)
    assert not killed.exists()


def test_a_scratch_folder_that_gc_took_away_while_it_was_empty_is_made_again(
    packed: tuple[list[Run], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    made: list[str] = []

    def taken_away(**options: Any) -> str:
        made.append(tempfile.mkdtemp(**options))
        if len(made) == 1:
            delete_folder(Path(made[0]))
        return made[-1]

    monkeypatch.setattr("wristctl.records.archive.tempfile", SimpleNamespace(mkdtemp=taken_away))
    assert len(unpack(packed[1], tmp_path / "colleague").new) == 3 and len(made) == 2


def broken_piece(content: bytes) -> bytes:
    """Of an archive whose largest entry is no deflated data any more."""
    with zipfile.ZipFile(io.BytesIO(content)) as archive:
        largest = max(archive.infolist(), key=lambda each: each.compress_size)
    begin = largest.header_offset + 30 + len(largest.filename)
    return content[:begin] + bytes([0xFF]) * 8 + content[begin + 8 :]


def test_damaged_data_and_entries_that_cannot_stand_side_by_side_are_refused_in_words(
    packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    chain, file = packed
    (tmp_path / "damaged.zip").write_bytes(broken_piece(file.read_bytes()))
    with pytest.raises(UserError, match="no archive of runs"):
        unpack(tmp_path / "damaged.zip", tmp_path / "colleague")
    for name, what in {"run.json/x": "a file and a folder", "x" * 1001: "a name of more than"}.items():
        more = {f"{chain[0].id}/{name}": b""}
        other = rewritten(file, more.__ror__)
        with pytest.raises(UserError, match=what):
            unpack(other, tmp_path / "colleague")
    assert os.listdir(tmp_path / "colleague") == []


def test_what_is_no_file_is_refused_at_once_and_a_file_for_a_folder_in_words(
    packed: tuple[list[Run], Path], tmp_path: Path
) -> None:
    os.mkfifo(tmp_path / "fifo")
    for odd in (Path("/dev/zero"), tmp_path / "fifo", tmp_path):
        with pytest.raises(UserError, match="no plain file"):
            unpack(odd, tmp_path / "colleague")
    (tmp_path / "file").write_text("mine")
    for results, number in {tmp_path / "file": errno.EEXIST, tmp_path / "file/x": errno.ENOTDIR}.items():
        with pytest.raises(UserError, match=os.strerror(number)) as caught:
            unpack(packed[1], results)
        assert (
            caught.value.fix == UserError("", "", fix_of(OSError(number, ""))).fix
            and str(results) in caught.value.where
        )
    assert (tmp_path / "file").read_text() == "mine"


NUMBERS = (errno.EEXIST, errno.ENOENT, errno.ENOTDIR, errno.ENAMETOOLONG, errno.ENOSPC, errno.EACCES, errno.EROFS)


@pytest.mark.parametrize("number", NUMBERS, ids=errno.errorcode.get)
@pytest.mark.parametrize("operation", ["open", "mkdir", "rename"])
def test_what_the_system_refuses_while_unpacking_is_said_of_the_results_folder(
    packed: tuple[list[Run], Path], tmp_path: Path, number: int, operation: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    results = tmp_path / "colleague"
    results.mkdir()
    original = getattr(Path, operation)

    def refused(path: Path, *args: Any, **options: Any) -> Any:
        if ".unpack-" in str(path) and (operation != "open" or args[:1] == ("xb",)):
            raise OSError(number, os.strerror(number), str(path))
        return original(path, *args, **options)

    monkeypatch.setattr(Path, operation, refused)
    with pytest.raises(UserError, match=f"cannot write: {os.strerror(number)}") as caught:
        unpack(packed[1], results)
    assert caught.value.fix == UserError("", "", fix_of(OSError(number, ""))).fix and str(results) in caught.value.where
    assert os.listdir(results) == [], "all or none"


def test_the_words_for_each_refusal_differ_and_none_of_a_missing_path_asks_an_owner() -> None:
    fixes = [UserError("", "", fix_of(OSError(number, ""))).fix for number in NUMBERS]
    assert len(set(fixes)) == len(NUMBERS) - 1, "no permission and read-only need the same"
    to_read = {number: UserError("", "", fix_to_read(OSError(number, ""))).fix for number in NUMBERS}
    assert [number for number, fix in to_read.items() if "owner" in fix] == [errno.EACCES]


def test_whoever_unpacks_it_by_other_means_can_read_the_files_and_run_none(packed: tuple[list[Run], Path]) -> None:
    with zipfile.ZipFile(packed[1]) as archive:
        modes = {entry.external_attr >> 16 for entry in archive.infolist() if not entry.is_dir()}
        assert modes == {stat.S_IFREG | 0o644}
        assert {entry.compress_type for entry in archive.infolist()} == {zipfile.ZIP_DEFLATED}
