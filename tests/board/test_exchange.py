"""Commands and answers on a wire that a test answers: what is counted, timed, sent again and given up."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from wristctl.board.board_errors import NoAnswer
from wristctl.board.driver import Exchange
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
