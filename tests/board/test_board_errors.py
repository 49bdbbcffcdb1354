"""Every error of the board says who is to blame, and ends a program with its code."""

from __future__ import annotations

import errno

import pytest

from wristctl.board.board_errors import (
    BoardError,
    Faulted,
    NoAnswer,
    PortLost,
    PortUnusable,
    Refused,
    Restarted,
    WrongFirmware,
)
from wristctl.board.layout import FAULT_MEANING
from wristctl.board.messages import Command, Fault, Result


@pytest.mark.parametrize(
    ("error", "origin", "code"),
    [
        (BoardError("host", "something"), "host", 4),
        (PortLost("/dev/a", OSError("gone")), "cable", 4),
        (NoAnswer("/dev/a", Command.PING, 3, 0), "cable", 4),
        (NoAnswer("/dev/a", Command.PING, 3, 0, 0.01), "cable", 4),  # a process is woken up so late now and then
        (NoAnswer("/dev/a", Command.PING, 3, 0, 0.05), "host", 4),
        (NoAnswer("/dev/a", Command.PING, 3, 1), "firmware", 4),
        (WrongFirmware("/dev/a", 1, (1, 2, 3), 2), "firmware", 4),
        (Refused("/dev/a", Command.ENABLE, next(each for each in Result if each != Result.OK)), "host", 4),
        (Restarted("/dev/a"), "cable", 5),
        (Faulted("/dev/a", Fault.ESTOP_INPUT, 0.0, 0.1), "host", 5),
        (Faulted("/dev/a", Fault.HANG | Fault.LINK, 0.0, 0.1), "firmware", 5),
        (Faulted("/dev/a", Fault.WATCHDOG, 0.0, 0.1), "firmware", 5),
        (Faulted("/dev/a", Fault.LINK, 0.05, 0.1), "cable", 5),
        (Faulted("/dev/a", Fault.LINK, 0.15, 0.1), "host", 5),
        (Faulted("/dev/a", Fault.LINK | Fault.ESTOP_COMMAND, 0.05, 0.1), "host", 5),
    ],
)
def test_an_error_names_who_is_to_blame_and_has_its_exit_code(error: BoardError, origin: str, code: int) -> None:
    assert error.origin == origin and error.exit_code == code and error.what.startswith(f"{origin}: ")
    assert isinstance(error, BoardError) and (not error.where or error.where == "/dev/a")


@pytest.mark.parametrize(
    ("port", "cause", "said"),
    [
        ("/dev/a", OSError(errno.EACCES, "x"), "no permission"),
        ("/dev/a", OSError("Permission denied"), "no permission"),
        ("COM3", OSError("Access is denied."), "no permission"),
        ("/dev/a", OSError(errno.EBUSY, "x"), "another program"),
        ("/dev/a", OSError(errno.EAGAIN, "x"), "another program"),
        ("/dev/a", OSError("could not exclusively lock port"), "another program"),
        ("/dev/a", OSError("device busy"), "another program"),
        ("socket://here:1", OSError("refused"), r"cannot connect \(refused\)"),
        ("/dev/a", OSError(errno.ENOENT, "x"), "no such port"),
    ],
)
def test_a_port_that_cannot_be_opened_is_told_with_why(port: str, cause: OSError, said: str) -> None:
    with pytest.raises(PortUnusable, match=said) as told:
        raise PortUnusable(port, cause)
    assert told.value.origin == "host" and told.value.exit_code == 4 and port in str(told.value)


def test_a_silent_host_is_told_for_how_long_and_a_silent_cable_is_not() -> None:
    late, lost = Faulted("p", Fault.LINK, 0.15, 0.1), Faulted("p", Fault.LINK, 0.05, 0.1)
    assert "of 100 ms: this computer was silent for 150 ms" in late.what and "silent for" not in lost.what
    assert late.faults == Fault.LINK


def test_every_fault_that_is_latched_is_told() -> None:
    both = Faulted("p", Fault.LINK | Fault.ESTOP_INPUT, 0.0, 0.1)
    assert FAULT_MEANING[Fault.LINK] in both.what and FAULT_MEANING[Fault.ESTOP_INPUT] in both.what
    assert FAULT_MEANING[Fault.HANG] not in both.what
    assert "a fault is latched" in Faulted("p", Fault(0), 0.0, 0.1).what


def test_versions_and_tables_of_both_sides_are_told() -> None:
    what = WrongFirmware("p", 0xABC, (1, 2, 3), 0xDEF).what
    assert "firmware 1.2.3 has the message table 00000abc, this host 00000def" in what
