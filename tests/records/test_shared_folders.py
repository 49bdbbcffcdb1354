"""Results folders without locks, of several people, with a damaged index or tags, or read-only."""

from __future__ import annotations

import errno
import fcntl
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

from wristctl.cli.app import main
from wristctl.cli.runs.verification import Verified
from wristctl.config.study import Study
from wristctl.plain_files import UNREADABLE
from wristctl.records import Run, list_runs, open_run, start_run
from wristctl.records.find import entries
from wristctl.records.index import INDEX
from wristctl.records.lock import LOCK, is_locked
from wristctl.records.manifest import SIGNATURE
from wristctl.records.removal import leftovers, remove
from wristctl.records.tags import change_tags, read_tags

Make = Callable[..., Run]
ROOT = Path(__file__).parents[2]


def test_without_locks_a_run_goes_on_while_its_lock_file_is_there(
    make: Make, results: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def no_locks(*_: object) -> None:
        raise OSError(errno.ENOLCK, "No locks available")

    monkeypatch.setattr(fcntl, "flock", no_locks)
    with start_run("tune", Study(), "", results) as live:
        assert Run(live.path).state == "running" and not list(leftovers(results))
    run = Run(live.path)
    assert run.state == "ok" and change_tags(results, run.id, add=["a"]) == ["a"]
    remove(run)
    assert not run.path.exists()


def test_a_lock_that_is_a_fifo_holds_nobody_up(make: Make) -> None:
    run = make()
    os.mkfifo(run.path / LOCK)
    assert not is_locked(run.path)


def test_a_lock_file_alone_is_no_sign_of_life(make: Make) -> None:
    run = make()
    (run.path / LOCK).write_text("elsewhere 0-0 12 345")
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


def test_of_a_run_in_a_read_only_archive_the_report_is_written_here(
    make: Make, small_disk: Callable[[int], Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:  # fmt: skip
    archive = small_disk(5)
    run = make()
    shutil.copytree(run.path, archive / run.id)
    subprocess.run(["mount", "-o", "remount,ro", str(archive)], check=True)
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))

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


ONE, ANOTHER = 65534, 65533
"""Users without a home, who may read this checkout."""


@pytest.fixture
def shared() -> Iterator[Path]:
    """A folder in which everybody may write, on a way that everybody may go."""
    if shutil.which("setpriv") is None or by(ONE, Path("/"), "--version")[0] != 0:
        pytest.skip("needs root, setpriv, and an interpreter that others may use")
    folder = Path(tempfile.mkdtemp(prefix="wristctl-shared-"))
    folder.chmod(0o755)
    (folder / "results").mkdir()
    (folder / "results").chmod(0o777)
    yield folder
    shutil.rmtree(folder)


def by(user: int, folder: Path, *arguments: str, umask: int = 0o022) -> tuple[int, str, str]:
    """Exit code, stdout and stderr of a command of this user."""
    become = ["setpriv", "--reuid", str(user), "--regid", str(user), "--clear-groups", sys.executable, "-P", "-c"]
    environment = {"PATH": os.environ["PATH"], "PYTHONPATH": str(ROOT), "HOME": "/nonexistent", "MPLCONFIGDIR": "/tmp"}
    done = subprocess.run(
        [*become, "from wristctl.cli.app import main; main()", *arguments],
        cwd=folder, env=environment, capture_output=True, text=True, umask=umask,
    )  # fmt: skip
    return done.returncode, done.stdout, done.stderr


@pytest.mark.slow
def test_in_a_folder_of_several_people_nobody_deletes_or_locks_out_another(shared: Path) -> None:
    assert by(ONE, shared, "gen-data", "--samples", "50")[0] == 0
    (run,) = list_runs(shared / "results")
    for user in (ONE, ANOTHER):
        assert by(user, shared, "runs", "tag", run.id, f"of-{user}")[0] == 0
    assert read_tags(shared / "results")[run.id] == [f"of-{ANOTHER}", f"of-{ONE}"]
    code, _, said = by(ANOTHER, shared, "runs", "rm", run.id, "--yes")
    assert code == 2 and "you may not delete this run" in said and said.count("\n") == 1
    assert run.problems() == [] and len(read_tags(shared / "results")[run.id]) == 2
    assert by(ANOTHER, shared, "runs", "verify")[:2] == (0, f"{run.id}  as sealed\n")

    left = run.path.with_name(f".{run.id}.removed")
    run.path.rename(left)
    assert by(ANOTHER, shared, "gen-data", "--samples", "60")[0] == 0
    (shared / "results" / ".index-left").write_text("")
    code, _, said = by(ANOTHER, shared, "runs", "gc", "--yes")
    assert code == 2 and "1 of 2 leftovers are not yours to delete" in said and said.count("\n") == 1
    assert not (shared / "results" / ".index-left").exists()
    assert by(ONE, shared, "runs", "gc", "--yes")[0] == 0 and not left.exists()


@pytest.mark.slow
def test_a_run_that_is_nobody_elses_to_read_is_said_to_be_so(shared: Path) -> None:
    assert by(ONE, shared, "gen-data", "--samples", "50", umask=0o077)[0] == 0
    (run,) = list_runs(shared / "results")
    code, out, said = by(ANOTHER, shared, "runs", "ls")
    assert (code, said) == (0, "") and "broken" in out and "cannot be read: Permission denied" in out
    code, out, _ = by(ANOTHER, shared, "runs", "verify")
    assert code == 3
    assert out == f"{run.id}  could not be checked\n  SHA256SUMS: cannot be read: Permission denied\n"
    for verb in (["show", run.id], ["report", run.id], ["lineage", run.id], ["tag", run.id, "a"]):
        code, _, said = by(ANOTHER, shared, "runs", *verb)
        assert code == 2 and "cannot be read: Permission denied" in said and said.count("\n") == 1, verb
    assert by(ANOTHER, shared, "runs", "gc")[:2] == (0, "nothing is left over in results\n")
    assert by(ONE, shared, "runs", "verify")[0] == 0


@pytest.mark.parametrize(
    ("problems", "said"),
    [
        ([("a.csv", UNREADABLE + "Permission denied")], "could not be checked"),
        ([("a.csv", UNREADABLE + "Permission denied"), (SIGNATURE, "not signed")], "could not be checked"),
        ([("a.csv", UNREADABLE + "Permission denied"), ("b.csv", "is not as it was sealed")], "changed"),
        ([("b.csv", "is not as it was sealed"), (SIGNATURE, "not signed")], "changed"),
        ([(SIGNATURE, "not signed")], "as sealed, but nobody vouches for it"),
        ([], "as sealed"),
    ],
)
def test_a_run_of_which_one_file_is_changed_is_so_whatever_cannot_be_read(
    problems: list[tuple[str, str]], said: str
) -> None:
    assert Verified(problems).said == said
