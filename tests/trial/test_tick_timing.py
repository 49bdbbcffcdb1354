"""Who makes ticks late is named, and a loop that skips its ticks is stopped."""

from __future__ import annotations

import pytest

from wristctl.config.hw_run import Safety
from wristctl.trial.safety import SafetyStop
from wristctl.trial.tick_timing import LINK, SCHEDULING, WORK, TickTiming

PERIOD, SOUND = 5e-3, 2.9e-3
LIMITS = Safety()


def run(timing: TickTiming, ticks: int, woken: float = 0.0, trip: float = SOUND, work: float = 4e-4) -> None:
    """Ticks as a loop does them, each judged."""
    late = 0.0
    for _ in range(ticks):
        took = trip + work
        ended = late + woken + took - PERIOD
        skipped = max(0, int(ended / PERIOD))
        timing.tick(late + woken, woken, trip, took, skipped)
        timing.judge(LIMITS)
        late = max(0.0, ended - skipped * PERIOD)


def test_a_sound_loop_goes_on_and_blames_nobody() -> None:
    timing = TickTiming(PERIOD)
    run(timing, 500, woken=1e-4)
    assert timing.overruns == 0 and not timing.culprits
    assert timing.said() == "500 ticks of 5 ms, late by 0.10 ms (p50), 0.10 ms (p99), 0.10 ms at most; 0 overruns"


@pytest.mark.parametrize(
    ("how", "culprit", "said"),
    [
        ({"trip": 0.016}, LINK, "the board's answers take 16.0 ms of a tick's 5 ms"),
        ({"trip": 0.006}, LINK, "the board's answers take 6.0 ms"),
        ({"woken": 0.006}, SCHEDULING, "ticks were skipped: the computer woke the loop late"),
        ({"work": 0.007}, WORK, "ticks were skipped: the loop's own work"),
    ],
)
def test_a_loop_that_cannot_keep_its_period_is_stopped_within_half_a_second_and_a_few_ticks(
    how: dict[str, float], culprit: str, said: str
) -> None:
    timing = TickTiming(PERIOD)
    with pytest.raises(SafetyStop, match=said) as stopped:
        run(timing, 400, **how)
    assert stopped.value.exit_code == 5 and stopped.value.fix
    assert len(timing.late) + timing.overruns <= 115
    assert timing.culprits.most_common(1)[0][0] == culprit and culprit in timing.said()


def test_a_few_skipped_ticks_are_borne_and_half_of_them_never() -> None:
    timing = TickTiming(PERIOD)
    for k in range(1000):
        timing.tick(0.0, 0.0, SOUND, SOUND, int(k % 10 == 0))
        timing.judge(LIMITS)
    assert timing.overruns == 100
    most = Safety.model_validate({"skipped": 0.49, "round_trip": 1.0})
    with pytest.raises(SafetyStop, match="50 % of the last half second's ticks"):
        for _ in range(400):
            timing.tick(0.0, 6e-3, SOUND, SOUND, 1)
            timing.judge(most)


def test_the_last_half_second_counts_and_no_older_one() -> None:
    timing = TickTiming(PERIOD)
    run(timing, 40, woken=0.006)  # too few to be judged yet
    skipped = timing.overruns
    assert skipped > 0
    for _ in range(10):
        timing.tick(0.0, 0.0, SOUND, SOUND, 0)
    with pytest.raises(SafetyStop):
        run(timing, 40)
    later = TickTiming(PERIOD)
    run(later, 300)
    run(later, 14, woken=0.006)
    run(later, 300)
