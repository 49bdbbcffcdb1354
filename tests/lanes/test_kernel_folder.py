"""Compiled kernels are kept where no other machine and nobody else writes: what is in their folder is loaded."""

from __future__ import annotations

import os
import pickle
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace

import pytest

from wristctl.lanes import compiled, kernel_folder
from wristctl.lanes.compiled import cache_folder
from wristctl.lanes.kernel_folder import is_shared, kernels_folder, own_folder

ROOT = Path(__file__).parents[2]


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "a home"
    monkeypatch.setenv("XDG_CACHE_HOME", str(place))
    monkeypatch.setenv("WRISTCTL_KERNELS", "")
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return place


def mounted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str, point: Path) -> None:
    file = tmp_path / "mounts"
    escaped = str(point).replace(" ", "\\040")
    file.write_text(f"/dev/sda1 / ext4 rw 0 0\nserver:/home {escaped} {kind} rw 0 0\n")
    monkeypatch.setattr(kernel_folder, "_MOUNTS", file)


def of_the_machine(tmp_path: Path) -> Path:
    return tmp_path / f"wristctl-kernels-{os.geteuid()}"


def test_on_a_disk_of_ones_own_it_is_the_users_cache(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mounted(monkeypatch, tmp_path, "xfs", home)
    folder = kernels_folder()
    assert folder == home / "wristctl" / "kernels" and folder.stat().st_mode & 0o777 == 0o700


@pytest.mark.parametrize("kind", ["nfs4", "lustre"])
def test_on_a_shared_home_it_is_on_this_machine_and_ones_own(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    mounted(monkeypatch, tmp_path, kind, home)
    assert is_shared(home / "wristctl") and not is_shared(tmp_path / "elsewhere")
    folder = kernels_folder()
    assert folder == of_the_machine(tmp_path)
    assert folder.stat().st_mode & 0o777 == 0o700 and kernels_folder() == folder


def test_a_folder_that_is_named_is_taken(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mounted(monkeypatch, tmp_path, "nfs", home)
    monkeypatch.setenv("WRISTCTL_KERNELS", str(tmp_path / "named"))
    assert kernels_folder() == tmp_path / "named"


def _open(folder: Path) -> None:
    folder.mkdir(parents=True)
    folder.chmod(0o777)


def _linked(folder: Path) -> None:
    """A link to a folder that others may write."""
    _open(folder.parent.parent / "theirs")
    folder.parent.mkdir(parents=True)
    folder.symlink_to(folder.parent.parent / "theirs")


def _of_another(folder: Path) -> None:
    folder.mkdir(parents=True)
    if os.geteuid() != 0:
        pytest.skip("giving a folder away needs root")
    os.chown(folder, 4711, 4711)


OPEN: dict[str, Callable[[Path], None]] = {
    "itself": _open,
    "its parent": lambda folder: _open(folder.parent),
    "the parent of its parent": lambda folder: _open(folder.parent.parent),
    "of another user": _of_another,
    "a parent of another user": lambda folder: _of_another(folder.parent),
    "a link": _linked,
}


@pytest.mark.parametrize("which", OPEN)
@pytest.mark.parametrize("named", [False, True], ids=["usual", "named"])
def test_a_folder_that_others_may_write_is_not_used_which_is_said_once(
    home: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    caplog: pytest.LogCaptureFixture,
    which: str,
    named: bool,
) -> None:
    usual = tmp_path / "a" / "named" / "one" if named else home / "wristctl" / "kernels"
    if named:
        monkeypatch.setenv("WRISTCTL_KERNELS", str(usual))
    OPEN[which](usual)
    for _ in range(3):
        assert kernels_folder() == of_the_machine(tmp_path)
    (said,) = (record.getMessage() for record in caplog.records)
    assert f"{of_the_machine(tmp_path)}" in said and "are not used" in said
    assert os.environ["WRISTCTL_KERNELS"] == str(of_the_machine(tmp_path)), "whom this process starts knows"


def test_without_a_folder_of_ones_own_nothing_is_kept(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    _open(home / "wristctl" / "kernels")
    _open(of_the_machine(tmp_path))
    assert kernels_folder() is None and "memory alone" in caplog.text
    monkeypatch.setattr(compiled, "_kernels", kernels_folder)
    (tmp_path / "law.py").write_text("gain = 1.0\n")
    assert cache_folder.__wrapped__(tmp_path / "law.py") is None


def test_a_folder_in_a_sticky_one_is_ones_own(home: Path) -> None:
    """As below /tmp: others may put theirs beside it, and cannot move it."""
    home.mkdir()
    home.chmod(0o1777)
    assert kernels_folder() == home / "wristctl" / "kernels"


@pytest.mark.parametrize(
    ("name", "members", "own"), [("ada", [], True), ("ada", ["ada"], True), ("ada", ["bob"], False), ("lab", [], False)]
)
def test_a_group_that_is_the_users_alone_is_the_user(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str, members: list[str], own: bool
) -> None:
    """As with a umask of 002."""
    usual = home / "wristctl" / "kernels"
    usual.mkdir(parents=True)
    for folder in (home, home / "wristctl", usual):
        folder.chmod(0o775)
    group = SimpleNamespace(gr_name=name, gr_mem=members)
    monkeypatch.setattr("pwd.getpwuid", lambda uid: SimpleNamespace(pw_name="ada", pw_gid=os.getegid()))
    monkeypatch.setattr("grp.getgrgid", lambda gid: group)
    assert kernels_folder() == (usual if own else of_the_machine(tmp_path))


@pytest.mark.parametrize("planted", ["a file of another user", "a file that others may write", "a link"])
def test_a_file_that_others_may_have_written_goes_with_its_folder(
    tmp_path: Path, caplog: pytest.LogCaptureFixture, planted: str
) -> None:
    folder = tmp_path / "0123456789abcdef"
    assert own_folder(folder) and folder.stat().st_mode & 0o777 == 0o700
    folder.chmod(0o755)
    file = folder / "law.nbi"
    if planted == "a link":
        file.symlink_to("/etc/hostname")
    else:
        file.touch()
        file.chmod(0o666)
    if planted == "a file of another user":
        if os.geteuid() != 0:
            pytest.skip("giving a file away needs root")
        file.chmod(0o600)
        os.chown(file, 4711, 4711)
    assert own_folder(folder) and list(folder.iterdir()) == [] and "others may have written them" in caplog.text


def test_files_of_a_closed_folder_may_have_any_mode(tmp_path: Path) -> None:
    """With a umask of 000 they have."""
    folder = tmp_path / "0123456789abcdef"
    assert own_folder(folder)
    (folder / "law.nbi").touch()
    (folder / "law.nbi").chmod(0o666)
    assert own_folder(folder) and (folder / "law.nbi").exists()


POISONED = """
import sys
from pathlib import Path
from law import double
print(double(2.0))
"""
LAW = """
from wristctl.lanes.compiled import kernel


@kernel
def double(x):
    return 2.0 * x
"""


class _Trap:
    def __init__(self, mark: Path) -> None:
        self.mark = mark

    def __reduce__(self) -> tuple[object, tuple[str]]:
        return os.mkdir, (str(self.mark),)


@pytest.mark.slow
def test_a_poisoned_kernel_is_not_loaded_and_compiled_anew(tmp_path: Path) -> None:
    """The index that numba keeps is a pickle."""
    (tmp_path / "law.py").write_text(LAW)
    (tmp_path / "cache").mkdir(mode=0o755)
    environment = {
        **os.environ,
        "XDG_CACHE_HOME": str(tmp_path / "cache"),
        "TMPDIR": str(tmp_path),
        "WRISTCTL_KERNELS": "",
    }
    environment["PYTHONPATH"] = f"{ROOT}{os.pathsep}{tmp_path}"

    def run() -> str:
        command = [sys.executable, "-c", POISONED]
        done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True, cwd=tmp_path)
        assert done.stdout == "4.0\n"
        return done.stderr

    assert run() == ""
    indexes = list((tmp_path / "cache" / "wristctl" / "kernels").rglob("*.nbi"))
    assert len(indexes) == 1 and run() == ""
    version = pickle.loads(indexes[0].read_bytes())  # the first of two
    indexes[0].write_bytes(pickle.dumps(version) + pickle.dumps(_Trap(tmp_path / "trapped")))
    for folder in (tmp_path / "cache", *indexes[0].parents[:3]):
        folder.chmod(0o777)
    said = run()
    assert "are not used" in said and said.count("\n") == 1 and not (tmp_path / "trapped").exists()
    (tmp_path / "cache").chmod(0o755)
    for folder in (*indexes[0].parents[1:3],):
        folder.chmod(0o755)
    assert "others may have written them" in run() and not (tmp_path / "trapped").exists()


def test_what_nothing_has_used_for_30_days_is_removed(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WRISTCTL_KERNELS", str(tmp_path / "named"))
    for days in (0.0, 29.0, 31.0, 400.0):
        folder = tmp_path / "named" / f"{days:g}"
        folder.mkdir(parents=True)
        (folder / "law.nbi").touch()
        os.utime(folder, (time.time() - 86400.0 * days,) * 2)
    assert compiled._kernels.__wrapped__() == tmp_path / "named"
    assert sorted(each.name for each in (tmp_path / "named").iterdir()) == ["0", "29"]


def test_the_folder_is_made_when_it_is_first_used_and_each_use_counts(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(compiled, "_kernels", kernels_folder)
    (tmp_path / "law.py").write_text("gain = 1.0\n")
    folder = cache_folder.__wrapped__(tmp_path / "law.py")
    assert folder is not None and folder.parent == home / "wristctl" / "kernels"
    os.utime(folder, (0.0, 0.0))
    assert cache_folder.__wrapped__(tmp_path / "law.py") == folder and list(folder.iterdir()) == []
    assert time.time() - folder.stat().st_mtime < 3600.0
    assert cache_folder.__wrapped__(tmp_path / "law.py", frozen=b"2") not in (folder, None)
    assert cache_folder.__wrapped__(tmp_path / "typed.py") is None
