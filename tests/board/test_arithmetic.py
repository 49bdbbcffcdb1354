"""Every 8-bit arithmetic instruction on every operand, against arithmetic on whole numbers."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from wristctl.board.emulator import Atmega2560

PROGRAM = Path(__file__).parent / "programs" / "flags.hex"
ROUTINE_WORDS, RESULTS = 32, 0x400
CYCLES = 256 * 20 + 50
C, Z, N, V, S, H, T = (1 << bit for bit in range(7))

Numbers = NDArray[np.int64]
Model = Callable[[Numbers, Numbers, int], tuple[Numbers, Numbers]]
"""First operand, second, SREG before -> result, SREG after."""


def signed(x: Numbers) -> Numbers:
    return np.where(x & 0x80, x - 256, x)


def flags(result: Numbers, overflow: NDArray[np.bool_] | bool) -> Numbers:
    negative, overflowed = result >= 0x80, np.broadcast_to(overflow, result.shape)
    return Z * (result == 0) + N * negative + V * overflowed + S * (negative != overflowed)


def added(carry: Callable[[int], int]) -> Model:
    def model(x: Numbers, y: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
        one = carry(sreg)
        total, exact = x + y + one, signed(x) + signed(y) + one
        half = (x % 16) + (y % 16) + one > 15
        result = total % 256
        return result, (sreg & T) + C * (total > 255) + H * half + flags(result, (exact > 127) | (exact < -128))

    return model


def subtracted(through: bool, kept: bool = True) -> Model:
    def model(x: Numbers, y: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
        one = sreg & C if through else 0
        exact = signed(x) - signed(y) - one
        result = (x - y - one) % 256
        after = C * (x < y + one) + H * (x % 16 < y % 16 + one) + flags(result, (exact > 127) | (exact < -128))
        if through and not sreg & Z:
            after &= ~Z
        return (result if kept else x), (sreg & T) + after

    return model


def logical(operation: Callable[[Numbers, Numbers], Numbers]) -> Model:
    def model(x: Numbers, y: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
        result = operation(x, y)
        return result, (sreg & (T | H | C)) + flags(result, False)

    return model


def com(_: Numbers, x: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
    return 255 - x, (sreg & (T | H)) + C + flags(255 - x, False)


def neg(_: Numbers, x: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
    return subtracted(False)(np.zeros_like(x), x, sreg)


def swap(_: Numbers, x: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
    return x % 16 * 16 + x // 16, np.full_like(x, sreg)


def counted(step: int) -> Model:
    def model(_: Numbers, x: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
        result = (x + step) % 256
        return result, (sreg & (T | H | C)) + flags(result, abs(signed(x) + step + 0.5) > 128)

    return model


def shifted(top: Callable[[Numbers, int], Numbers]) -> Model:
    def model(_: Numbers, x: Numbers, sreg: int) -> tuple[Numbers, Numbers]:
        result = x // 2 + 128 * top(x, sreg)
        carry = x % 2
        return result, (sreg & (T | H)) + carry + flags(result, (result >= 0x80) != carry)

    return model


MODELS: list[Model] = [
    added(lambda sreg: 0),
    added(lambda sreg: sreg & C),
    subtracted(False),
    subtracted(True),
    subtracted(False, kept=False),
    subtracted(True, kept=False),
    logical(np.bitwise_and),
    logical(np.bitwise_or),
    logical(np.bitwise_xor),
    com,
    neg,
    swap,
    counted(1),
    counted(-1),
    shifted(lambda x, sreg: x // 128),
    shifted(lambda x, sreg: 0 * x),
    shifted(lambda x, sreg: 0 * x + (sreg & C)),
]
NAMES = (
    *("add", "adc", "sub", "sbc", "cp", "cpc", "and", "or", "eor"),
    *("com", "neg", "swap", "inc", "dec", "asr", "lsr", "ror"),
)
PRODUCTS = ("mul", "muls", "mulsu", "fmul", "fmuls", "fmulsu")


@pytest.fixture(scope="module")
def chip() -> Atmega2560:
    chip = Atmega2560(PROGRAM)
    chip.run(100)
    return chip


def ran(chip: Atmega2560, routine: int, first: int, sreg: int, bytes_each: int) -> Numbers:
    """What the routine has stored, a row for each value of the second operand."""
    where = ROUTINE_WORDS * (routine + 1)
    stored = ((30, where & 0xFF), (31, where >> 8), (26, RESULTS & 0xFF), (27, RESULTS >> 8))
    for register, value in (*stored, (21, first), (20, sreg), (24, 1)):
        chip.poke(register, value)
    chip.run(CYCLES)
    return chip.ram(RESULTS, 256 * bytes_each).astype(np.int64).reshape(256, bytes_each)


@pytest.mark.parametrize("routine", range(len(NAMES)), ids=NAMES)
@pytest.mark.slow
def test_result_and_flags_are_those_of_whole_number_arithmetic(chip: Atmega2560, routine: int) -> None:
    second = np.arange(256)
    for sreg in (0, C, T | H | V | N | S | Z, 0x7F):
        for first in range(256) if routine < NAMES.index("com") else [0]:
            found = ran(chip, routine, first, sreg, 2)
            result, after = MODELS[routine](np.full(256, first), second, sreg)
            np.testing.assert_array_equal(found[:, 0], result, f"result of {first} with SREG {sreg:#x}")
            np.testing.assert_array_equal(found[:, 1], after, f"SREG of {first} with SREG {sreg:#x}")


@pytest.mark.parametrize("name", PRODUCTS)
def test_products_and_their_flags_are_those_of_whole_number_arithmetic(chip: Atmega2560, name: str) -> None:
    second = np.arange(256)
    for first in range(256):
        found = ran(chip, len(NAMES) + PRODUCTS.index(name), first, 0x7F, 3)
        x = first if name.endswith("mul") else int(signed(np.array(first)))
        y = signed(second) if name.endswith("muls") else second
        product = x * y % 65536
        carry = product >> 15
        if name.startswith("f"):
            product = product * 2 % 65536
        np.testing.assert_array_equal(found[:, 0] + 256 * found[:, 1], product, f"{first}")
        np.testing.assert_array_equal(found[:, 2], 0x7C + C * carry + Z * (product == 0), f"SREG of {first}")
