"""Commands and answers on a wire that a test answers: what is counted, timed, sent again and given up."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest

from wristctl.board.board_errors import NoAnswer
from wristctl.board.exchange import Exchange
from wristctl.board.framing import Decoder, WireFrame, encode
from wristctl.board.messages import Command

Answers = Callable[[WireFrame, int], bytes]


class Wire:
    """Answers the n-th frame that it gets as a test says, a millisecond later; without an answer time passes."""

    name, boot_time = "wire", 0.0

    def __init__(self, answers: Answers) -> None:
        self.answers, self.time, self.coming = answers, 5.0, b""
        self.frames: list[WireFrame] = []

    def write(self, data: bytes) -> None:
        for frame in Decoder().feed(data):
            self.frames.append(frame)
            self.coming += self.answers(frame, len(self.frames))

    def read(self, timeout: float) -> bytes:
        self.time += 0.001 if self.coming else timeout
        data, self.coming = self.coming, b""
        return data

    def now(self) -> float:
        return self.time

    def wait(self, seconds: float) -> None:
        self.time += seconds

    def close(self) -> None:
        """Nothing is open."""


def answer(frame: WireFrame, payload: bytes = b"\0", sequence: int = 0, code: int = 0) -> bytes:
    return encode((frame.code | 0x80) + code, (frame.sequence + sequence) & 0xFF, payload)


def test_an_answer_is_the_payload_of_the_frame_with_the_same_number_and_the_answers_bit() -> None:
    wire = Wire(
        lambda frame, n: answer(frame, b"wrong", sequence=1) + answer(frame, b"other", code=1) + answer(frame, b"right")
    )
    exchange = Exchange(wire)
    assert exchange.ask(Command.PING, b"say", 0.02, 3) == b"right"
    assert wire.frames == [WireFrame(Command.PING, 1, b"say")]
    traffic = exchange.traffic
    assert (traffic.sent, traffic.resent, traffic.answers, traffic.stale) == (1, 0, 1, 2)
    assert traffic.bytes_read == sum(len(answer(wire.frames[0], each)) for each in (b"wrong", b"other", b"right"))


def test_a_second_answer_and_one_without_a_payload_are_stale() -> None:
    exchange = Exchange(Wire(lambda frame, n: answer(frame, b"") + answer(frame) + answer(frame)))
    exchange.ask(Command.PING, b"", 0.02, 3)
    assert (exchange.traffic.answers, exchange.traffic.stale) == (1, 2)


def test_commands_are_numbered_and_begin_again_after_255() -> None:
    wire = Wire(lambda frame, n: answer(frame))
    exchange = Exchange(wire)
    for _ in range(300):
        exchange.ask(Command.PING, b"", 0.02, 3)
    assert [frame.sequence for frame in wire.frames] == [(k + 1) % 256 for k in range(300)]


def test_without_an_answer_it_is_sent_again_under_its_number_and_the_round_trip_counts_from_the_first() -> None:
    wire = Wire(lambda frame, n: answer(frame) if n == 3 else b"")
    exchange = Exchange(wire)
    exchange.ask(Command.PING, b"", 0.02, 3)
    assert [frame.sequence for frame in wire.frames] == [1, 1, 1]
    assert (exchange.traffic.sent, exchange.traffic.resent, exchange.traffic.answers) == (3, 2, 1)
    assert exchange.round_trip == pytest.approx(2 * 0.02 + 0.001)


def test_after_the_last_attempt_it_is_given_up_with_what_was_seen() -> None:
    wire = Wire(lambda frame, n: b"")
    with pytest.raises(NoAnswer, match="cable: no answer to PING after 2 attempts"):
        Exchange(wire).ask(Command.PING, b"", 0.02, 2)
    assert len(wire.frames) == 2 and wire.time == pytest.approx(5.04)
    garbled = Exchange(Wire(lambda frame, n: b"\0xyz\0"))
    for _ in range(2):
        with pytest.raises(NoAnswer, match=r"only garbled bytes \(\d+\) in answer to STATUS after 1 attempts") as told:
            garbled.ask(Command.STATUS, b"", 0.003, 1)
    assert f"({garbled.traffic.bytes_read // 2})" in str(told.value), "of this command alone"
    assert garbled.bad_frames >= 2


def test_answers_that_are_only_too_late_are_no_garbled_bytes() -> None:
    """A busy computer reads the answer to the command before: cable and firmware are not at fault."""
    late = Exchange(Wire(lambda frame, n: answer(frame, sequence=-1)))
    with pytest.raises(NoAnswer, match="no answer to STATUS after 2 attempts"):
        late.ask(Command.STATUS, b"", 0.003, 2)
    assert late.traffic.stale >= 1 and late.bad_frames == 0


def test_bad_frames_are_those_that_are_none_and_those_with_a_wrong_check_sum() -> None:
    spoilt = bytearray(answer(WireFrame(1, 1, b"")))
    spoilt[3] ^= 0x40
    exchange = Exchange(Wire(lambda frame, n: b"\0\x02a\0" + bytes(spoilt) + answer(frame)))
    exchange.ask(Command.PING, b"", 0.02, 1)
    assert exchange.bad_frames == 2


def test_silence_is_between_two_commands_that_feed_the_watchdog() -> None:
    wire = Wire(lambda frame, n: answer(frame))
    exchange = Exchange(wire)
    exchange.ask(Command.PING, b"", 0.02, 1)
    assert exchange.silence == 0.0
    wire.wait(0.5)
    exchange.ask(Command.STATUS, b"", 0.02, 1)  # does not feed it
    wire.wait(0.25)
    exchange.ask(Command.PING, b"", 0.02, 1)
    assert exchange.silence == pytest.approx(0.752)


def test_a_silent_host_is_silent_also_for_a_command_that_does_not_feed() -> None:
    """The board's fault is then noticed by STATUS, and the computer is to blame, not the cable."""
    wire = Wire(lambda frame, n: answer(frame))
    exchange = Exchange(wire)
    for _ in range(2):
        exchange.ask(Command.PING, b"", 0.02, 1)
    wire.wait(0.3)
    exchange.ask(Command.STATUS, b"", 0.02, 1)
    assert exchange.silence == pytest.approx(0.301)
    wire.wait(0.01)
    exchange.ask(Command.STATUS, b"", 0.02, 1)
    assert exchange.silence == pytest.approx(0.312)
    exchange.ask(Command.PING, b"", 0.02, 1)
    exchange.ask(Command.PING, b"", 0.02, 1)
    assert exchange.silence == pytest.approx(0.001)


@pytest.mark.parametrize(("sleeps", "blamed"), [(0.0, "cable"), (0.3, "host")])
def test_an_answer_that_the_computer_slept_through_is_not_the_cables_fault(sleeps: float, blamed: str) -> None:
    class Sleepy(Wire):
        def read(self, timeout: float) -> bytes:
            self.time += sleeps
            return super().read(timeout)

    with pytest.raises(NoAnswer) as lost:
        Exchange(Sleepy(lambda frame, n: b"")).ask(Command.PING, b"", 0.025, 3)
    assert lost.value.origin == blamed and ("slept" in lost.value.what) == bool(sleeps)


class Late(Wire):
    """Answers, each so long after its command as a test says; inf: never."""

    def __init__(self, delays: list[float]) -> None:
        super().__init__(lambda frame, n: b"")
        self.delays, self.due = delays, list[tuple[float, bytes]]()

    def write(self, data: bytes) -> None:
        for frame in Decoder().feed(data):
            self.due.append((self.time + self.delays[len(self.frames)], answer(frame, bytes([0, len(self.frames)]))))
            self.frames.append(frame)

    def read(self, timeout: float) -> bytes:
        first = min((time for time, _ in self.due), default=math.inf)
        self.time = max(self.time, min(self.time + timeout, first))
        came = [each for each in self.due if each[0] <= self.time]
        self.due = [each for each in self.due if each not in came]
        return b"".join(data for _, data in came)


def posted(delays: list[float]) -> tuple[Exchange, Late]:
    """Commands posted every 10 ms from 5.0 s on, the answers to which nobody has asked for."""
    wire = Late(delays)
    exchange = Exchange(wire)
    for k in range(len(delays)):
        wire.time = 5.0 + 0.01 * k
        assert exchange.post(Command.PING, b"") == wire.time
    return exchange, wire


def heard(exchange: Exchange, until: float) -> tuple[int, float] | None:
    """Number of the command whose answer comes by then, in milliseconds after 5 s when it was posted."""
    arrived = exchange.arrived(until, 0.1)
    if arrived is None:
        return None
    began, command, payload = arrived
    assert command is Command.PING
    return payload[1], round(1e3 * (began - 5.0), 9)


def test_answers_to_what_was_posted_come_in_turn_those_of_one_reading_too() -> None:
    exchange, wire = posted([0.025, 0.016, 0.012])
    assert heard(exchange, 5.02) is None and wire.time == 5.02, "none is there, and time is up"
    wire.time = 5.03
    assert heard(exchange, 5.04) == (0, 0.0) and wire.time == 5.03
    assert exchange.round_trip == pytest.approx(0.03)
    assert heard(exchange, 5.0) == (1, 10.0), "it had come with the first"
    assert heard(exchange, 6.0) == (2, 20.0) and wire.time == pytest.approx(5.032)
    assert heard(exchange, 9.0) is None and wire.time == pytest.approx(5.032), "nothing is on its way"
    traffic = exchange.traffic
    assert (traffic.sent, traffic.resent, traffic.answers, traffic.stale) == (3, 0, 3, 0)


def test_what_came_while_the_host_was_busy_is_read_though_time_is_up() -> None:
    exchange, wire = posted([0.002])
    wire.time = 5.3
    assert heard(exchange, 5.01) == (0, 0.0) and wire.time == 5.3


def test_a_command_that_the_answer_to_a_later_one_passes_over_counts_as_sent_again() -> None:
    exchange, _ = posted([math.inf, math.inf, 0.005])
    assert heard(exchange, 6.0) == (2, 20.0)
    assert (exchange.traffic.resent, exchange.traffic.answers) == (2, 1)


def test_posted_commands_without_any_answer_are_given_up_and_the_next_one_that_is_asked_begins_anew() -> None:
    exchange, wire = posted([math.inf, math.inf, 0.5])
    assert heard(exchange, 5.09) is None
    with pytest.raises(NoAnswer, match="cable: no answer to PING after 3 attempts"):
        heard(exchange, 5.11)
    wire.delays.append(0.001)
    wire.time = 5.6
    assert exchange.ask(Command.STATUS, b"", 0.02, 1) == b"\0\3" and exchange.traffic.stale == 1
    assert heard(exchange, 9.0) is None
