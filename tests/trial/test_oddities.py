"""A trial's odd words: each just beyond its limit, alone, and none just within; a sound rig has none."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.tracking_monitor import Greatest
from wristctl.trial.warnings_report import Oddities

SETTINGS = HwRunSettings()
LIMITS, PERIOD = SETTINGS.safety, SETTINGS.control_period
TICKS = 1000
SQUARE = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 40.0], [0.0, 40.0]])


def tick(
    trial: Oddities,
    number: int,
    usable: bool = False,
    age: float = 0.0,
    late: float = 0.0,
    verdict: str = "",
    greatest: Greatest = Greatest(),  # noqa: B008
) -> None:
    row = {"late": late, "time": number * PERIOD, "verdict": verdict, "theta_measured": 0.1 if usable else math.nan}
    trial.tick(row, age, greatest)


def usual(frames: float = 57.0, settings: HwRunSettings = SETTINGS, ticks: int = TICKS) -> Oddities:
    """A trial in which so many frames a second could be used, and nothing is odd but that, if they are too few."""
    trial, used = Oddities(settings), 0.0
    for number in range(1, ticks + 1):
        usable = used < frames * number * PERIOD - 0.5
        used += usable
        tick(trial, number, usable, verdict="ok" if usable else "")
    return trial


def greatest(**values: float) -> Callable[[Oddities], None]:
    return lambda trial: tick(trial, TICKS, greatest=Greatest(**values))


def lagging(seconds: float) -> Callable[[Oddities], None]:
    def seen(trial: Oddities) -> None:
        for time in np.arange(0.0, 3.0, 1.0 / 60.0):
            trial.lag.add(0.5 * math.sin(time - seconds), 0.5 * math.sin(time), 0.5 * math.cos(time))

    return seen


def setting(name: str, value: object) -> Callable[[Oddities], None]:
    return lambda trial: setattr(trial, name, value)


def moved(share: float) -> Callable[[Oddities], None]:
    """The base's marker is elsewhere in between, by a share of its side, and back at last."""

    def seen(trial: Oddities) -> None:
        for shift in (0.0, share, 0.0):
            trial.base(SQUARE + np.array([0.0, shift * 40.0]))
        trial.base(np.full((4, 2), math.nan))

    return seen


WORDS: dict[str, tuple[Callable[[float], Callable[[Oddities], None]], float, str]] = {
    "apart": (lambda x: greatest(apart=math.radians(x)), 0.35 * LIMITS.follow_deg, "1.3 deg off its motors"),
    "jump": (lambda x: greatest(jump=math.radians(x)), 0.5 * LIMITS.jump_deg, "1.1 deg of jump"),
    "across": (lambda x: greatest(across=math.radians(x)), 0.8 * LIMITS.across_deg, "0.8 deg across"),
    "load": (lambda x: greatest(load=x), 0.6 * LIMITS.load, "a load of 1.0 N m"),
    "gap": (lambda x: lambda trial: tick(trial, TICKS, age=x), 0.6 * LIMITS.stale, "no usable marker angle for 94 ms"),
    "late": (lambda x: lambda trial: tick(trial, TICKS, late=x), 0.6 * LIMITS.late, "a tick 32 ms late"),
    "skipped": (lambda x: setting("skipped", round(x)), 0.01 * TICKS, "11 of 1012 ticks skipped"),
    "moved": (moved, 0.03, "moved by 3 % of its side"),
    "round trip": (
        lambda x: setting("round_trips", [0.0, x, 1.0]),
        0.85 * PERIOD,
        "answers took 4.5 ms, of 5 ms",
    ),
    "lag": (lagging, 0.015, "comes 16 ms or more after"),
    "resent": (lambda x: setting("resent", round(x)), 0.002 * TICKS, "3 commands sent again"),
}


def test_a_sound_trial_has_no_word() -> None:
    assert usual().words() == ""


@pytest.mark.parametrize("name", WORDS)
def test_each_word_is_said_just_beyond_its_limit_alone_and_not_just_within(name: str) -> None:
    change, limit, said = WORDS[name]
    step = max(0.05 * limit, 1.0 if name in ("skipped", "resent") else 0.0)
    within, beyond = usual(), usual()
    change(limit - step)(within)
    change(limit + step)(beyond)
    tick(beyond, TICKS)  # of several ticks the worst counts, not the last
    assert within.words() == ""
    assert said in beyond.words() and ";" not in beyond.words()
    for other, (changed, value, _) in WORDS.items():
        if other != name:
            changed(1.5 * value)(beyond)
    assert beyond.words().count(";") == len(WORDS) - 1, "and with all others"


@pytest.mark.parametrize("dropped", [0.0, 0.1, 0.4])
def test_frames_count_as_missing_beside_those_that_are_believed_to_drop(dropped: float) -> None:
    """A tenth of the usable ones may be missing, and a short trial cannot tell."""
    sensor = SETTINGS.sensor.model_copy(update={"dropped": dropped, "frame_rate": 60.0})
    settings = SETTINGS.model_copy(update={"sensor": sensor})
    believed = 60.0 * (1.0 - dropped)
    for frames in (believed, 0.91 * believed):
        assert usual(frames, settings).words() == ""
    few = usual(0.89 * believed, settings)
    assert f"{0.89 * believed:.0f} usable angles per second instead of {believed:.0f}" in few.words()
    assert ";" not in few.words() and "(" not in few.words()
    for verdict, times in (("no tip", 3), ("no base", 5), ("ok", 9), ("", 9)):
        for _ in range(times):
            tick(few, TICKS, verdict=verdict)
    assert few.words().endswith("(no base)"), "the verdict that came most often"
    assert usual(0.5 * believed, settings, round(0.5 / PERIOD)).words() == ""
    assert usual(0.5 * believed, settings, round(0.52 / PERIOD)).words() != ""


def test_the_first_place_of_the_bases_marker_is_where_it_was_first_seen_whole() -> None:
    trial = usual()
    trial.base(np.full((4, 2), math.nan))
    trial.base(SQUARE + 500.0)
    trial.base(SQUARE + 500.0 + [0.9, 0.0])
    assert trial.words() == "" and trial.moved == pytest.approx(0.9 / 40.0)
    trial.base(SQUARE + 500.0 - [0.0, 4.0])
    assert trial.moved == pytest.approx(0.1) and "10 % of its side" in trial.words()
