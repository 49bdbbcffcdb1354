"""Which interrupt is next, in the order of the vectors (data sheet, table 14-1)."""

from __future__ import annotations

import numpy as np

from wristctl.board.emulator.chip import Chip
from wristctl.board.emulator.timers import TIFR, TIMERS, UNITS
from wristctl.board.emulator.usart import RXC, TXC, UCSRA, UCSRB, UDRE
from wristctl.board.emulator.watchdog import WDIE, WDIF, WDTCSR, watchdog_served
from wristctl.lanes.compiled import compiled

_TIMSK = 0x6E
_COMPARE_A = (21, 17, 13, 32, 42, 47)
"""Vector of the first compare unit of each timer; its other units and its overflow follow."""

_WATCHDOG_VECTOR = 12


def _sources() -> list[tuple[int, int, int, int, int, bool]]:
    """Vector, address and bit of the flag, address and bit of the enable, whether serving it clears the flag."""
    rows = [
        (_WATCHDOG_VECTOR, WDTCSR, WDIF, WDTCSR, WDIE, False),
        (25, UCSRA, RXC, UCSRB, RXC, False),
        (26, UCSRA, UDRE, UCSRB, UDRE, False),
        (27, UCSRA, TXC, UCSRB, TXC, True),
    ]
    for k, first in enumerate(_COMPARE_A):
        bits = [2 << unit for unit in range(TIMERS[k, UNITS])] + [1]
        rows += [(first + n, int(TIMERS[k, TIFR]), bit, _TIMSK + k, bit, True) for n, bit in enumerate(bits)]
    return sorted(rows)


_VECTOR, _FLAGS, _FLAG, _ENABLES, _ENABLE, _CLEARS = range(6)
_SOURCES = np.array(_sources(), np.int64)


@compiled
def take_interrupt(chip: Chip) -> int:
    """The first vector that is flagged and enabled, its flag cleared as the chip clears it; 0 if there is none."""
    memory = chip.memory
    for n in range(len(_SOURCES)):
        source = _SOURCES[n]
        if memory[source[_FLAGS]] & source[_FLAG] and memory[source[_ENABLES]] & source[_ENABLE]:
            if source[_CLEARS]:
                memory[source[_FLAGS]] &= ~source[_FLAG]
            if source[_VECTOR] == _WATCHDOG_VECTOR:
                watchdog_served(chip)
            return source[_VECTOR]
    return 0
