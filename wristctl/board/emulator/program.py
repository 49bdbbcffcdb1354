"""Programs of the emulated processor: hex files, decoded words, and self-programming."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from wristctl.board.emulator.chip import CONSTANTS, FLASH_WORDS, Chip
from wristctl.board.emulator.instructions import PATTERNS, Op
from wristctl.board.emulator.registers import RAMPZ, SPMCSR
from wristctl.errors import UserError
from wristctl.plain_files import read_text

_POINTER = {"X": 26, "Y": 28, "Z": 30}
# Order of an instruction's operands by their letters.
_RANK = "dDPrRAsKqbkhw"

Words = NDArray[np.int64]


def decode(flash: NDArray[np.uint8], program: NDArray[np.int32], first: int = 0, count: int = FLASH_WORDS) -> None:
    """Fill `count` rows of `program` (operation and two operands) from the flash bytes."""
    every = flash.view("<u2").astype(np.int64)
    words = every[first : first + count]
    behind = np.append(every, 0xFFFF)[first + 1 : first + count + 1]
    rows = program[first : first + count]
    rows[:] = (Op.ILLEGAL, 0, 0)
    for line in PATTERNS.split("\n")[1:-1]:
        name, pattern, extra = line[:10].strip(), line[10:29].replace(" ", ""), line[30:]
        fixed = int("".join("01"[bit in "01"] for bit in pattern), 2)
        value = int("".join("01"[bit == "1"] for bit in pattern), 2)
        places = np.flatnonzero((words & fixed) == value)
        if places.size:
            letters = sorted(
                {*pattern, *extra.replace("X", "").replace("Y", "").replace("Z", "")} - {*"01"},
                key=_RANK.find,
            )
            operands = [_operand(letter, pattern, words[places], behind[places]) for letter in letters if letter != "h"]
            if extra in _POINTER:
                displacement = operands[1] if len(operands) == 2 else np.zeros_like(places)
                operands = [operands[0], _POINTER[extra] + (displacement << 5)]
            if "h" in letters:
                operands = [(_bits("h", pattern, words[places]) << 16 | behind[places]) % FLASH_WORDS]
            rows[places, 0] = Op[name]
            for column, operand in enumerate(operands):
                rows[places, 1 + column] = operand


def _operand(letter: str, pattern: str, words: Words, behind: Words) -> Words:
    """The value of one operand as `execute` wants it."""
    bits = _bits(letter, pattern, words)
    match letter:
        case "d" | "r":
            return bits if pattern.count(letter) == 5 else 16 + bits
        case "D" | "R":
            return 2 * bits
        case "P":
            return 24 + 2 * bits
        case "A":
            return 0x20 + bits
        case "K":
            return bits if "P" in pattern else CONSTANTS + bits
        case "b" | "s":
            return np.left_shift(1, bits)
        case "k":
            half = 1 << (pattern.count("k") - 1)
            return (bits ^ half) - half
        case "w":
            return behind
    return bits


def _bits(letter: str, pattern: str, words: Words) -> Words:
    """The bits of `words` where `pattern` has `letter`, moved together."""
    value = np.zeros_like(words)
    for place, symbol in enumerate(pattern):
        if symbol == letter:
            value = (value << 1) | ((words >> (15 - place)) & 1)
    return value


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


_DATA, _END, _SEGMENT, _START_SEGMENT, _LINEAR, _START_LINEAR = range(6)


def read_hex(path: Path) -> dict[int, bytes]:
    """The records of a file: byte address -> bytes. UserError for a file that is not one, naming the line."""
    try:
        lines = read_text(path, encoding="ascii").splitlines()
    except (OSError, UnicodeDecodeError) as error:
        raise UserError(f"cannot read the program: {error}", str(path), "name an Intel hex file") from error
    records: dict[int, bytes] = {}
    base = 0
    for number, line in enumerate(lines, 1):
        where = f"{path}:{number}"
        try:
            record = bytes.fromhex(line.removeprefix(":"))
            if not line.startswith(":") or record[0] != len(record) - 5:
                raise ValueError
        except (ValueError, IndexError) as error:
            raise UserError("not a line of an Intel hex file", where, "build or fetch the file anew") from error
        if sum(record) & 0xFF:
            raise UserError("a wrong check sum", where, "build or fetch the file anew")
        kind, payload = record[3], record[4:-1]
        if kind == _DATA:
            records[base + int.from_bytes(record[1:3], "big")] = payload
        elif kind in (_SEGMENT, _LINEAR):
            base = int.from_bytes(payload, "big") << (4 if kind == _SEGMENT else 16)
        elif kind == _END:
            return records
    raise UserError("the file ends before its end record", str(path), "build or fetch the file anew")
