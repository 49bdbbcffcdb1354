"""Results and flags of the arithmetic and logic instructions, by the manual's boolean formulas."""

from wristctl.board.emulator.instructions import Op
from wristctl.lanes.compiled import compiled

C, Z, N, V, S, H, T, I = (1 << bit for bit in range(8))  # noqa: E741 - the manual's name
KEEP = T | I


@compiled
def signs(result: int, overflow: int) -> int:
    """Flags N, V, S and Z of an 8-bit result; `overflow` is 0 or not."""
    negative, overflowed = result >> 7 & 1, 1 if overflow else 0
    zero = 1 if result == 0 else 0
    return zero * Z | negative * N | overflowed * V | (negative ^ overflowed) * S


@compiled
def two_operands(op: int, x: int, y: int, sreg: int) -> tuple[int, int]:
    """Result (of a comparison: the difference) and new SREG."""
    if op == Op.MOV:
        return y, sreg
    if op == Op.ADD or op == Op.ADC:
        result = (x + y + (sreg & C if op == Op.ADC else 0)) & 0xFF
        carries = (x & y) | (y & ~result) | (~result & x)
        overflow = ((x & y & ~result) | (~x & ~y & result)) & 0x80
        half = (carries >> 3 & 1) * H
        return result, (sreg & KEEP) | half | (carries >> 7 & 1) * C | signs(result, overflow)
    if op == Op.AND or op == Op.OR or op == Op.EOR:
        result = x & y if op == Op.AND else x | y if op == Op.OR else x ^ y
        return result, (sreg & (KEEP | H | C)) | signs(result, 0)
    through = op == Op.SBC or op == Op.CPC
    result = (x - y - (sreg & C if through else 0)) & 0xFF
    borrows = (~x & y) | (y & result) | (result & ~x)
    overflow = ((x & ~y & ~result) | (~x & y & result)) & 0x80
    flags = (borrows >> 3 & 1) * H | (borrows >> 7 & 1) * C | signs(result, overflow)
    if through:
        flags &= sreg | ~Z
    return result, (sreg & KEEP) | flags


@compiled
def one_operand(op: int, x: int, sreg: int) -> tuple[int, int]:
    """Result and new SREG."""
    if op == Op.SWAP:
        return (x << 4 | x >> 4) & 0xFF, sreg
    if op == Op.INC:
        result = (x + 1) & 0xFF
        return result, (sreg & (KEEP | H | C)) | signs(result, result == 0x80)
    if op == Op.DEC:
        result = (x - 1) & 0xFF
        return result, (sreg & (KEEP | H | C)) | signs(result, result == 0x7F)
    if op == Op.COM:
        result = 0xFF - x
        return result, (sreg & (KEEP | H)) | C | signs(result, 0)
    if op == Op.NEG:
        result = -x & 0xFF
        flags = ((result | x) >> 3 & 1) * H | (C if result else 0) | signs(result, result == 0x80)
        return result, (sreg & KEEP) | flags
    top = x & 0x80 if op == Op.ASR else (sreg & C) << 7 if op == Op.ROR else 0
    result = x >> 1 | top
    return result, (sreg & (KEEP | H)) | (x & C) | signs(result, (result >> 7) ^ (x & 1))


@compiled
def add_word(x: int, step: int, down: bool, sreg: int) -> tuple[int, int]:
    """ADIW, or SBIW if `down`: 16-bit result and new SREG."""
    result = (x - step if down else x + step) & 0xFFFF
    rose, fell = result & ~x & 0x8000, x & ~result & 0x8000
    carry, overflow = (rose, fell) if down else (fell, rose)
    flags = signs(result >> 8, overflow) & ~Z
    return result, (sreg & (KEEP | H)) | flags | (C if carry else 0) | (Z if result == 0 else 0)


@compiled
def multiply(op: int, x: int, y: int, sreg: int) -> tuple[int, int]:
    """16-bit product of MUL, MULS, MULSU, or doubled of FMUL, FMULS, FMULSU, and new SREG."""
    if op != Op.MUL and op != Op.FMUL:
        x -= (x & 0x80) << 1
    if op == Op.MULS or op == Op.FMULS:
        y -= (y & 0x80) << 1
    product = (x * y) & 0xFFFF
    carry = C if product & 0x8000 else 0
    if op == Op.FMUL or op == Op.FMULS or op == Op.FMULSU:
        product = product << 1 & 0xFFFF
    return product, (sreg & ~(C | Z)) | carry | (Z if product == 0 else 0)
