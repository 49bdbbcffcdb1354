"""Timers 0 to 5: prescaler, normal and CTC counting, compare and overflow flags (data sheet DS40002211, ch. 16-20).

A timer's count is not kept but worked out from the cycle at which it was last known. Waveform modes that drive
pins, and input capture, are not emulated: a program that asks for them halts.
"""

import numpy as np

from wristctl.board.emulator.chip import LOOK, NEVER, NOT_EMULATED, Chip
from wristctl.lanes.compiled import compiled

# Columns of `Chip.timers`: cycles a count (0: stopped), highest count, count at cycle ORIGIN, 16-bit buffer.
PRESCALE, TOP, BASE, ORIGIN, TEMP = range(5)

TCCRA, TCCRB, TCNT, OCRA, UNITS, LIMIT, TIFR = range(7)
# Addresses, number of compare units and greatest count of each timer.
TIMERS = np.array(
    [
        [0x44, 0x45, 0x46, 0x47, 2, 0xFF, 0x35],
        [0x80, 0x81, 0x84, 0x88, 3, 0xFFFF, 0x36],
        [0xB0, 0xB1, 0xB2, 0xB3, 2, 0xFF, 0x37],
        [0x90, 0x91, 0x94, 0x98, 3, 0xFFFF, 0x38],
        [0xA0, 0xA1, 0xA4, 0xA8, 3, 0xFFFF, 0x39],
        [0x120, 0x121, 0x124, 0x128, 3, 0xFFFF, 0x3A],
    ]
)

# Place of the overflow in a timer's four of `Chip.due`, behind its compare units.
OVERFLOW = 3

_PRESCALES = np.array([[0, 1, 8, 64, 256, 1024, 0, 0], [0, 1, 8, 32, 64, 128, 256, 1024]])


@compiled
def count(chip: Chip, k: int) -> int:
    """TCNT of timer k now."""
    timer, limit = chip.timers[k], TIMERS[k, LIMIT]
    if timer[PRESCALE] == 0:
        return timer[BASE]
    value = timer[BASE] + chip.cycles // timer[PRESCALE] - timer[ORIGIN] // timer[PRESCALE]
    if timer[BASE] > timer[TOP]:  # past TOP it counts on to its limit
        if value <= limit:
            return value
        value -= limit + 1
    return value % (timer[TOP] + 1)


@compiled
def _set_count(chip: Chip, k: int, value: int) -> None:
    chip.timers[k, BASE], chip.timers[k, ORIGIN] = value, chip.cycles


@compiled
def _compare(chip: Chip, k: int, unit: int) -> int:
    """Value that sets the unit's flag one count later."""
    if unit == OVERFLOW:
        return TIMERS[k, LIMIT]
    if TIMERS[k, LIMIT] == 0xFF:
        return chip.memory[TIMERS[k, OCRA] + unit]
    low = TIMERS[k, OCRA] + 2 * unit
    return chip.memory[low] | chip.memory[low + 1] << 8


@compiled
def _schedule_unit(chip: Chip, k: int, unit: int) -> None:
    timer, now = chip.timers[k], count(chip, k)
    value, top = _compare(chip, k, unit), timer[TOP]
    due = NEVER
    if timer[PRESCALE] and (value <= top or value >= now > top):
        if now <= top:
            ahead = (value - now) % (top + 1)
        else:
            ahead = value - now if value >= now else TIMERS[k, LIMIT] + 1 - now + value
        due = (chip.cycles // timer[PRESCALE] + ahead + 1) * timer[PRESCALE]
    chip.due[4 * k + unit] = due
    chip.next = min(chip.next, due)


@compiled
def _schedule(chip: Chip, k: int) -> None:
    for unit in range(TIMERS[k, UNITS]):
        _schedule_unit(chip, k, unit)
    _schedule_unit(chip, k, OVERFLOW)


@compiled
def _configure(chip: Chip, k: int) -> None:
    """Take over the mode and the clock of TCCRnA and TCCRnB."""
    memory = chip.memory
    _set_count(chip, k, count(chip, k))
    a, b = memory[TIMERS[k, TCCRA]], memory[TIMERS[k, TCCRB]]
    if TIMERS[k, LIMIT] == 0xFFFF:
        mode, clear_mode = (a & 3) | (b >> 1 & 0xC), 4
    else:
        mode, clear_mode = (a & 3) | (b >> 1 & 4), 2
    external = k != 2 and b & 7 > 5
    if a & 0xFC or external or not (mode == 0 or mode == clear_mode):
        chip.halt, chip.next = NOT_EMULATED, 0
    chip.timers[k, PRESCALE] = _PRESCALES[1 if k == 2 else 0, b & 7]
    chip.timers[k, TOP] = _compare(chip, k, 0) if mode == clear_mode else TIMERS[k, LIMIT]
    _schedule(chip, k)


@compiled
def read_timer(chip: Chip, k: int, address: int) -> int:
    """Read a register of timer k; the low byte of a 16-bit count latches its high byte."""
    low = TIMERS[k, TCNT]
    if address == low:
        value = count(chip, k)
        chip.timers[k, TEMP] = value >> 8
        return value & 0xFF
    if address == low + 1 and TIMERS[k, LIMIT] == 0xFFFF:
        return chip.timers[k, TEMP]
    return chip.memory[address]


@compiled
def write_timer(chip: Chip, k: int, address: int, value: int) -> None:
    """Write a register of timer k; the low byte of a 16-bit register takes the high byte written before."""
    memory, row = chip.memory, TIMERS[k]
    if address == row[TCCRA] or address == row[TCCRB]:
        memory[address] = value
        _configure(chip, k)
        return
    wide = row[LIMIT] == 0xFFFF
    if wide and address >= row[TCNT]:
        if address & 1:
            chip.timers[k, TEMP] = value
            return
        if address != row[TCNT]:
            memory[address + 1] = chip.timers[k, TEMP]
        value |= chip.timers[k, TEMP] << 8
    if address == row[TCNT]:
        _set_count(chip, k, value)
        _schedule(chip, k)
        return
    memory[address] = value & 0xFF
    unit = (address - row[OCRA]) >> (1 if wide else 0)
    if unit == 0 and chip.timers[k, TOP] != row[LIMIT]:
        _configure(chip, k)
    elif 0 <= unit < row[UNITS]:
        _schedule_unit(chip, k, unit)


@compiled
def timer_events(chip: Chip, k: int) -> None:
    """Set the flags of timer k that are due."""
    for unit in range(4):
        if chip.due[4 * k + unit] <= chip.cycles:
            chip.memory[TIMERS[k, TIFR]] |= 1 if unit == OVERFLOW else 2 << unit
            chip.check |= LOOK
            _schedule_unit(chip, k, unit)
