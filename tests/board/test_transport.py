"""The wire: ports, what comes in pieces, and which of several ports is the board's."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest
import serial
from serial.tools import list_ports

from wristctl.board import transport
from wristctl.board.board_errors import BoardError, PortLost
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.transport import BOOT_TIME, SerialTransport, only_board, open_transport, ports


class Port:
    """A serial port that has these bytes, and modem lines or none."""

    def __init__(self, coming: bytes = b"", lines: bool = True) -> None:
        self.coming, self.lines, self.written, self.asked = coming, lines, b"", list[Any]()
        self.timeout: float = -1.0
        self.gone = False

    @property
    def cts(self) -> bool:
        if not self.lines:
            raise OSError("no such line")
        return False

    def read(self, count: int) -> bytes:
        if self.gone:
            raise OSError("gone")
        self.asked.append((count, self.timeout))
        found, self.coming = self.coming[:count], self.coming[count:]
        return found

    def write(self, data: bytes) -> None:
        if self.gone:
            raise TypeError("closed")
        self.written += data

    def close(self) -> None:
        self.gone = True


@pytest.fixture
def opened(monkeypatch: pytest.MonkeyPatch) -> dict[str, Any]:
    """What the next port was opened with; `port` is what is opened."""
    seen: dict[str, Any] = {"port": Port()}

    def serial_for_url(name: str, **how: Any) -> Port:
        seen.update(name=name, how=how)
        found: Port = seen["port"]
        return found

    monkeypatch.setattr(serial, "serial_for_url", serial_for_url)
    return seen


def test_a_port_is_opened_for_this_program_alone_at_its_rate(opened: dict[str, Any]) -> None:
    SerialTransport("/dev/a", 250_000)
    assert opened["name"] == "/dev/a" and opened["how"]["baudrate"] == 250_000 and opened["how"]["exclusive"]
    SerialTransport("/dev/a", 250_000, exclusive=False)
    assert "exclusive" not in opened["how"]
    SerialTransport("socket://here:1", 250_000)
    assert "exclusive" not in opened["how"]


def test_only_a_port_with_modem_lines_restarts_a_board_when_it_is_opened(opened: dict[str, Any]) -> None:
    assert SerialTransport("/dev/a", 1).boot_time == BOOT_TIME == 2.0
    assert SerialTransport("socket://here:1", 1).boot_time == 0.0
    opened["port"] = Port(lines=False)
    assert SerialTransport("/dev/pts/1", 1).boot_time == 0.0


def test_reading_waits_for_the_first_byte_and_takes_what_else_is_there(opened: dict[str, Any]) -> None:
    opened["port"] = port = Port(b"abc")
    wire = SerialTransport("/dev/a", 1)
    assert wire.read(0.25) == b"abc"
    assert port.asked == [(1, 0.25), (4096, 0)]
    assert wire.read(0.5) == b"" and port.asked[-1] == (1, 0.5)
    wire.write(b"xyz")
    assert port.written == b"xyz"


def test_a_port_that_goes_away_is_lost_to_reading_and_writing(opened: dict[str, Any]) -> None:
    wire = SerialTransport("/dev/a", 1)
    wire.close()
    with pytest.raises(PortLost, match="gone"):
        wire.read(0.0)
    with pytest.raises(PortLost, match="closed"):
        wire.write(b"x")


def found(*devices: tuple[str, int | None]) -> Any:
    return lambda: [
        SimpleNamespace(device=name, vid=vid, description=None, serial_number=None) for name, vid in devices
    ]


def test_ports_that_may_be_boards_come_first_and_by_name(monkeypatch: pytest.MonkeyPatch) -> None:
    known = [0x2341, 0x2A03, 0x1A86, 0x0403, 0x10C4]
    others: list[tuple[str, int | None]] = [("/dev/a", None), ("/dev/b", 0x1234)]
    boards = [(f"/dev/z{9 - k}", vid) for k, vid in enumerate(known)]
    monkeypatch.setattr(list_ports, "comports", found(*others, *boards))
    listed = ports()
    assert [port.device for port in listed] == [f"/dev/z{k}" for k in range(5, 10)] + ["/dev/a", "/dev/b"]
    assert [port.board_like for port in listed] == [True] * 5 + [False] * 2
    assert [port.adapter for port in listed] == ["CP210x", "FTDI", "CH340", "16U2", "16U2", "", ""]
    assert (listed[0].description, listed[0].serial_number) == ("", "")


def test_the_only_board_is_found_and_none_or_several_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    for devices, said in (
        ([("/dev/a", None)], "no board is plugged in"),
        ([("/dev/a", 0x2341), ("/dev/b", 0x2341)], "several boards: /dev/a, /dev/b"),
    ):
        monkeypatch.setattr(list_ports, "comports", found(*devices))
        with pytest.raises(BoardError, match=said) as told:
            only_board()
        assert told.value.exit_code == 4 and "--port" in told.value.fix
    monkeypatch.setattr(list_ports, "comports", found(("/dev/a", None), ("/dev/b", 0x2341)))
    assert only_board() == "/dev/b"


def test_a_named_port_is_opened_the_only_board_without_a_name_and_the_emulated_one_by_its_word(
    opened: dict[str, Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(transport, "only_board", lambda: "/dev/only")
    open_transport("/dev/a", 9600)
    assert (opened["name"], opened["how"]["baudrate"], opened["how"]["exclusive"]) == ("/dev/a", 9600, True)
    open_transport(None, 9600, exclusive=False)
    assert opened["name"] == "/dev/only" and "exclusive" not in opened["how"]
    assert isinstance(open_transport("emulated", 9600), VirtualTransport)


def test_virtual_time_passes_while_it_is_waited_on_and_no_further_than_asked() -> None:
    wire = VirtualTransport()
    began = wire.now()
    wire.wait(0.25)
    assert wire.now() - began == pytest.approx(0.25, abs=1e-6)
    assert wire.read(0.125) == b"" and wire.now() - began == pytest.approx(0.375, abs=1e-6)
    assert wire.read(0.0) == b"" and wire.now() - began == pytest.approx(0.375, abs=1e-6)
