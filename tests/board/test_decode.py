"""Words as avr-as assembles them are decoded to their operation and operands."""

from __future__ import annotations

import numpy as np
import pytest

from wristctl.board.emulator.chip import CONSTANTS, FLASH_BYTES, FLASH_WORDS
from wristctl.board.emulator.instructions import Op
from wristctl.board.emulator.program import decode

K = CONSTANTS
"""Where the number 0 lies: an immediate operand is read like a register."""

DECODED = [
    ("mov r5, r17", [0x2E51], Op.MOV, 5, 17),
    ("add r31, r2", [0x0DF2], Op.ADD, 31, 2),
    ("movw r30, r16", [0x01F8], Op.MOVW, 30, 16),
    ("mul r5, r17", [0x9E51], Op.MUL, 5, 17),
    ("muls r16, r31", [0x020F], Op.MULS, 16, 31),
    ("mulsu r17, r22", [0x0316], Op.MULSU, 17, 22),
    ("fmul r17, r22", [0x031E], Op.FMUL, 17, 22),
    ("fmuls r17, r22", [0x0396], Op.FMULS, 17, 22),
    ("fmulsu r17, r22", [0x039E], Op.FMULSU, 17, 22),
    ("ldi r20, 0xA5", [0xEA45], Op.MOV, 20, K + 0xA5),
    ("cpi r31, 0x5A", [0x35FA], Op.CP, 31, K + 0x5A),
    ("subi r20, 1", [0x5041], Op.SUB, 20, K + 1),
    ("sbci r20, 1", [0x4041], Op.SBC, 20, K + 1),
    ("ori r20, 0x0F", [0x604F], Op.OR, 20, K + 0x0F),
    ("andi r20, 0x0F", [0x704F], Op.AND, 20, K + 0x0F),
    ("adiw r26, 63", [0x96DF], Op.ADIW, 26, 63),
    ("adiw r24, 1", [0x9601], Op.ADIW, 24, 1),
    ("sbiw r30, 63", [0x97FF], Op.SBIW, 30, 63),
    ("ld r5, X", [0x905C], Op.LOAD, 5, 26),
    ("ld r5, -Y", [0x905A], Op.LOAD_DEC, 5, 28),
    ("ld r5, Z+", [0x9051], Op.LOAD_INC, 5, 30),
    ("ldd r5, Y+63", [0xAC5F], Op.LOAD, 5, 28 + (63 << 5)),
    ("ldd r5, Z+33", [0xA051], Op.LOAD, 5, 30 + (33 << 5)),
    ("ld r5, Y", [0x8058], Op.LOAD, 5, 28),
    ("std Y+41, r5", [0xA659], Op.STORE, 5, 28 + (41 << 5)),
    ("std Z+1, r5", [0x8251], Op.STORE, 5, 30 + (1 << 5)),
    ("st X+, r5", [0x925D], Op.STORE_INC, 5, 26),
    ("st -Z, r5", [0x9252], Op.STORE_DEC, 5, 30),
    ("lds r5, 0x0321", [0x9050, 0x0321], Op.LDS, 5, 0x0321),
    ("sts 0x0321, r5", [0x9250, 0x0321], Op.STS, 5, 0x0321),
    ("in r5, 0x2B", [0xB45B], Op.IN, 5, 0x4B),
    ("out 0x2B, r5", [0xBC5B], Op.OUT, 5, 0x4B),
    ("sbi 0x02, 7", [0x9A17], Op.SBI, 0x22, 0x80),
    ("cbi 0x02, 0", [0x9810], Op.CBI, 0x22, 0x01),
    ("sbic 0x11, 3", [0x998B], Op.SBIC, 0x31, 0x08),
    ("sbrs r5, 3", [0xFE53], Op.SBRS, 5, 0x08),
    ("bst r5, 6", [0xFA56], Op.BST, 5, 0x40),
    ("bld r5, 6", [0xF856], Op.BLD, 5, 0x40),
    ("brcs .+4", [0xF010], Op.BRBS, 0x01, 2),
    ("brne .-4", [0xF7F1], Op.BRBC, 0x02, -2),
    ("brne .+126", [0xF5F9], Op.BRBC, 0x02, 63),
    ("brne .-128", [0xF601], Op.BRBC, 0x02, -64),
    ("rjmp .-2", [0xCFFF], Op.RJMP, -1, 0),
    ("rjmp .+4094", [0xC7FF], Op.RJMP, 2047, 0),
    ("rcall .-4096", [0xD800], Op.RCALL, -2048, 0),
    ("jmp 0x2468A", [0x940D, 0x2345], Op.JMP, 0x12345, 0),
    ("call 0x2468A", [0x940F, 0x2345], Op.CALL, 0x12345, 0),
    ("sei", [0x9478], Op.BSET, 0x80, 0),
    ("clt", [0x94E8], Op.BCLR, 0x40, 0),
    ("lpm", [0x95C8], Op.LPM, 0, 0),
    ("elpm r5, Z+", [0x9057], Op.ELPM_INC, 5, 0),
    ("break", [0x9598], Op.NOP, 0, 0),
    ("no instruction", [0xFFFF], Op.ILLEGAL, 0, 0),
    ("no instruction", [0x9404], Op.ILLEGAL, 0, 0),
]


def decoded(words: list[int], at: int = 0) -> list[tuple[int, ...]]:
    flash, program = np.full(FLASH_BYTES, 0xFF, np.uint8), np.zeros((FLASH_WORDS, 3), np.int32)
    flash.view("<u2")[at : at + len(words)] = words
    decode(flash, program, at, len(words))
    return [tuple(map(int, row)) for row in program[at : at + len(words)]]


@pytest.mark.parametrize(("_", "words", "operation", "first", "second"), DECODED, ids=[each[0] for each in DECODED])
def test_a_word_means_its_operation_and_operands(
    _: str, words: list[int], operation: Op, first: int, second: int
) -> None:
    assert decoded(words)[0] == (operation, first, second)


def test_the_word_behind_the_last_one_of_flash_is_erased_flash() -> None:
    assert decoded([0x9050], at=FLASH_WORDS - 1) == [(Op.LDS, 5, 0xFFFF)]


def test_only_the_rows_asked_for_are_decoded_with_the_word_behind_them() -> None:
    flash, program = np.zeros(FLASH_BYTES, np.uint8), np.full((FLASH_WORDS, 3), -1, np.int32)
    flash.view("<u2")[10:13] = [0x9050, 0x0321, 0x2E51]
    decode(flash, program, 10, 1)
    assert program[10].tolist() == [Op.LDS, 5, 0x0321]
    assert (program[:10] == -1).all() and (program[11:] == -1).all()
