"""avrdude is called for the right chip and file, and what it says in the end is told."""

from __future__ import annotations

import hashlib
from pathlib import Path

import pytest

from wristctl.board.board_errors import BoardError
from wristctl.board.flashing import IMAGE, flash


@pytest.fixture
def avrdude(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Says what it was given, and ends as the file `code` says."""
    program = tmp_path / "bin" / "avrdude"
    program.parent.mkdir()
    program.write_text('#!/bin/sh\necho "$@"\necho\necho "  Error: no sync  "\necho bye >&2\nexit $(cat "$0.code")\n')
    program.chmod(0o755)
    (tmp_path / "bin" / "avrdude.code").write_text("0")
    monkeypatch.setenv("PATH", f"{program.parent}:/usr/bin:/bin")
    return program


def image(tmp_path: Path) -> Path:
    file = tmp_path / "some.hex"
    file.write_text(":00000001FF")
    return file


def test_the_image_is_written_through_the_boot_loader(avrdude: Path, tmp_path: Path) -> None:
    said: list[str] = []
    flash("socket://here:5000", image(tmp_path), said.append)
    assert said[0].split() == (
        f"-c wiring -p atmega2560 -P net:here:5000 -b 115200 -D -U flash:w:{tmp_path}/some.hex:i".split()
    )
    assert said[1:] == ["Error: no sync", "bye"], "what it says, without empty lines"


def test_a_failure_is_told_by_its_last_error(avrdude: Path, tmp_path: Path) -> None:
    avrdude.with_name("avrdude.code").write_text("1")
    with pytest.raises(BoardError, match="cable: Error: no sync") as told:
        flash("/dev/a", image(tmp_path))
    assert told.value.exit_code == 4 and told.value.where == "/dev/a"


def test_without_avrdude_nothing_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BoardError, match="avrdude is not installed"):
        flash("/dev/a", image(tmp_path))


def test_an_image_that_is_not_what_its_check_sum_says_is_not_written(avrdude: Path, tmp_path: Path) -> None:
    file, beside = image(tmp_path), tmp_path / "some.hex.sha256"
    beside.write_text(hashlib.sha256(file.read_bytes()).hexdigest() + "  some.hex\n")
    flash("/dev/a", file)
    file.write_text(":00000001FE")
    with pytest.raises(BoardError, match="not what its check sum says") as told:
        flash("/dev/a", file)
    assert told.value.exit_code == 4
    with pytest.raises(BoardError, match="no such firmware") as told:
        flash("/dev/a", tmp_path / "none.hex")
    assert told.value.exit_code == 2


def test_the_packaged_image_has_its_check_sum_beside_it() -> None:
    assert IMAGE.with_name("wrist.hex.sha256").read_text().split()[0] == hashlib.sha256(IMAGE.read_bytes()).hexdigest()
