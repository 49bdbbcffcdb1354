"""What happens to runs in the world: removed while they run, tampered with, linked, shared, made by strangers."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import re
import shutil
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.cli.app import main
from wristctl.config.errors import UserError
from wristctl.config.study import Study
from wristctl.records import InputRun, Run, list_runs, open_run, require, start_run
from wristctl.records.files import sha256_of
from wristctl.records.index import INDEX
from wristctl.records.leftovers import clear, leftovers, lost_tags
from wristctl.records.lineage import ancestry
from wristctl.records.lock import LOCK, is_locked
from wristctl.records.query import entries
from wristctl.records.remove import foreign, removable, remove
from wristctl.records.seal import write_seal
from wristctl.records.tags import change_tags, read_tags

Make = Callable[..., Run]


def removed_while_running(results: Path, what: Callable[[Path], object], exist: bool = True) -> UserError:
    with pytest.raises(UserError) as caught, start_run("tune", Study(), "", results) as live:
        live.metric("rmse", 1.0)
        live.table("data/samples.csv", {"x": np.ones(1)})
        what(live.path)
        live.arrays("data/after.npz", {}) if exist else None
    return caught.value


@pytest.mark.parametrize("more", [False, True], ids=["at its end", "before its next file"])
@pytest.mark.parametrize("whole", [False, True], ids=["the run", "the results folder"])
def test_a_run_whose_folder_is_removed_fails_and_does_not_come_back(results: Path, whole: bool, more: bool) -> None:
    error = removed_while_running(results, lambda path: shutil.rmtree(path.parent if whole else path), more)
    assert "removed, moved or replaced while it ran" in error.what and error.exit_code == 2
    assert list_runs(results) == []


def test_a_run_whose_folder_is_moved_or_replaced_is_not_sealed(results: Path, tmp_path: Path) -> None:
    removed_while_running(results, lambda path: path.rename(tmp_path / path.name))
    assert list_runs(results) == []
    assert [Run(each).state for each in tmp_path.iterdir() if each != results] == ["crashed"]

    def replace(path: Path) -> None:
        shutil.copytree(path, path.with_suffix(".copy"))
        shutil.rmtree(path)
        path.with_suffix(".copy").rename(path)

    removed_while_running(results, replace)
    (copy,) = list_runs(results)
    assert copy.state == "crashed"


@pytest.mark.parametrize("name", ["data/samples.csv", "config.yaml", "environment.txt", "code.txt"])
def test_a_run_that_lost_a_file_while_it_ran_is_not_ok(results: Path, name: str) -> None:
    error = removed_while_running(results, lambda path: (path / name).unlink())
    assert "removed or changed while it ran" in error.what and name in error.where
    (run,) = list_runs(results)
    assert run.state == "failed"


def test_provenance_that_was_changed_while_it_ran_is_told(results: Path) -> None:
    removed_while_running(results, lambda path: (path / "config.yaml").write_text("seed: 7\n"))


def _altered(run: Run, sums: str | None) -> None:
    """Twice as much data, under other sums; without any given, sealed anew."""
    file = run.path / "data/samples.csv"
    file.write_text(file.read_text() * 2)
    if sums is None:
        write_seal(run.path, {})
    else:
        (run.path / "SHA256SUMS").write_text(sums)


@pytest.mark.parametrize(
    ("tamper", "said"),
    [
        (lambda run: _altered(run, ""), "is not among what was sealed"),
        (lambda run: _altered(run, None), "hash in SHA256SUMS is not that in run.json"),
        (lambda run: (run.path / "SHA256SUMS").write_text(_without(run, "data/samples.csv")), "output of run.json"),
        (lambda run: _rewrite(run, "result_sha256", "0" * 64), "result_sha256 is not that of the outputs"),
        (lambda run: _rewrite(run, "id", "20200101T000000Z-tune-0"), "is that of run 20200101T000000Z-tune-0"),
        (lambda run: _linked(run, "data/samples.csv"), "is a link"),
        (lambda run: (run.path / "data/samples.csv").unlink(), "sealed file is missing"),
    ],
    ids=["no sums", "other sums", "fewer sums", "result hash", "id", "link", "missing"],
)
def test_what_was_tampered_with_is_no_input(make: Make, tamper: Callable[[Run], object], said: str) -> None:
    run = make()
    tamper(run)
    assert any(said in what for _, what in Run(run.path).problems())
    with pytest.raises(UserError):
        require(run.path, "gen-data")


def _without(run: Run, name: str) -> str:
    lines = (run.path / "SHA256SUMS").read_text().splitlines()
    return "".join(f"{line}\n" for line in lines if not line.endswith(name))


def _rewrite(run: Run, key: str, value: str) -> None:
    """Another value in run.json, and its hash in the sums."""
    content = json.loads((run.path / "run.json").read_text())
    (run.path / "run.json").write_text(json.dumps({**content, key: value}))
    sums = run.path / "SHA256SUMS"
    sums.write_text(
        re.sub(r"[0-9a-f]{64}  run\.json", f"{sha256_of(run.path / 'run.json')}  run.json", sums.read_text())
    )


def _linked(run: Run, name: str) -> None:
    """A link to an equal file elsewhere in the place of the file."""
    other = run.path.parent.parent / "elsewhere.csv"
    shutil.copy(run.path / name, other)
    (run.path / name).unlink()
    (run.path / name).symlink_to(other)


def test_whatever_is_added_to_a_sealed_run_is_named(make: Make, tmp_path: Path) -> None:
    run = make()
    (run.path / ".hidden").write_text("x")
    (run.path / "empty").mkdir()
    os.mkfifo(run.path / "pipe")
    (run.path / "dangling").symlink_to("nowhere")
    (run.path / "folder").symlink_to(tmp_path)
    assert [name for name, _ in run.problems()] == [".hidden", "dangling", "empty", "folder", "pipe"]


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


def test_leftovers_of_every_kind_are_found_and_runs_are_not(make: Make, results: Path) -> None:
    run, crashed = make(), make("tune")
    change_tags(results, "20250101T000000Z-tune-123456", add=["old"])
    (crashed.path / "SHA256SUMS").unlink()
    manifest = crashed.path / "run.json"
    manifest.write_text(manifest.read_text().replace('"state": "ok"', '"state": "running"'))
    begun = results / "20260101T000000Z-tune-abcdef"
    mine = results / "20260101T000000Z-notes"
    for folder in (results / ".20250101T000000Z-tune-123456.removed", begun, mine):
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
        run.id, crashed.id, mine.name, "tags.json",
    }  # fmt: skip
    run.check()


def test_without_locks_a_run_goes_on_while_its_process_does(
    make: Make, results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with start_run("tune", Study(), "", results) as live:
        assert Run(live.path).state == "running"
    run = Run(live.path)
    assert run.state == "ok" and change_tags(results, run.id, add=["a"]) == ["a"]
    held = run.path / LOCK
    child = subprocess.Popen([sys.executable, "-c", "pass"])
    child.wait()
    ours = f"{os.uname().nodename} {Path('/proc/sys/kernel/random/boot_id').read_text().strip()}"
    for holder, lives in {
        f"{ours} {child.pid} 1": False,
        f"{ours} {os.getpid()} 1": False,
        "elsewhere 0-0 12 345": True,
        "": False,
    }.items():
        held.write_text(holder)
        assert is_locked(run.path) is lives, holder


@pytest.mark.parametrize("held", ["seized", "lost"])
def test_a_lock_file_alone_is_no_sign_of_life(make: Make, held: str) -> None:
    run = make()
    (run.path / LOCK).write_text("elsewhere 0-0 12 345" if held == "seized" else "")
    assert not is_locked(run.path)


@pytest.mark.parametrize(
    "entry",
    [[], [[1]], [None, {}], [[1, 2, 3, 4], {"id": 3}], {"a": 1}, "text", None, [[1, 2, 3, 4], {"metrics": [1]}]],
    ids=str,
)
def test_an_odd_entry_of_the_index_stops_nothing(make: Make, results: Path, entry: Any) -> None:
    run = make()
    before = entries(results)
    index = results / INDEX
    content = json.loads(index.read_text())
    if isinstance(entry, list) and entry and entry[0] == [1, 2, 3, 4]:
        entry = [content["runs"][run.id][0], {**content["runs"][run.id][1], **entry[1]}]
    content["runs"][run.id] = entry
    index.write_text(json.dumps(content))
    assert entries(results) == before
    assert open_run("latest:gen-data", results).id == run.id


def test_the_index_is_for_everybody_who_may_read_the_folder(make: Make, results: Path) -> None:
    make()
    results.chmod(0o755)
    entries(results)
    assert (results / INDEX).stat().st_mode & 0o777 == 0o644


@pytest.mark.parametrize("content", [b"\xff", b"3", b'{"a": 1}', b'{"a": [1]}', b"[" * 100_000])
def test_runs_are_listed_where_their_tags_cannot_be_read(
    make: Make, results: Path, content: bytes, caplog: pytest.LogCaptureFixture
) -> None:
    run = make()
    (results / "tags.json").write_bytes(content)
    assert [each.id for each in entries(results)] == [run.id]
    assert "without their tags" in caplog.text


def test_a_run_that_names_itself_as_its_input_is_told_of(make: Make) -> None:
    run = make()
    with start_run("train", Study(), "", run.path.parent, inputs=[InputRun("data", run)]) as live:
        pass
    manifest = live.path / "run.json"
    text = manifest.read_text().replace(run.id, live.id).replace(f'"kind": "{run.kind}"', '"kind": "train"')
    manifest.write_text(text)
    write_seal(live.path, {})
    (itself,) = ancestry(Run(live.path)).inputs
    assert itself.state == "its own ancestor: that cannot be"


def test_an_input_that_leads_out_of_the_results_is_not_followed_by_name(make: Make, tmp_path: Path) -> None:
    run = make()
    outside = tmp_path / "outside"
    shutil.copytree(run.path, outside)
    with start_run("train", Study(), "", run.path.parent, inputs=[InputRun("data", run)]) as live:
        pass
    manifest = json.loads((live.path / "run.json").read_text())
    manifest["inputs"][0].update(run="../../outside", path="/nowhere")
    (live.path / "run.json").write_text(json.dumps(manifest))
    write_seal(live.path, {})
    assert [each.state for each in ancestry(Run(live.path)).inputs] == ["gone"]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"schema": "wristctl.run/2"}, None),
        ({"mood": "good"}, None),
        ({"schema": "wristctl.run/2", "kind": 3}, "newer"),
    ],
    ids=["a later schema", "a key more", "a later schema that this one cannot read"],
)
def test_runs_of_a_newer_wristctl_are_read_as_far_as_they_can_be(
    make: Make, change: dict[str, Any], said: str | None, caplog: pytest.LogCaptureFixture
) -> None:
    run = make()
    content = json.loads((run.path / "run.json").read_text())
    (run.path / "run.json").write_text(json.dumps({**content, **change}, indent=2))
    write_seal(run.path, {})
    found = open_run(run.path)
    if said:
        with pytest.raises(UserError, match=said):
            found.manifest  # noqa: B018
    else:
        assert found.manifest.kind == "gen-data" and found.state == "ok"
        assert ("newer wristctl" in caplog.text) == ("schema" in change)
    assert all(said in what for _, what in found.problems()) if said else found.problems() == []


def test_a_killed_replay_takes_its_repetition_with_it(tmp_path: Path) -> None:
    results, scratch = tmp_path / "results", tmp_path / "tmp"
    scratch.mkdir()
    environment = {**os.environ, "PYTHONPATH": str(Path(__file__).parents[2]), "TMPDIR": str(scratch)}
    wristctl = [sys.executable, "-P", "-m", "wristctl"]
    made = [*wristctl, "gen-data", "--samples", "2000", "--out", str(results)]
    subprocess.run(made, env=environment, check=True, capture_output=True)
    replay = [*wristctl, "runs", "replay", "latest:gen-data", "--out", str(results)]
    child = subprocess.Popen(replay, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    below = Path(f"/proc/{child.pid}/task/{child.pid}/children")
    while not (found := [each for each in below.read_text().split() if _repeats(each)]):
        time.sleep(0.01)
    child.kill()
    child.wait()
    until = time.monotonic() + 60.0
    while any(Path(f"/proc/{each}/environ").exists() and _lives(each) for each in found):
        assert time.monotonic() < until
        time.sleep(0.02)
    assert "ok" not in [run.state for each in scratch.glob("wristctl-replay-*") for run in list_runs(each)]


def _repeats(pid: str) -> bool:
    """Whether a child is the repetition already, and no longer a copy of its parent."""
    return b"--label\0replay" in Path(f"/proc/{pid}/cmdline").read_bytes()


def _lives(pid: str) -> bool:
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def test_of_a_run_in_a_read_only_archive_the_report_is_written_here(
    make: Make, small_disk: Callable[[int], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    archive = small_disk(5)
    run = make()
    shutil.copytree(run.path, archive / run.id)
    subprocess.run(["mount", "-o", "remount,ro", str(archive)], check=True)
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[object, str, str]:
        monkeypatch.setattr(sys, "argv", ["wristctl", "runs", *arguments, "--out", str(archive)])
        with pytest.raises(SystemExit) as ended:
            main()
        return ended.value.code, *capsys.readouterr()

    code, out, _ = call("report", run.id)
    assert code == 0 and out.strip() == f"report-{run.id}.html" and Path(out.strip()).is_file()
    for verb in (["tag", run.id, "a"], ["rm", run.id, "--yes"], ["report", run.id, "--to", str(archive / "page.html")]):
        code, _, err = call(*verb)
        assert code == 2 and "Read-only file system" in err and err.count("\n") == 1, verb
    for verb in (["ls"], ["show", run.id], ["verify"], ["lineage", run.id], ["gc"]):
        assert call(*verb)[0] == 0, verb
    assert Run(archive / run.id).problems() == []
