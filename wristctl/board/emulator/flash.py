"""Self-programming: what SPM does to the flash, so that boot loaders can write programs (data sheet, ch. 29).

Erasing and writing take no time here; the program never sees them busy.
"""

from __future__ import annotations

import numpy as np

from wristctl.board.emulator.chip import Chip
from wristctl.board.emulator.decode import decode
from wristctl.board.emulator.registers import RAMPZ, SPMCSR

PAGE_BYTES = 256
_ENABLE, _ERASE, _WRITE, _READ_AGAIN = 0x01, 0x03, 0x05, 0x11


def self_program(chip: Chip) -> None:
    """Carry out the SPM that the program has just executed."""
    memory = chip.memory
    command = int(memory[SPMCSR]) & 0x1F
    address = int(memory[RAMPZ]) << 16 | int(memory[31]) << 8 | int(memory[30])
    page = address // PAGE_BYTES * PAGE_BYTES % len(chip.flash)
    within = address % PAGE_BYTES & ~1
    if command == _ENABLE:
        chip.page[within : within + 2] = memory[0:2]
    elif command == _ERASE:
        chip.flash[page : page + PAGE_BYTES] = 0xFF
    elif command == _WRITE:
        chip.flash[page : page + PAGE_BYTES] &= chip.page
    if command in (_WRITE, _READ_AGAIN):
        chip.page[:] = 0xFF
    if command in (_ERASE, _WRITE):
        before = max(0, page // 2 - 1)  # its second word may be the first of this page
        decode(chip.flash, chip.program, before, (page + PAGE_BYTES) // 2 - before)
    memory[SPMCSR] &= ~np.int32(0x1F)
