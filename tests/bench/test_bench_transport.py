"""The wire to the bench's board in virtual time: when it is lost, deaf, or its board restarts."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, chip_with
from wristctl.bench.faults import Faults
from wristctl.bench.virtual_bench import BenchTransport
from wristctl.board.board_errors import PortLost
from wristctl.board.driver import Board
from wristctl.board.emulator import Atmega2560
from wristctl.config.bench import FaultKind, InjectedFault, SerialLine


def wire(
    kind: FaultKind, at: float = 0.01, duration: float | None = None, chip: Atmega2560 | None = None, size: float = 1.0
) -> BenchTransport:
    faults = Faults([InjectedFault(kind=kind, at=at, duration=duration, size=size)])
    faults.begin(0.0)
    return BenchTransport(chip or Atmega2560(), faults, SerialLine(adapter="ch340"))


def test_a_lost_port_stays_lost_while_the_board_runs_on() -> None:
    lost = wire("port-lost", duration=0.005)
    lost.write(b"\0")
    lost.wait(0.0099)
    assert lost.read(0.0) == b""
    with pytest.raises(PortLost):
        lost.read(0.001)
    assert lost.now() == pytest.approx(0.01, abs=1.1e-3)
    lost.wait(0.1)
    assert lost.now() > 0.1
    for call in (lambda: lost.read(0.0), lambda: lost.write(b"\0")):
        with pytest.raises(PortLost):
            call()


def test_a_silent_host_is_not_heard_for_as_long_as_it_lasts() -> None:
    silent = wire("host-silent", duration=0.01)
    for time, heard in ((0.005, 1), (0.015, 0), (0.025, 1)):
        silent.wait(time - silent.now())
        silent.write(b"\0")
        coming = 0
        for _ in range(110):  # to USB's next frame, and a byte's time until it is in
            silent.wait(1e-5)
            coming = max(coming, silent.chip.bytes_coming)
        assert coming == heard


def test_a_board_restarts_once_at_its_moment_whether_waited_for_or_read_from(tmp_path: Path) -> None:
    for reading in (False, True):
        restarting = wire("board-reset", at=0.05, chip=chip_with(tmp_path, {0: [RJMP_SELF]}))
        restarting.chip.poke(0x54, 0)  # the causes of earlier resets
        restarting.wait(0.049)
        assert restarting.chip.peek(0x54) == 0
        if reading:
            restarting.read(0.011)
        else:
            restarting.wait(0.011)
        assert restarting.chip.peek(0x54) == 0x02 and restarting.now() == pytest.approx(0.06, abs=1e-6)
        restarting.chip.poke(0x54, 0)
        restarting.wait(0.1)
        assert restarting.chip.peek(0x54) == 0


def test_late_answers_come_so_much_later_whole_and_in_their_order() -> None:
    """Each byte by the same time, whatever pieces it is read in."""
    sound, late = (wire("answers-late", at, size=8.0) for at in (100.0, 0.0))
    trips = []
    for each in (sound, late):
        board = Board(each)
        board.connect()
        each.wait(math.ceil(1e3 * each.now()) * 1e-3 - each.now())
        began = each.now()
        status = board.read()
        trips.append(each.now() - began)
        assert status.position == (0, 0, 0, 0)
    assert trips[1] - trips[0] == pytest.approx(8e-3, abs=1e-5)


def test_reading_takes_no_longer_than_asked_and_hands_over_at_whole_milliseconds() -> None:
    free = wire("port-lost", at=100.0)
    began = free.now()
    assert free.read(0.0105) == b"" and free.now() - began == pytest.approx(0.0105, abs=1e-6)
    board = Board(free)
    board.connect()
    free.wait(0.0003)
    board.ping()
    assert 1e3 * free.now() == pytest.approx(round(1e3 * free.now()), abs=2e-3)
