"""The data space: what reading and writing an address does beyond the memory behind it."""

import numpy as np

from wristctl.board.emulator.chip import DELAY, LOOK, Chip
from wristctl.board.emulator.peripherals import (
    EECR,
    PIN,
    WDTCSR,
    levels,
    read_eeprom,
    write_eeprom,
    write_port,
    write_watchdog,
)
from wristctl.board.emulator.timers import TIFR, TIMERS, read_timer, write_timer
from wristctl.board.emulator.usart import UCSRA, UCSRB, UDR, read_byte, write_byte, write_control
from wristctl.lanes.compiled import compiled, kernel

SPL, SPH, SREG = 0x5D, 0x5E, 0x5F
RAMPZ, EIND, SMCR, SPMCSR = 0x5B, 0x5C, 0x53, 0x57
IO_FIRST, IO_LAST = 0x20, 0x1FF
GLOBAL_INTERRUPT = 0x80

_MEMORY, _PORT, _TIMER, _FLAGS, _MASK, _CONTROL, _DATA, _WATCHDOG, _SREG, _EEPROM = range(10)


def _device_table() -> list[tuple[int, int]]:
    """For each address what stands behind it, and which one of several."""
    table = [(_MEMORY, 0)] * (IO_LAST + 1)
    for port, pin in enumerate(PIN):
        table[pin : pin + 3] = [(_PORT, port)] * 3
    for k, row in enumerate(TIMERS):
        width = 5 if k in (0, 2) else 14
        table[row[0] : row[0] + width] = [(_TIMER, k)] * width
        table[row[TIFR]], table[0x6E + k] = (_FLAGS, k), (_MASK, k)
    table[UCSRA], table[UCSRB], table[UDR] = (_CONTROL, 0), (_CONTROL, 0), (_DATA, 0)
    table[WDTCSR], table[SREG], table[EECR] = (_WATCHDOG, 0), (_SREG, 0), (_EEPROM, 0)
    return table


_DEVICE = np.array(_device_table())


@kernel
def read(chip: Chip, address: int) -> int:
    """Read the value of a load from this address."""
    if IO_FIRST <= address <= IO_LAST:
        device, which = _DEVICE[address, 0], _DEVICE[address, 1]
        if device == _TIMER:
            return read_timer(chip, which, address)
        if device == _DATA:
            return read_byte(chip)
        if device == _PORT and address == PIN[which]:
            return levels(chip, which)
        if device == _EEPROM:
            return read_eeprom(chip)
    return chip.memory[address]


@kernel
def write(chip: Chip, address: int, value: int) -> None:
    """Store a value at this address, with the effects of its register."""
    memory = chip.memory
    if not IO_FIRST <= address <= IO_LAST:
        memory[address] = value
        return
    device, which = _DEVICE[address, 0], _DEVICE[address, 1]
    if device == _PORT:
        write_port(chip, which, address, value)
    elif device == _TIMER:
        write_timer(chip, which, address, value)
    elif device == _DATA:
        write_byte(chip, value)
    elif device == _CONTROL:
        write_control(chip, address, value)
    elif device == _FLAGS:
        memory[address] &= ~value
    elif device == _WATCHDOG:
        write_watchdog(chip, value)
    elif device == _EEPROM:
        write_eeprom(chip, value)
    else:
        if device == _MASK:
            chip.check |= LOOK
        elif device == _SREG and value & ~memory[SREG] & GLOBAL_INTERRUPT:
            chip.check |= DELAY
        memory[address] = value


@compiled
def change_bit(chip: Chip, address: int, bit: int, level: bool) -> None:
    """SBI and CBI: where writing a one acts by itself (PINx, flags) they write that one alone."""
    device, which = _DEVICE[address, 0], _DEVICE[address, 1]
    acts = device == _FLAGS or (device == _PORT and address == PIN[which])
    old = 0 if acts else chip.memory[address]
    if level or not acts:
        write(chip, address, old | bit if level else old & ~bit)


@compiled
def push(chip: Chip, value: int) -> None:
    """Put a byte on the stack."""
    memory = chip.memory
    pointer = memory[SPL] | memory[SPH] << 8
    memory[pointer] = value & 0xFF
    pointer = (pointer - 1) & 0xFFFF
    memory[SPL], memory[SPH] = pointer & 0xFF, pointer >> 8


@compiled
def pop(chip: Chip) -> int:
    """Take a byte from the stack."""
    memory = chip.memory
    pointer = ((memory[SPL] | memory[SPH] << 8) + 1) & 0xFFFF
    memory[SPL], memory[SPH] = pointer & 0xFF, pointer >> 8
    return memory[pointer]


@compiled
def push_pc(chip: Chip, pc: int) -> None:
    """Put a 3-byte return address on the stack."""
    push(chip, pc)
    push(chip, pc >> 8)
    push(chip, pc >> 16)


@compiled
def pop_pc(chip: Chip) -> int:
    """Take a 3-byte return address from the stack."""
    high = pop(chip)
    middle = pop(chip)
    return (high << 16 | middle << 8 | pop(chip)) & 0x1FFFF


@compiled
def pair(chip: Chip, register: int) -> int:
    """The 16 bits of a register pair."""
    return chip.memory[register] | chip.memory[register + 1] << 8


@compiled
def set_pair(chip: Chip, register: int, value: int) -> None:
    """Write a register pair."""
    chip.memory[register], chip.memory[register + 1] = value & 0xFF, value >> 8 & 0xFF
