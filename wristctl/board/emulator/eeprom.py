"""EEPROM: bytes that outlive power, written in 3.4 ms each (data sheet, ch. 8)."""

from __future__ import annotations

from wristctl.board.emulator.chip import Chip
from wristctl.lanes.compiled import compiled, kernel

EECR, EEDR, EEARL, EEARH = 0x3F, 0x40, 0x41, 0x42
EEMPE, EEPE, EERE = 0x04, 0x02, 0x01
_WRITING = 54_400
"""Cycles."""


@compiled
def read_eeprom(chip: Chip) -> int:
    """EECR: EEPE stays set while a byte is written."""
    busy = EEPE if chip.cycles < chip.eeprom_until else 0
    return (chip.memory[EECR] & ~EEPE) | busy


@kernel
def write_eeprom(chip: Chip, value: int) -> None:
    """Write EECR: EERE reads the byte at EEAR into EEDR, EEPE behind EEMPE writes it."""
    memory = chip.memory
    place = (memory[EEARL] | memory[EEARH] << 8) % len(chip.eeprom)
    if value & EERE:
        memory[EEDR] = chip.eeprom[place]
    if value & EEPE and memory[EECR] & EEMPE and chip.cycles >= chip.eeprom_until:
        chip.eeprom[place] = memory[EEDR]
        chip.eeprom_until = chip.cycles + _WRITING
        value &= ~EEMPE
    memory[EECR] = value & ~(EERE | EEPE)
