"""What happens at a cycle of its own: timers, bytes on the line, the watchdog; and reset."""

from __future__ import annotations

from wristctl.board.emulator.chip import NEVER, RX_BYTE, TX_BYTE, WATCHDOG, Chip
from wristctl.board.emulator.registers import IO_FIRST, IO_LAST, SPH, SPL
from wristctl.board.emulator.timers import BASE, LIMIT, ORIGIN, PRESCALE, TEMP, TIMERS, TOP, timer_events
from wristctl.board.emulator.usart import UCSRA, UDRE, byte_arrived, byte_sent
from wristctl.board.emulator.watchdog import MCUSR, WDE, WDRF, WDTCSR, restart_watchdog, watchdog_expired
from wristctl.lanes.compiled import compiled, kernel

POWER_ON, EXTERNAL = 0x01, 0x02
"""Causes of a reset as MCUSR shows them, beside WDRF."""


@kernel
def reset(chip: Chip, cause: int) -> None:
    """Reset: I/O registers and the program counter; registers and RAM keep what they hold."""
    memory = chip.memory
    causes = (memory[MCUSR] & 0x0F if cause != POWER_ON else 0) | cause
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
