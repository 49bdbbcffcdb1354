"""The emulated chip's devices, driven by stores and loads as a program would make them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.board.flash_image import chip_with
from wristctl.board.emulator import Atmega2560, Halted
from wristctl.errors import UserError

RJMP_SELF, SEI, SLEEP, RETI, NOP, WDR = 0xCFFF, 0x9478, 0x9588, 0x9518, 0x0000, 0x95A8
MCUSR, SMCR, WDTCSR, SREG = 0x54, 0x53, 0x60, 0x5F
UCSRA, UCSRB, UBRR, UDR = 0xC0, 0xC1, 0xC4, 0xC6
TCCR1B, TCNT1, OCR1A, TIFR1, TIMSK1 = 0x81, 0x84, 0x88, 0x36, 0x6F
BYTE = 640  # cycles at 250,000 baud
R16 = 16


@pytest.fixture
def idle(tmp_path: Path) -> Atmega2560:
    """A chip in an endless loop."""
    return chip_with(tmp_path, {0: [RJMP_SELF]})


def serial(chip: Atmega2560) -> None:
    for address, value in ((UCSRA, 0x02), (UBRR, 7), (UCSRB, 0x18)):
        chip.poke(address, value)


def test_receiver_keeps_two_bytes_and_loses_the_third_when_a_fourth_begins(idle: Atmega2560) -> None:
    serial(idle)
    idle.write(b"abcde")
    idle.run(5 * BYTE + 10)
    assert idle.peek(UCSRA) & 0x88 == 0x88, "byte ready, overrun"
    assert [idle.peek(UDR) for _ in range(3)] == list(b"abe")
    assert idle.lost_bytes == 2
    assert not idle.peek(UCSRA) & 0x88


def test_receiver_keeps_a_third_byte_in_its_shift_register_while_the_line_rests(idle: Atmega2560) -> None:
    serial(idle)
    idle.write(b"abc")
    idle.run(4 * BYTE)
    assert [idle.peek(UDR) for _ in range(3)] == list(b"abc")
    assert idle.lost_bytes == 0


def test_bytes_take_ten_bits_each_way(idle: Atmega2560) -> None:
    serial(idle)
    idle.write(b"xy")
    idle.run(BYTE - 10)
    assert not idle.peek(UCSRA) & 0x80
    idle.run(20)
    assert idle.peek(UCSRA) & 0x80 and idle.bytes_coming == 1
    began = idle.cycles
    idle.poke(UDR, ord("A"))
    idle.poke(UDR, ord("B"))
    assert not idle.peek(UCSRA) & 0x20, "one byte goes out, one waits"
    idle.run(10 * BYTE, until_sent=True)
    assert idle.read() == b"A" and abs(idle.cycles - began - BYTE) <= 4
    idle.run(10 * BYTE, until_sent=True)
    assert idle.read() == b"B" and abs(idle.cycles - began - 2 * BYTE) <= 4


def test_timer_counts_by_its_prescaler_and_sets_its_flag_one_count_after_the_match(idle: Atmega2560) -> None:
    idle.poke(OCR1A + 1, 0x01)
    idle.poke(OCR1A, 0x00)
    idle.poke(TCCR1B, 0x02)  # a count is 8 cycles
    began = idle.cycles
    while not idle.peek(TIFR1) & 2:
        idle.run(1)
    assert abs(idle.cycles - began - 8 * 257) <= 10
    low, high = idle.peek(TCNT1), idle.peek(TCNT1 + 1)
    assert high * 256 + low == (idle.cycles - idle.cycles % 8 - began) // 8


def test_timer_in_clear_on_compare_mode_interrupts_with_its_exact_period(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF], 34: [0x9A00, RETI]})  # SBI PINA, 0 toggles PORTA
    chip.poke(OCR1A + 1, 1599 >> 8)
    chip.poke(OCR1A, 1599 & 0xFF)
    chip.poke(TIMSK1, 2)
    chip.poke(TCCR1B, 0x09)
    chip.run(1600 * 1000 + 100)
    edges = chip.events()
    assert len(edges) == 1000
    gaps = np.diff(edges["cycle"].astype(np.int64))
    assert abs(gaps - 1600).max() <= 2 and gaps.sum() == pytest.approx(1600 * 999, abs=2)


def test_one_instruction_runs_between_sei_and_an_interrupt_so_that_sleep_never_misses_it(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [NOP] * 9 + [SEI, SLEEP, 0xE001, RJMP_SELF], 34: [RETI]})
    chip.poke(SMCR, 1)
    chip.poke(TIMSK1, 2)
    chip.poke(TCCR1B, 1)  # OCR1A is 0: the flag is up before SEI
    chip.run(60)
    assert chip.peek(R16) == 1, "woken, and past SLEEP"


def test_sleep_with_interrupts_off_lasts_for_ever(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [NOP, NOP, SLEEP, 0xE001, RJMP_SELF]})
    chip.poke(SMCR, 1)
    chip.poke(TCCR1B, 1)
    chip.poke(TIMSK1, 2)
    chip.run(10_000_000)
    assert chip.peek(R16) == 0


def test_watchdog_resets_after_its_time_and_says_so(idle: Atmega2560) -> None:
    idle.poke(MCUSR, 0)
    idle.poke(0x400, 0x5A)
    idle.poke(WDTCSR, 0x18)
    idle.poke(WDTCSR, 0x08)  # 16 ms
    idle.run(255_000)
    assert idle.peek(MCUSR) == 0
    idle.run(2_000)
    assert idle.peek(MCUSR) == 0x08
    assert idle.peek(0x400) == 0x5A, "RAM survives"
    assert idle.peek(WDTCSR) & 0x08, "it goes on after its reset"


def test_watchdog_cannot_be_switched_off_without_the_timed_sequence(idle: Atmega2560) -> None:
    idle.poke(MCUSR, 0)
    idle.poke(WDTCSR, 0x18)
    idle.poke(WDTCSR, 0x08)
    idle.run(10)
    idle.poke(WDTCSR, 0x00)
    assert idle.peek(WDTCSR) & 0x08
    idle.poke(WDTCSR, 0x18)
    idle.poke(WDTCSR, 0x00)
    assert not idle.peek(WDTCSR) & 0x08


def test_watchdog_in_interrupt_mode_interrupts_and_does_not_reset(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF], 24: [0x9A00, RETI]})
    chip.poke(MCUSR, 0)
    chip.poke(WDTCSR, 0x18)
    chip.poke(WDTCSR, 0x40)
    chip.run(256_000 * 3 + 1000)
    assert len(chip.events()) == 3
    assert chip.peek(MCUSR) == 0


def test_a_restarted_watchdog_does_not_bite(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [WDR, 0xCFFE]})
    chip.poke(MCUSR, 0)
    chip.poke(WDTCSR, 0x18)
    chip.poke(WDTCSR, 0x08)
    chip.run(2_000_000)
    assert chip.peek(MCUSR) == 0


def test_inputs_read_what_drives_them_else_their_pull_up(idle: Atmega2560) -> None:
    assert not idle.pin("G", 1)
    idle.poke(0x34, 0x02)
    assert idle.pin("G", 1), "pulled up"
    idle.drive("G", 1, False)
    assert not idle.pin("G", 1)
    assert idle.peek(0x32) == 0


def test_every_change_of_a_latch_is_recorded_however_many_there_are(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [0x9A00, 0xCFFE]})  # SBI PINA, 0; RJMP back: every 4 cycles
    chip.run(4 * 200_000)
    edges = chip.events()
    assert len(edges) == 200_000
    assert set(np.diff(edges["cycle"].astype(np.int64))) == {4}
    assert (edges["port"] == ord("A")).all() and (edges["value"] == np.arange(1, 200_001) % 2).all()


def test_running_in_pieces_is_running_at_once() -> None:
    whole, pieces = Atmega2560(), Atmega2560()
    whole.run(1_000_000)
    while pieces.cycles < 1_000_000:
        pieces.run(min(997, 1_000_000 - pieces.cycles))
    assert abs(whole.cycles - pieces.cycles) <= 4
    assert (whole.ram(0x200, 0x2000) == pieces.ram(0x200, 0x2000)).all()


def test_a_program_that_runs_into_erased_flash_is_said_to_have_crashed(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [NOP]})
    with pytest.raises(Halted, match="near byte address 0x2"):
        chip.run(100)


def test_a_device_mode_that_is_not_emulated_is_refused(idle: Atmega2560) -> None:
    with pytest.raises(Halted, match="not emulated"):
        idle.poke(0x80, 0x81)  # PWM on a pin of timer 1


@pytest.mark.parametrize(
    ("text", "said"),
    [(":02000000CFFF3", "not a line"), (":02000000FFCF31", "check sum"), ("", "end record"), ("hello", "not a line")],
)
def test_a_broken_hex_file_is_named_with_its_line(tmp_path: Path, text: str, said: str) -> None:
    path = tmp_path / "broken.hex"
    path.write_text(text)
    with pytest.raises(UserError, match=said):
        Atmega2560(path)
