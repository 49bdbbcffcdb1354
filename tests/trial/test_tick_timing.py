"""Lateness of ticks has quantiles, and who made them late is named."""

from __future__ import annotations

import pytest

from wristctl.trial.tick_timing import FIX, SCHEDULING, WORK, TickTiming

PERIOD = 5e-3


def test_a_sound_loop_blames_nobody() -> None:
    timing = TickTiming(PERIOD)
    for _ in range(500):
        timing.tick(1e-4, 1e-4, 4e-4, 0)
    assert timing.overruns == 0 and not timing.culprits
    assert timing.said() == "500 ticks of 5 ms, late by 0.10 ms (p50), 0.10 ms (p99), 0.10 ms at most; 0 overruns"


@pytest.mark.parametrize(
    ("woken", "work", "culprit"),
    [(6e-3, 4e-4, SCHEDULING), (0.0, 7e-3, WORK), (1e-3, 7e-3, WORK), (4e-3, 3e-3, SCHEDULING)],
)
def test_who_was_slower_is_blamed_and_skipped_ticks_are_counted(woken: float, work: float, culprit: str) -> None:
    timing = TickTiming(PERIOD)
    assert timing.tick(woken, woken, work, 2) == culprit
    assert timing.overruns == 2 and timing.culprits == {culprit: 1} and culprit in timing.said() and FIX[culprit]
