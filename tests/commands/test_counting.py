"""How far something has come is counted, shown, noted at most once a second, and told in the end."""

from __future__ import annotations

import logging
from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.commands import progress
from wristctl.commands.progress import Count, watched


def test_a_count_is_a_line_of_text() -> None:
    assert Count("frames", None, "").line() == "frames"
    assert Count("tuning", 20, "iterations", 3, {"best": 0.123456}).line() == "tuning: 3 of 20 iterations, best 0.1235"
    assert Count("frames", None, "", 7).line() == "frames: 7"
    assert Count("x", 5, "s", 0, {"a": 1.0, "b": 2.0}).line() == "x: a 1, b 2"


def test_every_step_is_shown_but_noted_once_a_second_and_at_the_end(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    clock = {"now": 100.0}
    monkeypatch.setattr("wristctl.commands.progress.time", SimpleNamespace(monotonic=lambda: clock["now"]))
    shown: list[tuple[Any, ...]] = []
    events: list[dict[str, Any]] = []

    def event(kind: str, **fields: Any) -> None:
        events.append({"event": kind, **fields})

    show = watched(lambda *told: shown.append(told))
    with caplog.at_level(logging.INFO), show(event, "search", 9, "steps") as done:
        for count, now in ((1, 100.0), (2, 100.5), (3, 100.99), (4, 101.0), (5, 101.5), (6, 102.0)):
            clock["now"] = now
            done(count, best=float(10 - count))
    assert [told[:3] for told in shown] == [("search", k, 9) for k in range(7)]
    assert shown[0][3] == {} and shown[-1][3] == {"best": 4.0}
    assert [each["count"] for each in events] == [1, 4, 6, 6]
    assert events[1] == {"event": "progress", "what": "search", "total": 9, "count": 4, "best": 6.0}
    assert caplog.messages == ["search: 6 of 9 steps, best 4, 2.0 s"]


def test_figures_stay_until_they_are_told_anew() -> None:
    told: list[Any] = []
    with watched(lambda *each: told.append(each))(progress.no_event, "x", None, "") as done:
        done(1, a=1.0)
        done(2, b=2.0)
    assert told[-1] == ("x", 2, None, {"a": 1.0, "b": 2.0})
