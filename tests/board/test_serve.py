"""The emulated board in real time, as any serial program meets it."""

from __future__ import annotations

import gc
import os
import re
import socket
import threading
from collections.abc import Iterator
from contextlib import closing, suppress

import numpy as np
import pytest

from tests.board.patience import patient, wait_for
from wristctl.board.board_errors import BoardError, PortUnusable
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import Line, PtyLine, TcpLine, serve
from wristctl.board.messages import BAUD, State
from wristctl.board.transport import SerialTransport


class WatchedLine:
    """A line that says whether a client is there."""

    def __init__(self, line: Line) -> None:
        self._line, self.address, self.there = line, line.address, False
        self.receive, self.send, self.close = line.receive, line.send, line.close

    def wait(self, timeout: float) -> bool:
        self.there = self._line.wait(timeout)
        return self.there


@pytest.fixture(params=[PtyLine, lambda: TcpLine(0)], ids=["pty", "tcp"])
def line(request: pytest.FixtureRequest) -> Iterator[WatchedLine]:
    """A line with an emulated board on it, in a thread of its own."""
    line, running = WatchedLine(request.param()), [True]
    serving = threading.Thread(target=serve, args=(Atmega2560(), line, lambda: running[0]))
    serving.start()
    yield line
    running[0] = False
    serving.join()
    line.close()


@pytest.mark.slow
def test_a_board_answers_through_pyserial_and_starts_anew_for_the_next_client(line: WatchedLine) -> None:
    nonces = []
    for _ in range(2):
        with closing(patient(SerialTransport(line.address, BAUD))) as board:
            assert board.hello is not None
            nonces.append(board.hello.boot_nonce)
            board.enable()
            board.home()
            assert board.turn((1000.0, 0.0, 0.0, 0.0))[1].state == State.ENABLED
        wait_for(lambda: not line.there)
    assert nonces[1] == nonces[0] + 1


class Clock:
    """A line and the clock by which the chip on it runs: waiting takes these times, and no bytes come."""

    address = "clock"

    def __init__(self, waits: list[float]) -> None:
        self.now, self.waits = 1000.0, waits

    def monotonic(self) -> float:
        return self.now

    def wait(self, timeout: float) -> bool:
        self.now += self.waits.pop(0)
        return True

    def receive(self) -> bytes:
        return b""

    def send(self, data: bytes) -> None:
        raise AssertionError("the board says nothing unasked")

    def close(self) -> None:
        """Nothing is open."""


def paced(monkeypatch: pytest.MonkeyPatch, waits: list[float]) -> list[tuple[float, float]]:
    """After each wait: seconds that have passed, and seconds that the chip has run."""
    clock, chip = Clock(list(waits)), Atmega2560()
    seen: list[tuple[float, float]] = []

    def look(_edges: object, start: float) -> None:
        assert start + chip.cycles / FREQUENCY == pytest.approx(clock.now, abs=1e-6)
        seen.append((clock.now - began, (chip.cycles - cycles) / FREQUENCY))

    began, cycles = clock.now, chip.cycles
    monkeypatch.setattr("wristctl.board.emulator.serve.time", clock)
    serve(chip, clock, lambda: bool(clock.waits), look)
    return seen


@pytest.mark.slow
def test_the_chip_keeps_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for passed, ran in paced(monkeypatch, [0.0005, 0.0007, 0.02, 0.0, 0.09, 0.0001] * 5):
        assert ran == pytest.approx(passed, abs=1e-6)


@pytest.mark.slow
def test_time_in_which_the_computer_did_something_else_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of it but a tenth of a second, so that the board does not race through what it has missed."""
    before, after, later = paced(monkeypatch, [0.05, 3.0, 0.01])
    assert after[1] - before[1] == pytest.approx(0.1, abs=1e-6)
    assert later[1] - after[1] == pytest.approx(0.01, abs=1e-6)


@pytest.mark.slow
def test_how_late_the_board_spoke_is_told_and_a_warning_where_that_is_seen(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    """What the chip says is heard when its piece ends: half a piece late as a mean, longer pieces weighing more."""
    told = r"ran ([\d.]+) ms late as a mean, (\d+) ms at worst"
    for waits, late, worst, level in (
        ([0.001] * 10, 0.5, 1, "INFO"),
        ([0.001] * 30 + [0.04], 20.0 * 40.0 / 69.0, 40, "WARNING"),
        ([0.0001] * 10 + [3.0], 50.0 * 100.0 / 100.9, 3000, "WARNING"),
    ):
        caplog.clear()
        with caplog.at_level("INFO", logger="wristctl.board.emulator.serve"):
            paced(monkeypatch, waits)
        said = re.search(told, caplog.records[-1].getMessage())
        assert said is not None and caplog.records[-1].levelname == level
        assert float(said[1]) == pytest.approx(late, abs=0.3) and int(said[2]) == worst


@pytest.mark.slow
def test_garbage_collection_does_not_hold_a_board_up() -> None:
    """All that was there before is left alone: to go through it takes a tenth of a second, which no board pauses."""
    clock, left_alone = Clock([0.001] * 3), list[int]()
    serve(Atmega2560(), clock, lambda: bool(clock.waits), lambda *_: left_alone.append(gc.get_freeze_count()))
    assert len(left_alone) == 3 and min(left_alone) > 10_000 and gc.get_freeze_count() == 0


def test_a_second_program_of_ours_is_refused_the_port_and_told_why() -> None:
    line = PtyLine()
    first = SerialTransport(line.address, BAUD)
    try:
        with pytest.raises(PortUnusable, match="another program") as error:
            SerialTransport(line.address, BAUD)
        assert error.value.exit_code == 4
        SerialTransport(line.address, BAUD, exclusive=False).close()
    finally:
        first.close()
        line.close()


@pytest.mark.parametrize(
    ("port", "said"), [("/dev/no-such-port", "no such port"), ("socket://127.0.0.1:9", "cannot connect")]
)
def test_a_port_that_is_not_there_is_named_with_what_to_do(port: str, said: str) -> None:
    with pytest.raises(PortUnusable, match=said) as error:
        SerialTransport(port, BAUD)
    assert error.value.where == port and error.value.fix


class Flood:
    """A client that always has bytes to say, and counts those that were taken."""

    address = "flood"

    def __init__(self, chip: Atmega2560, waits: int) -> None:
        self.chip, self.waits, self.taken, self.most = chip, waits, 0, 0
        self.now = 1000.0

    def monotonic(self) -> float:
        return self.now

    def sleep(self, seconds: float) -> None:
        self.now += seconds

    def wait(self, timeout: float) -> bool:
        self.waits -= 1
        self.now += 1e-5  # it need not wait
        return True

    def receive(self) -> bytes:
        self.taken += 4096
        self.most = max(self.most, self.chip.bytes_coming + 4096)
        return bytes(range(256)) * 16

    def send(self, data: bytes) -> None:
        """Nobody reads."""

    def close(self) -> None:
        """Nothing is open."""


@pytest.mark.slow
def test_a_client_that_says_more_than_the_line_carries_has_to_wait(monkeypatch: pytest.MonkeyPatch) -> None:
    chip = Atmega2560()
    flood = Flood(chip, 4000)
    monkeypatch.setattr("wristctl.board.emulator.serve.time", flood)
    serve(chip, flood, lambda: flood.waits > 0)
    passed = flood.now - 1000.0
    assert passed > 1.0
    assert flood.most < 4096 + 1024 + 1
    assert flood.taken <= BAUD / 10 * passed + 2 * 4096


def test_many_clients_together_are_taken_from_by_no_more_than_one() -> None:
    line = TcpLine(0)
    clients = [socket.create_connection(("127.0.0.1", int(line.address.rsplit(":", 1)[1]))) for _ in range(20)]
    try:
        for each in clients:
            line.wait(0.5)
            each.sendall(bytes(4096))
        wait_for(lambda: 4096 <= len(line.receive()) < 2 * 4096)
    finally:
        for each in clients:
            each.close()
        line.close()


@pytest.mark.slow
def test_a_foreign_program_on_the_same_port_moves_nothing_and_ends_nothing() -> None:
    """It takes answers away and mixes bytes in: our session may lose its link, the board stops and serves on."""
    line, running = WatchedLine(PtyLine()), [True]
    chip = Atmega2560()
    serving = threading.Thread(target=serve, args=(chip, line, lambda: running[0]))
    serving.start()
    try:
        board = patient(SerialTransport(line.address, BAUD))
        board.enable()
        board.home()
        stranger = os.open(line.address, os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        rng = np.random.default_rng(0)
        with suppress(BoardError):
            for _ in range(60):
                with suppress(BlockingIOError):
                    os.write(stranger, rng.bytes(200))
                    os.read(stranger, 64)
                board.read()
        os.close(stranger)
        before = chip.cycles
        wait_for(lambda: chip.cycles > before + FREQUENCY // 10)
        board.transport.close()
        wait_for(lambda: not line.there)
        with closing(patient(SerialTransport(line.address, BAUD))) as again:
            assert again.read().position == (0, 0, 0, 0)
    finally:
        running[0] = False
        serving.join()
        line.close()
