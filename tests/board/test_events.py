"""Reset: what starts anew, what stays, and what it says of its cause."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

MCUSR, SPL, SREG, WDTCSR, UCSRA, UCSRB, UDR = 0x54, 0x5D, 0x5F, 0x60, 0xC0, 0xC1, 0xC6


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    """Its program counts its starts in r16."""
    return chip_with(tmp_path, {0: [0x9503, SEI, RJMP_SELF]})  # INC r16


def test_power_on_is_the_only_cause_at_first_and_a_reset_adds_its_own(chip: Atmega2560) -> None:
    assert chip.peek(MCUSR) == 0x01
    chip.reset()
    assert chip.peek(MCUSR) == 0x03
    chip.poke(MCUSR, 0)
    chip.reset()
    assert chip.peek(MCUSR) == 0x02


def test_the_stack_begins_at_the_end_of_ram_and_the_transmitter_empty(chip: Atmega2560) -> None:
    for again in (False, True):
        if again:
            chip.poke(SPL, 0)
            chip.reset()
        assert chip.peek(SPL) | chip.peek(SPL + 1) << 8 == 0x21FF
        assert chip.peek(UCSRA) == 0x20


def test_a_reset_starts_the_program_anew_and_keeps_registers_and_ram(chip: Atmega2560) -> None:
    chip.run(20)
    chip.poke(0x1000, 0x42)
    chip.poke(0x22, 0xFF)
    chip.poke(0x1F0, 0x11)
    chip.poke(0x1FF, 0x11)
    chip.poke(0x200, 0x43)
    assert chip.peek(SREG) == 0x80
    chip.reset()
    assert (chip.peek(0x1000), chip.peek(0x200), chip.peek(16)) == (0x42, 0x43, 1)
    assert (chip.peek(SREG), chip.peek(0x22), chip.peek(0x1F0), chip.peek(0x1FF)) == (0, 0, 0, 0)
    chip.run(20)
    assert chip.peek(16) == 2


def test_a_reset_forgets_bytes_on_their_way(chip: Atmega2560) -> None:
    chip.poke(UCSRB, 0x18)
    chip.write(b"abcdef")
    chip.poke(UDR, 1)
    chip.poke(UDR, 2)
    chip.run(500)
    chip.reset()
    assert chip.bytes_coming == 0
    chip.poke(UCSRB, 0x18)
    chip.read()
    chip.run(2000)
    assert chip.read() == b"" and chip.peek(UCSRA) == 0x20
    chip.write(b"x")
    chip.run(200)
    assert chip.peek(UDR) == ord("x")


def test_an_external_reset_switches_the_watchdog_off(chip: Atmega2560) -> None:
    chip.poke(MCUSR, 0)
    chip.poke(WDTCSR, 0x08)
    chip.reset()
    assert chip.peek(WDTCSR) == 0
    chip.run(600_000)
    assert chip.peek(16) == 1 and chip.peek(MCUSR) == 0x02


def test_a_reset_by_the_watchdog_starts_the_program_anew_each_time(chip: Atmega2560) -> None:
    chip.poke(MCUSR, 0)
    chip.poke(WDTCSR, 0x08)
    chip.run(256_000 * 3 + 1000)
    assert chip.peek(16) == 4


def test_events_that_fall_together_all_happen(chip: Atmega2560) -> None:
    """All six timers overflow in the same cycle."""
    for control in (0x45, 0x81, 0xB1, 0x91, 0xA1, 0x121):
        chip.poke(control, 1)
    chip.run(66_000)
    assert [chip.peek(0x35 + k) & 1 for k in range(6)] == [1] * 6
