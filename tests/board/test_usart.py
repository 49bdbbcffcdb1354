"""The serial port: the rate that the program sets, what is switched off, and every flag by itself."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, chip_with
from wristctl.board.emulator import Atmega2560

UCSRA, UCSRB, UBRR, UDR = 0xC0, 0xC1, 0xC4, 0xC6
RXC, TXC, UDRE, DOR, U2X = 0x80, 0x40, 0x20, 0x08, 0x02
RXEN, TXEN = 0x10, 0x08
BYTE = 160
"""Cycles of ten bits at full speed, undoubled."""


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    """In an endless loop, its serial port on at 1 Mbaud."""
    made = chip_with(tmp_path, {0: [RJMP_SELF]})
    made.poke(UCSRB, RXEN | TXEN)
    return made


def time_of_a_byte(chip: Atmega2560) -> int:
    began = chip.cycles
    chip.poke(UDR, 0x55)
    chip.run(20_000_000, until_sent=True)
    return chip.cycles - began


@pytest.mark.parametrize(("rate", "double"), [(0, False), (0, True), (7, True), (0x0102, False), (0x0FFF, True)])
def test_a_byte_takes_ten_bits_of_16_cycles_times_its_rate_plus_one(chip: Atmega2560, rate: int, double: bool) -> None:
    chip.poke(UCSRA, U2X if double else 0)
    chip.poke(UBRR, rate & 0xFF)
    chip.poke(UBRR + 1, rate >> 8)
    expected = 10 * (8 if double else 16) * (rate + 1)
    assert time_of_a_byte(chip) == pytest.approx(expected, abs=3)
    chip.write(b"x")
    chip.run(expected - 6)
    assert not chip.peek(UCSRA) & RXC
    chip.run(12)
    assert chip.peek(UCSRA) & RXC and chip.peek(UDR) == ord("x")


def test_the_line_may_have_a_rate_of_its_own(tmp_path: Path) -> None:
    chip_with(tmp_path, {0: [RJMP_SELF]})
    chip = Atmega2560(tmp_path / "program.hex", baud=9600)
    chip.poke(UCSRB, RXEN | TXEN)
    chip.write(b"x")
    chip.run(16_660)  # 10 bits of 16 MHz / 9600
    assert not chip.peek(UCSRA) & RXC
    chip.run(12)
    assert chip.peek(UCSRA) & RXC
    assert time_of_a_byte(chip) == pytest.approx(BYTE, abs=3), "what it sends goes by its own"


def test_flags_of_the_transmitter_follow_its_bytes(chip: Atmega2560) -> None:
    assert chip.peek(UCSRA) == UDRE
    chip.poke(UDR, 1)
    assert chip.peek(UCSRA) == UDRE, "it goes straight into the shift register"
    chip.poke(UDR, 2)
    assert chip.peek(UCSRA) == 0
    chip.run(BYTE + 4)
    assert chip.peek(UCSRA) == UDRE, "the second has moved up; not all is out yet"
    chip.run(BYTE + 4)
    assert chip.peek(UCSRA) == UDRE | TXC
    assert chip.read() == b"\1\2"
    chip.poke(UCSRA, 0)
    assert chip.peek(UCSRA) == UDRE | TXC, "a zero leaves it"
    chip.poke(UCSRA, TXC | U2X)
    assert chip.peek(UCSRA) == UDRE | U2X, "a one clears it"


def test_status_flags_cannot_be_written(chip: Atmega2560) -> None:
    chip.write(b"x")
    chip.run(BYTE + 10)
    chip.poke(UCSRA, 0x02)
    assert chip.peek(UCSRA) == RXC | UDRE | U2X
    chip.poke(UCSRA, RXC | DOR | 0x01)
    assert chip.peek(UCSRA) == RXC | UDRE | 0x01


def test_a_transmitter_that_is_off_sends_nothing(chip: Atmega2560) -> None:
    chip.poke(UCSRB, RXEN)
    chip.poke(UDR, 1)
    chip.run(10 * BYTE)
    assert chip.read() == b"" and chip.peek(UCSRA) == UDRE


def test_a_receiver_that_is_off_hears_nothing(chip: Atmega2560) -> None:
    chip.poke(UCSRB, TXEN)
    chip.write(b"x")
    chip.run(BYTE + 10)
    assert chip.bytes_coming == 0 and not chip.peek(UCSRA) & RXC


def test_switching_the_receiver_off_empties_it(chip: Atmega2560) -> None:
    chip.write(b"abcd")
    chip.run(5 * BYTE)
    assert chip.peek(UCSRA) & RXC and chip.peek(UCSRA) & DOR
    chip.poke(UCSRB, TXEN)
    assert not chip.peek(UCSRA) & (RXC | DOR)
    chip.poke(UCSRB, RXEN | TXEN)
    chip.write(b"e")
    chip.run(BYTE + 10)
    assert chip.peek(UDR) == ord("e") and not chip.peek(UCSRA) & RXC


def test_reading_takes_bytes_in_their_order_and_clears_the_flag_with_the_last(chip: Atmega2560) -> None:
    chip.write(b"ab")
    chip.run(3 * BYTE)
    assert chip.peek(UCSRA) & RXC and chip.peek(UDR) == ord("a")
    assert chip.peek(UCSRA) & RXC and chip.peek(UDR) == ord("b")
    assert not chip.peek(UCSRA) & RXC
    chip.write(b"cd")
    chip.run(BYTE + 10)
    assert chip.peek(UDR) == ord("c")
    chip.run(BYTE + 10)
    assert chip.peek(UDR) == ord("d") and chip.lost_bytes == 0


def test_a_byte_that_waits_behind_a_full_buffer_comes_after_it(chip: Atmega2560) -> None:
    chip.write(b"abc")
    chip.run(4 * BYTE)
    assert chip.peek(UDR) == ord("a")
    chip.write(b"d")
    chip.run(BYTE + 10)
    assert [chip.peek(UDR) for _ in range(3)] == list(b"bcd")
    assert chip.lost_bytes == 0 and not chip.peek(UCSRA) & (RXC | DOR)


def test_an_overrun_is_said_until_the_next_byte_is_read(chip: Atmega2560) -> None:
    chip.write(b"abcd")
    chip.run(5 * BYTE)
    assert chip.peek(UCSRA) & DOR and chip.lost_bytes == 1
    chip.peek(UDR)
    assert not chip.peek(UCSRA) & DOR and chip.peek(UCSRA) & RXC


def test_more_bytes_than_its_buffers_hold_are_all_sent_and_all_heard(chip: Atmega2560) -> None:
    """Beyond the 4096 bytes and the 65,536 of the record's own arrays."""
    said = bytes(k % 251 for k in range(5000))
    for byte in said:
        chip.poke(UDR, byte)
        chip.run(BYTE + 4)
    assert chip.read() == said
    for _ in range(3):
        chip.write(bytes(30_000))
        chip.run(30_000 * BYTE + 200)
        assert chip.bytes_coming == 0
    chip.peek(UDR)
    chip.write(b"end")
    assert chip.bytes_coming == 3


def test_the_line_holds_65536_bytes_and_says_when_it_is_full(chip: Atmega2560) -> None:
    chip.write(bytes(65_536))
    assert chip.bytes_coming == 65_536
    with pytest.raises(ValueError, match="more than 65536 bytes"):
        chip.write(b"x")
