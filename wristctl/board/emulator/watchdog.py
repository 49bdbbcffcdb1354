"""The watchdog: its timed write sequence, and its interrupt, reset and both-in-turn modes (data sheet, ch. 12)."""

from __future__ import annotations

from wristctl.board.emulator.chip import LOOK, NEVER, WATCHDOG, Chip
from wristctl.lanes.compiled import compiled

MCUSR, WDTCSR = 0x54, 0x60
WDRF = 0x08
WDIF, WDIE, WDCE, WDE, WDP = 0x80, 0x40, 0x10, 0x08, 0x27
_OSCILLATOR_CYCLES = 125  # of 128 kHz, in cycles of 16 MHz
_UNLOCKED_CYCLES = 4


@compiled
def restart_watchdog(chip: Chip) -> None:
    """WDR."""
    chip.watchdog_from = chip.cycles
    _schedule(chip)


@compiled
def _schedule(chip: Chip) -> None:
    control = chip.memory[WDTCSR]
    scale = (control & 7) | (control >> 2 & 8)
    on = control & (WDE | WDIE)
    chip.due[WATCHDOG] = chip.watchdog_from + (2048 << scale) * _OSCILLATOR_CYCLES if on else NEVER
    chip.next = min(chip.next, chip.due[WATCHDOG])


@compiled
def write_watchdog(chip: Chip, value: int) -> None:
    """Write WDTCSR: clearing WDE and changing the time need WDCE within four cycles before."""
    old = chip.memory[WDTCSR]
    new = (old & (WDP | WDE | (WDIF & ~value))) | (value & (WDIE | WDE))
    if chip.cycles <= chip.watchdog_unlocked:
        new = (new & ~(WDP | WDE)) | (value & (WDP | WDE))
    if value & WDCE and value & WDE:
        chip.watchdog_unlocked = chip.cycles + _UNLOCKED_CYCLES
    if chip.memory[MCUSR] & WDRF:
        new |= WDE
    chip.memory[WDTCSR] = new
    if not old & (WDE | WDIE):
        chip.watchdog_from = chip.cycles
    _schedule(chip)


@compiled
def watchdog_expired(chip: Chip) -> bool:
    """Take what follows a time-out; whether the chip must reset."""
    memory = chip.memory
    if not memory[WDTCSR] & WDIE:
        return True
    memory[WDTCSR] |= WDIF
    chip.check |= LOOK
    chip.watchdog_from = chip.cycles
    _schedule(chip)
    return False


@compiled
def watchdog_served(chip: Chip) -> None:
    """Its interrupt begins: the flag clears, and with WDE set the next time-out resets."""
    chip.memory[WDTCSR] &= ~WDIF
    if chip.memory[WDTCSR] & WDE:
        chip.memory[WDTCSR] &= ~WDIE
