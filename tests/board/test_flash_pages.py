"""SPM: pages of flash are erased and written as the boot loader does it, and run as they were written."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

SPMCSR, RAMPZ = 0x57, 0x5B
FILL, ERASE, WRITE, CLEAR = 0x01, 0x03, 0x05, 0x11
SPM, ELPM = 0x95E8, 0x9056
"""ELPM r5, Z."""
PAGE = 256


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    """With an SPM and an ELPM to go to; the page at 0x20300 holds a count."""
    words = {0: [SEI, RJMP_SELF], 0x80: [SPM, RJMP_SELF], 0x88: [ELPM, RJMP_SELF]}
    words |= {0x20300 // 2: [2 * k | (2 * k + 1) << 8 for k in range(128)], 0x20200 // 2 + 127: [0x1111]}
    return chip_with(tmp_path, words | {0x20400 // 2: [0x2222], 0x10300 // 2: [0x3333]})


def at(chip: Atmega2560, address: int) -> None:
    for register, value in ((30, address & 0xFF), (31, address >> 8 & 0xFF), (RAMPZ, address >> 16)):
        chip.poke(register, value)


def do(chip: Atmega2560, command: int, address: int) -> None:
    at(chip, address)
    chip.poke(SPMCSR, command)
    chip.jump(0x100)
    chip.run(8)


def fill(chip: Atmega2560, address: int, word: int) -> None:
    chip.poke(0, word & 0xFF)
    chip.poke(1, word >> 8)
    do(chip, FILL, address)


def flash(chip: Atmega2560, address: int) -> int:
    at(chip, address)
    chip.jump(0x110)
    chip.run(8)
    return chip.peek(5)


def page(chip: Atmega2560, address: int) -> list[int]:
    return [flash(chip, address + k) for k in range(PAGE)]


def test_an_erased_page_is_all_ones_and_its_neighbours_stay(chip: Atmega2560) -> None:
    assert page(chip, 0x20300) == list(range(PAGE))
    do(chip, ERASE, 0x20377)
    assert page(chip, 0x20300) == [0xFF] * PAGE
    assert [flash(chip, each) for each in (0x202FE, 0x202FF, 0x20400, 0x20401, 0x10300)] == [
        0x11,
        0x11,
        0x22,
        0x22,
        0x33,
    ]
    assert chip.peek(SPMCSR) & 0x1F == 0


def test_a_page_takes_the_words_that_were_filled_in(chip: Atmega2560) -> None:
    do(chip, ERASE, 0x20300)
    for offset, word in ((0, 0x1234), (2, 0x5678), (255, 0x9ABC)):
        fill(chip, 0x20300 + offset, word)
    do(chip, WRITE, 0x20300)
    assert page(chip, 0x20300) == [0x34, 0x12, 0x78, 0x56, *[0xFF] * 250, 0xBC, 0x9A]


def test_writing_only_clears_bits(chip: Atmega2560) -> None:
    fill(chip, 0x20302, 0x0FF1)
    do(chip, WRITE, 0x20300)
    assert [flash(chip, 0x20300 + k) for k in range(5)] == [0, 1, 2 & 0xF1, 3 & 0x0F, 4]


@pytest.mark.parametrize("clearing", [CLEAR, WRITE])
def test_the_buffer_is_empty_after_it_was_written_or_cleared(chip: Atmega2560, clearing: int) -> None:
    fill(chip, 0, 0x1234)
    do(chip, clearing, 0x20400)
    do(chip, ERASE, 0x20300)
    do(chip, WRITE, 0x20300)
    assert page(chip, 0x20300) == [0xFF] * PAGE


def test_without_a_command_nothing_happens(chip: Atmega2560) -> None:
    do(chip, 0, 0x20300)
    assert page(chip, 0x20300)[:4] == [0, 1, 2, 3]


def test_new_instructions_run_at_once_and_one_across_the_pages_edge_too(chip: Atmega2560) -> None:
    """LDS r6, 0x400 with its address on the next page."""
    chip.poke(0x400, 0x5A)
    chip.poke(0x500, 0x6B)
    fill(chip, 0x300FE, 0x9060)
    do(chip, WRITE, 0x30000)
    fill(chip, 0x30100, 0x0400)
    fill(chip, 0x30102, RJMP_SELF)
    do(chip, WRITE, 0x30100)
    chip.jump(0x300FE)
    chip.run(8)
    assert chip.peek(6) == 0x5A
    do(chip, ERASE, 0x30100)
    fill(chip, 0x30100, 0x0500)
    fill(chip, 0x30102, RJMP_SELF)
    do(chip, WRITE, 0x30100)
    chip.jump(0x300FE)
    chip.run(8)
    assert chip.peek(6) == 0x6B


@pytest.mark.parametrize("first", [0x00000, 0x3FF00])
def test_the_first_and_the_last_page_can_be_written(chip: Atmega2560, first: int) -> None:
    do(chip, ERASE, first)
    fill(chip, first, 0x1234)
    do(chip, WRITE, first)
    assert [flash(chip, first + k) for k in range(3)] == [0x34, 0x12, 0xFF]
