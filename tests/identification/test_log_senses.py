"""Spools of two planes that are exchanged or have the other sign are named, with what mends them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.log_model import robot_of_logs, spools_of_log
from wristctl.identification.log_senses import check_places
from wristctl.records.log_converters import read_log
from wristctl.records.open_log import OpenLog, write_log

WRISTS = {3: WristParameters(tendons="three"), 4: WristParameters()}
ANGLES = {3: (0.0, 120.0, 240.0), 4: (-135.0, 135.0, -45.0, 45.0)}
NUMBERS = {3: (1, 2, 3), 4: (1, 2, 4, 5)}


def made(tendons: int, turned_deg: float = 0.0) -> OpenLog:
    """A wrist that bends all around, its tendons turned together."""
    time = 0.02 * np.arange(300.0)
    y, z = 0.3 * np.sin(1.7 * time), 0.25 * np.sin(2.3 * time + 1.0)
    columns = {"time": time, "bend_y": y, "bend_z": z}
    for number, angle in zip(NUMBERS[tendons], ANGLES[tendons], strict=True):
        toward = math.radians(angle + turned_deg)
        columns[f"spool_{number}"] = 2e-4 + 0.02 * (math.cos(toward) * y + math.sin(toward) * z)
    return OpenLog(Path("made.csv"), "log", columns)


def said(log: OpenLog, tendons: int) -> list[str]:
    robot = robot_of_logs([log], WRISTS[tendons], 0.01)
    return check_places([log], robot, spools_of_log(log))


def with_order(log: OpenLog, order: Sequence[int], tendons: int) -> OpenLog:
    names = [f"spool_{number}" for number in NUMBERS[tendons]]
    moved = {name: log.columns[names[k]] for name, k in zip(names, order, strict=True)}
    return replace(log, columns={**log.columns, **moved})


@pytest.mark.parametrize("tendons", [3, 4])
@pytest.mark.parametrize("turned_deg", [0.0, 20.0])
def test_a_sound_log_has_no_finding(tendons: int, turned_deg: float) -> None:
    assert said(made(tendons, turned_deg), tendons) == []


@pytest.mark.parametrize(
    ("tendons", "order"), [(3, (0, 2, 1)), (4, (1, 0, 2, 3)), (4, (0, 3, 2, 1)), (4, (0, 2, 3, 1))]
)
def test_exchanged_spools_are_refused_and_the_fix_gives_the_sound_log(
    tendons: int, order: tuple[int, ...], tmp_path: Path
) -> None:
    sound = made(tendons)
    file = tmp_path / "log.csv"
    write_log(with_order(sound, order, tendons), file)
    with pytest.raises(UserError, match="does not bend toward the tendons") as refused:
        said(read_log(file), tendons)
    mended = read_log(file, refused.value.fix.split("--columns '")[1].rstrip("'"))
    assert said(mended, tendons) == []


@pytest.mark.parametrize(("tendons", "name"), [(3, "spool_2"), (4, "spool_5"), (3, "bend_z"), (4, "bend_y")])
def test_another_sign_is_refused_and_the_fix_gives_the_sound_log(tendons: int, name: str, tmp_path: Path) -> None:
    sound = made(tendons)
    file = tmp_path / "log.csv"
    write_log(replace(sound, columns={**sound.columns, name: -sound.columns[name]}), file)
    with pytest.raises(UserError) as refused:
        said(read_log(file), tendons)
    if name.startswith("spool"):
        assert f"it would if {name} had the other sign" in refused.value.fix
    mended = read_log(file, refused.value.fix.split("--columns '")[1].rstrip("'"))
    assert said(mended, tendons) == []


@pytest.mark.parametrize(("tendons", "order"), [(3, (1, 2, 0)), (4, (1, 3, 0, 2))])
def test_tendons_that_are_all_turned_alike_are_told_and_not_refused(tendons: int, order: tuple[int, ...]) -> None:
    (told,) = said(with_order(made(tendons), order, tendons), tendons)
    assert "deg from where wrist.tendons has them" in told and "exchanged" in told


def test_a_motion_along_one_direction_tells_nothing_of_places() -> None:
    log = made(3)
    columns = {**log.columns, "bend_z": 0.01 * log.columns["bend_z"]}
    assert said(with_order(replace(log, columns=columns), (0, 2, 1), 3), 3) == []


def along_a_line(tendons: int, toward_deg: float, noise: float = 0.0) -> OpenLog:
    """A wrist that bends along one line; its bends are noisy."""
    sound, rng = made(tendons), np.random.default_rng(1)
    toward, way = math.radians(toward_deg), 0.3 * np.sin(1.7 * sound.columns["time"])
    y, z = way * math.cos(toward), way * math.sin(toward)
    columns = {"time": sound.columns["time"]}
    columns |= {"bend_y": y + noise * rng.standard_normal(300), "bend_z": z + noise * rng.standard_normal(300)}
    for number, angle in zip(NUMBERS[tendons], ANGLES[tendons], strict=True):
        pulls = math.radians(angle)
        columns[f"spool_{number}"] = 2e-4 + 0.02 * (math.cos(pulls) * y + math.sin(pulls) * z)
    return OpenLog(Path("made.csv"), "log", columns)


@pytest.mark.parametrize("tendons", [3, 4])
@pytest.mark.parametrize("toward_deg", [0.0, 45.0, 90.0, 200.0])
def test_a_sound_log_of_a_motion_along_one_line_has_no_finding(tendons: int, toward_deg: float) -> None:
    assert said(along_a_line(tendons, toward_deg, 0.005), tendons) == []


@pytest.mark.parametrize(
    ("toward_deg", "order", "which"), [(0.0, (3, 1, 2, 0), "spool_1 and spool_5"), (90.0, (0, 3, 2, 1), "")]
)
def test_spools_exchanged_across_the_line_of_a_motion_are_named_and_on_one_side_they_are_alike(
    toward_deg: float, order: tuple[int, ...], which: str
) -> None:
    log = with_order(along_a_line(4, toward_deg, 0.005), order, 4)
    if not which:  # 2 and 5 pull alike toward flexion
        assert said(log, 4) == []
        return
    with pytest.raises(UserError, match=f"{which} were exchanged"):
        said(log, 4)
    bare = {name: column for name, column in log.columns.items() if name != "bend_z"}
    with pytest.raises(UserError, match=f"{which} were exchanged"):
        said(replace(log, columns=bare), 4)


def test_a_spool_with_the_other_sign_is_named_of_a_motion_along_one_line() -> None:
    log = along_a_line(3, 0.0)
    with pytest.raises(UserError, match="spool_2 had the other sign"):
        said(replace(log, columns={**log.columns, "spool_2": -log.columns["spool_2"]}), 3)


def test_a_bend_of_a_motion_along_one_line_that_is_counted_the_other_way_is_said() -> None:
    log = along_a_line(4, 0.0)
    (told,) = said(replace(log, columns={**log.columns, "bend_y": -log.columns["bend_y"]}), 4)
    assert "180 deg from where wrist.tendons has them" in told and "bend_y were counted the other way" in told
