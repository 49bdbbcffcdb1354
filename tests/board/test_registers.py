"""What a store to an address does beyond its memory, and the bits that act one by one."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import NOP, RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

SREG, SPL = 0x5F, 0x5D
TIFR0, TIFR1, TCCR0B, TCCR1B, TIMSK0 = 0x35, 0x36, 0x45, 0x81, 0x6E
SBI, CBI = 0x9A00, 0x9800


def bit(operation: int, address: int, number: int) -> int:
    """SBI or CBI of a bit at an address of the data space."""
    return operation | (address - 0x20) << 3 | number


CODE = [
    bit(SBI, 0x20, 2),
    bit(CBI, 0x20, 0),
    bit(SBI, TIFR1, 1),
    bit(CBI, TIFR1, 2),
    bit(SBI, 0x3E, 5),
    bit(CBI, 0x3E, 5),
]


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    return chip_with(tmp_path, {0: [SEI, RJMP_SELF], 0x100: CODE})


def stepped(chip: Atmega2560, number: int) -> None:
    chip.jump(2 * (0x100 + number))
    chip.run(1)


def test_a_bit_set_in_a_pin_register_toggles_that_one_alone_and_one_cleared_does_nothing(chip: Atmega2560) -> None:
    chip.poke(0x22, 0b0000_1001)
    stepped(chip, 0)
    assert chip.peek(0x22) == 0b0000_1101
    stepped(chip, 1)
    assert chip.peek(0x22) == 0b0000_1101


def test_a_bit_set_in_a_flag_register_clears_that_flag_alone_and_one_cleared_does_nothing(chip: Atmega2560) -> None:
    chip.poke(TCCR1B, 1)
    chip.run(70_000)
    assert chip.peek(TIFR1) == 0x0F
    chip.poke(TCCR1B, 0)
    stepped(chip, 2)
    assert chip.peek(TIFR1) == 0x0D
    stepped(chip, 3)
    assert chip.peek(TIFR1) == 0x0D


def test_a_bit_of_any_other_register_is_set_and_cleared(chip: Atmega2560) -> None:
    chip.poke(0x3E, 0x81)
    stepped(chip, 4)
    assert chip.peek(0x3E) == 0xA1
    stepped(chip, 5)
    assert chip.peek(0x3E) == 0x81


@pytest.mark.parametrize("address", [0x00, 0x1F, 0x200, 0x21FF, 0x3E, 0xC8, 0x1FF])
def test_registers_ram_and_plain_io_hold_what_was_stored(chip: Atmega2560, address: int) -> None:
    chip.poke(address, 0x5A)
    assert chip.peek(address) == 0x5A and chip.ram(address, 1).tolist() == [0x5A]


def test_memory_beside_a_device_is_not_it(chip: Atmega2560) -> None:
    """The places behind the last timer's registers and between two ports' are memory."""
    for address in (0x43, 0x49, 0x7F, 0x8E, 0xC5, 0xC7, 0x61, 0x12E, 0x10C, 0xB5):
        chip.poke(address, 0xFF)
        assert chip.peek(address) == 0xFF, hex(address)


def test_switching_interrupts_on_lets_one_more_instruction_run_first(tmp_path: Path) -> None:
    """By OUT to SREG as by SEI: a flag waits already."""
    for enable in ([0xE800, 0xBF0F], [NOP, SEI]):  # LDI r16, 0x80; OUT SREG, r16
        chip = chip_with(tmp_path, {0: [*enable, 0x9513, 0x9513, RJMP_SELF], 34: [RJMP_SELF]})
        chip.poke(0x6F, 2)
        chip.poke(TCCR1B, 1)
        chip.poke(0x89, 0)
        chip.run(1)
        chip.poke(0x84, 0)
        chip.poke(0x36, 0)
        chip.run(40)
        assert chip.peek(17) <= 1


def test_enabling_an_interrupt_whose_flag_waits_lets_it_happen(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF], 46: [0x9503, 0x9518]})
    chip.poke(TCCR0B, 1)
    chip.run(600)
    assert chip.peek(16) == 0 and chip.peek(TIFR0) & 1
    chip.poke(TCCR0B, 0)
    chip.poke(TIMSK0, 1)
    chip.run(20)
    assert chip.peek(16) == 1 and not chip.peek(TIFR0) & 1


def test_the_stack_grows_down_across_a_page_and_up_again(tmp_path: Path) -> None:
    push, pop = 0x920F | 5 << 4, 0x900F | 6 << 4
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF], 0x100: [push, push, pop, pop, pop, RJMP_SELF]})
    chip.poke(5, 0x77)
    chip.poke(SPL, 0x00)
    chip.poke(SPL + 1, 0x04)
    chip.poke(0x401, 0x12)
    chip.jump(0x200)
    for pointer in (0x3FF, 0x3FE, 0x3FF, 0x400, 0x401):
        chip.run(1)
        assert chip.peek(SPL) | chip.peek(SPL + 1) << 8 == pointer
    assert chip.ram(0x3FF, 2).tolist() == [0x77, 0x77] and chip.peek(6) == 0x12
