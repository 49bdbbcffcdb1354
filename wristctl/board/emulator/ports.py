"""Ports A to L: output latches, inputs with pull-ups, and a record of every change of a latch."""

from __future__ import annotations

import numpy as np

from wristctl.board.emulator.chip import BUFFER_FULL, Chip
from wristctl.lanes.compiled import compiled, kernel

LETTERS = "ABCDEFGHJKL"
PIN = tuple(0x20 + 3 * p if p < 7 else 0x100 + 3 * (p - 7) for p in range(11))
"""Address of PINx; DDRx and PORTx follow it."""

_PIN, _LETTER = np.array(PIN), np.array([ord(letter) for letter in LETTERS])


@kernel
def levels(chip: Chip, port: int) -> int:
    """What reading PINx gives: outputs their latch, inputs what drives them, else their pull-up."""
    pin = _PIN[port]
    outputs, latch = chip.memory[pin + 1], chip.memory[pin + 2]
    driven, level = chip.inputs[port, 0], chip.inputs[port, 1]
    return (latch & outputs) | (((level & driven) | (latch & ~driven)) & ~outputs & 0xFF)


@compiled
def write_port(chip: Chip, port: int, address: int, value: int) -> None:
    """Write PINx (toggles the latch), DDRx or PORTx."""
    memory = chip.memory
    pin = _PIN[port]
    if address == pin + 1:
        memory[address] = value
        return
    latch = memory[pin + 2] ^ value if address == pin else value
    if latch != memory[pin + 2]:
        memory[pin + 2] = latch
        edge = chip.edges[chip.edge_count]
        edge[0], edge[1], edge[2] = chip.cycles, _LETTER[port], latch
        chip.edge_count += 1
        if chip.edge_count == len(chip.edges):
            chip.halt, chip.next = BUFFER_FULL, 0
