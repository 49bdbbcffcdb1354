"""What a terminal shows while trials go on, and how a question stands out from it."""

from __future__ import annotations

import os
import pty
import re
import select
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any, cast

import pytest

from wristctl.cli import operator
from wristctl.cli.hw_bench import _newest
from wristctl.cli.operator import TerminalOperator
from wristctl.cli.progress import Terminal
from wristctl.commands.session import Session
from wristctl.config.study import Study
from wristctl.errors import UserError
from wristctl.records import start_run
from wristctl.trial.log import tick_columns
from wristctl.trial.trials import Trial

TRIALS = [Trial(0, "ulnar", 0, 0.0, 0), Trial(1, "radial", 0, 2.0, 0)]


class Screen:
    """A pseudo terminal with a console on it, without colours."""

    def __init__(self) -> None:
        self._master, slave = pty.openpty()
        self._file = os.fdopen(slave, "w", encoding="utf-8")
        self.console = Terminal(file=self._file, width=100, color_system=None)
        self.operator, self.session = TerminalOperator(self.console, False, frozenset()), cast("Session", None)

    def read(self, seconds: float) -> str:
        """What comes in this time."""
        found, until = b"", time.monotonic() + seconds
        while (left := until - time.monotonic()) > 0.0:
            if select.select([self._master], [], [], left)[0]:
                found += os.read(self._master, 65536)
        return found.decode(errors="ignore")

    def panel(self, told: str) -> str:
        """The first whole panel that tells this."""
        found, until = "", time.monotonic() + 30.0
        while time.monotonic() < until:
            if select.select([self._master], [], [], 1.0)[0]:
                found += os.read(self._master, 65536).decode(errors="ignore")
            for panel in re.findall(r"╭[^╭╯]*╯", found):
                if told in panel:
                    return str(panel)
        raise AssertionError(f"no panel tells {told!r}: {found}")

    def close(self) -> None:
        self._file.close()
        os.close(self._master)


@pytest.fixture
def screen(monkeypatch: pytest.MonkeyPatch) -> Iterator[Screen]:
    monkeypatch.setenv("TERM", "xterm")
    made = Screen()
    yield made
    made.close()


def row(trial: int, degrees: float, verdict: str = "") -> dict[str, Any]:
    """A tick."""
    known = {"trial": trial, "theta": degrees * 3.14159265 / 180.0, "verdict": verdict, "state": "ENABLED"}
    return dict.fromkeys(tick_columns(1), 0.0) | known


def test_the_panel_tells_the_newest_angle_and_verdict_and_counts_the_trials_that_are_done(screen: Screen) -> None:
    with screen.operator.watch(TRIALS, screen.session) as take:
        screen.panel("homing")
        take(row(-1, 0.5))
        assert "━" not in screen.panel("0.50 deg")
        take(row(0, 11.0, "ok"))
        take(row(0, 12.0))  # a tick between two frames
        shown = screen.panel("12.00 deg")
        assert "trial 1 of 2: ulnar" in shown and re.search(r"seen +ok", shown) and "━" not in shown
        take(row(-1, 3.0, "no tip"))
        shown = screen.panel("3.00 deg")
        assert "between trials" in shown and re.search(r"seen +no tip", shown) and shown.count("━") == 30
        take(row(1, -4.0))
        assert "trial 2 of 2: radial, pushed with 2 N" in screen.panel("-4.00 deg")
        take(row(-1, -1.0))
        assert screen.panel("-1.00 deg").count("━") == 60


def test_the_panel_gives_way_to_a_question_and_comes_back(screen: Screen, monkeypatch: pytest.MonkeyPatch) -> None:
    beside = []

    def answered(meanwhile: Any) -> str:
        screen.read(0.2)
        beside.append(screen.read(0.5))  # four panels' time
        return "yes"

    monkeypatch.setattr(operator, "typed_line", answered)
    with screen.operator.watch(TRIALS, screen.session) as take:
        take(row(0, 1.0))
        screen.panel("1.00 deg")
        screen.operator.confirm("Turn the wrist.")
        take(row(0, 2.0))
        screen.panel("2.00 deg")
    assert beside == [""]


def test_who_looks_on_sees_the_newest_trials_and_writes_nothing_beside_them(tmp_path: Path) -> None:
    results, made = tmp_path / "results", []
    for kind in ("hw-run", "hw-run", "gen-data"):
        with start_run(kind, Study(), "", results, ["wristctl", kind]) as run:
            made.append(run.path)
    before = sorted(results.iterdir())
    assert _newest(results).path == made[1] and sorted(results.iterdir()) == before
    with pytest.raises(UserError, match="no run of hw-run"):
        _newest(tmp_path)
