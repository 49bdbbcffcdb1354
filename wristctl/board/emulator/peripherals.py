"""Watchdog, ports and EEPROM of the emulated chip."""

import numpy as np

from wristctl.board.emulator.amplifiers import PORT, clock_amplifiers
from wristctl.board.emulator.chip import BUFFER_FULL, LOOK, NEVER, WATCHDOG, Chip
from wristctl.lanes.compiled import compiled, kernel

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
    """Begin the watchdog's interrupt: the flag clears, and with WDE set the next time-out resets."""
    chip.memory[WDTCSR] &= ~WDIF
    if chip.memory[WDTCSR] & WDE:
        chip.memory[WDTCSR] &= ~WDIE


LETTERS = "ABCDEFGHJKL"
# Address of PINx; DDRx and PORTx follow it.
PIN = tuple(0x20 + 3 * p if p < 7 else 0x100 + 3 * (p - 7) for p in range(11))

_PIN, _LETTER = np.array(PIN), np.array([ord(letter) for letter in LETTERS])


@kernel
def levels(chip: Chip, port: int) -> int:
    """Levels that PINx reads: an output's latch, an input's driver, else its pull-up."""
    pin = _PIN[port]
    outputs, latch = chip.memory[pin + 1], chip.memory[pin + 2]
    driven, level = chip.inputs[port, 0], chip.inputs[port, 1]
    return (latch & outputs) | (((level & driven) | (latch & ~driven)) & ~outputs & 0xFF)


@compiled
def write_port(chip: Chip, port: int, address: int, value: int) -> None:
    """Write PINx (toggles the latch), DDRx or PORTx."""
    memory = chip.memory
    pin = _PIN[port]
    if address == pin + 1:
        memory[address] = value
        return
    latch = memory[pin + 2] ^ value if address == pin else value
    if latch != memory[pin + 2]:
        if port == PORT:
            clock_amplifiers(chip, memory[pin + 2], latch)
        memory[pin + 2] = latch
        edge = chip.edges[chip.edge_count]
        edge[0], edge[1], edge[2] = chip.cycles, _LETTER[port], latch
        chip.edge_count += 1
        if chip.edge_count == len(chip.edges):
            chip.halt, chip.next = BUFFER_FULL, 0


EECR, EEDR, EEARL, EEARH = 0x3F, 0x40, 0x41, 0x42
EEMPE, EEPE, EERE = 0x04, 0x02, 0x01
# Cycles.
_WRITING = 54_400


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
