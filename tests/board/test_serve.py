"""The emulated board in real time, as any serial program meets it."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import closing

import pytest

from tests.board.patience import patient, wait_for
from wristctl.board.board_errors import PortUnusable
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


def test_the_chip_keeps_real_time(monkeypatch: pytest.MonkeyPatch) -> None:
    for passed, ran in paced(monkeypatch, [0.0005, 0.0007, 0.02, 0.0, 0.09, 0.0001] * 5):
        assert ran == pytest.approx(passed, abs=1e-6)


def test_time_in_which_the_computer_did_something_else_is_given_up(monkeypatch: pytest.MonkeyPatch) -> None:
    """All of it but a tenth of a second, so that the board does not race through what it has missed."""
    before, after, later = paced(monkeypatch, [0.05, 3.0, 0.01])
    assert after[1] - before[1] == pytest.approx(0.1, abs=1e-6)
    assert later[1] - after[1] == pytest.approx(0.01, abs=1e-6)


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
