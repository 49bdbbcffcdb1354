"""One command and its answer: sent again until answered, and counted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from wristctl.board.board_errors import NoAnswer
from wristctl.board.framing import Decoder, encode
from wristctl.board.messages import FEEDS_WATCHDOG, Command
from wristctl.board.transport import Transport

_ANSWER = 0x80

Overheard = Callable[[float, str, bytes], None]
"""Takes the time [s], the way (sent or came) and the bytes that went over the wire then; never raises."""


def nobody(time: float, way: str, data: bytes) -> None:
    """Overhears nothing."""


@dataclass
class Traffic:
    """What the driver has seen on the wire since it was made."""

    sent: int = 0
    resent: int = 0
    answers: int = 0
    stale: int = 0  # answers that came after the command had been sent again, or to nobody
    bytes_read: int = 0


class Exchange:
    """Commands and answers in turn over a transport."""

    def __init__(self, transport: Transport, overheard: Overheard = nobody) -> None:
        self.transport, self._overheard = transport, overheard
        self.traffic = Traffic()
        self.round_trip = 0.0
        """Seconds from the last command to its answer."""
        self.silence = 0.0
        """Seconds for which no command fed the board's watchdog: before the last that did, or since then, whichever is
        longer."""
        self._decoder = Decoder()
        self._sequence = 0
        self._last_fed = 0.0

    @property
    def bad_frames(self) -> int:
        """Pieces that came from the board and were no frame, or had a wrong CRC."""
        return self._decoder.bad_frames + self._decoder.bad_crc

    def ask(self, command: Command, payload: bytes, patience: float, attempts: int) -> bytes:
        """Result and payload of the answer, each attempt waited for `patience` seconds. Raises NoAnswer."""
        self._sequence = (self._sequence + 1) & 0xFF
        frame, seen, began = (
            encode(command, self._sequence, payload),
            self.traffic.bytes_read,
            self.transport.now(),
        )
        gap = began - self._last_fed if self._last_fed else 0.0
        self.silence = gap if command in FEEDS_WATCHDOG else max(gap, self.silence)
        for attempt in range(attempts):
            self._overheard(self.transport.now(), "sent", frame)
            self.transport.write(frame)
            self.traffic.sent += 1
            self.traffic.resent += attempt > 0
            if (answer := self._answer(command, self.transport.now() + patience)) is not None:
                self.round_trip = self.transport.now() - began
                if command in FEEDS_WATCHDOG:
                    self._last_fed = began
                return answer
        overslept = self.transport.now() - began - attempts * patience
        raise NoAnswer(self.transport.name, command, attempts, self.traffic.bytes_read - seen, overslept)

    def _answer(self, command: Command, deadline: float) -> bytes | None:
        found = None
        while found is None and (left := deadline - self.transport.now()) > 0:
            data = self.transport.read(left)
            self.traffic.bytes_read += len(data)
            if data:
                self._overheard(self.transport.now(), "came", data)
            for frame in self._decoder.feed(data):
                if (
                    found is None
                    and (frame.code, frame.sequence) == (command | _ANSWER, self._sequence)
                    and frame.payload
                ):
                    found = frame.payload
                    self.traffic.answers += 1
                else:
                    self.traffic.stale += 1
        return found
