"""Every emulated device interrupts at its vector, in the order of the vectors (data sheet, table 14-1)."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import NOP, RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

SREG, R16, R17 = 0x5F, 16, 17
I = 0x80  # noqa: E741 - the manual's name
WATCHDOG, RECEIVED, EMPTY, SENT = 12, 25, 26, 27
UCSRA, UCSRB, UBRR, UDR, WDTCSR, MCUSR = 0xC0, 0xC1, 0xC4, 0xC6, 0x60, 0x54

VECTORS = {
    0: (21, 22, 23), 1: (17, 18, 19, 20), 2: (13, 14, 15), 3: (32, 33, 34, 35), 4: (42, 43, 44, 45),
    5: (47, 48, 49, 50),
}  # fmt: skip
"""Of each timer its compare units' and its overflow's."""
CLOCK = (0x45, 0x81, 0xB1, 0x91, 0xA1, 0x121)
TIMED = [(k, unit) for k, vectors in VECTORS.items() for unit in range(len(vectors))]


def listing(chip_folder: Path, main: list[int]) -> Atmega2560:
    """A chip whose every vector loads its number into r16 and stays there."""
    vectors = {2 * n: [0xE000 | (n & 0xF0) << 4 | n & 0xF, RJMP_SELF] for n in range(1, 57)}
    return chip_with(chip_folder, {0: [0x940C, 0x100], **vectors, 0x100: main})


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    """In an endless loop with interrupts on."""
    made = listing(tmp_path, [SEI, RJMP_SELF])
    made.run(20)
    return made


def bit(timer: int, unit: int) -> int:
    """Of a compare unit in TIFRn and TIMSKn, the overflow's last."""
    return 1 if unit == len(VECTORS[timer]) - 1 else 2 << unit


@pytest.mark.parametrize(("timer", "unit"), TIMED)
def test_a_timers_flag_interrupts_at_its_own_vector_once(chip: Atmega2560, timer: int, unit: int) -> None:
    chip.poke(0x6E + timer, bit(timer, unit))
    chip.poke(CLOCK[timer], 1)
    chip.run(70_000)
    assert chip.peek(R16) == VECTORS[timer][unit]
    assert chip.peek(SREG) & I == 0, "none interrupts it in turn"


@pytest.mark.parametrize(("timer", "unit"), TIMED)
def test_a_flag_without_its_enable_does_not_interrupt(chip: Atmega2560, timer: int, unit: int) -> None:
    for other in range(6):
        mask = sum(bit(other, each) for each in range(len(VECTORS[other])))
        chip.poke(0x6E + other, mask & ~bit(timer, unit) if other == timer else 0)
        chip.poke(0x6E + other, 0)
    chip.poke(CLOCK[timer], 1)
    chip.run(70_000)
    assert chip.peek(R16) == 0 and chip.peek(0x35 + timer) & bit(timer, unit)


def test_of_two_the_lower_vector_is_first_and_its_flag_clears(chip: Atmega2560) -> None:
    chip.poke(SREG, 0)
    chip.poke(0x6E, 0x07)
    chip.poke(0x6F, 0x0F)
    chip.poke(CLOCK[0], 1)
    chip.poke(CLOCK[1], 1)
    chip.run(66_000)
    before = chip.peek(0x36)
    assert before == 0x0F
    for vector, flag in ((17, 2), (18, 4), (19, 8), (20, 1), (21, None)):
        chip.poke(SREG, I)
        chip.run(10)
        assert chip.peek(R16) == vector
        if flag is not None:
            before &= ~flag
            assert chip.peek(0x36) == before


def test_the_receivers_and_transmitters_interrupts_are_in_the_order_of_their_vectors(chip: Atmega2560) -> None:
    chip.poke(SREG, 0)
    chip.poke(UCSRB, 0x18)
    chip.poke(UCSRA, 0x02)
    chip.poke(UDR, 1)
    chip.write(b"x")
    chip.run(2000)
    chip.poke(UCSRB, 0xF8)
    chip.poke(SREG, I)
    chip.run(10)
    assert chip.peek(R16) == RECEIVED
    chip.peek(UDR)
    chip.poke(SREG, I)
    chip.run(10)
    assert chip.peek(R16) == EMPTY and chip.peek(UCSRA) & 0x20, "an empty buffer interrupts until it is filled"
    chip.poke(UCSRB, 0xD8)
    chip.poke(SREG, I)
    chip.run(10)
    assert chip.peek(R16) == SENT and not chip.peek(UCSRA) & 0x40, "serving it clears it"


@pytest.mark.parametrize(("enable", "vector"), [(0x98, RECEIVED), (0x38, EMPTY), (0x58, SENT)])
def test_each_of_the_serial_ports_interrupts_has_its_own_enable(chip: Atmega2560, enable: int, vector: int) -> None:
    chip.poke(UCSRB, 0x18)
    chip.poke(UDR, 1)
    chip.write(b"x")
    chip.run(4000)
    assert chip.peek(R16) == 0
    chip.poke(UCSRB, enable)
    chip.run(10)
    assert chip.peek(R16) == vector


def test_the_watchdogs_interrupt_comes_before_all_others_here(chip: Atmega2560) -> None:
    chip.poke(SREG, 0)
    chip.poke(MCUSR, 0)
    chip.poke(WDTCSR, 0x40)
    chip.poke(0x70, 0x07)
    chip.poke(CLOCK[2], 1)
    chip.run(300_000)
    assert chip.peek(WDTCSR) & 0x80
    chip.poke(SREG, I)
    chip.run(10)
    assert chip.peek(R16) == WATCHDOG and chip.peek(WDTCSR) == 0x40


def test_an_interrupt_takes_five_cycles_and_from_sleep_ten(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [0x940C, 0x100], 34: [NOP, RJMP_SELF], 0x100: [NOP] * 20 + [0x9588, RJMP_SELF]})
    for asleep, cycles in ((False, 5), (True, 10)):
        chip.reset()
        chip.poke(0x53, 1)
        chip.run(2 if not asleep else 60)
        chip.poke(0x6F, 2)
        chip.poke(0x36, 0xFF)
        chip.poke(0x81, 1)
        chip.run(10)
        chip.poke(SREG, I)
        chip.run(1)  # one instruction, or a cycle asleep, comes first
        began = chip.cycles
        chip.run(1)
        assert chip.cycles - began == cycles + 1, "and a cycle of its first instruction"


def test_an_interrupt_returns_to_the_instruction_that_was_next(tmp_path: Path) -> None:
    """0x9513 is INC r17: none is left out and none comes twice."""
    main = [SEI, *[0x9513] * 100, RJMP_SELF]
    chip = chip_with(tmp_path, {0: [0x940C, 0x100], 34: [0x9503, 0x9518], 0x100: main})
    chip.poke(0x89, 0)
    chip.poke(0x88, 19)
    chip.poke(0x6F, 2)
    chip.poke(0x81, 0x09)
    chip.run(1000)
    assert chip.peek(R17) == 100 and chip.peek(R16) >= 10
