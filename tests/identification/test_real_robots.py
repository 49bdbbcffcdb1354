"""Published recordings as they serve: which of their samples are fitted, which give a zero, which are predicted."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.choices import ROBOTS
from wristctl.errors import UserError
from wristctl.identification import real_robots
from wristctl.identification.arc_robot import ArcRecording, window_means
from wristctl.identification.real_robots import (
    DEEPC_ARM,
    OPENCR_V4,
    OPENCR_V6,
    SOFT_NECK,
    TEE_PROBE,
    ZEROS_UNTIL,
    recordings_of,
)
from wristctl.records.open_log import OpenLog

ALL = (SOFT_NECK, OPENCR_V4, OPENCR_V6, DEEPC_ARM, TEE_PROBE)


def given(monkeypatch: pytest.MonkeyPatch, logs: Mapping[str, OpenLog]) -> dict[str, Path]:
    """Files that hold these logs, by the ends of their names."""
    monkeypatch.setattr(real_robots, "read_log", lambda file, names: logs[str(file)])
    return {name: Path(name) for name in logs}


def log(time: np.ndarray, spools: int, seen: tuple[str, ...], trial: Any = None, **more: Any) -> OpenLog:
    """Every column is its own multiple of the time."""
    names = [*(f"spool_{k}" for k in range(1, spools + 1)), *seen]
    columns = {"time": time} | {name: (k + 1.0) * 1e-3 * time for k, name in enumerate(names)}
    return OpenLog(Path("a.csv"), "log", columns | more, {} if trial is None else {"trial": np.asarray(trial)})


def neck_files(monkeypatch: pytest.MonkeyPatch, closed: bool = False) -> dict[str, Path]:
    time, logs = np.arange(0.0, 30.0, 0.01), dict[str, OpenLog]()
    for load in (0, 200, 400, 500, 600, 800, 1000):
        own = log(time, 3, ("bend_y", "bend_z"), mass=np.full(len(time), 1e-3 * load))
        logs[
            f"imu_closeloop/frontier_test_{load:03d}gr.csv" if closed else f"imu_openloop/spring_test_{load}gr.csv"
        ] = own
    return given(monkeypatch, logs)


def test_the_necks_middle_load_is_predicted_from_the_other_two(monkeypatch: pytest.MonkeyPatch) -> None:
    """Its first 20 s give its zero alone; means over 0.1 s, in blocks of 5 s."""
    (parts,) = recordings_of(SOFT_NECK, neck_files(monkeypatch))
    assert {part.name: part.mass for part in parts} == {"0 g": 0.0, "1000 g": 1.0, "500 g": 0.5}
    for part in parts:
        alone, begin = part.name == "500 g", part.time < ZEROS_UNTIL
        assert part.fitted.tolist() == [not alone] * len(begin)
        assert part.zeroing.tolist() == (begin & alone).tolist() and part.asked.tolist() == (~begin & alone).tolist()
        np.testing.assert_allclose(np.diff(part.time), 0.1)
        np.testing.assert_allclose(part.spools, np.outer(part.time, (1e-3, 2e-3, 3e-3)), atol=1e-9)
        np.testing.assert_allclose(part.measured, np.outer(part.time, (4e-3, 5e-3)), atol=1e-9)
        assert np.isnan(part.pause[0]) and part.pause[1:] == pytest.approx(0.1)
        assert np.bincount(part.block).tolist()[1:-1] == [50] * 4


def test_the_necks_steps_rest_until_they_begin_and_all_else_is_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    assert SOFT_NECK.steps is not None
    steps = SOFT_NECK.steps(neck_files(monkeypatch, closed=True))
    assert [part.name for part in steps] == [f"step 1, {load} g" for load in (0, 200, 400, 600, 800, 1000)]
    for part in steps:
        assert not part.fitted.any() and (part.zeroing ^ part.asked).all()
        assert part.zeroing.tolist() == (part.time < 0.15).tolist() and part.zeroing.sum() == 1


def test_a_file_of_the_closed_loop_has_a_step_for_each_start_of_its_clock(monkeypatch: pytest.MonkeyPatch) -> None:
    files = neck_files(monkeypatch, closed=True)
    once = log(np.arange(0.0, 30.0, 0.01), 3, ("bend_y", "bend_z"), mass=np.full(3000, 0.2))
    names = np.full(2 * len(once), "frontier_test_200gr")
    columns = {name: np.concatenate([column, column]) for name, column in once.columns.items()}
    monkeypatch.setattr(
        real_robots, "read_log", lambda file, kind: replace(once, columns=columns, words={"trial": names})
    )
    assert SOFT_NECK.steps is not None
    steps = SOFT_NECK.steps(files)
    assert [part.name for part in steps[:3]] == ["step 1, 0 g", "step 2, 0 g", "step 1, 200 g"] and len(steps) == 12
    for part in steps:
        np.testing.assert_allclose(part.measured, np.outer(part.time, (4e-3, 5e-3)), atol=1e-9)


def test_patterns_are_in_the_order_of_time_and_each_begins_at_the_straight_robot(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Rows where a pattern is held are its own; those of the training file are fitted, the others predicted."""
    tips = ("tip_x", "tip_y", "tip_z")
    late = log(100.0 + np.array([4.0, 5.0, 6.0, 7.0]), 9, tips, ["b", "b_hold", "c", "c"])
    early = log(100.0 + np.array([0.0, 2.0, 1.0, 3.0]), 9, tips, ["a", "a_hold", "a", "d"])
    for robot in (OPENCR_V4, OPENCR_V6):
        (((part),),) = recordings_of(robot, given(monkeypatch, {"v_train.csv": late, "v_val.csv": early}))
        assert part.time.tolist() == list(range(8)) and part.fitted.tolist() == [False] * 4 + [True] * 4
        assert (part.fitted ^ part.asked).all() and not part.zeroing.any()
        assert np.isnan(part.pause).tolist() == [True, False, False, True, True, False, True, False]
        assert part.pause[[1, 2, 5, 7]].tolist() == [1.0] * 4
        parted = [part.block[0] == each for each in part.block]
        assert parted == [True] * 3 + [False] * 5 and len(set(part.block.tolist())) == 4
        np.testing.assert_allclose(part.spools, np.outer(100.0 + part.time, 1e-3 * np.arange(1, 10)))
        np.testing.assert_allclose(part.measured, np.outer(100.0 + part.time, 1e-3 * np.arange(10, 13)))
        assert robot.robot.ends == (1, 1, 1, 2, 2, 2, 3, 3, 3) and robot.centred


def test_the_first_half_of_a_day_is_fitted_and_the_second_predicted(monkeypatch: pytest.MonkeyPatch) -> None:
    """Recordings of the closed loop, which have tips alone, are left out."""
    tips, time = ("tip_x", "tip_y", "tip_z"), np.arange(0.0, 12.5, 0.1)
    days = {"one": log(time, 3, tips), "two": log(time[:-1], 3, tips), "closed": log(time, 0, tips)}
    cases = recordings_of(DEEPC_ARM, given(monkeypatch, days))
    assert [part.name for (part,) in cases] == ["one", "two"]
    for (part,) in cases:
        count = len(part.time)
        assert part.fitted.tolist() == [k < count // 2 for k in range(count)]
        assert (part.fitted ^ part.asked).all() and not part.zeroing.any()
        assert np.isnan(part.pause[0]) and part.pause[1:] == pytest.approx(0.1)
        assert np.bincount(part.block).tolist() == [60, 60, count - 120]


@pytest.mark.parametrize(("rows", "step"), [(1500, 1), (1501, 2), (3000, 2), (3001, 3)])
def test_every_sheet_of_the_probe_is_by_itself_and_thinned_to_1500_samples(
    rows: int, step: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    sheets = np.repeat(["up", "down"], rows)
    time = 0.1 * np.arange(float(rows))
    book = log(np.tile(time, 2), 2, ("bend_y", "bend_z"), sheets)
    plain = log(0.1 * np.arange(90.0), 2, ("bend_y", "bend_z"))
    cases = recordings_of(TEE_PROBE, given(monkeypatch, {"book.xlsx": book, "plain.xlsx": plain}))
    parts = [part for (part,) in cases]
    assert [part.name for part in parts] == ["book.xlsx, up", "book.xlsx, down", "plain.xlsx"]
    assert parts[0].time.tolist() == list(range(0, rows, step))
    np.testing.assert_allclose(parts[0].spools[:, 1], 2e-4 * parts[0].time)
    for part in parts:
        assert part.fitted.all() and part.asked.all() and not part.zeroing.any()
        assert np.isnan(part.pause[0]) and (part.pause[1:] == 1.0).all()
    assert np.bincount(parts[2].block).tolist() == [60, 30]


def test_files_without_a_robots_motors_are_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    closed = given(monkeypatch, {"closed.mat": log(np.arange(9.0), 0, ("tip_x", "tip_y", "tip_z"))})
    with pytest.raises(UserError, match="no recording of the DeePC arm") as caught:
        recordings_of(DEEPC_ARM, closed)
    assert "closed.mat" in caught.value.where
    with pytest.raises(UserError, match="no file"):
        recordings_of(TEE_PROBE, {})


def test_bends_are_told_in_degrees_and_tips_in_millimetres() -> None:
    assert [(one.unit, one.robot.measured) for one in ALL] == [
        ("deg", "bend"), ("mm", "tip"), ("mm", "tip"), ("mm", "tip"), ("deg", "bend")
    ]  # fmt: skip
    assert SOFT_NECK.scale == pytest.approx(180.0 / np.pi) and DEEPC_ARM.scale == 1e3
    assert {id(ROBOTS[name]) for name in ROBOTS} == {id(one) for one in ALL}
    assert [one for one in ALL if one.in_sample] == [TEE_PROBE] and not TEE_PROBE.robot.timed


@pytest.mark.parametrize("robot", ALL, ids=lambda robot: robot.title)
def test_the_tendons_of_an_arc_are_evenly_around_and_each_unknown_begins_within_its_bounds(robot: Any) -> None:
    """A third of a turn apart, of the probe half a turn; the authors' own models are told best first."""
    own = robot.robot
    assert len(own.angles) == len(own.ends) and set(own.ends) == set(range(1, len(own.lengths) + 1))
    for arc in set(own.ends):
        angles = [angle for angle, end in zip(own.angles, own.ends, strict=True) if end == arc]
        assert np.diff([*angles, 2.0 * np.pi]) == pytest.approx([2.0 * np.pi / len(angles)] * len(angles))
    terms = ("tendon friction", "inner friction", "slack", "creep")
    for unknown in own.unknowns(terms).values():
        assert unknown.low <= unknown.begin <= unknown.high and 0.0 < unknown.scale < unknown.high - unknown.low
    assert [error for _, error in robot.authors] == sorted(error for _, error in robot.authors)


def test_a_mean_over_a_window_is_that_of_the_course_between_its_samples() -> None:
    """Of a parabola by its integral; beyond its ends the course stays."""
    time = np.linspace(0.0, 2.0, 4001)
    course = np.stack([time**2, 3.0 * time], axis=1)
    means = window_means(time, course, np.array([0.5, 1.2]), 0.4)
    np.testing.assert_allclose(means[:, 0], [(0.7**3 - 0.3**3) / 1.2, (1.4**3 - 1.0**3) / 1.2], rtol=1e-6)
    np.testing.assert_allclose(means[:, 1], [1.5, 3.6])
    np.testing.assert_allclose(window_means(time, course, np.array([2.5]), 0.4), [[4.0, 6.0]])
    half = window_means(time, course, np.array([2.0]), 0.4)[0, 1]
    assert half == pytest.approx(0.5 * (5.7 + 6.0))


def test_a_delay_shows_spools_and_motion_as_they_were_before() -> None:
    fine, time = np.linspace(0.0, 5.0, 5001), np.arange(0.5, 4.5, 0.1)
    flags = np.ones(len(time), bool)
    one = ArcRecording(
        "a", "a", time, np.zeros((len(time), 1)), np.zeros((len(time), 2)), np.full(len(time), 0.1), flags, flags,
        flags,
        np.zeros(len(time), np.int64), course=(fine, 2.0 * fine[:, None]),
    )  # fmt: skip
    np.testing.assert_allclose(one.delayed(0.25)[:, 0], 2.0 * (time - 0.25), atol=1e-9)
    seen = one.later(np.stack([time, -time], axis=1), 0.25)
    np.testing.assert_allclose(seen[3:], np.stack([time - 0.25, 0.25 - time], axis=1)[3:], atol=1e-9)
