"""A trial is drawn while its log grows: whole rows only, and no more of them than asked for."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pandas as pd
import pytest

from wristctl.commands.hw_run.live_figure import newest_rows, recent
from wristctl.trial.log import tick_columns

PERIOD = 0.005


def rows(count: int) -> pd.DataFrame:
    time = PERIOD * np.arange(count)
    words = {"state": "ENABLED", "verdict": "ok", "faults": "ESTOP"}
    return pd.DataFrame({name: words.get(name, time) for name in tick_columns(1)} | {"trial": 1, "theta": 0.1 * time})


@pytest.mark.parametrize("count", [1, 300, 4000])
def test_the_last_seconds_are_read_but_for_a_row_that_is_being_written(tmp_path: Path, count: int) -> None:
    log, whole = tmp_path / "log.csv", rows(count)
    log.write_text(whole.to_csv(index=False) + "1,0.12")
    found = newest_rows(log, 1.0, PERIOD)
    pd.testing.assert_frame_equal(
        found.reset_index(drop=True), whole[-200:].reset_index(drop=True), check_dtype=False, atol=1e-12
    )


def test_the_picture_shows_angle_and_reference_up_to_now() -> None:
    above, below = recent(rows(100)).axes
    (angle,) = (each for each in above.lines if each.get_label() == "angle")
    assert np.asarray(angle.get_xdata())[-1] == 0.0
    np.testing.assert_allclose(np.asarray(angle.get_ydata()), np.degrees(0.1 * PERIOD * np.arange(100)))
    assert [each.get_label() for each in below.lines] == [f"tendon {number}" for number in (1, 2, 4, 5)]


def test_before_the_first_row_there_are_axes_and_no_lines() -> None:
    assert not any(axes.lines for axes in recent(rows(0)).axes)


def test_rows_may_be_as_long_as_a_thousand_bytes(tmp_path: Path) -> None:
    log, whole = tmp_path / "log.csv", rows(1000)
    long = whole.assign(state="x" * 265)
    assert 950 < max(map(len, long.to_csv(index=False).splitlines())) <= 1000
    log.write_text(long.to_csv(index=False))
    assert len(newest_rows(log, 1.0, PERIOD)) == 200


def test_a_row_that_is_whole_is_read_however_short_the_log(tmp_path: Path) -> None:
    log, whole = tmp_path / "log.csv", rows(3)
    log.write_text(whole.to_csv(index=False))
    assert list(newest_rows(log, 100.0, PERIOD)["clock"]) == pytest.approx(list(whole["clock"]))


def test_the_picture_is_in_degrees_with_the_marker_where_its_frame_was_taken() -> None:
    table = rows(100).assign(theta_ref=0.2, theta_measured=0.3, captured=0.1, state="ENABLED")
    table["clock"] = table["time"] + 50.0
    table.loc[99, "state"] = "STOPPED"
    above, below = recent(table).axes
    lines = {str(each.get_label()): each for each in above.lines}
    np.testing.assert_allclose(np.asarray(lines["reference"].get_ydata()), np.degrees(0.2))
    np.testing.assert_allclose(np.asarray(lines["marker"].get_ydata()), np.degrees(0.3))
    np.testing.assert_allclose(np.asarray(lines["marker"].get_xdata()), 0.1 - 0.495, atol=1e-12)
    assert np.asarray(lines["angle"].get_xdata())[0] == pytest.approx(-0.495)
    assert above.get_title("left") == "trial 2, 0.5 s, board STOPPED"
    assert (above.get_ylabel(), below.get_xlabel(), below.get_ylabel()) == (
        "bending angle [deg]",
        "time before now [s]",
        "tension [N]",
    )
    for number, line in zip((1, 2, 4, 5), below.lines, strict=True):
        np.testing.assert_allclose(np.asarray(line.get_ydata()), table[f"tension_{number}"])
    assert len({str(line.get_color()) for line in below.lines}) == 4
