"""Single instructions do what the AVR manual says, in its cycles on a chip with a 3-byte program counter."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import pytest

from tests.board.flash_image import chip_with
from wristctl.board.emulator import Atmega2560

SREG, SPL, RAMPZ, EIND = 0x5F, 0x5D, 0x5B, 0x5C
C, Z, N, V, S, H, T, I = (1 << bit for bit in range(8))  # noqa: E741 - the manual's name
AT = 0x1000
"""Word address at which each of the instructions stands, a long way apart from the next."""
APART = 0x40
X, Y, ZZ = 26, 28, 30
STACK = 0x8FF


class Case(NamedTuple):
    """An instruction: its words, memory before, what has changed after, cycles, and words that the counter moves."""

    name: str
    words: list[int]
    before: Mapping[int, int]
    after: Mapping[int, int]
    cycles: int
    moved: int | None = None
    """None: to the next instruction."""


def wide(at: int, value: int) -> dict[int, int]:
    return {at: value & 0xFF, at + 1: value >> 8}


CASES = [
    # loads and stores: 0x321 lies in RAM
    Case("ld r5, X", [0x905C], {**wide(X, 0x321), 0x321: 7}, {5: 7}, 2),
    Case("ld r5, X+", [0x905D], {**wide(X, 0x3FF), 0x3FF: 7}, {5: 7, **wide(X, 0x400)}, 2),
    Case("ld r5, -X", [0x905E], {**wide(X, 0x400), 0x3FF: 7}, {5: 7, **wide(X, 0x3FF)}, 2),
    Case("ld r5, Y+", [0x9059], {**wide(Y, 0x3FF), 0x3FF: 7}, {5: 7, **wide(Y, 0x400)}, 2),
    Case("ld r5, -Z", [0x9052], {**wide(ZZ, 0x400), 0x3FF: 7}, {5: 7, **wide(ZZ, 0x3FF)}, 2),
    Case("ldd r5, Y+63", [0xAC5F], {**wide(Y, 0x300), 0x33F: 7}, {5: 7}, 2),
    Case("ldd r5, Z+33", [0xA051], {**wide(ZZ, 0x300), 0x321: 7}, {5: 7}, 2),
    Case("st X, r5", [0x925C], {**wide(X, 0x321), 5: 7}, {0x321: 7}, 2),
    Case("st X+, r5", [0x925D], {**wide(X, 0x3FF), 5: 7}, {0x3FF: 7, **wide(X, 0x400)}, 2),
    Case("st -Y, r5", [0x925A], {**wide(Y, 0x400), 5: 7}, {0x3FF: 7, **wide(Y, 0x3FF)}, 2),
    Case("st Z+, r5", [0x9251], {**wide(ZZ, 0x321), 5: 7}, {0x321: 7, **wide(ZZ, 0x322)}, 2),
    Case("std Y+41, r5", [0xA659], {**wide(Y, 0x300), 5: 7}, {0x329: 7}, 2),
    Case("lds r5, 0x0321", [0x9050, 0x0321], {0x321: 7}, {5: 7}, 2, 2),
    Case("sts 0x0321, r5", [0x9250, 0x0321], {5: 7}, {0x321: 7}, 2, 2),
    Case("push r5", [0x925F], {5: 7}, {STACK: 7, **wide(SPL, STACK - 1)}, 2),
    Case("pop r5", [0x905F], {STACK + 1: 7}, {5: 7, **wide(SPL, STACK + 1)}, 2),
    Case("in r5, 0x2B", [0xB45B], {0x4B: 7}, {5: 7}, 1),
    Case("out 0x2B, r5", [0xBC5B], {5: 7}, {0x4B: 7}, 1),
    # numbers
    Case("mov r5, r17", [0x2E51], {17: 7}, {5: 7}, 1),
    Case("movw r30, r16", [0x01F8], wide(16, 0x1234), wide(30, 0x1234), 1),
    Case("ldi r20, 0xA5", [0xEA45], {}, {20: 0xA5}, 1),
    Case("cpi r20, 0xA5", [0x3A45], {20: 0xA5}, {SREG: I | Z}, 1),
    Case("subi r20, 1", [0x5041], {20: 0}, {20: 0xFF, SREG: I | S | N | C | H}, 1),
    Case("sbci r20, 1", [0x4041], {20: 2, SREG: I | C}, {20: 0, SREG: I}, 1),
    Case("ori r20, 0x0F", [0x604F], {20: 0x51}, {20: 0x5F}, 1),
    Case("andi r20, 0x0F", [0x704F], {20: 0x5A}, {20: 0x0A}, 1),
    Case("adiw r26, 63", [0x96DF], wide(X, 0x00FF), wide(X, 0x013E), 2),
    Case("adiw r24, 1 over", [0x9601], wide(24, 0xFFFF), {**wide(24, 0), SREG: I | Z | C}, 2),
    Case("adiw r24, 1 half", [0x9601], wide(24, 0x7FFF), {**wide(24, 0x8000), SREG: I | N | V}, 2),
    Case("sbiw r28, 1 under", [0x9721], wide(Y, 0) | {SREG: I | T | H},
         wide(Y, 0xFFFF) | {SREG: I | T | H | S | N | C}, 2),
    Case("sbiw r28, 1 half", [0x9721], wide(Y, 0x8000), {**wide(Y, 0x7FFF), SREG: I | V | S}, 2),
    Case("sbiw r30, 63", [0x97FF], {**wide(ZZ, 63), SREG: I | C}, {**wide(ZZ, 0), SREG: I | Z}, 2),
    Case("mul r5, r17", [0x9E51], {5: 200, 17: 250}, {**wide(0, 50_000), SREG: I | C}, 2),
    # bits; port A's latch is at 0x22, port G's latch at 0x34
    Case("sbi 0x02, 7", [0x9A17], {0x22: 0x01}, {0x22: 0x81}, 2),
    Case("cbi 0x02, 0", [0x9810], {0x22: 0x81}, {0x22: 0x80}, 2),
    Case("sec", [0x9408], {}, {SREG: I | C}, 1),
    Case("clc", [0x9488], {SREG: I | C | Z}, {SREG: I | Z}, 1),
    Case("set", [0x9468], {}, {SREG: I | T}, 1),
    Case("bst r5, 6 of 1", [0xFA56], {5: 0x40}, {SREG: I | T}, 1),
    Case("bst r5, 6 of 0", [0xFA56], {5: 0xBF, SREG: I | T | C}, {SREG: I | C}, 1),
    Case("bld r5, 6 of 1", [0xF856], {5: 0x01, SREG: I | T}, {5: 0x41}, 1),
    Case("bld r5, 6 of 0", [0xF856], {5: 0xFF}, {5: 0xBF}, 1),
    # skips: over nothing, one word, two words
    Case("sbic 0x11, 3 of 1", [0x998B, 0], {0x31: 0x08}, {}, 1),
    Case("sbic 0x11, 3 of 0", [0x998B, 0], {0x31: 0xF7}, {}, 2, 2),
    Case("sbis 0x11, 3 of 0", [0x9B8B, 0], {0x31: 0xF7}, {}, 1),
    Case("sbis 0x11, 3 of 1", [0x9B8B, 0], {0x31: 0x08}, {}, 2, 2),
    Case("sbrc r5, 3 of 0 before lds", [0xFC53, 0x9050, 0], {5: 0xF7}, {}, 3, 3),
    Case("sbrc r5, 3 of 1", [0xFC53, 0], {5: 0x08}, {}, 1),
    Case("sbrs r5, 3 of 1 before sts", [0xFE53, 0x9250, 0], {5: 0x08}, {}, 3, 3),
    Case("sbrs r5, 3 of 0", [0xFE53, 0], {5: 0xF7}, {}, 1),
    Case("cpse r5, r17 alike before jmp", [0x1251, 0x940D, 0], {5: 9, 17: 9}, {}, 3, 3),
    Case("cpse r5, r17 alike before call", [0x1251, 0x940F, 0], {5: 9, 17: 9}, {}, 3, 3),
    Case("cpse r5, r17 alike before rjmp", [0x1251, 0xCFFF], {5: 9, 17: 9}, {}, 2, 2),
    Case("cpse r5, r17 different", [0x1251, 0], {5: 9, 17: 8}, {}, 1),
    # jumps
    Case("brcs .+4 taken", [0xF010], {SREG: I | C}, {}, 2, 3),
    Case("brcs .+4 not taken", [0xF010], {SREG: I | Z | N}, {}, 1),
    Case("brne .-4 taken", [0xF7F1], {SREG: I | C}, {}, 2, -1),
    Case("brne .-4 not taken", [0xF7F1], {SREG: I | Z}, {}, 1),
    Case("rjmp .+6", [0xC003], {}, {}, 2, 4),
    Case("rjmp .-6", [0xCFFD], {}, {}, 2, -2),
    Case("nop", [0x0000], {}, {}, 1),
    Case("break", [0x9598], {}, {}, 1),
    Case("wdr", [0x95A8], {}, {}, 1),
    # tables in flash: the bytes of 0x4321 are at the byte addresses 0x200 and 0x10200
    Case("lpm", [0x95C8], {**wide(ZZ, 0x200), RAMPZ: 1}, {0: 0x21}, 3),
    Case("lpm r5, Z", [0x9054], wide(ZZ, 0x201), {5: 0x43}, 3),
    Case("lpm r5, Z+", [0x9055], wide(ZZ, 0x200), {5: 0x21, **wide(ZZ, 0x201)}, 3),
    Case("elpm", [0x95D8], {**wide(ZZ, 0x200), RAMPZ: 1}, {0: 0x65}, 3),
    Case("elpm r5, Z", [0x9056], {**wide(ZZ, 0x201), RAMPZ: 1}, {5: 0x87}, 3),
    Case("elpm r5, Z+", [0x9057], {**wide(ZZ, 0xFFFF), RAMPZ: 0}, {5: 0xFF, **wide(ZZ, 0), RAMPZ: 1}, 3),
]  # fmt: skip


@pytest.fixture(scope="module")
def chip(tmp_path_factory: pytest.TempPathFactory) -> Atmega2560:
    """All instructions in flash, and two tables."""
    # interrupts on at first, since the test goes in from the main program
    words = {0: [0x9478, 0xCFFF], 0x100: [0x4321], 0x8100: [0x8765]}
    words |= {AT + APART * k: case.words for k, case in enumerate(CASES)}
    words |= {FAR: [0x940E, AT], FAR + 8: [0xD003], FAR + 16: [0x9509], FAR + 24: [0x9519], FAR + 32: [0x9508]}
    words |= {FAR + 40: [0x9518], FAR + 48: [0x940D, 0x2345], FAR + 56: [0x9419], FAR + 64: [0x9409]}
    return chip_with(tmp_path_factory.mktemp("flash"), words)


def stepped(chip: Atmega2560, at: int, before: Mapping[int, int]) -> tuple[int, int]:
    """One instruction at a word address: cycles, and the word address of the next."""
    for address in (*range(32), 0x22, RAMPZ, EIND):
        chip.poke(address, 0)
    chip.poke(SREG, I)
    chip.jump(2 * at)
    for address, value in {**wide(SPL, STACK), **before}.items():
        chip.poke(address, value)
    began = chip.cycles
    chip.run(1)
    spent = chip.cycles - began
    seen = chip.peek(SREG)
    chip.poke(SREG, seen | I)
    after = chip.jump(0) // 2
    chip.poke(SREG, seen)
    return spent, after


@pytest.mark.parametrize("case", CASES, ids=[case.name for case in CASES])
def test_an_instruction_changes_what_the_manual_says_in_its_cycles(chip: Atmega2560, case: Case) -> None:
    at = AT + APART * CASES.index(case)
    untouched = dict.fromkeys(range(32), 0) | {SREG: I, **wide(SPL, STACK)}
    expected = untouched | dict(case.before) | dict(case.after)
    assert stepped(chip, at, case.before) == (case.cycles, at + (1 if case.moved is None else case.moved))
    assert {address: chip.peek(address) for address in expected} == expected


FAR = 0x12000
"""A place beyond 64 K words: three bytes of it go on the stack, the lowest first."""


@pytest.mark.parametrize(
    ("at", "words", "to", "cycles"),
    [
        (FAR, 2, AT, 5), (FAR + 8, 1, FAR + 8 + 4, 4), (FAR + 16, 1, 0x0345, 4), (FAR + 24, 1, 0x10345, 4),
    ],
    ids=["call", "rcall", "icall", "eicall"],
)  # fmt: skip
def test_a_call_leaves_where_to_return_to(chip: Atmega2560, at: int, words: int, to: int, cycles: int) -> None:
    assert stepped(chip, at, {**wide(ZZ, 0x0345), EIND: 1}) == (cycles, to)
    back = at + words
    assert [chip.peek(STACK - k) for k in range(3)] == [back & 0xFF, back >> 8 & 0xFF, back >> 16]
    assert chip.peek(SPL) | chip.peek(SPL + 1) << 8 == STACK - 3


@pytest.mark.parametrize(("at", "sreg"), [(FAR + 32, Z), (FAR + 40, I | Z)], ids=["ret", "reti"])
def test_a_return_goes_to_the_three_bytes_on_the_stack_and_from_an_interrupt_sets_its_flag(
    chip: Atmega2560, at: int, sreg: int
) -> None:
    spent, after = stepped(chip, at, {SREG: Z, STACK + 1: 0x01, STACK + 2: 0x23, STACK + 3: 0x45})
    assert (spent, after) == (5, 0x12345)
    assert chip.peek(SPL) | chip.peek(SPL + 1) << 8 == STACK + 3
    assert chip.peek(SREG) == sreg


@pytest.mark.parametrize(
    ("at", "to", "cycles"),
    [(FAR + 48, 0x12345, 3), (FAR + 56, 0x10345, 2), (FAR + 64, 0x0345, 2)],
    ids=["jmp", "eijmp", "ijmp"],
)
def test_a_far_jump_reaches_all_of_flash(chip: Atmega2560, at: int, to: int, cycles: int) -> None:
    assert stepped(chip, at, {**wide(ZZ, 0x0345), EIND: 1}) == (cycles, to)


def test_an_arithmetic_program_has_the_result_and_the_cycles_that_it_has_on_simavr() -> None:
    """All flags, soft float and 64-bit division hashed, as simavr 1.6 runs `programs/arithmetic.c`."""
    chip = Atmega2560(Path(__file__).parent / "programs" / "arithmetic.hex")
    chip.run(20_000_000, until_sent=True)
    assert chip.cycles - 160 == pytest.approx(15_058_987, abs=2)
    chip.run(1600)
    assert chip.read().hex() == "391d86a9"
