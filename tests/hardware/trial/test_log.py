"""The log loses nothing, whatever the disk does."""

from __future__ import annotations

from pathlib import Path

import pandas as pd
import pytest

from wristctl.hardware.trial.log import FRAMES, Disk, Stream


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
