"""The processor: fetch, execute, count cycles, serve interrupts (AVR manual, cycles of the ATmega2560)."""

from wristctl.board.emulator.arithmetic import T, add_word, multiply, one_operand, two_operands
from wristctl.board.emulator.chip import (
    ASLEEP,
    DELAY,
    FLASH_CHANGED,
    FLASH_WORDS,
    ILLEGAL,
    LOOK,
    NOT_EMULATED,
    RUNNING,
    Chip,
)
from wristctl.board.emulator.instructions import Op
from wristctl.board.emulator.interrupts import happen, take_interrupt
from wristctl.board.emulator.peripherals import restart_watchdog
from wristctl.board.emulator.registers import (
    EIND,
    GLOBAL_INTERRUPT,
    RAMPZ,
    SMCR,
    SREG,
    change_bit,
    pair,
    pop,
    pop_pc,
    push,
    push_pc,
    read,
    set_pair,
    write,
)
from wristctl.board.emulator.usart import start_line
from wristctl.lanes.compiled import compiled, kernel

_X, _Y, _Z = 26, 28, 30
_INTERRUPT_CYCLES, _WAKING_CYCLES = 5, 5
_SLEEP_ENABLE, _SLEEP_MODE = 0x01, 0x0E


@kernel
def run(chip: Chip, until: int) -> int:
    """Execute until cycle `until`, or until something stops it: RUNNING, or what else `chip.halt` says."""
    memory, program = chip.memory, chip.program
    chip.halt = RUNNING
    start_line(chip)
    pc, cycles = chip.pc, chip.cycles
    while cycles < until:
        if cycles >= chip.next:
            chip.pc, chip.cycles = pc, cycles
            happen(chip)
            pc = chip.pc
            if chip.halt:
                break
        if chip.check:
            if chip.check & DELAY:
                chip.check = (chip.check | LOOK) & ~DELAY
            else:
                vector = take_interrupt(chip) if memory[SREG] & GLOBAL_INTERRUPT else 0
                if vector:
                    cycles += _INTERRUPT_CYCLES + (_WAKING_CYCLES if chip.check & ASLEEP else 0)
                    push_pc(chip, pc)
                    memory[SREG] &= ~GLOBAL_INTERRUPT
                    pc = 2 * vector
                    chip.check = 0
                elif chip.check & ASLEEP:
                    chip.check = ASLEEP
                    cycles = min(chip.next, until)
                    continue
                else:
                    chip.check = 0
        op, a, b = program[pc, 0], program[pc, 1], program[pc, 2]
        pc += 1
        cycles += 1
        if op <= Op.MOV:
            result, sreg = two_operands(op, memory[a], memory[b], memory[SREG])
            memory[SREG] = sreg
            if op != Op.CP and op != Op.CPC:
                memory[a] = result
        elif op <= Op.ROR:
            memory[a], memory[SREG] = one_operand(op, memory[a], memory[SREG])
        elif op <= Op.POP:
            chip.cycles = cycles
            cycles += _transfer(chip, op, a, b)
            if op == Op.LDS or op == Op.STS:
                pc += 1
        elif op <= Op.SBIS:
            if op <= Op.BRBC:
                if (memory[SREG] & a != 0) == (op == Op.BRBS):
                    pc += b
                    cycles += 1
            else:
                chip.cycles = cycles
                if _skips(chip, op, a, b):
                    words = 2 if _has_two_words(program[pc, 0]) else 1
                    pc += words
                    cycles += words
        elif op <= Op.RETI:
            pc, spent = _jump(chip, op, a, pc)
            cycles += spent
        else:
            chip.cycles = cycles
            cycles += _rest(chip, op, a, b)
        pc &= FLASH_WORDS - 1
    chip.pc, chip.cycles = pc, cycles
    return chip.halt


@compiled
def _transfer(chip: Chip, op: int, a: int, b: int) -> int:
    """Loads and stores; the cycles beyond the first."""
    memory = chip.memory
    if op == Op.IN:
        memory[a] = read(chip, b)
        return 0
    if op == Op.OUT:
        write(chip, b, memory[a])
        return 0
    if op == Op.PUSH:
        push(chip, memory[a])
    elif op == Op.POP:
        memory[a] = pop(chip)
    elif op == Op.LDS:
        memory[a] = read(chip, b)
    elif op == Op.STS:
        write(chip, b, memory[a])
    else:
        pointer = b & 31
        address = pair(chip, pointer)
        if op == Op.LOAD_DEC or op == Op.STORE_DEC:
            address = (address - 1) & 0xFFFF
            set_pair(chip, pointer, address)
        elif op == Op.LOAD_INC or op == Op.STORE_INC:
            set_pair(chip, pointer, address + 1)
        else:
            address = (address + (b >> 5)) & 0xFFFF
        if op <= Op.LOAD_DEC:
            memory[a] = read(chip, address)
        else:
            write(chip, address, memory[a])
    return 1


@compiled
def _skips(chip: Chip, op: int, a: int, b: int) -> bool:
    """Whether CPSE, SBRC, SBRS, SBIC or SBIS skips the next instruction."""
    memory = chip.memory
    if op == Op.CPSE:
        return memory[a] == memory[b]
    value = memory[a] if op <= Op.SBRS else read(chip, a)
    wanted = op == Op.SBRS or op == Op.SBIS
    return (value & b != 0) == wanted


@compiled
def _has_two_words(op: int) -> bool:
    return op == Op.LDS or op == Op.STS or op == Op.JMP or op == Op.CALL


@compiled
def _jump(chip: Chip, op: int, a: int, pc: int) -> tuple[int, int]:
    """The new program counter, and the cycles beyond the first; `pc` is that of the next word."""
    memory = chip.memory
    if op == Op.RJMP:
        return pc + a, 1
    if op == Op.JMP:
        return a, 2
    if op == Op.RET:
        return pop_pc(chip), 4
    if op == Op.RETI:
        memory[SREG] |= GLOBAL_INTERRUPT
        chip.check |= DELAY
        return pop_pc(chip), 4
    far = (memory[EIND] << 16) | pair(chip, _Z)
    if op == Op.IJMP:
        return pair(chip, _Z), 1
    if op == Op.EIJMP:
        return far, 1
    push_pc(chip, pc + 1 if op == Op.CALL else pc)
    if op == Op.RCALL:
        return pc + a, 3
    if op == Op.CALL:
        return a, 4
    return (pair(chip, _Z) if op == Op.ICALL else far), 3


@compiled
def _rest(chip: Chip, op: int, a: int, b: int) -> int:
    """Everything else; the cycles beyond the first."""
    memory = chip.memory
    if op == Op.MOVW:
        memory[a], memory[a + 1] = memory[b], memory[b + 1]
        return 0
    if op == Op.ADIW or op == Op.SBIW:
        result, memory[SREG] = add_word(pair(chip, a), b, op == Op.SBIW, memory[SREG])
        set_pair(chip, a, result)
        return 1
    if Op.MUL <= op <= Op.FMULSU:
        result, memory[SREG] = multiply(op, memory[a], memory[b], memory[SREG])
        set_pair(chip, 0, result)
        return 1
    if op == Op.SBI or op == Op.CBI:
        change_bit(chip, a, b, op == Op.SBI)
        return 1
    if op == Op.BSET:
        if a & ~memory[SREG] & GLOBAL_INTERRUPT:
            chip.check |= DELAY
        memory[SREG] |= a
    elif op == Op.BCLR:
        memory[SREG] &= ~a
    elif op == Op.BST:
        memory[SREG] = (memory[SREG] & ~T) | (T if memory[a] & b else 0)
    elif op == Op.BLD:
        memory[a] = (memory[a] & ~b) | (b if memory[SREG] & T else 0)
    elif op <= Op.ELPM_INC:
        return _load_program(chip, op, a)
    elif op == Op.SPM:
        chip.halt, chip.next = FLASH_CHANGED, 0
    elif op == Op.WDR:
        restart_watchdog(chip)
    elif op == Op.SLEEP:
        if memory[SMCR] & _SLEEP_MODE:
            chip.halt, chip.next = NOT_EMULATED, 0
        elif memory[SMCR] & _SLEEP_ENABLE:
            chip.check |= ASLEEP
    elif op == Op.ILLEGAL:
        chip.halt, chip.next = ILLEGAL, 0
    return 0


@compiled
def _load_program(chip: Chip, op: int, a: int) -> int:
    memory = chip.memory
    far = op >= Op.ELPM
    address = pair(chip, _Z) | (memory[RAMPZ] << 16 if far else 0)
    memory[a] = chip.flash[address % len(chip.flash)]
    if op == Op.LPM_INC or op == Op.ELPM_INC:
        set_pair(chip, _Z, address + 1)
        if far:
            memory[RAMPZ] = (address + 1) >> 16 & 3
    return 2
