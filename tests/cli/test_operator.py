"""The person at the terminal is asked on stderr, and only a yes is a yes."""

from __future__ import annotations

import io
import os
import sys
from types import SimpleNamespace
from typing import Any

import pytest

from wristctl.cli.operator import TerminalOperator
from wristctl.cli.progress import Terminal
from wristctl.errors import UserError


def _operator(*flags: str, quiet: bool = False, terminal: bool = False) -> TerminalOperator:
    console = Terminal(stderr=True, force_terminal=terminal)
    return TerminalOperator(console, quiet, frozenset(flags))


def test_a_yes_lets_it_go_on(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("yes\n"))
    _operator().confirm("the motors will move")
    out, err = capsys.readouterr()
    assert out.strip() == "" and err == "the motors will move\nType yes to go on: "


@pytest.mark.parametrize("typed", ["\n", "no\n", "y\n", "YES\n"])
def test_anything_else_stops(monkeypatch: pytest.MonkeyPatch, typed: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(typed))
    with pytest.raises(UserError, match="nothing was moved further") as caught:
        _operator("other").confirm("the motors will move")
    assert caught.value.exit_code == 3


def test_what_goes_wrong_while_a_person_thinks_ends_the_question(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also in the middle of a line; a line that is whole is an answer, be it followed by others."""
    reading, writing = os.pipe()
    with open(reading) as stdin:
        monkeypatch.setattr(sys, "stdin", stdin)
        moments: list[int] = []

        def meanwhile() -> None:
            moments.append(len(moments))
            if len(moments) == 2:
                os.write(writing, b"ye")
            if len(moments) == 4:
                raise TimeoutError

        with pytest.raises(TimeoutError):
            _operator().confirm("the motors will move", meanwhile)
        assert moments == [0, 1, 2, 3]
        os.write(writing, b"yes\nno\n")
        _operator().confirm("the motors will move", meanwhile)
        os.close(writing)
        for _ in range(2):  # the other line, and then the end
            with pytest.raises(UserError, match="nothing was moved further"):
                _operator().confirm("the motors will move", meanwhile)
    assert moments == [0, 1, 2, 3]


def test_with_the_flag_nobody_is_asked(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(""))
    _operator("yes").confirm("the motors will move")
    assert capsys.readouterr() == ("", "the motors will move\n")


def test_enter_is_waited_for_and_told_texts_are_plain(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO("\n"))
    _operator().wait_for("Pull the tendon, then press Enter")
    _operator(quiet=True).tell("axis [3] moves")
    out, err = capsys.readouterr()
    assert out.strip() == "" and err == "Pull the tendon, then press Enter:axis [3] moves\n"


@pytest.mark.parametrize(
    ("terminal", "quiet", "live"), [(True, False, True), (True, True, False), (False, False, False)]
)
def test_trials_are_shown_live_on_a_terminal_that_is_not_to_be_quiet(
    monkeypatch: pytest.MonkeyPatch, terminal: bool, quiet: bool, live: bool
) -> None:
    seen: dict[str, Any] = {}
    monkeypatch.setattr("wristctl.cli.trial_panel.panel_shown", lambda *given: seen.update(live=given))
    monkeypatch.setattr("wristctl.cli.trial_panel.trials_counted", lambda *given: seen.update(counted=given))
    operator, session, trials = _operator(quiet=quiet, terminal=terminal), SimpleNamespace(), [SimpleNamespace()]
    operator.watch(trials, session)  # type: ignore[arg-type]
    assert seen == ({"live": (operator.console, trials)} if live else {"counted": (session, trials)})
