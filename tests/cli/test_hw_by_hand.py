"""Motors by a person's word: asked first, moved as told, held meanwhile, released at the end."""

from __future__ import annotations

import io
import os
import sys
from collections.abc import Iterator
from typing import ClassVar

import pytest

from tests.cli.conftest import Call
from wristctl.board.driver import Board
from wristctl.board.emulator import atmega2560 as virtual
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.messages import Limits
from wristctl.config.plant import Actuator

STEP_MM = 1e3 * Actuator().step_length
VERBS = (("jog", "--axis", "1", "--mm", "0.5"), ("home",), ("limits",), ("slacken",), ("tension",), ("clear",))


class Emulated(VirtualTransport):
    """The board that the command opened."""

    made: ClassVar[list[Emulated]] = []

    def __init__(self) -> None:
        super().__init__()
        self.made.append(self)
        self.presses_after = float("inf")

    def wait(self, seconds: float) -> None:
        super().wait(seconds)
        if self.now() > self.presses_after:
            self.chip.drive("G", 0, True)

    @property
    def energised(self) -> list[bool]:
        return [not self.chip.pin("C", axis) for axis in range(4)]


@pytest.fixture(autouse=True)
def emulated(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    Emulated.made.clear()
    monkeypatch.setattr(virtual, "VirtualTransport", Emulated)
    yield


def typed(monkeypatch: pytest.MonkeyPatch, lines: str) -> None:
    monkeypatch.setattr(sys, "stdin", io.StringIO(lines))


@pytest.mark.parametrize("verb", VERBS, ids=lambda verb: verb[0])
def test_a_dry_run_says_what_would_be_done_and_opens_nothing(call: Call, verb: tuple[str, ...]) -> None:
    code, out, err = call("hw", *verb, "--port", "emulated", "--dry-run")
    assert code == 0 and err == "" and len(out.splitlines()) == 1 and not Emulated.made


@pytest.mark.parametrize("verb", VERBS[:-1], ids=lambda verb: verb[0])
def test_only_a_yes_switches_the_drives_on(call: Call, monkeypatch: pytest.MonkeyPatch, verb: tuple[str, ...]) -> None:
    typed(monkeypatch, "y\n")
    code, _, err = call("hw", *verb, "--port", "emulated")
    assert code == 3 and "Emergency stop within reach" in err and "nothing was moved" in err
    (board,) = Emulated.made
    assert not len(board.chip.events()) or not any(board.energised)
    assert board.chip.pin("C", 0), "off all the time"


def test_a_tendon_is_reeled_in_by_what_is_typed_and_let_go_at_the_end(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    typed(monkeypatch, "yes\n0.3\nfar\n-9\n-0.2\n\n")
    code, out, err = call("hw", "jog", "--axis", "2", "--mm", "0.5", "--port", "emulated")
    steps = [round(mm / STEP_MM) for mm in (0.5, 0.3, -0.2)]
    assert code == 0 and out.splitlines() == [f"axis 2: {each:+d} steps" for each in steps]
    assert "'far' is no length" in err and "'-9' is no length of at most 5 mm" in err
    (board,) = Emulated.made
    assert board.energised == [False] * 4 and Board(board).read().position == (0, 0, sum(steps), 0)


@pytest.mark.slow
def test_jogs_together_lead_no_further_than_a_taut_tendon_may_be_pulled_until_the_drives_let_go(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    """60 N at 20 kN/m are 3 mm, to either side: nobody knows which way is in."""
    for sign in (1, -1):
        typed(monkeypatch, f"yes\n{0.9 * sign}\n{0.2 * sign}\n{-5.0 * sign}\n\n")
        words = (
            "hw",
            "jog",
            "--axis",
            "2",
            "--mm",
            str(2.0 * sign),
            "--port",
            "emulated",
            "--set",
            "safety.tension=60",
        )
        code, out, err = call(*words)
        assert code == 0 and out.count("\n") == 3, "the third word alone is refused"
        assert "axis 2 would be 3.1 mm from where" in err and "would pull 62 N, beyond 60 N" in err
        position = sum(round(mm * sign / STEP_MM) for mm in (2.0, 0.9, -5.0))
        assert Board(Emulated.made[-1]).read().position == (0, 0, position, 0)
    for length, refused in (("3", 0), ("3.1", 2)):
        again = ("hw", "slacken", "--mm", length, "--port", "emulated", "--yes", "--set", "safety.tension=60")
        assert call(*again)[0] == refused


def test_from_home_an_axis_goes_to_lengths_from_zero(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    typed(monkeypatch, "2 0.5\n7 1\n1 -1\n2 0\n\n")
    code, out, err = call("hw", "home", "--port", "emulated", "--yes")
    half, one = round(0.5 / STEP_MM), round(1.0 / STEP_MM)
    assert code == 0 and "'7 1' is no axis and length" in err
    assert out.splitlines()[1:] == [
        f"positions {each} steps" for each in ((0, 0, half, 0), (0, -one, half, 0), (0, -one, 0, 0))
    ]
    assert Emulated.made[0].energised == [False] * 4


def test_limits_are_tried_without_a_step(call: Call) -> None:
    code, out, _ = call("hw", "limits", "--port", "emulated", "--yes", "--set", "safety.travel=0.01")
    assert code == 0 and f"+-{round(10 / STEP_MM)} steps is refused" in out
    (board,) = Emulated.made
    assert Board(board).read().position == (0, 0, 0, 0) and board.energised == [False] * 4


def test_limits_that_the_board_does_not_keep_are_told_of(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    set_up = Board.set_up
    monkeypatch.setattr(Board, "set_up", lambda board, settings, limits: set_up(board, settings, Limits()))
    code, _, err = call("hw", "limits", "--port", "emulated", "--yes")
    assert code == 4 and "axis 0 has no soft limit" in err and Emulated.made[0].energised == [False] * 4


@pytest.mark.parametrize(("words", "length"), [(("--mm", "1"), 1.0), ((), 0.6)])
def test_slackened_tendons_are_paid_out_together_and_released(
    call: Call, words: tuple[str, ...], length: float
) -> None:
    code, out, _ = call("hw", "slacken", *words, "--port", "emulated", "--yes")
    (board,), paid = Emulated.made, -round(length / STEP_MM)
    assert code == 0 and out == f"paid out: {(paid,) * 4} steps\n"
    assert Board(board).read().position == (paid,) * 4 and board.energised == [False] * 4


@pytest.mark.slow
def test_a_button_pressed_while_a_person_thinks_ends_the_command(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    reading, writing = os.pipe()
    init = Emulated.__init__

    def pressed(board: Emulated) -> None:
        init(board)
        board.presses_after = 1.5

    monkeypatch.setattr(Emulated, "__init__", pressed)
    with open(reading) as stdin, open(writing, "w"):
        monkeypatch.setattr(sys, "stdin", stdin)
        code, _, err = call("hw", "jog", "--axis", "0", "--mm", "0.5", "--port", "emulated", "--yes")
    (board,) = Emulated.made
    assert code == 5 and "the emergency stop button is pressed" in err
    assert board.now() < 1.8 and board.energised == [False] * 4


def test_a_latched_fault_is_told_and_cleared_after_a_yes(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    init = Emulated.__init__

    def stopped(board: Emulated) -> None:
        init(board)
        board.wait(0.1)
        Board(board).emergency_stop()

    monkeypatch.setattr(Emulated, "__init__", stopped)
    typed(monkeypatch, "no\n")
    code, out, _ = call("hw", "clear", "--port", "emulated")
    assert code == 3 and out == "the host sent an emergency stop\n"
    code, out, _ = call("hw", "clear", "--port", "emulated", "--yes")
    assert code == 0 and out.splitlines()[1] == "cleared; the board is DISABLED"
    monkeypatch.setattr(Emulated, "__init__", init)
    code, out, _ = call("hw", "clear", "--port", "emulated", "--yes")
    assert code == 0 and out == "no fault is latched; the board is DISABLED\n"


def test_a_tendon_is_reeled_in_until_its_person_says_taut_and_let_go_before_the_next(
    call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    typed(monkeypatch, "yes\nm\nmore\nm\n\n\nm\n\n\n")
    code, out, err = call("hw", "tension", "--mm", "0.2", "--port", "emulated")
    reeled = (0.6, 0.2, 0.4, 0.2)
    assert code == 0 and "each axis in turn reels in 0.2 mm at a time until you say so" in err
    assert err.count("axis 0: 0.40 mm reeled in. m and Enter for more, Enter where it is taut") == 2, "asked again"
    assert out.splitlines() == [
        f"axis {k}: taut after {mm:.2f} mm, and paid out by 0.6 mm" for k, mm in enumerate(reeled)
    ]
    (board,), one, back = Emulated.made, round(0.2 / STEP_MM), round(0.6 / STEP_MM)
    assert Board(board).read().position == tuple(round(mm / 0.2) * one - back for mm in reeled)
    assert board.energised == [False] * 4


def test_where_nobody_answers_a_tendon_is_reeled_in_no_further(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    typed(monkeypatch, "m\n")
    code, out, err = call("hw", "tension", "--axis", "3", "--port", "emulated", "--yes")
    assert code == 3 and out == "" and "nobody says whether the tendon is taut - axis 3" in err
    assert Board(Emulated.made[0]).read().position == (0, 0, 0, 2 * round(0.1 / STEP_MM))
    assert Emulated.made[0].energised == [False] * 4
