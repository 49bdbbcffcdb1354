"""Small programs for the emulated chip, as words in flash."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from wristctl.board.emulator import Atmega2560

RJMP_SELF, RJMP_BACK, SEI, NOP = 0xCFFF, 0xCFFE, 0x9478, 0x0000


def record(address: int, kind: int, payload: bytes) -> str:
    """A line of an Intel hex file."""
    body = bytes([len(payload)]) + address.to_bytes(2, "big") + bytes([kind]) + payload
    return ":" + (body + bytes([-sum(body) & 0xFF])).hex()


def chip_with(folder: Path, words: Mapping[int, Sequence[int]]) -> Atmega2560:
    """A chip whose flash holds these words, by word address."""
    lines = []
    for at, code in words.items():
        for k, word in enumerate(code):
            address = 2 * (at + k)
            lines.append(record(0, 4, (address >> 16).to_bytes(2, "big")))
            lines.append(record(address & 0xFFFF, 0, word.to_bytes(2, "little")))
    path = folder / "program.hex"
    path.write_text("\n".join([*lines, ":00000001FF"]))
    return Atmega2560(path)
