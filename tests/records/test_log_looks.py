"""What no wrist does is refused at its line before anything is fitted; what is mended is told."""

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.errors import UserError
from wristctl.records.log_converters import read_log
from wristctl.records.log_looks import looked_at

FIELD = Path(__file__).parents[1] / "data" / "field"
COUNTS = "time=ms [ms], bend_y=imu [deg], spool_1=enc1 [0.000719 mm], spool_2=enc2 [0.000719 mm]"


@pytest.mark.parametrize(
    ("name", "columns", "words"),
    [
        ("swapped.csv", "", "exchanged"),
        ("degrees_as_rad.csv", "", "in degrees"),
        ("ms_as_s.csv", "", "in ms"),
        ("still.csv", "", "without motion"),
        ("wrapped_counts.csv", COUNTS, "enc1 jumps 47 mm"),
    ],
)
def test_refused_before_a_fit(name: str, columns: str, words: str) -> None:
    with pytest.raises(UserError) as refused:
        looked_at(read_log(FIELD / name, columns))
    assert words in str(refused.value)
    if columns:
        assert f"{name}:27" in str(refused.value)


@pytest.mark.parametrize("tendon", [1, 2])
def test_millimetres_under_a_head_of_metres_are_refused_at_the_furthest_sample(tendon: int, tmp_path: Path) -> None:
    table = pd.read_csv(FIELD / "clean.csv")
    (head,) = (name for name in map(str, table) if name.startswith(f"spool_{tendon} [mm]"))
    changed = table.rename(columns={head: f"spool_{tendon} [m]"})
    changed.to_csv(tmp_path / "metres.csv", index=False)
    with pytest.raises(UserError, match="is it in mm") as refused:
        looked_at(read_log(tmp_path / "metres.csv"))
    furthest = int(table[head].abs().argmax()) + 2
    assert f"spool_{tendon}" in str(refused.value) and f"metres.csv:{furthest}" in str(refused.value)


def test_a_sound_log_stays_as_it_is() -> None:
    log = read_log(FIELD / "clean.csv")
    assert looked_at(log) is log


def test_repeated_rows_are_left_out_and_told() -> None:
    clean, log = read_log(FIELD / "clean.csv"), looked_at(read_log(FIELD / "duplicate.csv"))
    for name, column in clean.columns.items():
        np.testing.assert_array_equal(log.columns[name], column)
    assert log.remarks[0].startswith("3 rows")


def test_a_clock_that_starts_again_parts_the_log() -> None:
    log = looked_at(read_log(FIELD / "clock_reset.csv"))
    trials = log.trials()
    assert len(trials) == 2
    assert all(np.all(np.diff(trial.columns["time"]) > 0.0) for trial in trials.values())
    assert ":502:" in log.remarks[0]
