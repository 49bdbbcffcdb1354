"""The state of the emulated ATmega2560: one record, which this package's compiled functions change in place."""

from typing import Protocol, cast

import numpy as np
from numpy.typing import NDArray

FREQUENCY = 16_000_000  # Hz, of the Mega 2560 board
FLASH_BYTES = 0x40000
FLASH_WORDS = FLASH_BYTES // 2
# Behind the 64 KiB of data space lie the numbers 0 to 255: an immediate operand is read like a register.
CONSTANTS = 0x10000

NEVER = 1 << 62
# Places in `Chip.due`, behind four for each of the six timers.
RX_BYTE, TX_BYTE, WATCHDOG = 24, 25, 26

# Bits of `Chip.check`: look for interrupts; but not before one more instruction; sleeping.
LOOK, DELAY, ASLEEP = 1, 2, 4

# Values of `Chip.halt`: why `execute.run` came back early.
RUNNING, BUFFER_FULL, FLASH_CHANGED, BYTE_SENT, ILLEGAL, NOT_EMULATED = range(6)


class Chip(Protocol):
    """Everything the compiled core knows."""

    pc: int  # in words
    cycles: int
    next: int  # no later than the earliest `due`
    check: int
    halt: int
    reset_pc: int
    memory: NDArray[np.int32]  # registers, I/O, RAM, then CONSTANTS
    flash: NDArray[np.uint8]
    page: NDArray[np.uint8]  # buffer of SPM
    program: NDArray[np.int32]  # decoded flash: operation and its two operands
    due: NDArray[np.int64]  # cycle at which each thing happens next
    timers: NDArray[np.int64]  # columns in timers.py
    inputs: NDArray[np.int64]  # by port: pins driven from outside, and their levels
    watchdog_from: int  # cycle of its last restart
    watchdog_unlocked: int  # cycle until which it may be slowed down or switched off
    eeprom: NDArray[np.uint8]
    eeprom_until: int  # cycle at which what is being written is
    line: NDArray[np.uint8]  # ring of bytes on their way to the receiver
    line_head: int  # bytes put on the line so far
    line_tail: int  # bytes taken from it
    line_byte: int  # cycles of a byte on it; 0: as the receiver is set
    fifo_count: int
    fifo_first: int
    fifo_second: int
    held: int  # byte in the receiver's shift register behind a full FIFO, or -1
    lost: int  # bytes lost so
    shifting: int  # byte in the transmitter's shift register, or -1
    waiting: int  # byte behind it, or -1
    sent: NDArray[np.uint8]
    sent_count: int
    stop_when_sent: int
    edges: NDArray[np.int64]  # changed output latches: cycle, port letter, value
    edge_count: int
    amplifiers: NDArray[np.int64]  # columns in amplifiers.py


_ARRAYS = {
    "memory": (np.int32, CONSTANTS + 256),
    "flash": (np.uint8, FLASH_BYTES),
    "page": (np.uint8, 256),
    "program": (np.int32, (FLASH_WORDS, 3)),
    "due": (np.int64, 27),
    "timers": (np.int64, (6, 5)),
    "inputs": (np.int64, (11, 2)),
    "eeprom": (np.uint8, 1 << 12),
    "line": (np.uint8, 1 << 16),
    "sent": (np.uint8, 1 << 12),
    "edges": (np.int64, (1 << 16, 3)),
    "amplifiers": (np.int64, (4, 5)),
}


def new_chip() -> Chip:
    """A chip without power, its flash erased."""
    fields = [(name, *_ARRAYS.get(name, (np.int64,))) for name in Chip.__annotations__]
    chip = cast(Chip, np.zeros(1, np.dtype((np.record, np.dtype(fields, align=True))))[0])
    chip.memory[CONSTANTS:] = np.arange(256)
    chip.flash[:] = 0xFF
    chip.page[:] = chip.eeprom[:] = 0xFF
    return chip
