"""The USB adapter between a host and the emulated board: when each side has the other's bytes."""

from collections import deque
from typing import NamedTuple

from wristctl.board.emulator.chip import FREQUENCY
from wristctl.config.bench import SerialLine

# Cycles of one frame of USB at full speed.
FRAME = FREQUENCY // 1000


class HandOver(NamedTuple):
    """When an adapter gives USB the bytes that it holds."""

    every: int
    """Cycles between two ticks of its timer, at which it does."""
    full: int
    """Number of bytes beyond which it does at once."""


def hand_over_of(line: SerialLine) -> HandOver:
    """Hand-over of the adapter of these settings.

    The program of a Mega's ATmega16U2 (arduino-usbserial) looks whether its 8-bit timer at 16 MHz/256 has overflowed,
    or more than 96 bytes wait. An FTDI chip has its latency timer, or a whole packet of 62 bytes. A CH340 packs what it
    has into the next frame, as Linux's driver sets it up.
    """
    if line.adapter == "16u2":
        return HandOver(256 * 256, 96)
    if line.adapter == "ftdi":
        return HandOver(round(line.latency_timer * FREQUENCY), 61)
    return HandOver(FRAME, 0)


class UsbAdapter:
    """Holds bytes on their way in both directions; all times are cycles of the board's clock.

    Whatever either side gives to USB reaches the other at the beginning of the next frame.
    """

    def __init__(self, hand_over: HandOver) -> None:
        self.hand_over = hand_over
        self.late = 0
        """Cycles by which all that the board says comes later."""
        self._held, self._looked = b"", 0
        self._to_host: deque[tuple[int, bytes]] = deque()
        self._to_board: deque[tuple[int, bytes]] = deque()

    def take_from_host(self, data: bytes, now: int) -> None:
        """Take what the host writes now."""
        if data:
            self._to_board.append((_next(now, FRAME), data))

    def give_board(self, now: int) -> bytes:
        """Give the bytes that have arrived at the board."""
        return _arrived(self._to_board, now)

    def take_from_board(self, data: bytes, now: int) -> None:
        """Take what the board has said since the last call. To be called at `next` at the latest."""
        self._held += data
        tick, before = now - now % self.hand_over.every, self._looked
        self._looked = now
        if self._held and (tick > before or len(self._held) > self.hand_over.full):
            given = tick if tick > before else now
            self._to_host.append((-(-given // FRAME) * FRAME + self.late, self._held))
            self._held = b""

    def give_host(self, now: int) -> bytes:
        """Give the bytes that have arrived at the host."""
        return _arrived(self._to_host, now)

    def next(self, now: int) -> int:
        """When something may happen next, after now."""
        coming = [queue[0][0] for queue in (self._to_host, self._to_board) if queue and queue[0][0] > now]
        return min([_next(now, self.hand_over.every), *coming])


def _next(now: int, every: int) -> int:
    return (now // every + 1) * every


def _arrived(queue: deque[tuple[int, bytes]], now: int) -> bytes:
    data = b""
    while queue and queue[0][0] <= now:
        data += queue.popleft()[1]
    return data
