"""Choice of the next interrupt, in the order of the vectors (data sheet, table 14-1)."""

import numpy as np

from wristctl.board.emulator.amplifiers import LATCH, clock_amplifiers
from wristctl.board.emulator.chip import NEVER, RX_BYTE, TX_BYTE, WATCHDOG, Chip
from wristctl.board.emulator.peripherals import (
    MCUSR,
    WDE,
    WDIE,
    WDIF,
    WDRF,
    WDTCSR,
    restart_watchdog,
    watchdog_expired,
    watchdog_served,
)
from wristctl.board.emulator.registers import IO_FIRST, IO_LAST, SPH, SPL
from wristctl.board.emulator.timers import BASE, LIMIT, ORIGIN, PRESCALE, TEMP, TIFR, TIMERS, TOP, UNITS, timer_events
from wristctl.board.emulator.usart import RXC, TXC, UCSRA, UCSRB, UDRE, byte_arrived, byte_sent
from wristctl.lanes.compiled import compiled, kernel

_TIMSK = 0x6E
# Vector of the first compare unit of each timer; its other units and its overflow follow.
_COMPARE_A = (21, 17, 13, 32, 42, 47)

_WATCHDOG_VECTOR = 12


def _sources() -> list[tuple[int, int, int, int, int, bool]]:
    """Vector, address and bit of the flag, address and bit of the enable, whether serving it clears the flag."""
    rows = [
        (_WATCHDOG_VECTOR, WDTCSR, WDIF, WDTCSR, WDIE, False),
        (25, UCSRA, RXC, UCSRB, RXC, False),
        (26, UCSRA, UDRE, UCSRB, UDRE, False),
        (27, UCSRA, TXC, UCSRB, TXC, True),
    ]
    for k, first in enumerate(_COMPARE_A):
        bits = [2 << unit for unit in range(TIMERS[k, UNITS])] + [1]
        rows += [(first + n, int(TIMERS[k, TIFR]), bit, _TIMSK + k, bit, True) for n, bit in enumerate(bits)]
    return sorted(rows)


_VECTOR, _FLAGS, _FLAG, _ENABLES, _ENABLE, _CLEARS = range(6)
_SOURCES = np.array(_sources(), np.int64)


@compiled
def take_interrupt(chip: Chip) -> int:
    """The first vector that is flagged and enabled, its flag cleared as the chip clears it; 0 if there is none."""
    memory = chip.memory
    for n in range(len(_SOURCES)):
        source = _SOURCES[n]
        if memory[source[_FLAGS]] & source[_FLAG] and memory[source[_ENABLES]] & source[_ENABLE]:
            if source[_CLEARS]:
                memory[source[_FLAGS]] &= ~source[_FLAG]
            if source[_VECTOR] == _WATCHDOG_VECTOR:
                watchdog_served(chip)
            return source[_VECTOR]
    return 0


# Causes of a reset as MCUSR shows them, beside WDRF.
POWER_ON, EXTERNAL = 0x01, 0x02


@kernel
def reset(chip: Chip, cause: int) -> None:
    """Reset: I/O registers and the program counter; registers and RAM keep what they hold."""
    memory = chip.memory
    causes = (memory[MCUSR] & 0x0F if cause != POWER_ON else 0) | cause
    clock_amplifiers(chip, memory[LATCH], 0)
    memory[IO_FIRST : IO_LAST + 1] = 0
    memory[UCSRA], memory[SPL], memory[SPH], memory[MCUSR] = UDRE, 0xFF, 0x21, causes
    chip.due[:] = NEVER
    for k in range(6):
        timer = chip.timers[k]
        timer[PRESCALE] = timer[BASE] = timer[TEMP] = 0
        timer[TOP], timer[ORIGIN] = TIMERS[k, LIMIT], chip.cycles
    chip.pc, chip.check, chip.next = chip.reset_pc, 0, NEVER
    chip.fifo_count, chip.held, chip.shifting, chip.waiting = 0, -1, -1, -1
    chip.line_tail = chip.line_head
    if causes & WDRF:
        memory[WDTCSR] = WDE
        restart_watchdog(chip)


@compiled
def happen(chip: Chip) -> None:
    """Let everything happen that is due, and note when the next is."""
    due = chip.due
    chip.next = NEVER
    for k in range(6):
        if min(due[4 * k], due[4 * k + 1], due[4 * k + 2], due[4 * k + 3]) <= chip.cycles:
            timer_events(chip, k)
    if due[RX_BYTE] <= chip.cycles:
        byte_arrived(chip)
    if due[TX_BYTE] <= chip.cycles:
        byte_sent(chip)
    if due[WATCHDOG] <= chip.cycles and watchdog_expired(chip):
        reset(chip, WDRF)
    chip.next = 0 if chip.halt else due.min()
