"""Progress is shown off a terminal as plain lines, and noted as events."""

from __future__ import annotations

import io
import time
from typing import Any

import pytest
from rich.console import Console

from wristctl.cli import progress as module
from wristctl.commands.progress import Count, no_event


def _shown(total: int | None, quiet: bool = False) -> tuple[list[str], list[dict[str, Any]]]:
    screen, events = io.StringIO(), []
    console = Console(file=screen, width=20)
    with module.progress(
        console, lambda name, **fields: events.append(fields), "tuning", total, "steps", quiet
    ) as done:
        for count in range(1, 1001):
            done(count, best=1.0 / count)
    return screen.getvalue().splitlines(), events


def test_frequent_calls_give_few_lines_and_events() -> None:
    lines, events = _shown(1000)
    assert lines == []
    assert [event["count"] for event in events] == [1, 1000]
    assert events[-1]["best"] == 1e-3


def test_a_line_tells_count_and_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "_LINE_EVERY", 0.0)
    lines, _ = _shown(1000)
    assert lines[-1] == "tuning: 1000 of 1000 steps, best 0.001"


def test_the_time_that_is_left_is_told_at_the_pace_so_far(monkeypatch: pytest.MonkeyPatch) -> None:
    count = Count("drawing", 1000, "samples", 250, began=0.0)
    for now, left in ((1.0, ""), (20.0, "about 60 s left"), (200.0, "about 10 min left"), (2400.0, "about 2 h left")):
        monkeypatch.setattr("time.monotonic", lambda now=now: now)
        assert count.remaining() == left
    for known in (Count("drawing", 1000, "samples", 1000, began=0.0), Count("drawing", None, "samples", 3, began=0.0)):
        assert known.seconds_left() is None and known.remaining() == ""
    instants = iter([0.0, 0.0, *[20.0] * 10])
    monkeypatch.setattr("time.monotonic", lambda: next(instants))
    monkeypatch.setattr(module, "_LINE_EVERY", 0.0)
    screen = io.StringIO()
    with module.progress(Console(file=screen, width=20), no_event, "drawing", 40, "samples", False) as done:
        done(10)
    assert screen.getvalue() == "drawing: 10 of 40 samples, about 60 s left\n"


def test_a_length_that_is_unknown_is_announced_and_quiet_is_quiet() -> None:
    assert _shown(None)[0] == ["tuning ..."]
    assert _shown(None, quiet=True)[0] == []


def test_what_says_nothing_for_long_is_said_to_go_on_off_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """A rig that is prepared for a minute, in a pipe."""
    monkeypatch.setattr(module, "_LINE_EVERY", 1.0)
    screen = io.StringIO()
    with module.progress(Console(file=screen, width=80), no_event, "opening board and camera", None, "", False):
        time.sleep(1.3)
    begin, still = screen.getvalue().splitlines()
    assert begin == "opening board and camera ..." and still == "opening board and camera ... 1 s"
