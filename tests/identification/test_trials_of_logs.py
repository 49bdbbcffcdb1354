"""Logs of bends in two planes as trials: whose spools they are, and which readings of which time they hold."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError
from wristctl.identification.measured_trials import places_of_log, trials_of_logs
from wristctl.identification.problem import GAIN, TURN, bend_problem
from wristctl.records.open_log import OpenLog

WRIST = WristParameters()
TIME = np.linspace(2.0, 6.0, 401)
SQUARE = (1, 2, 4, 5)


def log(numbers: tuple[int, ...] = SQUARE, name: str = "first.csv", **more: Any) -> OpenLog:
    """A motion in both planes; spools reel in their number in mm per second."""
    columns = {"time": TIME, "bend_y": 0.1 * np.sin(TIME), "bend_z": 0.2 * np.cos(TIME)}
    columns |= {f"spool_{number}": 1e-3 * number * TIME for number in numbers}
    return OpenLog(Path(name), "log", columns | more)


def changed(name: str, column: Any) -> OpenLog:
    whole = log()
    return replace(whole, columns={**whole.columns, name: column})


def wrist(*angles: float, **more: Any) -> WristParameters:
    places = tuple(TendonPlace(angle_deg=angle, **more) for angle in angles)
    return WRIST.model_copy(update={"tendons": places})


@pytest.mark.parametrize(
    ("tendons", "numbers", "directions"),
    [
        ("four", (1, 2, 4, 5), [225.0, 135.0, 315.0, 45.0]),
        ("five", (1, 2, 4, 5), [225.0, 135.0, 315.0, 45.0]),
        ("three", (1, 2, 3), [0.0, 120.0, 240.0]),
        ((10.0, 130.0, 250.0), (1, 2, 3), [10.0, 130.0, 250.0]),
        ((0.0, 90.0, 180.0, 270.0), (1, 2, 3, 4), [0.0, 90.0, 180.0, 270.0]),
    ],
)
def test_each_spool_has_the_place_of_its_number(
    tendons: Any, numbers: tuple[int, ...], directions: list[float]
) -> None:
    """1, 2, 4 and 5 of the square wrist are at its corners; others are those of the study in their order."""
    given = wrist(*tendons) if isinstance(tendons, tuple) else WRIST.model_copy(update={"tendons": tendons})
    places = places_of_log(log(numbers), given)
    assert tuple(places) == numbers
    found = [np.degrees(place.angle) % 360.0 for place in places.values()]
    assert found == pytest.approx(directions)


@pytest.mark.parametrize("numbers", [(1, 2), (1, 2, 3), (1, 2, 3, 4, 5), (2, 3, 4, 5), (0, 1, 2, 3)])
def test_as_many_spools_as_the_wrist_has_no_places_are_refused(numbers: tuple[int, ...]) -> None:
    with pytest.raises(UserError, match="the wrist has 4 places"):
        places_of_log(log(numbers), wrist(0.0, 90.0, 180.0, 270.0))


def test_a_trial_holds_every_reading_at_its_own_time() -> None:
    """Both bends of their own frames, then each tendon's tension; spools at the middle of each step of the grid."""
    seen = np.arange(401) % 3 == 0
    bends: dict[str, Any] = {"bend_z": np.where(seen, 0.2 * np.cos(TIME), np.nan)}
    noise = np.random.default_rng(0).standard_normal((2, 401))
    bends["bend_y"] = 0.1 * np.sin(TIME) + 1e-4 * noise[0]
    pulls: dict[str, Any] = {"tension_4": np.where(seen, 3.0 + 0.5 * noise[1], np.nan)}
    (trial,) = trials_of_logs([log(**bends, **pulls)], WRIST, 0.01, exposure=4e-3)
    assert (trial.label, trial.run, trial.exposure) == ("first", "first", 4e-3) and trial.time[0] == TIME[0]
    np.testing.assert_allclose(trial.reeled, np.outer(trial.time + 0.005, (1e-3, 2e-3, 4e-3, 5e-3)), atol=1e-12)
    channels = {0: bends["bend_y"], 1: bends["bend_z"], 4: trial.per_newton * pulls["tension_4"]}
    assert set(trial.channel.tolist()) == set(channels)
    for channel, column in channels.items():
        own = trial.channel == channel
        there = np.isfinite(column) & (trial.time[-1] >= TIME)
        np.testing.assert_array_equal(trial.captured[own], TIME[there])
        np.testing.assert_allclose(trial.angle[own], column[there])
    assert trial.per_newton == pytest.approx(1e-4 / 0.5, rel=0.4), "a newton counts by the noise of both"


def test_without_tensions_a_newton_is_a_radian_and_a_mass_is_the_hands() -> None:
    (plain,) = trials_of_logs([log()], WRIST, 0.01)
    assert plain.per_newton == 1.0 and plain.wrist == WRIST and set(plain.channel.tolist()) == {0, 1}
    (heavy,) = trials_of_logs([log(mass=np.full(401, 0.7))], WRIST, 0.01)
    assert heavy.wrist == WRIST.model_copy(update={"hand_mass": 0.7})


def test_trials_are_named_by_their_log_and_their_own_name() -> None:
    words = {"trial": np.where(TIME < 4.0, "slow", "quick")}
    parted = replace(log(), words=words)
    labels = [(trial.label, trial.run) for trial in trials_of_logs([parted, log(name="a/second.csv")], WRIST, 0.01)]
    assert labels == [("first, slow", "first"), ("first, quick", "first"), ("second", "second")]


def test_logs_with_less_than_both_bends_and_times_are_refused() -> None:
    for name in ("time", "bend_y", "bend_z"):
        less = replace(log(), columns={each: column for each, column in log().columns.items() if each != name})
        with pytest.raises(UserError, match=f"{name} is not in the log"):
            trials_of_logs([less], WRIST, 0.01)
    with pytest.raises(UserError, match="other numbers") as caught:
        trials_of_logs([log(), log((1, 2, 3), "second.csv")], WRIST, 0.01)
    assert "second.csv" in caught.value.where


def test_a_trial_with_too_few_readings_is_refused_and_says_how_many() -> None:
    """Twenty of each bend and of all spools at once are enough, whatever the others are."""
    for name in ("bend_z", "spool_4"):
        columns = {count: np.where(np.arange(401) % 20 == 0, log().columns[name], np.nan) for count in (20, 19)}
        for count, column in columns.items():
            column[np.flatnonzero(np.isfinite(column))[count:]] = np.nan
        trials_of_logs([changed(name, columns[20])], WRIST, 0.01)
        with pytest.raises(UserError, match="19 "):
            trials_of_logs([changed(name, columns[19])], WRIST, 0.01)


def test_bends_at_times_of_their_own_are_of_cameras_whose_views_may_stand_askew() -> None:
    """Bends beside the counts of all spools are one instrument's; one row is enough to say so."""
    together, gap = log(), math.nan
    seen = np.arange(len(TIME)) % 2 == 0
    columns = {
        name: np.where(seen ^ name.startswith("spool"), column, gap) for name, column in together.columns.items()
    }
    columns["time"] = TIME
    apart = replace(together, columns=columns)
    (one,), (cameras,) = (trials_of_logs([each], WRIST, 1e-3) for each in (together, apart))
    assert not one.by_cameras and cameras.by_cameras
    places, tendons = places_of_log(log(), WRIST), Actuator(level="tendon")
    problems = [
        bend_problem(trials, places, WRIST, tendons, IdentifySettings())
        for trials in ([one], [cameras], [one, cameras])
    ]
    kinds = [{coordinate.kind for coordinate in problem.coordinates} & {TURN, GAIN} for problem in problems]
    assert kinds == [set(), {TURN, GAIN}, {TURN, GAIN}]
    both, bends = problems[-1], np.ones((3, 2))
    moved = [both.viewed(trial, bends, np.full(len(both.coordinates), 1e-3)) for trial in (one, cameras)]
    np.testing.assert_array_equal(moved[0], bends)
    np.testing.assert_allclose(moved[1], np.tile([1.002, 1.0], (3, 1)))
