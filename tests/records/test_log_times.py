"""Dates, times of the day and Unix times are seconds from the first row, and it is said."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import OpenLog

STEPS = [0.0, 0.01, 0.02, 0.55]


def log_of(folder: Path, times: list[str], head: str = "time", mark: str = ",", names: str = "") -> OpenLog:
    file = folder / "log.csv"
    file.write_text(f"{head}{mark}bend_y [deg]\n" + "".join(f"{cell}{mark}1\n" for cell in times), encoding="utf-8")
    return read_log(file, names)


@pytest.mark.parametrize(
    "times",
    [
        ["2026-11-27T23:59:59.990", "2026-11-28T00:00:00", "2026-11-28T00:00:00.010", "2026-11-28 00:00:00.540"],
        ["2026-11-28T00:30:00.99Z", "2026-11-28T00:30:01.000Z", "2026-11-28T01:30:01.010+01:00",
         "2026-11-27T19:30:01.54-05:00"],
        ["27.11.2026 23:59:59.99", "28.11.2026 00:00:00", "28.11.2026 0:00:00.01", "28.11.2026 00:00:00.540"],
        ["23:59:59.99", "00:00:00", "0:00:00.010", "00:00:00.540"],
        ["1795906800.990", "1795906801.000", "1795906801.01", "1795906801.54"],
        ["1795906800990", "1795906801000", "1795906801010", "1795906801540"],
        ["1795906800990000", "1795906801000000", "1795906801010000", "1795906801540000"],
        ["1795906800990000000", "1795906801000000000", "1795906801010000000", "1795906801540000000"],
    ],
)  # fmt: skip
def test_dates_and_unix_times_of_any_unit_are_the_same_seconds(tmp_path: Path, times: list[str]) -> None:
    log = log_of(tmp_path, times)
    np.testing.assert_allclose(log.columns["time"], STEPS, atol=3e-7)
    assert len(log.remarks) == 1 and "first row" in log.remarks[0]


def test_nanoseconds_keep_their_last_digit_and_decimal_commas_are_read(tmp_path: Path) -> None:
    times = log_of(tmp_path, ["1795906800000000001", "1795906800000000008"]).columns["time"]
    assert times.tolist() == [0.0, pytest.approx(7e-9, rel=1e-12)]
    german = log_of(tmp_path, ["2026-11-27T23:59:59,990", "", "2026-11-28T00:00:00,5"], mark=";")
    np.testing.assert_allclose(german.columns["time"], [0.0, np.nan, 0.51])


def test_a_unit_in_the_header_is_held_against_the_year(tmp_path: Path) -> None:
    log = log_of(tmp_path, ["1795906800990", "1795906801000"], "time [ms]")
    assert log.columns["time"].tolist() == [0.0, 0.01] and "2026-11-28" in log.remarks[0]
    with pytest.raises(UserError, match=r"after 1970 by its header - .*log.csv:2 - fix: is it in ms"):
        log_of(tmp_path, ["1795906800990", "1795906801000"], "time [s]")
    named = log_of(tmp_path, ["2026-11-27T10:00:00", "2026-11-27T10:00:01"], "Zeit", names="time=Zeit [s]")
    assert named.columns["time"].tolist() == [0.0, 1.0]


def test_plain_seconds_stay_as_they_are_wherever_they_begin(tmp_path: Path) -> None:
    log = log_of(tmp_path, ["5.5", "5.6"], "time [s]")
    assert log.columns["time"].tolist() == [5.5, 5.6] and not log.remarks


def test_a_cell_that_is_no_date_is_refused_with_its_line(tmp_path: Path) -> None:
    with pytest.raises(UserError, match=r"time is 'soon' - .*log.csv:3 - fix: a date"):
        log_of(tmp_path, ["2026-11-27T10:00:00", "soon"])
    with pytest.raises(UserError, match=r"time is '10:00' - .*log.csv:3 - fix: a time of the day"):
        log_of(tmp_path, ["10:00:00", "10:00"])


def test_dates_of_a_parquet_file(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    times = pd.to_datetime(["2026-11-27T23:59:59.990", "2026-11-28T00:00:00.000"]).tz_localize("Europe/Berlin")
    pd.DataFrame({"time": times, "bend_y [deg]": [1.0, 2.0]}).to_parquet(tmp_path / "log.parquet")
    log = read_log(tmp_path / "log.parquet")
    np.testing.assert_allclose(log.columns["time"], [0.0, 0.01])
    np.testing.assert_allclose(log.columns["bend_y"], np.radians([1.0, 2.0]))
