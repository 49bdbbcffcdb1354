"""The motor board on simavr, an emulator independent of ours. Build first: `make -C tests/firmware`."""

from __future__ import annotations

import ctypes
from pathlib import Path

import numpy as np

LIBRARY = Path(__file__).parents[2] / "build" / "firmware" / "libsimavr_board.so"
EVENT = np.dtype([("cycle", "<u8"), ("port", "u1"), ("value", "u1"), ("unused", "V6")])
SIGNATURES: dict[str, tuple[object, list[object]]] = {
    "new": (ctypes.c_void_p, [ctypes.c_char_p, ctypes.c_uint32, ctypes.c_int]),
    "run": (ctypes.c_int, [ctypes.c_void_p, ctypes.c_uint64]),
    "write": (None, [ctypes.c_void_p, ctypes.c_char_p, ctypes.c_size_t]),
    "sent": (ctypes.c_size_t, [ctypes.c_void_p]),
    "take_sent": (None, [ctypes.c_void_p, ctypes.c_char_p]),
    "event_count": (ctypes.c_size_t, [ctypes.c_void_p]),
    "take_events": (None, [ctypes.c_void_p, ctypes.c_void_p]),
    "cycles": (ctypes.c_uint64, [ctypes.c_void_p]),
    "port": (ctypes.c_uint8, [ctypes.c_void_p, ctypes.c_uint8]),
    "drive": (None, [ctypes.c_void_p, ctypes.c_uint8, ctypes.c_int, ctypes.c_int]),
    "jump": (ctypes.c_uint32, [ctypes.c_void_p, ctypes.c_uint32]),
    "poke": (None, [ctypes.c_void_p, ctypes.c_uint16, ctypes.c_uint8]),
    "set_baud": (None, [ctypes.c_void_p, ctypes.c_uint32]),
    "reset": (None, [ctypes.c_void_p]),
    "free": (None, [ctypes.c_void_p]),
}


def _library() -> ctypes.CDLL:
    library = ctypes.CDLL(str(LIBRARY))
    for name, (result, arguments) in SIGNATURES.items():
        function = getattr(library, f"board_{name}")
        function.restype, function.argtypes = result, arguments
    return library


class SimavrBoard:
    """An ATmega2560 at 16 MHz running one Intel hex image in virtual time, its inputs closed to GND."""

    def __init__(self, image: Path, baud: int = 250_000, start_in_bootloader: bool = False) -> None:
        self._lib = _library()
        self._board = self._lib.board_new(str(image).encode(), baud, start_in_bootloader)
        if not self._board:
            raise ValueError(f"{image} is no Intel hex image")
        for port, bit in (("G", 0), *(("L", bit) for bit in range(4))):
            self.drive(port, bit, False)

    @property
    def cycles(self) -> int:
        """Clock cycles (62.5 ns) since power came on."""
        return int(self._lib.board_cycles(self._board))

    def run(self, cycles: int) -> None:
        """Run at least `cycles`, some instructions more at most. RuntimeError where the program crashed the chip."""
        if self._lib.board_run(self._board, cycles):
            raise RuntimeError("the chip crashed or went to sleep for ever")

    def write(self, data: bytes) -> None:
        """Queue bytes at the receive pin; they arrive one per ten bits of the line's baud rate."""
        self._lib.board_write(self._board, data, len(data))

    def read(self) -> bytes:
        """Return all bytes sent since the last call."""
        out = ctypes.create_string_buffer(self._lib.board_sent(self._board))
        self._lib.board_take_sent(self._board, out)
        return out.raw

    def pin(self, port: str, bit: int) -> bool:
        """Return the level of a pin of port A, C or F."""
        return bool(self._lib.board_port(self._board, ord(port)) >> bit & 1)

    def drive(self, port: str, bit: int, level: bool) -> None:
        """Put an outside level on an input pin."""
        self._lib.board_drive(self._board, ord(port), bit, level)

    def events(self) -> np.ndarray:
        """Return the changes of ports A, C and F since the last call: cycle, port letter, new value."""
        out = np.empty(self._lib.board_event_count(self._board), EVENT)
        self._lib.board_take_events(self._board, out.ctypes.data)
        return out[["cycle", "port", "value"]]

    def jump(self, address: int) -> int:
        """Send the main program (not an interrupt) on from this byte address of the flash; return where it was."""
        return int(self._lib.board_jump(self._board, address))

    def set_baud(self, baud: int) -> None:
        """Let the host write at another baud rate from here on."""
        self._lib.board_set_baud(self._board, baud)

    def poke(self, address: int, value: int) -> None:
        """Write one byte of data memory."""
        self._lib.board_poke(self._board, address, value)

    def reset(self) -> None:
        """Press the reset button: memory survives."""
        self._lib.board_reset(self._board)

    def close(self) -> None:
        """Free the emulator's memory."""
        if self._board:
            self._lib.board_free(self._board)
        self._board = None
