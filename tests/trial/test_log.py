"""The log loses nothing, whatever the disk does."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.trial.log import FRAMES, Disk, Stream, TrialLog, tick_columns, truth_columns
from wristctl.trial.residuals import columns


def test_rows_read_back_exactly_and_nan_is_empty(tmp_path: Path) -> None:
    stream = Stream(tmp_path / "frames.csv", FRAMES, Disk(tmp_path))
    stream.row((0, 7, 0.1 + 0.2, 1e-17, float("nan"), "no tip"))
    stream.close()
    text = (tmp_path / "frames.csv").read_text()
    assert text.splitlines()[1] == "0,7,0.30000000000000004,1e-17,,no tip"
    row = pd.read_csv(tmp_path / "frames.csv").iloc[0]
    assert row["captured"] == 0.1 + 0.2 and pd.isna(row["theta"])


def test_every_row_is_in_the_file_at_once(tmp_path: Path) -> None:
    stream = Stream(tmp_path / "frames.csv", FRAMES, Disk(tmp_path))
    for number in range(3):
        stream.row((0, number, 0.0, 0.0, 0.0, "ok"))
        assert pd.read_csv(tmp_path / "frames.csv")["number"].tolist() == list(range(number + 1))
    stream.close()


def test_a_full_disk_is_told_and_what_was_pending_is_written_into_the_reserve(tmp_path: Path) -> None:
    disk = Disk(tmp_path)
    stream = Stream(tmp_path / "frames.csv", FRAMES, disk)
    stream.row((0, 0, 0.0, 0.0, 0.0, "ok"))
    disk.pretend_full = True
    for number in (1, 2):
        with pytest.raises(OSError, match="No space left"):
            stream.row((0, number, 0.0, 0.0, 0.0, "ok"))
    assert len(pd.read_csv(tmp_path / "frames.csv")) == 1
    disk.give_up_reserve()
    stream.close()
    assert pd.read_csv(tmp_path / "frames.csv")["number"].tolist() == [0, 1, 2]
    assert not list(tmp_path.glob(".*"))


def test_a_trials_truth_is_written_a_little_with_each_tick_and_whole_at_the_end(tmp_path: Path) -> None:
    """So that no tick waits for it, and a process that is killed loses no earlier trial's."""
    log = TrialLog(tmp_path, 2, 5e-3)
    truth = np.random.default_rng(1).random((1000, len(truth_columns(2)) - 1))
    log.truth(3, truth)
    sizes = []
    for _ in range(10):
        log.tick(dict.fromkeys(tick_columns(1), 0.0) | {"trial": -1})
        sizes.append(len(pd.read_csv(tmp_path / "truth.csv")))
    assert sizes[0] > 5 and max(np.diff(sizes)) < 100 and sizes[-1] < 1000
    log.close()
    table = pd.read_csv(tmp_path / "truth.csv")
    assert set(table["trial"]) == {3} and np.array_equal(table.iloc[:, 1:].to_numpy(), truth)


def test_on_the_computers_clock_each_tick_has_its_date_and_in_virtual_time_none(tmp_path: Path) -> None:
    for name, monotonic in (("real", True), ("virtual", False)):
        (tmp_path / name).mkdir()
        log = TrialLog(tmp_path / name, None, 5e-3, monotonic)
        log.tick(dict.fromkeys(tick_columns(1), 0.0) | {"trial": 0, "clock": time.monotonic() - 100.0})
        log.close()
    assert time.time() - pd.read_csv(tmp_path / "real/log.csv")["utc"][0] == pytest.approx(100.0, abs=5.0)
    assert pd.read_csv(tmp_path / "virtual/log.csv")["utc"].isna().all()


def test_a_full_disk_stops_a_tick_and_never_the_wire(tmp_path: Path) -> None:
    """The bytes that stop the motors are among those to be written."""
    log = TrialLog(tmp_path, None, 5e-3)
    log.disk.pretend_full = True
    log.wire(1.0, "sent", b"\x01\xff")
    with pytest.raises(OSError, match="No space left"):
        log.tick(dict.fromkeys(tick_columns(1), 0.0) | {"trial": 0})
    log.wire(1.5, "came", b"\x02")
    log.close()
    wire = pd.read_csv(tmp_path / "wire.csv", dtype=str)
    assert wire.to_numpy().tolist() == [["1.0", "sent", "01ff"], ["1.5", "came", "02"]]


def test_residuals_stand_under_their_own_names_in_whatever_order_they_come(tmp_path: Path) -> None:
    log = TrialLog(tmp_path, None, 0.01)
    names = list(columns(1, False))
    log.residuals(3, 1.5, {name: float(names.index(name)) for name in reversed(names)})
    log.close()
    table = pd.read_csv(tmp_path / "residuals.csv")
    assert table.loc[0].to_dict() == {"trial": 3.0, "clock": 1.5, **{name: float(k) for k, name in enumerate(names)}}
