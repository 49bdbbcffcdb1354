"""The watchdog bites after its time, unless it is restarted, and yields only to the timed sequence."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

MCUSR, WDTCSR = 0x54, 0x60
WDIF, WDIE, WDP3, WDCE, WDE = 0x80, 0x40, 0x20, 0x10, 0x08
BITTEN = 0x08
PERIOD = 256_000
"""Cycles of 16 ms."""


@pytest.fixture
def idle(tmp_path: Path) -> Atmega2560:
    """A chip in an endless loop, whose power-on is forgotten."""
    made = chip_with(tmp_path, {0: [RJMP_SELF]})
    made.poke(MCUSR, 0)
    return made


def set_to(chip: Atmega2560, value: int) -> None:
    chip.poke(WDTCSR, WDCE | WDE)
    chip.poke(WDTCSR, value)


@pytest.mark.parametrize(("scale", "value"), [(0, 0), (1, 1), (2, 2), (4, 4), (7, 7), (8, WDP3), (9, WDP3 | 1)])
@pytest.mark.slow
def test_its_time_is_16_ms_doubled_by_each_count_of_its_prescaler(idle: Atmega2560, scale: int, value: int) -> None:
    set_to(idle, WDE | value)
    idle.run((PERIOD << scale) - 50)
    assert idle.peek(MCUSR) == 0
    idle.run(100)
    assert idle.peek(MCUSR) == BITTEN


def test_its_time_counts_from_where_it_was_switched_on(idle: Atmega2560) -> None:
    idle.run(3 * PERIOD // 2)
    set_to(idle, WDE)
    idle.run(PERIOD - 50)
    assert idle.peek(MCUSR) == 0
    idle.run(100)
    assert idle.peek(MCUSR) == BITTEN


def test_setting_it_anew_while_it_runs_does_not_restart_it(idle: Atmega2560) -> None:
    set_to(idle, WDE)
    idle.run(PERIOD // 2)
    set_to(idle, WDE)
    idle.run(PERIOD // 2 + 50)
    assert idle.peek(MCUSR) == BITTEN


def test_a_restart_gives_it_its_whole_time_again(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [RJMP_SELF], 0x100: [0x95A8, RJMP_SELF]})
    chip.poke(MCUSR, 0)
    set_to(chip, WDE)
    chip.run(PERIOD - 100)
    chip.poke(0x5F, 0x80)
    chip.jump(0x200)
    chip.run(PERIOD - 100)
    assert chip.peek(MCUSR) == 0
    chip.run(200)
    assert chip.peek(MCUSR) == BITTEN


@pytest.mark.parametrize(("cycles", "taken"), [(4, True), (6, False)])
def test_it_may_be_switched_off_within_four_cycles_of_its_unlocking(idle: Atmega2560, cycles: int, taken: bool) -> None:
    set_to(idle, WDE)
    idle.run(20)
    idle.poke(WDTCSR, WDCE | WDE)
    idle.run(cycles)
    idle.poke(WDTCSR, 0)
    assert (idle.peek(WDTCSR) & WDE == 0) == taken
    idle.run(2 * PERIOD)
    assert (idle.peek(MCUSR) == 0) == taken


@pytest.mark.parametrize("key", [WDCE, WDE])
def test_unlocking_needs_both_bits(idle: Atmega2560, key: int) -> None:
    set_to(idle, WDE)
    idle.run(20)
    idle.poke(WDTCSR, key)
    idle.poke(WDTCSR, 0x07)
    assert idle.peek(WDTCSR) & 0x0F == WDE


def test_without_unlocking_it_may_be_switched_on_but_its_time_stays(idle: Atmega2560) -> None:
    idle.run(20)
    idle.poke(WDTCSR, WDE | 0x07)
    assert idle.peek(WDTCSR) == WDE
    idle.run(20)
    idle.poke(WDTCSR, WDE | WDP3)
    assert idle.peek(WDTCSR) == WDE


def test_after_it_has_bitten_it_stays_on_until_its_mark_is_cleared(idle: Atmega2560) -> None:
    set_to(idle, WDE)
    idle.run(PERIOD + 50)
    assert idle.peek(WDTCSR) == WDE, "at its shortest time"
    set_to(idle, 0)
    assert idle.peek(WDTCSR) & WDE
    idle.poke(MCUSR, 0)
    set_to(idle, 0)
    assert idle.peek(WDTCSR) == 0


def test_a_bite_while_its_mark_stands_adds_to_earlier_causes(idle: Atmega2560) -> None:
    idle.reset()
    assert idle.peek(MCUSR) == 0x02
    set_to(idle, WDE)
    idle.run(PERIOD + 50)
    assert idle.peek(MCUSR) == 0x02 | BITTEN
    idle.run(PERIOD + 50)
    assert idle.peek(MCUSR) == 0x02 | BITTEN


def test_in_interrupt_mode_its_flag_rises_each_time_and_clears_by_a_one(idle: Atmega2560) -> None:
    idle.poke(WDTCSR, WDIE)
    idle.run(PERIOD - 50)
    assert idle.peek(WDTCSR) == WDIE
    idle.run(100)
    assert idle.peek(WDTCSR) == WDIE | WDIF
    idle.poke(WDTCSR, WDIE)
    assert idle.peek(WDTCSR) == WDIE | WDIF, "a zero leaves it"
    idle.poke(WDTCSR, WDIE | WDIF)
    assert idle.peek(WDTCSR) == WDIE
    idle.run(PERIOD - 150)
    assert idle.peek(WDTCSR) == WDIE
    idle.run(200)
    assert idle.peek(WDTCSR) == WDIE | WDIF and idle.peek(MCUSR) == 0


def test_in_both_modes_it_interrupts_first_and_resets_at_the_next_time_out(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF], 24: [0x9A00, 0x9518]})  # SBI PINA, 0; RETI
    chip.poke(MCUSR, 0)
    set_to(chip, WDIE | WDE)
    chip.run(PERIOD + 50)
    assert len(chip.events()) == 1 and chip.peek(MCUSR) == 0
    assert chip.peek(WDTCSR) == WDE
    chip.run(PERIOD)
    assert chip.peek(MCUSR) == BITTEN


def test_switched_off_it_never_bites(idle: Atmega2560) -> None:
    set_to(idle, WDE)
    set_to(idle, 0)
    idle.run(4 * PERIOD)
    assert idle.peek(MCUSR) == 0
