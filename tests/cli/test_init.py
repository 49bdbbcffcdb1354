"""`wristctl init` lays the experiments out, whole and over nothing."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import pytest

from tests.cli.conftest import ROOT, Command

SOURCE = ROOT / "experiments"


def _files(folder: Path) -> dict[str, bytes]:
    found = (each for each in folder.rglob("*") if each.is_file() and each.suffix != ".pyc")
    return {each.relative_to(folder).as_posix(): each.read_bytes() for each in found}


def test_init_lays_all_experiments_out_and_its_next_lines_run(
    wristctl: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    done = wristctl("init", "my study")
    assert done.returncode == 0 and _files(tmp_path / "my study" / "experiments") == _files(SOURCE)
    assert [each.name for each in (tmp_path / "my study").iterdir()] == ["experiments"]
    lines = [shlex.split(line) for line in re.findall(r"^  (.*)$", done.stdout, re.MULTILINE)]
    assert lines[0] == ["cd", "my study"] and len(lines) > 4
    monkeypatch.chdir(lines[0][1])
    for _, *typed in lines[1:]:
        said = wristctl(*typed, "--dry-run")
        assert said.returncode == 0 or re.search(r"no [a-z-]+ run that ended ok - latest:", said.stderr), said.stderr


def test_init_goes_into_a_folder_of_yours_and_writes_over_nothing(wristctl: Command, tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    assert wristctl("init", ".").returncode == 0
    (tmp_path / "experiments" / "quick.yaml").write_text("seed: 5")
    before = _files(tmp_path)
    again = wristctl("init", ".")
    assert again.returncode == 2 and re.search(r"already.* - experiments - fix: another folder", again.stderr)
    assert _files(tmp_path) == before and before["notes.txt"] == b"mine"


def test_init_that_cannot_write_leaves_nothing(
    wristctl: Command, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "file").write_text("")
    assert re.search(r"cannot write: .* - file/experiments - fix: .*DIR", wristctl("init", "file").stderr)
    write, left = Path.write_bytes, [3]

    def full(file: Path, content: bytes) -> int:
        left[0] -= 1
        if not left[0]:
            raise OSError(28, "No space left on device")
        return write(file, content)

    monkeypatch.setattr(Path, "write_bytes", full)
    done = wristctl("init", "study")
    assert done.returncode == 2 and "No space left on device" in done.stderr
    assert list((tmp_path / "study").iterdir()) == []
