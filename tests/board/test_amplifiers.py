"""The emulated HX711, clocked by hand on the pins of port F."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.board.flash_image import RJMP_SELF, SEI, chip_with
from wristctl.board.emulator import Atmega2560

PORTF, DDRF = 0x31, 0x30
US = 16


@pytest.fixture
def chip(tmp_path: Path) -> Atmega2560:
    chip = chip_with(tmp_path, {0: [SEI, RJMP_SELF]})
    chip.poke(DDRF, 0xAA)
    chip.poke(PORTF, 0x55)
    for axis in range(4):
        chip.fit_amplifier(axis, True)
    return chip


def clocked(chip: Atmega2560, axis: int, pulses: int, high: int = US) -> list[int]:
    """Level of DOUT after each of so many pulses."""
    levels = []
    for _ in range(pulses):
        chip.poke(PORTF, 0x55 | 2 << 2 * axis)
        chip.run(high)
        levels.append(int(chip.pin("F", 2 * axis)))
        chip.poke(PORTF, 0x55)
        chip.run(US)
    return levels


def ready(chip: Atmega2560, axis: int) -> bool:
    return not chip.pin("F", 2 * axis)


@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(axis=st.integers(0, 3), counts=st.integers(-(2**24), 2**24))
def test_24_bits_come_in_twos_complement_highest_first_then_dout_is_high(
    chip: Atmega2560, axis: int, counts: int
) -> None:
    chip.convert(axis, counts, chip.cycles)
    assert ready(chip, axis)
    bits = clocked(chip, axis, 25)
    within = max(-(2**23), min(2**23 - 1, counts))
    assert int("".join(map(str, bits[:24])), 2) == within & 0xFFFFFF and bits[24] == 1
    assert not ready(chip, axis) and clocked(chip, axis, 3) == [1, 1, 1]


def test_a_clock_that_is_high_for_60_microseconds_switches_off_what_was_converting(chip: Atmega2560) -> None:
    for high, lives in ((59 * US, True), (61 * US, False)):
        chip.convert(1, 5, chip.cycles)
        clocked(chip, 1, 25)
        begun = chip.cycles
        clocked(chip, 1, 1, high)
        chip.convert(1, 7, begun)
        assert ready(chip, 1) is lives
    chip.run(US)
    chip.convert(1, 9, chip.cycles)
    assert ready(chip, 1)
    clocked(chip, 1, 25)
    chip.poke(PORTF, 0x55 | 8)
    chip.run(61 * US)
    chip.convert(1, 9, chip.cycles)
    assert not ready(chip, 1)  # off as long as the clock is high


def test_an_amplifier_that_is_unplugged_lets_dout_go_and_begins_anew(chip: Atmega2560) -> None:
    chip.convert(3, 5, chip.cycles)
    begun = chip.cycles
    chip.run(US)
    chip.fit_amplifier(3, False)
    chip.convert(3, 5, chip.cycles)
    assert chip.pin("F", 6)  # the pull-up
    chip.fit_amplifier(3, True)
    chip.convert(3, 5, begun)
    assert not ready(chip, 3)
    chip.convert(3, 5, chip.cycles)
    assert ready(chip, 3)


def test_a_reset_of_the_chip_amid_a_pulse_lets_the_clock_fall(chip: Atmega2560) -> None:
    chip.poke(PORTF, 0x55 | 2)
    chip.reset()
    chip.run(1000 * US)
    chip.convert(0, 5, chip.cycles)
    assert ready(chip, 0)
