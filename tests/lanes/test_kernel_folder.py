"""Compiled kernels are kept where no other machine writes."""

from __future__ import annotations

import os
import time
from pathlib import Path

import pytest

from wristctl.lanes import compiled as kernel_folder
from wristctl.lanes.compiled import cache_folder, is_shared, kernels_folder


@pytest.fixture
def home(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    place = tmp_path / "a home"
    monkeypatch.setenv("XDG_CACHE_HOME", str(place))
    monkeypatch.delenv("WRISTCTL_KERNELS", raising=False)
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    return place


def mounted(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, kind: str, point: Path) -> None:
    file = tmp_path / "mounts"
    escaped = str(point).replace(" ", "\\040")
    file.write_text(f"/dev/sda1 / ext4 rw 0 0\nserver:/home {escaped} {kind} rw 0 0\n")
    monkeypatch.setattr(kernel_folder, "_MOUNTS", file)


def test_on_a_disk_of_ones_own_it_is_the_users_cache(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mounted(monkeypatch, tmp_path, "xfs", home)
    assert kernels_folder() == home / "wristctl" / "kernels"


@pytest.mark.parametrize("kind", ["nfs4", "lustre"])
def test_on_a_shared_home_it_is_on_this_machine_and_ones_own(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kind: str
) -> None:
    mounted(monkeypatch, tmp_path, kind, home)
    assert is_shared(home / "wristctl") and not is_shared(tmp_path / "elsewhere")
    folder = kernels_folder()
    assert folder.parent == tmp_path and folder.stat().st_mode & 0o777 == 0o700 and kernels_folder() == folder


def test_a_folder_that_others_may_write_is_not_used(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    mounted(monkeypatch, tmp_path, "nfs", home)
    kernels_folder().chmod(0o777)
    with pytest.raises(PermissionError, match="not this user's alone"):
        kernels_folder()


def test_a_folder_that_is_named_is_taken(home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    mounted(monkeypatch, tmp_path, "nfs", home)
    monkeypatch.setenv("WRISTCTL_KERNELS", str(tmp_path / "named"))
    assert kernels_folder() == tmp_path / "named"


def test_what_nothing_has_used_for_30_days_is_removed(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("WRISTCTL_KERNELS", str(tmp_path / "named"))
    for days in (0.0, 29.0, 31.0, 400.0):
        folder = tmp_path / "named" / f"{days:g}"
        folder.mkdir(parents=True)
        (folder / "law.nbi").touch()
        os.utime(folder, (time.time() - 86400.0 * days,) * 2)
    assert kernel_folder._kernels.__wrapped__() == tmp_path / "named"
    assert sorted(each.name for each in (tmp_path / "named").iterdir()) == ["0", "29"]


def test_the_folder_is_made_when_it_is_first_used_and_each_use_counts(
    home: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(kernel_folder, "_kernels", kernels_folder)
    (tmp_path / "law.py").write_text("gain = 1.0\n")
    folder = cache_folder.__wrapped__(tmp_path / "law.py")
    assert folder is not None and folder.parent == home / "wristctl" / "kernels"
    os.utime(folder, (0.0, 0.0))
    assert cache_folder.__wrapped__(tmp_path / "law.py") == folder and list(folder.iterdir()) == []
    assert time.time() - folder.stat().st_mtime < 3600.0
    assert cache_folder.__wrapped__(tmp_path / "law.py", frozen=b"2") not in (folder, None)
    assert cache_folder.__wrapped__(tmp_path / "typed.py") is None
