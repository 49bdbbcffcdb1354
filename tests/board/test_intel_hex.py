"""Intel hex files: every kind of record, and what is wrong with a file is said with its line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import record
from wristctl.board.emulator.program import read_hex
from wristctl.errors import UserError

END = record(0, 1, b"")


def written(tmp_path: Path, *lines: str) -> Path:
    path = tmp_path / "program.hex"
    path.write_text("\n".join(lines))
    return path


def test_data_lies_where_its_records_say(tmp_path: Path) -> None:
    lines = record(0x0010, 0, b"abc"), record(0xFFFE, 0, b"de"), END
    assert read_hex(written(tmp_path, *lines)) == {0x10: b"abc", 0xFFFE: b"de"}
    assert read_hex(written(tmp_path, *(line.upper() for line in lines))) == {0x10: b"abc", 0xFFFE: b"de"}


def test_bases_are_of_16_bytes_or_of_64_kilobytes(tmp_path: Path) -> None:
    lines = (
        record(0, 2, bytes.fromhex("1234")), record(5, 0, b"a"),
        record(0, 4, bytes.fromhex("0003")), record(6, 0, b"b"), record(7, 0, b"c"),
        record(0, 4, bytes.fromhex("0000")), record(8, 0, b"d"), END,
    )  # fmt: skip
    assert read_hex(written(tmp_path, *lines)) == {0x12345: b"a", 0x30006: b"b", 0x30007: b"c", 8: b"d"}


def test_starting_addresses_and_what_follows_the_end_do_not_count(tmp_path: Path) -> None:
    lines = record(0, 3, bytes(4)), record(0, 5, b"\0\1\2\3"), record(9, 0, b"a"), END, "anything"
    assert read_hex(written(tmp_path, *lines)) == {9: b"a"}


@pytest.mark.parametrize(
    ("line", "said"),
    [
        (record(0, 0, b"abc")[1:], "not a line"),
        (record(0, 0, b"abc")[:-2], "not a line"),
        (record(0, 0, b"abc") + "00", "not a line"),
        (":", "not a line"),
        ("", "not a line"),
        (":0300zz", "not a line"),
        (record(0, 0, b"abc")[:-1] + "0", "check sum"),
    ],
)
def test_a_wrong_line_is_named(tmp_path: Path, line: str, said: str) -> None:
    path = written(tmp_path, record(0, 0, b"ab"), line, END)
    with pytest.raises(UserError, match=said) as told:
        read_hex(path)
    assert f"{path}:2" in str(told.value)


def test_a_file_that_ends_too_early_or_is_none_is_said(tmp_path: Path) -> None:
    with pytest.raises(UserError, match="before its end record"):
        read_hex(written(tmp_path, record(0, 0, b"ab")))
    with pytest.raises(UserError, match="cannot read the program"):
        read_hex(tmp_path / "none.hex")
