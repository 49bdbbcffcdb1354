"""EEPROM keeps what was written, over reset and power."""

from __future__ import annotations

from tests.board.bench import Bench
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.peripherals import EEARH, EEARL, EECR, EEDR, EEMPE, EEPE, EERE
from wristctl.board.messages import Command

MILLISECONDS = 16_000


def at(chip: Atmega2560, address: int) -> int:
    chip.poke(EEARL, address & 0xFF)
    chip.poke(EEARH, address >> 8)
    chip.poke(EECR, EERE)
    return chip.peek(EEDR)


def put(chip: Atmega2560, address: int, value: int, unlock: int = EEMPE) -> None:
    chip.poke(EEARL, address & 0xFF)
    chip.poke(EEARH, address >> 8)
    chip.poke(EEDR, value)
    chip.poke(EECR, unlock)
    chip.poke(EECR, unlock | EEPE)


def test_a_byte_is_written_in_3_4_ms_where_it_is_unlocked_and_nothing_else_is_being_written() -> None:
    chip = Atmega2560()
    chip.run(20 * MILLISECONDS)
    assert at(chip, 0x123) == 0xFF
    put(chip, 0x123, 0x5A, unlock=0)
    assert at(chip, 0x123) == 0xFF and not chip.peek(EECR) & EEPE
    put(chip, 0x123, 0x5A)
    put(chip, 0x124, 0x11)
    assert chip.peek(EECR) & EEPE
    chip.run(3 * MILLISECONDS)
    assert chip.peek(EECR) & EEPE
    chip.run(MILLISECONDS)
    assert not chip.peek(EECR) & EEPE
    chip.reset()
    assert (at(chip, 0x123), at(chip, 0x124)) == (0x5A, 0xFF)


def test_starts_are_counted_over_power_too() -> None:
    """Memory comes up alike after power was off: it cannot tell one start from another."""
    before = Atmega2560()
    nonce = Bench(before).do(Command.HELLO).boot_nonce
    after = Atmega2560()
    after._chip.eeprom[:] = before._chip.eeprom
    assert Bench(after).do(Command.HELLO).boot_nonce == nonce + 1
