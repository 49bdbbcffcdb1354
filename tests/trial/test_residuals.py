"""One table of residuals: each has its word and its stop, and a run's values give both again."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.trial.conftest import WRIST, settings_of
from wristctl.board.messages import State
from wristctl.control.response import Estimate
from wristctl.trial.residuals import (
    RESIDUALS,
    Judge,
    Limit,
    columns,
    limits_of,
    load,
    notes,
    plain,
    stopped_by,
    worst,
)
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tick_timing import SCHEDULING, WORK, TickTiming
from wristctl.trial.watch import Tick, Watch
from wristctl.vision.marker import Sighting, SightingVerdict

SETTINGS = settings_of(load_cells={})
LIMITS = limits_of(SETTINGS)
BY_NAME = {limit.name: limit for limit in LIMITS}
SOUND = dict.fromkeys(RESIDUALS, 0.0)
PERIOD, SAFETY = SETTINGS.control_period, SETTINGS.safety
SQUARE = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])

STOPPING = [limit for limit in LIMITS if math.isfinite(limit.limit)]
NOTED = [limit for limit in LIMITS if math.isfinite(limit.odd)]


def test_a_sound_tick_stops_nothing_and_a_sound_trial_has_no_word() -> None:
    assert Judge(LIMITS).beyond(0.0, SOUND) is None and notes(SOUND, LIMITS) == []
    assert {limit.name for limit in STOPPING} | {limit.name for limit in NOTED} == set(RESIDUALS)


@pytest.mark.parametrize("side", [1.0, -1.0])
@pytest.mark.parametrize("limit", STOPPING, ids=lambda limit: limit.name)
def test_each_limit_stops_just_beyond_it_alone_and_not_just_within(limit: Limit, side: float) -> None:
    judge, near = Judge(LIMITS), 1e-6 + 0.01 * limit.limit
    within = max(0.0, limit.limit - near)
    for tick in range(200):
        assert judge.beyond(tick * PERIOD, SOUND | {limit.name: side * within}) is None
    since = 200
    while not (beyond := judge.beyond(since * PERIOD, SOUND | {limit.name: side * (limit.limit + near)})):
        since += 1
    assert beyond is limit and (since - 200) * PERIOD == pytest.approx(limit.held, abs=PERIOD)
    said = stopped_by(limit, side * (limit.limit + near))
    assert said and "{" not in said and RESIDUALS[limit.name].causes


@pytest.mark.parametrize("limit", NOTED, ids=lambda limit: limit.name)
def test_each_word_is_said_just_beyond_its_value_alone_and_not_just_within(limit: Limit) -> None:
    most = worst({**SOUND, limit.name: -1.05 * limit.odd}, {})
    assert notes(worst(SOUND | {limit.name: 0.95 * limit.odd}, {}), LIMITS) == []
    (word,) = notes(most, LIMITS)
    assert word and "{" not in word
    every = {each.name: 1.05 * each.odd for each in NOTED}
    assert len(notes(worst(SOUND | every, {}), LIMITS)) == len(NOTED)


def test_of_several_ticks_the_largest_counts_and_of_a_lag_the_newest() -> None:
    most: Mapping[str, float] = {}
    for torque, lag in ((0.2, 0.02), (-0.9, 0.05), (0.1, 0.01), (math.nan, 0.012)):
        most = worst(SOUND | {"load": torque, "lag": lag}, most)
    assert (most["load"], most["lag"]) == (0.9, 0.012)


@given(st.lists(st.floats(0.0, 4.0), min_size=1, max_size=60))
def test_a_lasting_limit_is_exceeded_for_as_long_as_its_size_allows(sizes: list[float]) -> None:
    """By a plain reading of the words: since when, and how far now."""
    judge, limit, since, stop = Judge(LIMITS), BY_NAME["load"], math.inf, None
    for tick, size in enumerate(sizes):
        clock = tick * PERIOD
        since = min(since, clock) if size > limit.limit else math.inf
        if size > limit.limit and clock - since >= limit.held * limit.limit / size:
            stop = tick
            break
    first = next(
        (tick for tick, size in enumerate(sizes) if judge.beyond(tick * PERIOD, SOUND | {"load": size})), None
    )  # fmt: skip
    assert first == stop


def test_a_limit_that_is_kept_does_not_forgive_another_and_a_pause_between_motions_does() -> None:
    judge, apart = Judge(LIMITS), 5e-3
    over = {"across": 1.01 * BY_NAME["across"].limit}
    for tick in range(12):
        assert judge.beyond(tick * apart, SOUND | over | {"load": 2.0 * (tick % 2)}) is None
    assert judge.beyond(12 * apart, SOUND | over) is BY_NAME["across"]
    assert judge.beyond(12 * apart + 0.6, SOUND | over) is None


SHOWN = {
    "late": (0.0123, "s", "12 ms"), "lapses": (3.0, "", "3"), "no_number": (1.0, "", "1"),
    "angle": (math.radians(-51.3), "rad", "-51.3 deg"), "rate": (5.32, "rad/s", "5.3 rad/s"),
    "age": (0.061, "s", "61 ms"), "pull": (62.4, "N", "62 N"), "cell_age": (0.2, "s", "200 ms"),
    "measured_pull": (55.3, "N", "55 N"), "excess_pull": (21.0, "N", "21 N"), "missing_pull": (12.2, "N", "12 N"),
    "travel": (0.0123, "m", "12.3 mm"), "disabled": (1.0, "", "1"), "jump": (math.radians(4.2), "rad", "4.2 deg"),
    "doubted": (0.33, "", "33 %"), "across": (math.radians(9.1), "rad", "9.1 deg"), "load": (0.854, "N m", "0.85 N m"),
    "apart": (math.radians(7.0), "rad", "7.0 deg"), "round_trip": (0.0116, "s", "11.6 ms"),
    "skipped": (0.25, "", "25 %"), "unseen": (0.2, "", "20 %"), "repeated": (5.0, "", "5"), "resent": (4.0, "", "4"),
    "moved": (0.1, "", "10 %"), "lag": (0.021, "s", "21 ms"),
}  # fmt: skip
"""Of each a value as it is logged, the log's unit, and what people read."""


@pytest.mark.parametrize("name", RESIDUALS)
def test_what_is_logged_in_si_units_is_read_in_those_that_people_use(name: str) -> None:
    value, unit, said = SHOWN[name]
    limit, line = BY_NAME[name], RESIDUALS[name]
    assert line.shown(value) == said and columns(1, True)[name] == (unit, line.meaning) and limit.unit == unit
    if "{value}" in line.stops:
        signed = said if name in ("angle", "rate") else line.shown(abs(value))
        assert signed in stopped_by(limit, value)
    if "{value}" in line.notes:
        (word,) = notes({name: 2.0 * abs(limit.odd)}, LIMITS)
        assert line.shown(2.0 * limit.odd) in word


def test_limits_are_the_settings_of_these_names_and_six_of_them_may_be_exceeded_for_a_while() -> None:
    given = {
        "late": 0.021, "rate": 3.0, "stale": 0.22, "tension": 41.0, "cell_age": 0.21, "motor_pull": 33.0,
        "excess_pull": 17.0, "missing_pull": 13.0, "travel": 0.011, "load": 0.7, "skipped": 0.2, "odd_for": 0.4,
    }  # fmt: skip
    angles = {"angle": 44.0, "jump": 3.0, "across": 8.0, "follow": 6.0}
    own = settings_of(load_cells={}, safety=given | {f"{name}_deg": value for name, value in angles.items()})
    found = {limit.name: limit for limit in limits_of(own)}
    most = {name: limit.limit for name, limit in found.items()}
    same = ("late", "rate", "cell_age", "excess_pull", "missing_pull", "travel", "load", "skipped")
    assert [most[name] for name in same] == [given[name] for name in same]
    named = {"angle": "angle", "jump": "jump", "across": "across", "apart": "follow"}
    assert [math.degrees(most[name]) for name in named] == pytest.approx([angles[name] for name in named.values()])
    assert (most["age"], most["pull"], most["measured_pull"]) == (0.22, 41.0, 33.0)
    assert most["round_trip"] == pytest.approx(own.safety.round_trip * own.control_period)
    weaker = settings_of(load_cells={}, safety={"tension": 21.0, "motor_pull": 33.0})
    assert {limit.name: limit.limit for limit in limits_of(weaker)}["measured_pull"] == 21.0
    lasting = {"measured_pull", "excess_pull", "missing_pull", "across", "load", "apart"}
    assert {name: limit.held for name, limit in found.items()} == {
        name: 0.4 if name in lasting else 0.0 for name in RESIDUALS
    }


def test_a_rig_without_load_cells_has_no_line_of_them() -> None:
    of_cells = {"cell_age", "measured_pull", "excess_pull", "missing_pull"}
    assert set(columns(1, True)) - set(columns(1, False)) == of_cells and set(columns(1, True)) == set(RESIDUALS)
    assert {limit.name for limit in limits_of(settings_of())} == set(RESIDUALS) - of_cells
    by_size = set(columns(1, True)) - set(columns(2, True))
    assert by_size == {"across", "doubted"}, "two cameras see the bend across"
    assert {limit.name for limit in limits_of(settings_of(planes=2))} == set(RESIDUALS) - of_cells - by_size


def test_limits_written_are_limits_read(tmp_path: Path) -> None:
    file = tmp_path / "limits.json"
    file.write_text(json.dumps(plain(LIMITS), allow_nan=False))
    assert load(file) == LIMITS
    file.write_text("{}")
    with pytest.raises(KeyError):
        load(file)


WELL = Tick(0.0, 0.0, Estimate(0.0, 0.0, 0.0), np.zeros(4), np.zeros(4), State.ENABLED, 0, 0)


def ticks(watch: Watch, timing: TickTiming, count: int, woken: float = 0.0, trip: float = 2.9e-3, work: float = 4e-4,
          skips: int | None = None) -> None:  # fmt: skip
    """Ticks as a loop does them, each judged."""
    late = 0.0
    clock = getattr(watch, "clock", 0.0)
    for _ in range(count):
        tick = WELL._replace(clock=clock)
        watch.see(tick, clock)
        watch.judge(tick)
        ended = late + woken + work - PERIOD
        skipped = max(0, int(ended / PERIOD)) if skips is None else skips
        culprit = timing.tick(late + woken, woken, work, skipped)
        watch.ticked(clock, trip, skipped, culprit)
        late = max(0.0, ended - skipped * PERIOD)
        clock += (1 + skipped) * PERIOD
    watch.clock = clock  # type: ignore[attr-defined]


def watching(**changes: Any) -> tuple[Watch, TickTiming]:
    timing = TickTiming(PERIOD)
    return Watch(settings_of(**changes), WRIST, "ulnar", timing), timing


@pytest.mark.parametrize(
    ("how", "culprit", "said"),
    [
        ({"trip": 0.021}, None, "the board's answers take 21.0 ms, beyond 20 ms"),
        ({"woken": 0.014}, SCHEDULING, "ticks were skipped: the computer woke the loop late"),
        ({"work": 0.014}, WORK, "ticks were skipped: the loop's own work"),
    ],
)
def test_a_loop_that_cannot_keep_its_period_is_stopped_within_half_a_second_and_a_few_ticks(
    how: dict[str, float], culprit: str | None, said: str
) -> None:
    watch, timing = watching()
    with pytest.raises(SafetyStop, match=said) as stopped:
        ticks(watch, timing, 400, **how)  # type: ignore[arg-type]
    assert stopped.value.exit_code == 5 and stopped.value.fix
    assert len(timing.late) + timing.overruns <= 0.575 / PERIOD
    assert [who for who, _ in timing.culprits.most_common(1)] == ([] if culprit is None else [culprit])
    assert culprit is None or culprit in timing.said()


def test_a_few_skipped_ticks_are_borne_and_the_last_half_second_alone_counts() -> None:
    watch, timing = watching()
    for _ in range(20):
        ticks(watch, timing, 9)
        ticks(watch, timing, 1, skips=1)
    assert timing.overruns == 20 and watch.most["skipped"] == pytest.approx(0.1, abs=0.02)
    ticks(watch, timing, 200)
    watch.begin()
    ticks(watch, timing, 1)
    assert watch.most["skipped"] == 0.0
    with pytest.raises(SafetyStop, match="of the last half second's ticks were skipped"):
        ticks(watch, timing, 60, skips=1)


def sighting(
    number: int, verdict: SightingVerdict = SightingVerdict.OK, shift: float = 0.0, theta: float = 0.0, plane: int = 0
) -> Sighting:
    corners = np.stack([SQUARE + np.array([0.0, down]) for down in (shift, -300.0)])
    return Sighting(number / 60.0, number, theta, verdict, corners, 1.0, stands=1.0, grey=100.0, plane=plane)


@pytest.mark.parametrize(("dropped", "share"), [(0.0, 0.05), (0.0, 0.3), (0.4, 0.05), (0.4, 0.3)])
def test_usable_angles_count_as_missing_beside_those_that_are_believed_to_drop(dropped: float, share: float) -> None:
    watch, timing = watching(sensor={"level": "camera", "dropped": dropped})
    rate, used = 60.0 * (1.0 - dropped) * (1.0 - share), 0
    for tick in range(600):
        if used < rate * tick * PERIOD:
            used += 1
            watch.saw(sighting(used), tick * PERIOD, tick * PERIOD)
        ticks(watch, timing, 1)
    assert watch.most["unseen"] == pytest.approx(share, abs=0.05)
    assert ("angles that the camera" in watch.words()) is (share > 0.12)


def test_the_first_place_of_the_bases_marker_is_where_it_was_first_seen_whole() -> None:
    watch, timing = watching()
    for shift, moved in ((math.nan, 0.0), (500.0, 0.0), (500.9, 0.9 / 40.0), (496.0, 0.1), (math.nan, 0.1)):
        watch.sighted(sighting(0, shift=shift), 0.0)
        ticks(watch, timing, 1)
        assert watch._values["moved"] == pytest.approx(moved)
    assert "moved by 10 % of its side" in watch.words()


def test_pictures_that_are_no_news_and_commands_sent_again_are_counted_over_the_last_moments() -> None:
    watch, _ = watching()
    for number in range(5):
        watch.sighted(sighting(number, SightingVerdict.FROZEN if number % 2 else SightingVerdict.STAMP), 0.0)
    watch.sighted(sighting(9, SightingVerdict.NO_TIP), 0.0)
    for resent, clock in ((250, 0.0), (253, 0.5), (253, 0.99), (253, 1.01), (254, 3.0)):
        watch.see(WELL._replace(resent=resent, clock=clock), clock)
        expected = {0.0: (5, 0), 0.5: (5, 3), 0.99: (5, 3), 1.01: (0, 3), 3.0: (0, 1)}[clock]
        assert (watch._values["repeated"], watch._values["resent"]) == expected
    assert "5 pictures within a second were no news" in watch.words() and "3 commands" in watch.words()


@pytest.mark.parametrize("worse", [0, 1])
def test_of_two_cameras_the_one_counts_that_sees_less_or_shows_more(worse: int) -> None:
    """Angles that do not come, pictures that are no news, a base that moves, and a marker that lags."""
    watch, timing = watching(planes=2)
    reeled = np.array([1.0, 1.0, -1.0, -1.0]) if worse == 0 else np.array([1.0, -1.0, 1.0, -1.0])
    way = 1e-3 * np.sin(6.0 * PERIOD * np.arange(401))
    for tick in range(400):
        watch.predict((way[tick + 1] - way[tick]) * reeled)
        for plane in (0, 1):
            if plane != worse or tick % 3 == 0:
                bend = watch._blind.angles(max(0.0, tick * PERIOD - 0.05 * (plane == worse)))[0, plane]
                watch.saw(sighting(tick, theta=float(bend), plane=plane), tick * PERIOD, tick * PERIOD)
        watch.sighted(sighting(tick, shift=8.0 * (tick > 0), plane=worse), tick * PERIOD)
        watch.sighted(sighting(tick, plane=1 - worse), tick * PERIOD)
        ticks(watch, timing, 1)
    for _ in range(3):
        watch.sighted(sighting(0, SightingVerdict.FROZEN, 8.0, plane=worse), 400 * PERIOD)
    watch.sighted(sighting(0, SightingVerdict.FROZEN, plane=1 - worse), 400 * PERIOD)
    ticks(watch, timing, 1)
    assert watch._values["unseen"] == pytest.approx(1.0 - 1.0 / (3.0 * PERIOD * 60.0 * 0.95), abs=0.02)
    assert (watch._values["repeated"], watch._values["moved"]) == pytest.approx((3.0, 0.2))
    assert 0.03 < watch._values["lag"] <= 0.05, "as much as there is at least"


def test_a_tension_is_told_of_spools_that_were_counted_lately_alone() -> None:
    watch, _ = watching()
    pulling = WELL._replace(position=np.full(4, 500.0))
    told = watch.see(pulling._replace(unheard=1.1 * PERIOD), 0.0)["pull"]
    assert told > 1.0
    assert math.isnan(watch.see(pulling._replace(unheard=3.0 * PERIOD, clock=0.01), 0.0)["pull"])
    assert watch.see(pulling._replace(unheard=PERIOD, clock=0.02), 0.0)["pull"] == told
