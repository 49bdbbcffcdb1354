"""When the bytes of board and host are handed over by a USB adapter of each kind."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from wristctl.bench.faults import Faults
from wristctl.bench.usb_adapter import FRAME, HandOver, UsbAdapter, hand_over_of
from wristctl.bench.virtual_bench import BenchTransport
from wristctl.board.driver import Board
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.config.bench import SerialLine

MS = FREQUENCY // 1000


def delivered(usb: UsbAdapter, said: list[tuple[int, bytes]], until: int) -> list[tuple[int, bytes]]:
    """What comes to the host, and when, of what the board says at these times."""
    now, came, todo = 0, [], list(said)
    while now < until:
        now = min(usb.next(now), *(time for time, _ in todo), until)
        usb.take_from_board(b"".join(data for time, data in todo if time == now), now)
        todo = [(time, data) for time, data in todo if time > now] or [(until, b"")]
        if data := usb.give_host(now):
            came.append((now, data))
    return came


def test_a_megas_own_chip_hands_over_at_its_timers_overflow_and_the_next_frame_carries_it() -> None:
    usb = UsbAdapter(hand_over_of(SerialLine()))
    said = [(MS // 2, b"a"), (4 * MS, b"b"), (5 * MS, b"c"), (round(8.192 * MS), b"d"), (round(8.2 * MS), b"e")]
    came = delivered(usb, said, 20 * MS)
    assert [(now / MS, data) for now, data in came] == [(5.0, b"ab"), (9.0, b"cd"), (13.0, b"e")]


def test_more_bytes_than_it_likes_to_hold_go_at_once() -> None:
    usb = UsbAdapter(hand_over_of(SerialLine()))
    came = delivered(usb, [(MS // 4, 96 * b"x"), (MS // 2, b"y")], 6 * MS)
    assert [(now / MS, len(data)) for now, data in came] == [(1.0, 97)]


def test_an_ftdi_hands_over_at_its_latency_timer_and_a_ch340_in_each_frame() -> None:
    said = [(MS // 2, b"a"), (10 * MS, b"b"), (17 * MS, b"c")]
    ftdi = delivered(UsbAdapter(hand_over_of(SerialLine(adapter="ftdi"))), said, 40 * MS)
    assert [(now / MS, data) for now, data in ftdi] == [(16.0, b"ab"), (32.0, b"c")]
    quick = delivered(UsbAdapter(hand_over_of(SerialLine(adapter="ftdi", latency_timer=1e-3))), said, 40 * MS)
    assert [now / MS for now, _ in quick] == [1.0, 10.0, 17.0]
    ch340 = delivered(UsbAdapter(hand_over_of(SerialLine(adapter="ch340"))), said, 40 * MS)
    assert [(now / MS, data) for now, data in ch340] == [(1.0, b"a"), (10.0, b"b"), (17.0, b"c")]


@given(
    st.lists(st.tuples(st.integers(1, 60 * MS), st.binary(min_size=1, max_size=50)), max_size=12),
    st.sampled_from([HandOver(65_536, 96), HandOver(16 * MS, 61), HandOver(FRAME, 0)]),
)
def test_every_byte_comes_once_in_order_at_a_frame_and_none_is_held_for_longer_than_timer_and_frame(
    said: list[tuple[int, bytes]], hand_over: HandOver
) -> None:
    said = sorted(said, key=lambda pair: pair[0])
    came = delivered(UsbAdapter(hand_over), said, 100 * MS)
    assert b"".join(data for _, data in came) == b"".join(data for _, data in said)
    assert all(now % FRAME == 0 for now, _ in came)
    spoken = np.repeat([time for time, _ in said], [len(data) for _, data in said])
    heard = np.repeat([now for now, _ in came], [len(data) for _, data in came])
    assert np.all(heard >= spoken) and np.all(heard - spoken <= hand_over.every + FRAME)


def test_what_the_host_writes_reaches_the_board_with_the_next_frame() -> None:
    usb = UsbAdapter(hand_over_of(SerialLine()))
    usb.take_from_host(b"a", 3 * MS + 1)
    usb.take_from_host(b"b", 4 * MS)
    assert (
        usb.give_board(4 * MS - 1) == b"" and usb.give_board(4 * MS) == b"a" and usb.next(4 * MS) == round(4.096 * MS)
    )
    assert usb.give_board(5 * MS) == b"b"


@pytest.mark.parametrize(("adapter", "most"), [("ch340", 4.1), ("16u2", 8.2), ("ftdi", 20.1)])
def test_round_trips_through_an_adapter_take_what_its_timer_makes_them(adapter: Any, most: float) -> None:
    """A STATUS asked at any time: a frame, 7 bytes there, 42 bytes back, its timer and a frame."""
    wire = BenchTransport(Atmega2560(), Faults(()), SerialLine(adapter=adapter))
    board = Board(wire)
    board.connect()
    rng, trips = np.random.default_rng(1), []
    for _ in range(150):
        wire.wait(rng.uniform(0.0, 0.02))
        board.read()
        trips.append(1e3 * board.round_trip)
    assert 2.0 < min(trips) < 3.4 and most - 1.5 < max(trips) < most


def test_a_host_that_does_not_read_holds_nothing_up() -> None:
    usb = UsbAdapter(hand_over_of(SerialLine()))
    usb.take_from_board(b"a", 4 * MS)
    usb.take_from_board(b"", round(4.096 * MS))
    assert usb.next(round(4.096 * MS)) == 5 * MS
    assert usb.next(7 * MS) == round(8.192 * MS) and usb.give_host(7 * MS) == b"a"
