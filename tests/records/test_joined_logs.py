"""A log of motors and one of the motion, each on its own clock, are one log at the shift that their motion says."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.log_model import robot_of_logs
from wristctl.records.joined_logs import check_whole, joined_logs
from wristctl.records.log_looks import looked_at
from wristctl.records.open_log import OpenLog

ANGLES = (0.0, math.radians(120.0), math.radians(240.0))


def way(time: Array) -> Array:
    """Bends toward both sides (T, 2) [rad] that do not come back within a minute."""
    y = 0.2 * np.sin(1.3 * time) + 0.1 * np.sin(3.1 * time + 1.0) + 0.05 * np.sin(0.37 * time)
    z = 0.15 * np.sin(1.9 * time + 0.4) + 0.1 * np.sin(0.7 * time)
    return np.stack([y, z], axis=1)


def sine(time: Array) -> Array:
    """Bends (T, 2) [rad] that come back every 1.6 s."""
    return 0.3 * np.stack([np.sin(4.0 * time), np.sin(8.0 * time)], axis=1)


def motors(quantity: str = "spool", scale: float = 0.02, moved: Callable[[Array], Array] = way) -> OpenLog:
    """Twenty seconds of three motors, 100 rows/s."""
    time = 0.01 * np.arange(2000.0)
    pulls = scale * moved(time) @ np.stack([np.cos(ANGLES), np.sin(ANGLES)])
    columns = {"time": time} | {f"{quantity}_{k + 1}": column for k, column in enumerate(pulls.T)}
    return OpenLog(Path("motors.csv"), "log", columns)


def mocap(offset: float, begin: float = 2.0, end: float = 18.0, moved: Callable[[Array], Array] = way) -> OpenLog:
    """What a camera saw of it, 60 rows/s, whose clock is ahead of the motors' by `offset`."""
    time, rng = np.arange(begin, end, 1.0 / 60.0), np.random.default_rng(1)
    bends = moved(time) + 5e-4 * rng.standard_normal((len(time), 2))
    columns = {"time": time + offset, "bend_y": bends[:, 0], "bend_z": bends[:, 1]}
    return OpenLog(Path("mocap.csv"), "log", columns)


def shift_of(log: OpenLog, seen: OpenLog) -> float:
    """Time that was added to the motion's [s], without what it comes later by."""
    (row,) = np.flatnonzero(log.columns["bend_y"] == seen.columns["bend_y"][480])
    return float(log.columns["time"][row] - seen.columns["time"][480]) - 0.05


@settings(max_examples=15, deadline=None)
@given(offset=st.floats(-500.0, 500.0), begin=st.floats(-5.0, 5.0))
def test_the_shift_of_two_clocks_is_found(offset: float, begin: float) -> None:
    """Also where the camera began before the motors, or after."""
    seen = mocap(offset, begin, begin + 18.0)
    (log,) = joined_logs([seen, motors()])
    assert shift_of(log, seen) == pytest.approx(-offset, abs=4e-3)
    said = float(re.search(r"motors\.csv, ([+-][\d.]+) s", log.remarks[0])[1])  # type: ignore[index]
    assert said == pytest.approx(-offset, abs=4e-3)


@pytest.mark.parametrize(("quantity", "scale"), [("spool", 0.02), ("tension", 30.0), ("current", 0.4)])
@pytest.mark.parametrize("offset", [1.8e9, -3.0])
def test_motors_may_have_spools_tensions_or_currents_and_a_camera_the_time_of_day(
    quantity: str, scale: float, offset: float
) -> None:
    seen = mocap(offset)
    (log,) = joined_logs([motors(quantity, scale), seen])
    assert shift_of(log, seen) == pytest.approx(-offset, abs=4e-3)
    for name in ("bend_y", "bend_z"):
        column = log.columns[name]
        assert np.array_equal(column[np.isfinite(column)], seen.columns[name])
    assert np.isfinite(log.columns[f"{quantity}_3"]).sum() == 2000 and (np.diff(log.columns["time"]) > 0.0).all()
    assert looked_at(log, tendon_offset=0.02).remarks == log.remarks
    assert "mocap.csv is joined to motors.csv" in log.remarks[-1] and "100 % of the motion" in log.remarks[-1]


def test_the_delay_of_two_clocks_is_not_identifiable() -> None:
    wrist = WristParameters(tendons="three")
    (log,) = joined_logs([motors(), mocap(7.0)])
    assert not robot_of_logs([log], wrist, 0.01).is_told("delay", 0.05, 1e-4)
    both = OpenLog(log.file, "log", log.columns)
    assert robot_of_logs([both], wrist, 0.01).is_told("delay", 0.05, 1e-4)
    for logs in ([both, log], [log, both]):
        assert not robot_of_logs(logs, wrist, 0.01).is_told("delay", 0.05, 1e-4), "whichever of several it is"


def test_logs_that_have_both_stay_as_they_are() -> None:
    (log,) = joined_logs([motors(), mocap(7.0)])
    for logs in ([log, log], [motors()], [motors(), log], [mocap(1.0), log]):
        assert all(one is other for one, other in zip(joined_logs(logs), logs, strict=True))


def test_several_pairs_are_joined_in_their_order() -> None:
    seen = [mocap(7.0), mocap(-2.0)]
    logs = joined_logs([motors(), motors(), *seen])
    assert list(map(shift_of, logs, seen)) == pytest.approx([-7.0, 2.0], abs=4e-3)
    with pytest.raises(UserError, match="2 logs of motors and 1 of the motion"):
        joined_logs([motors(), motors(), mocap(7.0)])


def test_a_motion_of_something_else_and_one_that_comes_back_are_refused() -> None:
    def other(time: Array) -> Array:
        return np.stack([np.sign(np.sin(17.0 * time**1.3)), np.sin(23.0 * np.sqrt(time))], axis=1)

    with pytest.raises(UserError, match=r"at no shift of clocks does its motion go with motors\.csv"):
        joined_logs([motors(), mocap(0.0, moved=other)])
    for offset in (0.4, 6.7):
        with pytest.raises(UserError, match=r"join it to motors\.csv alike - .* a motion that does not come"):
            joined_logs([motors(moved=sine), mocap(offset, moved=sine)])


@pytest.mark.parametrize("late", [0.0, 0.03, -0.02])
def test_of_shifts_of_a_motion_that_comes_back_the_one_of_a_common_clock_is_taken(late: float) -> None:
    """Its zero is the best by no more than noise."""
    seen = mocap(late, moved=sine)
    (log,) = joined_logs([motors(moved=sine), seen])
    assert shift_of(log, seen) == pytest.approx(-late, abs=4e-3)
    assert "comes back" in log.remarks[-1] and "taken for the same" in log.remarks[-1]
    assert "comes back" not in joined_logs([motors(), mocap(late)])[0].remarks[-1]


def test_a_motion_that_all_but_comes_back_is_told_by_what_does_not() -> None:
    def moved(time: Array) -> Array:
        return sine(time) + 0.1 * np.exp(-(((time - 5.0) / 0.5) ** 2))[:, None]

    seen = mocap(7.0, moved=moved)
    (log,) = joined_logs([motors(moved=moved), seen])
    assert shift_of(log, seen) == pytest.approx(-7.0, abs=4e-3)


@pytest.mark.parametrize(("begin", "end"), [(-4.0, 12.0), (6.0, 26.0)])
def test_bends_that_were_seen_while_no_motors_were_logged_are_left_out(begin: float, end: float) -> None:
    (log,) = joined_logs([motors(), mocap(7.0, begin, end)])
    seen = log.columns["time"][np.isfinite(log.columns["bend_y"])]
    assert seen[0] == pytest.approx(max(begin + 0.05, 0.0), abs=0.02)
    assert seen[-1] == pytest.approx(min(end + 0.05, 19.99), abs=0.03)


def test_logs_without_times_or_of_trials_are_not_joined() -> None:
    seen = mocap(0.0)
    timeless = {name: column for name, column in seen.columns.items() if name != "time"}
    with pytest.raises(UserError, match="no times"):
        joined_logs([motors(), OpenLog(seen.file, "log", timeless)])
    trials = OpenLog(seen.file, "log", seen.columns, {"trial": np.full(len(seen), "a")})
    with pytest.raises(UserError, match="pairs of files"):
        joined_logs([motors(), trials])


def test_a_log_of_one_of_both_beside_a_whole_one_is_refused_by_what_it_lacks() -> None:
    (whole,) = joined_logs([motors(), mocap(7.0)])
    for logs in ([whole, mocap(1.0)], [mocap(1.0), whole]):
        with pytest.raises(UserError, match=r"no motors of its own.* mocap\.csv"):
            check_whole(logs)
    with pytest.raises(UserError, match="no motion of its own"):
        check_whole([motors(), whole])
    for right in ([whole, whole], [motors()], [mocap(1.0)], [motors(), motors()]):
        check_whole(right)
