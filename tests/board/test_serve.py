"""The emulated board in real time, as any serial program meets it."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator

import pytest

from wristctl.board.board import Board
from wristctl.board.board_errors import PortUnusable
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.emulator.serve import Line, PtyLine, TcpLine, serve
from wristctl.board.messages import BAUD, Configure, State
from wristctl.board.transport import SerialTransport


@pytest.fixture(params=[PtyLine, lambda: TcpLine(0)], ids=["pty", "tcp"])
def line(request: pytest.FixtureRequest) -> Iterator[Line]:
    """A line with an emulated board on it, in a thread of its own."""
    make: Callable[[], Line] = request.param
    chip, line, running = Atmega2560(), make(), [True]
    serving = threading.Thread(target=serve, args=(chip, line, lambda: running[0]))
    serving.start()
    line.chip = chip  # type: ignore[attr-defined]
    yield line
    running[0] = False
    serving.join()
    line.close()


def test_a_board_answers_through_pyserial_and_starts_anew_for_the_next_client(line: Line) -> None:
    nonces = []
    for _ in range(2):
        with Board(SerialTransport(line.address, BAUD)) as board:
            assert board.hello is not None
            nonces.append(board.hello.boot_nonce)
            board.configure(Configure(watchdog=2.0))  # the machine may be busy
            board.enable()
            board.home()
            assert board.turn((1000.0, 0.0, 0.0, 0.0))[1].state == State.ENABLED
        time.sleep(0.1)
    assert nonces[1] == nonces[0] + 1


def test_the_chip_keeps_real_time(line: Line) -> None:
    chip: Atmega2560 = line.chip  # type: ignore[attr-defined]
    time.sleep(0.1)
    began, cycles = time.monotonic(), chip.cycles
    time.sleep(0.5)
    assert (chip.cycles - cycles) / FREQUENCY == pytest.approx(time.monotonic() - began, abs=0.15)


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
