"""Progress is shown off a terminal as plain lines, and noted as events."""

from __future__ import annotations

import io
import logging
import time
from itertools import accumulate, islice, takewhile
from typing import Any

import pytest
from rich.console import Console

from wristctl.cli import progress as module
from wristctl.commands.progress import Ahead, Count, counting, no_event
from wristctl.lanes.compile_time import COMPILE_TIME


def _shown(total: int | None, quiet: bool = False) -> tuple[list[str], list[dict[str, Any]]]:
    screen, events = io.StringIO(), []
    console = Console(file=screen, width=20)

    def keep(_: str, **fields: Any) -> None:
        events.append(fields)

    with module.Bar(console, quiet) as bar, bar(keep, "tuning", total, "steps") as done:
        for count in range(1, 1001):
            done(count, best=1.0 / count)
    return screen.getvalue().splitlines(), events


def test_frequent_calls_give_no_lines_and_few_events() -> None:
    lines, events = _shown(1000)
    assert lines == []
    assert [event["count"] for event in events] == [1, 1000]
    assert events[-1]["best"] == 1e-3


def test_a_step_that_takes_long_has_lines_of_its_count(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_FIRST_LINE", 0.2)
    screen = io.StringIO()
    with module.progress(Console(file=screen, width=20), "tuning", False, 1000, "steps") as done:
        done(100, best=0.5)
        done(500, best=0.002)
        time.sleep(0.3)
    lines = screen.getvalue().splitlines()
    assert lines and all(line.startswith("tuning: 500 of 1000 steps, best 0.002, ") for line in lines)


def test_that_something_compiles_is_one_line_of_a_command_however_many_steps_do(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(module, "_FIRST_LINE", 0.05)
    screen = io.StringIO()
    with module.Bar(Console(file=screen, width=20), False) as bar:
        for task in ("tuning", "testing"):
            with bar(no_event, task, None, ""), COMPILE_TIME.counted():
                time.sleep(0.25)
    lines = screen.getvalue().splitlines()
    assert lines[0] == "tuning, compiling, once" and {line.partition(",")[0] for line in lines} == {"tuning", "testing"}
    assert len(lines) > 3 and all(line.endswith(" so far") for line in lines[1:])


def test_lines_of_a_step_come_further_and_further_apart_up_to_five_minutes() -> None:
    waits = list(islice(module._waits(), 9))
    assert waits[:3] == [10.0, 10.0, 20.0] and waits == sorted(waits) and waits[-2:] == [300.0, 300.0]
    assert sum(1 for _ in takewhile(lambda passed: passed < 3600.0, accumulate(module._waits()))) < 20


@pytest.mark.parametrize(("passed", "told"), [(0.4, False), (1.0, True), (75.0, True)])
def test_a_step_has_one_line_in_the_end_and_none_if_it_takes_less_than_a_second(
    passed: float, told: bool, monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    instants = iter([0.0, *[passed] * 10])
    monkeypatch.setattr("time.monotonic", lambda: next(instants))
    with caplog.at_level(logging.DEBUG), counting(no_event, "drawing", None, "", lambda count: None):
        pass
    (record,) = caplog.records
    assert record.getMessage() == f"drawing, {passed:.1f} s" and (record.levelno >= logging.INFO) == told


def test_the_time_that_is_left_is_told_at_the_pace_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    count = Count("drawing", 1000, "samples", 250, began=0.0)
    for now, left in (
        (0.9, ""),
        (1.0, "about 3 s left"),
        (20.0, "about 60 s left"),
        (200.0, "about 10 min left"),
        (2400.0, "about 2 h left"),
    ):
        monkeypatch.setattr("time.monotonic", lambda now=now: now)
        assert count.remaining() == left
        assert Count("drawing", 1750, "samples", 1000, began=0.0, kept=750).remaining() == left, "at the pace of today"
    for known in (Count("drawing", 1000, "samples", 1000, began=0.0), Count("drawing", None, "samples", 3, began=0.0)):
        assert known.seconds_left() is None and known.remaining() == ""


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """The time, which the test sets, on a machine that does nothing else."""
    now = [0.0]
    monkeypatch.setattr("os.getloadavg", lambda: (0.2, 0.0, 0.0))
    monkeypatch.setattr("time.monotonic", lambda: now[0])
    return now


def test_between_two_counts_the_time_left_runs_down_until_the_next_is_overdue(clock: list[float]) -> None:
    count = Count("tuning", 10, "iterations", began=0.0)
    clock[0] = 6.0
    count.count, count.reached = 2, count.worked()
    for now, left in ((6.0, 24.0), (8.0, 22.0), (9.0, 21.0), (12.0, 28.0)):
        clock[0] = now
        assert count.seconds_left() == pytest.approx(left), "3 s each, until 9 s have passed"


def test_the_next_count_is_overdue_when_a_step_as_large_as_the_last_takes_longer(clock: list[float]) -> None:
    seen: list[Count] = []
    with counting(no_event, "judging", 1000, "rollouts", seen.append) as done:
        for clock[0], count in ((5.0, 100), (10.0, 300)):
            done(count)
        for clock[0], whole in ((12.0, 100.0 / 3.0), (16.0, 100.0 / 3.0), (20.0, 40.0)):
            left = seen[-1].seconds_left()
            assert left is not None and left + clock[0] == pytest.approx(whole), "200 more were due after 16.7 s"


@pytest.mark.parametrize(("then", "after"), [(0.5, 0.0), (0.0, 7.0), (2.0, 3.0)])
def test_what_follows_a_task_is_part_of_the_time_left_also_when_all_of_it_is_counted(
    then: float, after: float, clock: list[float]
) -> None:
    count = Count("tuning", 4, "iterations", 1, began=0.0, then=then, after=after)
    clock[0] = 5.0
    assert count.seconds_left() == pytest.approx(15.0 + 20.0 * then + after)
    count.count, clock[0] = 4, 20.0
    assert count.seconds_left() == pytest.approx(20.0 * then + after)


@pytest.mark.parametrize(
    ("waiting", "cores", "had", "longer"),
    [
        (0.5, 1, 5.0, 1.0),
        (1.0, 1, 5.0, 1.0),
        (3.0, 1, 20.0, 1.0),  # the others are of low priority
        (3.0, 1, 10.0, 2.0),
        (3.0, 4, 40.0, 2.0),
        (3.0, 4, 80.0, 1.0),
        (3.0, 1, 1.0, 3.0),
        (3.0, 1, 0.0, 3.0),  # it waited for its workers
    ],
)
def test_seconds_that_follow_are_longer_where_a_crowded_machine_kept_this_process_waiting(
    waiting: float, cores: int, had: float, longer: float, clock: list[float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda process: range(4), raising=False)
    monkeypatch.setattr("os.getloadavg", lambda: (4.0 * waiting, 99.0, 99.0))
    monkeypatch.setenv("OMP_NUM_THREADS", str(cores))
    monkeypatch.setattr("time.process_time", lambda: 100.0 + had)
    count = Count("ranking", 4, "", 4, began=0.0, processor=100.0, after=7.0)
    clock[0] = 20.0
    assert count.seconds_left() == pytest.approx(7.0 * longer)


def test_compiling_is_no_part_of_the_pace(clock: list[float]) -> None:
    count = Count("ranking", 10, "", began=0.0)
    with COMPILE_TIME.counted():
        clock[0] = 50.0
        with COMPILE_TIME.counted():  # another thread, at once
            clock[0] = 90.0
        assert COMPILE_TIME.goes_on and count.worked() == pytest.approx(0.0)
    assert not COMPILE_TIME.goes_on
    clock[0], count.count = 94.0, 1
    assert count.seconds_left() == pytest.approx(36.0)


def test_a_task_without_a_count_goes_by_what_those_before_it_told(clock: list[float]) -> None:
    ahead, count = Ahead(), Count("ranking", 2, "", 1, began=0.0, after=6.0)
    assert ahead.seconds_left(Count("reading", None, "", began=0.0)) is None
    clock[0] = 4.0
    assert ahead.seconds_left(count) == pytest.approx(10.0)
    clock[0] = 9.0
    assert ahead.seconds_left(Count("drawing", None, "", began=8.0)) == pytest.approx(5.0)
    clock[0] = 15.0
    assert ahead.seconds_left(Count("drawing", None, "", began=8.0)) is None, "it is over its time"


def test_the_tasks_of_a_command_have_one_line_whose_bar_only_grows() -> None:
    console, shares = Console(file=io.StringIO(), force_terminal=True, width=100), list[float]()
    with module.Bar(console, False) as bar:
        (line,) = bar._bar.tasks
        for task in ("tuning smc", "drawing"):
            with bar(no_event, task, 4, "steps", after=1.0) as done:
                bar._count.began -= 8.0
                for count in range(1, 5):
                    done(count)
                    assert line.description == f"{task}: {count} of 4 steps"
                    shares.append(line.percentage)
            assert bar._bar.live.is_started and bar._bar.tasks == [line]
            assert line.description == "writing", "a count stays at its total no longer than its task"
    assert not bar._bar.live.is_started
    assert max(shares) < 100.0 and shares[:4] == sorted(shares[:4])


def test_nothing_is_announced_and_quiet_is_quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    assert _shown(None)[0] == []
    monkeypatch.setattr(module, "_FIRST_LINE", 0.1)
    screen = io.StringIO()
    with module.progress(Console(file=screen, width=20), "tuning", True):
        time.sleep(0.3)
    assert screen.getvalue() == ""


def test_what_says_nothing_for_long_is_said_to_go_on_off_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rig that is prepared for a minute, in a pipe."""
    monkeypatch.setattr(module, "_FIRST_LINE", 1.0)
    screen = io.StringIO()
    with module.progress(Console(file=screen, width=80), "opening board and camera", False):
        time.sleep(1.3)
    (still,) = screen.getvalue().splitlines()
    assert still == "opening board and camera, 1 s so far"
