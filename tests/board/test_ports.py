"""Every port has its three registers, and every change of a latch is recorded with its cycle."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.board.flash_image import RJMP_SELF, chip_with
from wristctl.board.emulator import Atmega2560

PIN = dict(zip("ABCDEFG", range(0x20, 0x35, 3), strict=True)) | dict(zip("HJKL", range(0x100, 0x10C, 3), strict=True))
"""Address of PINx by the data sheet; DDRx and PORTx follow."""


@pytest.fixture(scope="module")
def chip(tmp_path_factory: pytest.TempPathFactory) -> Atmega2560:
    """In an endless loop."""
    return chip_with(tmp_path_factory.mktemp("ports"), {0: [RJMP_SELF]})


@pytest.mark.parametrize("port", PIN)
def test_outputs_give_their_latch_and_inputs_what_drives_them_or_their_pull_up(chip: Atmega2560, port: str) -> None:
    pin, direction, latch = range(PIN[port], PIN[port] + 3)
    chip.poke(direction, 0b0000_1111)
    chip.poke(latch, 0b0101_0101)
    for bit, level in ((0, False), (1, True), (4, False), (5, True)):
        chip.drive(port, bit, level)
    assert chip.peek(pin) == 0b0110_0101
    assert [chip.pin(port, bit) for bit in range(8)] == [True, False, True, False, False, True, True, False]
    chip.drive(port, 5, False)
    chip.drive(port, 4, True)
    assert chip.peek(pin) == 0b0101_0101
    assert (chip.peek(direction), chip.peek(latch)) == (0b0000_1111, 0b0101_0101)


@pytest.mark.parametrize("port", PIN)
def test_a_latch_changes_by_writing_it_or_toggling_and_each_change_is_recorded(chip: Atmega2560, port: str) -> None:
    pin, direction, latch = range(PIN[port], PIN[port] + 3)
    chip.poke(latch, 0)
    chip.events()
    chip.poke(latch, 0xA5)
    first = chip.cycles
    chip.run(100)
    chip.poke(latch, 0xA5)  # no change
    chip.poke(direction, 0xFF)  # none of the latch
    chip.poke(pin, 0x0F)
    chip.poke(pin, 0)
    assert chip.peek(latch) == 0xAA
    events = chip.events()
    assert events["cycle"].tolist() == [first, chip.cycles]
    assert events["port"].tolist() == [ord(port)] * 2
    assert events["value"].tolist() == [0xA5, 0xAA]
    assert len(chip.events()) == 0


def test_the_emergency_stop_input_is_closed_from_the_start(tmp_path: Path) -> None:
    chip = chip_with(tmp_path, {0: [RJMP_SELF]})
    chip.poke(0x34, 0x01)
    assert not chip.pin("G", 0)
