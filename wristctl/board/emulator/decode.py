"""Flash words to operations and operands, once, before they run."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from wristctl.board.emulator.chip import CONSTANTS, FLASH_WORDS
from wristctl.board.emulator.instructions import PATTERNS, Op

_POINTER = {"X": 26, "Y": 28, "Z": 30}
_RANK = "dDPrRAsKqbkhw"
"""Of an instruction's operands, the one whose letter comes first here is its first."""

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
        at = np.flatnonzero((words & fixed) == value)
        if at.size:
            letters = sorted(
                {*pattern, *extra.replace("X", "").replace("Y", "").replace("Z", "")} - {*"01"},
                key=_RANK.find,
            )
            operands = [_operand(letter, pattern, words[at], behind[at]) for letter in letters if letter != "h"]
            if extra in _POINTER:
                displacement = operands[1] if len(operands) == 2 else np.zeros_like(at)
                operands = [operands[0], _POINTER[extra] + (displacement << 5)]
            if "h" in letters:
                operands = [(_bits("h", pattern, words[at]) << 16 | behind[at]) % FLASH_WORDS]
            rows[at, 0] = Op[name]
            for column, operand in enumerate(operands):
                rows[at, 1 + column] = operand


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
    for place, each in enumerate(pattern):
        if each == letter:
            value = (value << 1) | ((words >> (15 - place)) & 1)
    return value
