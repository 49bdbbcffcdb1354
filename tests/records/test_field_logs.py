"""One motion, as laboratories write it, is read to the same numbers."""

from pathlib import Path

import numpy as np
import pytest

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log

FIELD = Path(__file__).parents[1] / "data" / "field"
CLEAN = Path(__file__).parents[2] / "experiments" / "logs" / "clean.csv"
MATLAB = "time=t [s], bend_y=theta [rad], spool_1=l1 [m], spool_2=l2 [m]"


@pytest.mark.parametrize("name", ["german.csv", "units_row.csv"])
def test_other_dialects_read_to_the_same_numbers(name: str) -> None:
    clean, other = read_log(CLEAN), read_log(FIELD / name)
    assert {key: column.tolist() for key, column in other.columns.items()} == {
        key: column.tolist() for key, column in clean.columns.items()
    }


def test_text_among_the_numbers_is_passed_over_and_told_with_its_lines() -> None:
    clean, serial = read_log(CLEAN), read_log(FIELD / "serial.txt")
    np.testing.assert_array_equal(serial.columns["bend_y"], clean.columns["bend_y"])
    assert "2 lines of text (line 1, 403)" in serial.remarks[0]
    assert serial.lines[400] == 404  # not the line of the text


def test_more_text_than_one_line_in_twenty_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = [f"{k},{k}" for k in range(38)]
    file.write_text("\n".join(["time [s],bend_y [deg]", "note", *rows, "note"]))
    with pytest.raises(UserError) as refused:
        read_log(file)
    assert f"{file}:2" in str(refused.value)
    file.write_text("\n".join(["time [s],bend_y [deg]", "note", *rows, "38,38", "39,39", "note"]))
    assert len(read_log(file)) == 40


def test_a_torn_row_of_numbers_is_no_text(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    rows = [f"{k},{k},0" for k in range(100)]
    file.write_text("\n".join(["time [s],bend_y [deg],bend_z [deg]", *rows, "100,1"]))
    with pytest.raises(UserError, match="2 cells under 3 columns"):
        read_log(file)


def test_utf_16_and_a_repeated_header(tmp_path: Path) -> None:
    text = CLEAN.read_text()
    head, rows = text.partition("\n")[0], text.splitlines()[1:]
    file = tmp_path / "log.csv"
    file.write_text("\n".join([head, *rows[:400], head, *rows[400:]]), encoding="utf-16")
    log = read_log(file)
    np.testing.assert_array_equal(log.columns["time"], read_log(CLEAN).columns["time"])
    assert len(log.remarks) == 1


def test_a_spreadsheet_of_windows_is_read_in_its_own_encoding(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("Zeit [s];Biegung [°];Länge [mm]\n0,5;90;1\n", encoding="cp1252")
    with pytest.raises(UserError) as refused:
        read_log(file)
    proposed = "time=Zeit [s], bend_y=Biegung [deg], spool_1=Länge [mm]"
    assert f"--columns '{proposed}'" in refused.value.fix
    assert read_log(file, proposed).columns["bend_y"] == pytest.approx(0.5 * np.pi)
    file.write_bytes(b"time [s]\n\xb0\x00\n")
    with pytest.raises(UserError, match="no text in UTF-8, UTF-16 or Windows-1252"):
        read_log(file)


def test_a_decimal_comma_and_a_point_in_one_file_are_refused(tmp_path: Path) -> None:
    file = tmp_path / "log.csv"
    file.write_text("time [s];bend_y [deg]\n0.5;1,234\n")
    with pytest.raises(UserError, match="'1,234'"):
        read_log(file)


def test_vectors_of_matlab() -> None:
    clean, log = read_log(CLEAN), read_log(FIELD / "log.mat", MATLAB)
    for name, column in clean.columns.items():
        np.testing.assert_allclose(
            log.columns[name], column, atol=1e-6
        )  # of seconds, metres and radians: the table has fewer digits
    with pytest.raises(UserError, match="'l3'"):
        read_log(FIELD / "log.mat", MATLAB + ", spool_3=l3 [m]")
