"""The driver against the emulated board, over a wire that loses, doubles and garbles."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from wristctl.board import driver
from wristctl.board.board_errors import BoardError, Faulted, NoAnswer, Refused, Restarted, WrongFirmware
from wristctl.board.driver import ATTEMPTS, Board, within_reach
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.framing import encode
from wristctl.board.messages import (
    BAUD,
    DICTIONARY_HASH,
    MAX_RATE,
    TOTAL_RATE,
    Command,
    Configure,
    Fault,
    Flag,
    Result,
    State,
)
from wristctl.board.transport import BOOT_TIME

PERIOD = 0.005
BOOT_LOADER = Path("/usr/share/arduino/hardware/arduino/avr/bootloaders/stk500v2/stk500boot_v2_mega2560.hex")


class BadWire(VirtualTransport):
    """Drops or garbles the next frames each way, as many as asked."""

    def __init__(self) -> None:
        super().__init__()
        self.lose = self.garble = self.double = self.deaf = 0

    def write(self, data: bytes) -> None:
        if self.lose:
            self.lose -= 1
            return
        if self.garble:
            self.garble -= 1
            data = data[:5] + bytes([data[5] ^ 0x10]) + data[6:]
        if self.double:
            self.double -= 1
            data *= 2
        super().write(data)

    def read(self, timeout: float) -> bytes:
        data = super().read(timeout)
        if self.deaf and data:
            self.wait(0.004)  # the whole answer is lost
            super().read(0.0)
            self.deaf -= 1
            return b""
        return data


@pytest.fixture
def wire() -> BadWire:
    return BadWire()


@pytest.fixture
def board(wire: BadWire) -> Board:
    board = Board(wire)
    board.connect()
    return board


def ready(board: Board) -> Board:
    board.enable()
    board.home()
    return board


def test_a_jog_and_a_move_end_where_they_were_to_go_and_stand_there(board: Board) -> None:
    board.enable()
    assert board.jog((40, -30, 0, 7)).position == (40, -30, 0, 7)
    board.home()
    status = board.go_to((-90, 0, 300, 0), 400)
    assert status.position == (-90, 0, 300, 0) and Flag.MOVING not in status.flags and status.rate == (0, 0, 0, 0)


def test_a_jog_that_ends_elsewhere_is_told_of(board: Board, wire: BadWire, monkeypatch: pytest.MonkeyPatch) -> None:
    ready(board)
    wait, left = wire.wait, [3]

    def stopped(seconds: float) -> None:
        left[0] -= 1
        if not left[0]:
            board.stop()
        wait(seconds)

    monkeypatch.setattr(wire, "wait", stopped)
    with pytest.raises(BoardError, match=r"the axes stand at \(\d+, 0, 0, 0\), not at \(2000, 0, 0, 0\)"):
        board.go_to((2000, 0, 0, 0), 400)
    left[0] = -1
    monkeypatch.setattr(wire, "wait", lambda seconds: wire.chip.reset() if left[0] == -1 else wait(seconds))
    with pytest.raises(Restarted):
        board.go_to((2000, 0, 0, 0), 400)


def test_connecting_waits_for_a_board_that_is_starting(wire: BadWire) -> None:
    wire.lose = 5
    board = Board(wire)
    assert board.connect().dictionary == DICTIONARY_HASH
    assert board.traffic.sent >= 6


@pytest.mark.parametrize("trouble", ["lose", "garble", "deaf"])
def test_a_lost_frame_or_answer_is_made_good_within_the_watchdog_time(
    board: Board, wire: BadWire, trouble: str
) -> None:
    ready(board)
    resent = board.traffic.resent
    setattr(wire, trouble, ATTEMPTS - 1)
    began = wire.now()
    board.turn((100.0, 0.0, 0.0, 0.0))
    assert wire.now() - began < Configure().watchdog
    assert board.traffic.resent == resent + ATTEMPTS - 1
    assert board.read().state == State.ENABLED


def test_a_doubled_frame_changes_nothing_and_its_second_answer_is_dropped(board: Board, wire: BadWire) -> None:
    ready(board)
    wire.double = 1
    board.turn((0.0, 0.0, 0.0, 0.0))
    assert board.read().position == (0, 0, 0, 0)
    assert board.traffic.stale == 1


def test_a_dead_cable_is_said_to_be_the_cable(board: Board, wire: BadWire) -> None:
    wire.lose = 1000
    with pytest.raises(NoAnswer) as error:
        board.read()
    assert error.value.origin == "cable" and error.value.exit_code == 4
    assert "hw ports" in error.value.fix


def test_garbled_answers_point_at_baud_rate_and_firmware(
    board: Board, wire: BadWire, monkeypatch: pytest.MonkeyPatch
) -> None:
    def read(timeout: float) -> bytes:
        wire.wait(timeout)
        return b"\x55\xaa\x55"

    monkeypatch.setattr(wire, "read", read)
    with pytest.raises(NoAnswer) as error:
        board.read()
    assert error.value.origin == "firmware"


def test_another_message_table_is_refused_with_the_command_that_mends_it(
    wire: BadWire, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(driver, "DICTIONARY_HASH", DICTIONARY_HASH ^ 1)
    with pytest.raises(WrongFirmware) as error, Board(wire):
        pass
    assert error.value.fix == "wristctl hw flash --port emulated"
    assert error.value.exit_code == 4


def test_moving_before_enabling_is_refused_and_says_so(board: Board) -> None:
    with pytest.raises(Refused) as error:
        board.turn((1.0, 0.0, 0.0, 0.0))
    assert error.value.result == Result.STATE and "enable" in error.value.fix


def test_a_host_that_falls_silent_is_told_that_it_did(board: Board, wire: BadWire) -> None:
    ready(board)
    wire.wait(0.3)
    with pytest.raises(Faulted) as error:
        board.turn((0.0, 0.0, 0.0, 0.0))
    assert error.value.faults == Fault.LINK and error.value.origin == "host"
    assert "silent for 3" in error.value.what and error.value.exit_code == 5


def test_a_pressed_emergency_stop_ends_motion_and_is_named(board: Board, wire: BadWire) -> None:
    ready(board)
    wire.chip.drive("G", 0, True)
    wire.wait(0.01)
    with pytest.raises(Faulted) as error:
        board.turn((0.0, 0.0, 0.0, 0.0))
    assert Fault.ESTOP_INPUT in error.value.faults and "D41" in error.value.fix


def test_an_emergency_stop_in_a_jog_is_named_and_no_mystery_of_where_the_axes_stand(
    board: Board, wire: BadWire, monkeypatch: pytest.MonkeyPatch
) -> None:
    board.enable()
    wait, left = wire.wait, [4]

    def pressed(seconds: float) -> None:
        left[0] -= 1
        if not left[0]:
            wire.chip.drive("G", 0, True)
        wait(seconds)

    monkeypatch.setattr(wire, "wait", pressed)
    with pytest.raises(Faulted) as error:
        board.jog((190, 0, 0, 0))
    assert Fault.ESTOP_INPUT in error.value.faults and error.value.exit_code == 5


def test_a_board_that_restarts_is_noticed(board: Board, wire: BadWire) -> None:
    ready(board)
    wire.chip.reset()
    wire.wait(0.01)
    with pytest.raises(Restarted) as error:
        board.turn((0.0, 0.0, 0.0, 0.0))
    assert error.value.exit_code == 5


@pytest.mark.parametrize("error", [KeyboardInterrupt, RuntimeError])
def test_whatever_ends_a_session_stops_the_motors(wire: BadWire, error: type[BaseException]) -> None:
    with pytest.raises(error), Board(wire) as board:
        ready(board).turn((5000.0, 0.0, 0.0, 0.0))
        wire.wait(0.05)
        raise error
    wire.wait(0.01)
    wire.chip.events()
    wire.wait(0.1)
    assert not [edge for edge in wire.chip.events() if edge["port"] == ord("A")]
    status = Board(wire).read()
    assert status.state == State.FAULT and Fault.ESTOP_COMMAND in status.faults


@pytest.mark.parametrize(
    "stop",
    [
        Board.emergency_stop,
        lambda board: board.close(emergency=True),
        lambda board: Board(board.transport).stop_whatever_runs(),
    ],
    ids=["emergency_stop", "close", "stop_whatever_runs"],
)
def test_every_emergency_stop_of_the_driver_ends_the_steps_on_its_last_byte_whatever_waits_before_it(
    board: Board, wire: BadWire, monkeypatch: pytest.MonkeyPatch, stop: Callable[[Board], object]
) -> None:
    """Behind 60 other commands; obeyed in its turn it would be 17 ms later."""
    ready(board)
    for _ in range(40):
        board.turn((5000.0, -5000.0, 3000.0, 0.0), 0.2)
        wire.wait(0.005)
    write, last_byte = wire.write, [0]

    def timed(data: bytes) -> None:
        write(data)
        last_byte.append(wire.chip.cycles + wire.chip.bytes_coming * 10 * FREQUENCY // BAUD)

    wire.chip.events()
    write(60 * encode(Command.STATUS, 200))
    monkeypatch.setattr(wire, "write", timed)
    stop(board)
    wire.wait(0.1)
    events = wire.chip.events()
    steps = events["cycle"][events["port"] == ord("A")].astype(int)
    assert len(steps) > 50, "they moved until then"
    assert (steps[-1] - last_byte[1]) / FREQUENCY < 0.1e-3
    assert Board(wire).read().faults == Fault.ESTOP_COMMAND


def test_a_session_that_ends_well_leaves_the_drives_off(wire: BadWire) -> None:
    with Board(wire) as board:
        ready(board).turn((500.0, 0.0, 0.0, 0.0))
    wire.wait(0.1)
    status = Board(wire).read()
    assert status.state == State.DISABLED and Flag.DRIVES_ON not in status.flags


def test_rates_beyond_reach_are_cut_and_said_as_sent(board: Board) -> None:
    sent, _ = ready(board).turn((1e9, -30_000.0, 10_000.0, 0.0))
    assert sum(map(abs, sent)) == pytest.approx(TOTAL_RATE) and max(map(abs, sent)) <= MAX_RATE
    assert sent[0] == -sent[1] == 2 * sent[2]
    assert within_reach((1.0, 2.0, 3.0, 4.0)) == (1.0, 2.0, 3.0, 4.0)


def test_a_stopping_host_needs_no_session_nor_the_same_message_table(wire: BadWire) -> None:
    board = Board(wire)
    board.connect()
    ready(board).turn((5000.0, 0.0, 0.0, 0.0))
    assert Board(wire).stop_whatever_runs() == Result.OK
    with pytest.raises(BoardError):
        board.turn((5000.0, 0.0, 0.0, 0.0))


@pytest.mark.slow
def test_a_command_status_loop_at_200_hz_misses_no_deadline(board: Board, wire: BadWire) -> None:
    ready(board)
    late = 0
    for k in range(300):
        began = wire.now()
        board.turn((2000.0, -2000.0, 30.0 * k, 0.0))
        left = PERIOD - (wire.now() - began)
        late += left < 0
        wire.wait(max(left, 0.0))
    assert late == 0 and board.traffic.resent == 0
    counters = board.counters()
    assert counters.uart_errors == counters.bad_crc == counters.late_steps == 0
    assert board.send(Command.STATUS).state == State.ENABLED


@pytest.mark.skipif(not BOOT_LOADER.exists(), reason="needs arduino-core-avr")
def test_a_board_whose_boot_loader_has_just_started_hears_nothing_until_it_is_up_and_then_is_stopped() -> None:
    """A single byte before, and the stock boot loader waits for a program for seven seconds."""
    wire = VirtualTransport(Atmega2560(boot_loader=BOOT_LOADER))
    wire.boot_time = BOOT_TIME
    assert Board(wire).stop_whatever_runs() is Result.OK
    assert wire.now() < BOOT_TIME + 0.1
    assert Board(wire).read().faults is Fault.ESTOP_COMMAND


def test_a_board_beside_a_running_program_is_stopped_at_once(wire: BadWire, board: Board) -> None:
    ready(board).turn((500.0, 0.0, 0.0, 0.0))
    began = wire.now()
    assert Board(wire).stop_whatever_runs() is Result.OK
    assert wire.now() - began < 0.01


def test_all_pins_of_the_load_cells_are_the_boards_own() -> None:
    """JTAG, which has four of them where the fuses leave it on, is switched off (JTD in MCUCR)."""
    chip = Atmega2560()
    chip.run(FREQUENCY // 100)
    assert chip.peek(0x55) & 0x80
