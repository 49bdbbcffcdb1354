"""All six timers count, compare and overflow by the data sheet, each at its own addresses."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

import pytest

from tests.board.flash_image import RJMP_SELF, chip_with
from wristctl.board.emulator import Atmega2560, Halted


class Timer(NamedTuple):
    """Addresses of a timer's registers, how many bits it has, and the bit that clears it on a match."""

    control_a: int
    control_b: int
    counter: int
    compare: int
    flags: int
    bits: int
    units: int

    @property
    def clear(self) -> tuple[int, int]:
        """TCCRnA and TCCRnB of its clear-on-compare mode."""
        return (0, 0x08) if self.bits == 16 else (0x02, 0)


TIMERS = [
    Timer(0x44, 0x45, 0x46, 0x47, 0x35, 8, 2),
    Timer(0x80, 0x81, 0x84, 0x88, 0x36, 16, 3),
    Timer(0xB0, 0xB1, 0xB2, 0xB3, 0x37, 8, 2),
    Timer(0x90, 0x91, 0x94, 0x98, 0x38, 16, 3),
    Timer(0xA0, 0xA1, 0xA4, 0xA8, 0x39, 16, 3),
    Timer(0x120, 0x121, 0x124, 0x128, 0x3A, 16, 3),
]
EACH = pytest.mark.parametrize("timer", TIMERS, ids=[f"timer {k}" for k in range(6)])
BY_64 = {timer: 4 if k == 2 else 3 for k, timer in enumerate(TIMERS)}
"""Clock select that makes a count of 64 cycles."""


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    """A chip in an endless loop."""
    return chip_with(tmp_path, {0: [RJMP_SELF]})


def put(chip: Atmega2560, timer: Timer, register: int, value: int) -> None:
    """Write a count or a compare value: the high byte first."""
    if timer.bits == 16:
        chip.poke(register + 1, value >> 8)
    chip.poke(register, value & 0xFF)


def counted(chip: Atmega2560, timer: Timer) -> int:
    low = chip.peek(timer.counter)
    return low | (chip.peek(timer.counter + 1) << 8 if timer.bits == 16 else 0)


def go_to_count(chip: Atmega2560, counts: int) -> None:
    """Run until the 64-cycle prescaler has ticked so often from here, and a little."""
    chip.run(64 * (chip.cycles // 64 + counts) + 8 - chip.cycles)


@EACH
def test_a_count_is_as_many_cycles_as_the_clock_select_says(chip: Atmega2560, timer: Timer) -> None:
    scales = [1, 8, 32, 64, 128, 256, 1024] if timer is TIMERS[2] else [1, 8, 64, 256, 1024]
    for select, scale in enumerate(scales, start=1):
        put(chip, timer, timer.counter, 5)
        chip.poke(timer.control_b, select)
        began = chip.cycles
        chip.run(150 * scale + 7)
        expected = 5 + chip.cycles // scale - began // scale
        assert counted(chip, timer) == expected
        chip.poke(timer.control_b, 0)
        chip.run(5000)
        assert counted(chip, timer) == expected, "a stopped timer stands"


@EACH
def test_after_its_last_count_comes_zero_and_the_overflow_flag(chip: Atmega2560, timer: Timer) -> None:
    last = (1 << timer.bits) - 1
    for unit in range(timer.units):
        put(chip, timer, timer.compare + unit * timer.bits // 8, 0x80)
    put(chip, timer, timer.counter, last - 2)
    chip.poke(timer.control_b, BY_64[timer])
    go_to_count(chip, 2)
    assert counted(chip, timer) == last and chip.peek(timer.flags) == 0
    go_to_count(chip, 1)
    assert counted(chip, timer) == 0 and chip.peek(timer.flags) == 1
    chip.poke(timer.flags, 1)
    go_to_count(chip, 5)
    assert counted(chip, timer) == 5 and chip.peek(timer.flags) == 0, "written a one it clears, and stays so"


@EACH
def test_each_compare_unit_sets_its_own_flag_one_count_after_its_match(chip: Atmega2560, timer: Timer) -> None:
    matches = [30, 50, 70][: timer.units]
    for unit, match in enumerate(matches):
        put(chip, timer, timer.compare + unit * timer.bits // 8, match)
    chip.poke(timer.control_b, BY_64[timer])
    flagged = 0
    for unit, match in enumerate(matches):
        go_to_count(chip, match - counted(chip, timer))
        assert (counted(chip, timer), chip.peek(timer.flags)) == (match, flagged)
        flagged |= 2 << unit
        go_to_count(chip, 1)
        assert chip.peek(timer.flags) == flagged
    chip.poke(timer.flags, 4)
    assert chip.peek(timer.flags) == flagged & ~4, "only the flag that a one is written to clears"


@EACH
def test_in_clear_on_compare_mode_it_begins_again_after_the_first_compare_value(chip: Atmega2560, timer: Timer) -> None:
    put(chip, timer, timer.compare, 99)
    for unit in range(1, timer.units):
        put(chip, timer, timer.compare + unit * timer.bits // 8, 40)
    others = (2 << timer.units) - 4
    a, b = timer.clear
    chip.poke(timer.control_a, a)
    chip.poke(timer.control_b, b | BY_64[timer])
    began = chip.cycles // 64
    for ahead in (99, 1, 40, 1, 58, 1):
        go_to_count(chip, ahead)
        assert counted(chip, timer) == (chip.cycles // 64 - began) % 100
    assert chip.peek(timer.flags) == 2 | others, "all units, and no overflow"
    chip.poke(timer.flags, 2 | others)
    go_to_count(chip, 40)
    assert chip.peek(timer.flags) == 0
    go_to_count(chip, 1)
    assert chip.peek(timer.flags) == others
    go_to_count(chip, 58)
    assert chip.peek(timer.flags) == others
    go_to_count(chip, 1)
    assert chip.peek(timer.flags) == 2 | others, "and so in every round"


@EACH
def test_a_new_compare_value_is_the_new_end_at_once(chip: Atmega2560, timer: Timer) -> None:
    put(chip, timer, timer.compare, 99)
    a, b = timer.clear
    chip.poke(timer.control_a, a)
    chip.poke(timer.control_b, b | BY_64[timer])
    go_to_count(chip, 20)
    put(chip, timer, timer.compare, 29)
    go_to_count(chip, 9)
    assert counted(chip, timer) == 29
    go_to_count(chip, 1)
    assert counted(chip, timer) == 0 and chip.peek(timer.flags) & 2


@EACH
def test_a_count_set_past_the_end_goes_on_to_its_limit_and_overflows(chip: Atmega2560, timer: Timer) -> None:
    limit = (1 << timer.bits) - 1
    for unit in range(timer.units):
        put(chip, timer, timer.compare + unit * timer.bits // 8, 20)
    a, b = timer.clear
    chip.poke(timer.control_a, a)
    chip.poke(timer.control_b, b | BY_64[timer])
    put(chip, timer, timer.counter, limit - 3)
    go_to_count(chip, 3)
    assert counted(chip, timer) == limit and chip.peek(timer.flags) == 0
    go_to_count(chip, 1)
    assert counted(chip, timer) == 0 and chip.peek(timer.flags) == 1
    go_to_count(chip, 20)
    assert counted(chip, timer) == 20 and chip.peek(timer.flags) == 1
    go_to_count(chip, 1)
    assert counted(chip, timer) == 0 and chip.peek(timer.flags) == (2 << timer.units) - 1


@pytest.mark.parametrize("timer", [each for each in TIMERS if each.bits == 16], ids=["1", "3", "4", "5"])
def test_reading_the_low_byte_keeps_the_high_byte_of_that_moment(chip: Atmega2560, timer: Timer) -> None:
    put(chip, timer, timer.counter, 0x12FE)
    chip.poke(timer.control_b, BY_64[timer])
    assert chip.peek(timer.counter) == 0xFE
    go_to_count(chip, 4)
    assert chip.peek(timer.counter + 1) == 0x12
    assert counted(chip, timer) == 0x1302


@pytest.mark.parametrize("timer", [each for each in TIMERS if each.bits == 16], ids=["1", "3", "4", "5"])
def test_a_high_byte_waits_for_its_low_byte(chip: Atmega2560, timer: Timer) -> None:
    for unit, value in enumerate((0x1234, 0x5678, 0x9ABC)):
        put(chip, timer, timer.compare + 2 * unit, value)
    chip.poke(timer.compare + 1, 0xFF)
    found = [chip.peek(timer.compare + k) for k in range(6)]
    assert found == [0x34, 0x12, 0x78, 0x56, 0xBC, 0x9A]


REFUSED = [
    (0, 0x45, 0x06), (0, 0x45, 0x07), (1, 0x81, 0x06), (5, 0x121, 0x07),  # clocked from outside
    (0, 0x45, 0x08), (2, 0xB1, 0x08), (0, 0x44, 0x01), (0, 0x44, 0x03), (2, 0xB0, 0x03),  # PWM
    (1, 0x80, 0x01), (1, 0x80, 0x02), (1, 0x81, 0x10), (1, 0x81, 0x18), (4, 0xA1, 0x18),
    (0, 0x44, 0x40), (2, 0xB0, 0x10), (3, 0x90, 0x80), (3, 0x90, 0x04),  # pins driven
]  # fmt: skip


@pytest.mark.parametrize(("timer", "address", "value"), REFUSED)
def test_pins_driven_waveforms_and_outer_clocks_are_refused(
    chip: Atmega2560, timer: int, address: int, value: int
) -> None:
    with pytest.raises(Halted, match="not emulated"):
        chip.poke(address, value)


def test_timer_2_has_prescalers_where_others_are_clocked_from_outside(chip: Atmega2560) -> None:
    for select in (6, 7):
        chip.poke(TIMERS[2].control_b, select)


def test_a_reset_stops_all_timers_at_zero(chip: Atmega2560) -> None:
    for timer in TIMERS:
        put(chip, timer, timer.compare, 9)
        a, b = timer.clear
        chip.poke(timer.control_a, a)
        chip.poke(timer.control_b, b | 1)
    chip.run(1005)
    chip.reset()
    chip.run(500)
    for timer in TIMERS:
        assert (counted(chip, timer), chip.peek(timer.flags), chip.peek(timer.control_b)) == (0, 0, 0)
        chip.poke(timer.control_b, BY_64[timer])
    began = chip.cycles // 64
    go_to_count(chip, 100)
    assert [counted(chip, timer) for timer in TIMERS] == [chip.cycles // 64 - began] * 6, "and none ends at nine"
