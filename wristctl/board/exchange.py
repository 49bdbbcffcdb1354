"""Commands and answers on the wire to a motor board: numbered, sent again, counted and timed."""

from collections import deque
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from wristctl.board.board_errors import NoAnswer
from wristctl.board.framing import Decoder, WireFrame, encode
from wristctl.board.layout import FEEDS_WATCHDOG
from wristctl.board.messages import ESTOP_SEQ, Command
from wristctl.board.transport import Transport

_ANSWER = 0x80

# Takes the time [s], the way (sent or came) and the bytes that went over the wire then; never raises.
Overheard = Callable[[float, str, bytes], None]


def nobody(time: float, way: str, data: bytes) -> None:
    """Overhears nothing."""


@dataclass
class Traffic:
    """Counts of the driver's traffic on the wire since it was made."""

    sent: int = 0
    resent: int = 0
    answers: int = 0
    stale: int = 0  # answers that came after the command had been sent again, or to nobody
    bytes_read: int = 0


class _Sent(NamedTuple):
    """A command that is on its way."""

    command: Command
    sequence: int
    began: float
    """When it was sent [s]."""
    bytes_before: int
    """Bytes that had been read by then."""
    stale_before: int
    """Answers that had come too late by then."""

    def is_answered_by(self, frame: WireFrame) -> bool:
        return (frame.code, frame.sequence) == (self.command | _ANSWER, self.sequence) and bool(frame.payload)


class Exchange:
    """Commands and answers over a transport: in turn, or a command posted while answers to others are on their way."""

    def __init__(self, transport: Transport, overheard: Overheard = nobody) -> None:
        self.transport, self._overheard = transport, overheard
        self.traffic = Traffic()
        """Counts of the traffic on the wire."""
        self.round_trip = 0.0
        """Seconds from the last command that was answered to its answer."""
        self.silence = 0.0
        """Seconds for which no command fed the board's watchdog: before the last that did, or since then, whichever is
        longer."""
        self._decoder, self._frames = Decoder(), deque[WireFrame]()
        self._sequence = 0
        self._last_fed = 0.0
        self._posted: deque[_Sent] = deque()

    @property
    def bad_frames(self) -> int:
        """Pieces that came from the board and were no frame, or had a wrong CRC."""
        return self._decoder.bad_frames + self._decoder.bad_crc

    def ask(self, command: Command, payload: bytes, patience: float, attempts: int) -> bytes:
        """Result and payload of the answer, each attempt waited for `patience` seconds. Raises NoAnswer.

        Commands are numbered in turn; an emergency stop has the number by which the board obeys it on its last byte.
        Answers to what was posted before count as stale.
        """
        self._posted.clear()
        frame, asked = self._numbered(command, payload)
        for attempt in range(attempts):
            self._write(frame)
            self.traffic.resent += attempt > 0
            if (answer := self._answer(asked, self.transport.now() + patience)) is not None:
                return answer
        overslept = self.transport.now() - asked.began - attempts * patience
        raise NoAnswer(self.transport.name, command, attempts, self._unread(asked), overslept)

    def post(self, command: Command, payload: bytes) -> float:
        """Send a command that the next of its kind repeats, and do not wait for the answer; when that was [s]."""
        frame, posted = self._numbered(command, payload)
        self._write(frame)
        self._posted.append(posted)
        return posted.began

    def arrived(self, until: float, patience: float) -> tuple[float, Command, bytes] | None:
        """The next answer to what was posted, if it comes by `until` [s]: when it was sent, which, result and payload.

        None where nothing is on its way, or does not come by then. Raises NoAnswer where nothing has come for
        `patience` seconds. A command that is passed over by the answer to a later one counts as sent again.
        """
        while self._posted:
            for frame in self._came(until):
                for number, posted in enumerate(self._posted):
                    if posted.is_answered_by(frame):
                        for _ in range(number + 1):
                            self._posted.popleft()
                        self.traffic.resent += number
                        self._answered(posted)
                        return posted.began, posted.command, frame.payload
                self.traffic.stale += 1
            oldest, now = self._posted[0], self.transport.now()
            if now - oldest.began > patience:
                raise NoAnswer(self.transport.name, oldest.command, len(self._posted), self._unread(oldest))
            if now >= until:
                return None
        return None

    def _numbered(self, command: Command, payload: bytes) -> tuple[bytes, _Sent]:
        self._sequence = ESTOP_SEQ if command is Command.ESTOP else (self._sequence + 1) & 0xFF
        began = self.transport.now()
        gap = began - self._last_fed if self._last_fed else 0.0
        self.silence = gap if command in FEEDS_WATCHDOG else max(gap, self.silence)
        asked = _Sent(command, self._sequence, began, self.traffic.bytes_read, self.traffic.stale)
        return encode(command, self._sequence, payload), asked

    def _unread(self, asked: _Sent) -> int:
        """Bytes that have come since a command and say nothing; none where answers came that were only too late."""
        late = self.traffic.stale > asked.stale_before
        return 0 if late else self.traffic.bytes_read - asked.bytes_before

    def _write(self, frame: bytes) -> None:
        self._overheard(self.transport.now(), "sent", frame)
        self.transport.write(frame)
        self.traffic.sent += 1

    def _answered(self, asked: _Sent) -> None:
        self.traffic.answers += 1
        self.round_trip = self.transport.now() - asked.began
        if asked.command in FEEDS_WATCHDOG:
            self._last_fed = asked.began

    def _answer(self, asked: _Sent, deadline: float) -> bytes | None:
        while self._frames or self.transport.now() < deadline:
            for frame in self._came(deadline):
                if asked.is_answered_by(frame):
                    self._answered(asked)
                    self.traffic.stale += len(self._frames)
                    self._frames.clear()
                    return frame.payload
                self.traffic.stale += 1
        return None

    def _came(self, until: float) -> Iterator[WireFrame]:
        """Frames that were here already, else those that come next, by `until` [s]."""
        if not self._frames:
            data = self.transport.read(max(0.0, until - self.transport.now()))
            self.traffic.bytes_read += len(data)
            if data:
                self._overheard(self.transport.now(), "came", data)
            self._frames.extend(self._decoder.feed(data))
        while self._frames:
            yield self._frames.popleft()
