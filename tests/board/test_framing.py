"""Frames, against the `cobs` package and a bitwise CRC."""

from __future__ import annotations

import numpy as np
import pytest
from cobs import cobs
from hypothesis import given
from hypothesis import strategies as st

from wristctl.board.framing import LONGEST, Decoder, WireFrame, crc, encode, stuff, unstuff

BYTES = st.binary(max_size=LONGEST)
FRAMES = st.builds(WireFrame, st.integers(0, 255), st.integers(0, 255), st.binary(max_size=LONGEST - 4))


def crc_bit_by_bit(data: bytes) -> int:
    register = 0xFFFF
    for byte in data:
        for place in range(7, -1, -1):
            bit = (register >> 15) ^ (byte >> place & 1)
            register = (register << 1 & 0xFFFF) ^ 0x1021 * bit
    return register


@given(BYTES.filter(bool))
def test_stuffing_is_that_of_the_cobs_package(data: bytes) -> None:
    assert stuff(data) == cobs.encode(data)
    assert unstuff(stuff(data)) == data


@given(st.binary(min_size=1, max_size=LONGEST).filter(lambda data: 0 not in data))
def test_unstuffing_accepts_what_the_cobs_package_accepts(data: bytes) -> None:
    try:
        expected: bytes | None = cobs.decode(data)
    except cobs.DecodeError:
        expected = None
    try:
        found: bytes | None = unstuff(data)
    except ValueError:
        found = None
    assert found == expected


@given(BYTES)
def test_crc_is_ccitt_false(data: bytes) -> None:
    assert crc(data) == crc_bit_by_bit(data)


def test_crc_of_the_catalogues_check_string() -> None:
    assert crc(b"123456789") == 0x29B1


@given(st.lists(FRAMES, max_size=5), st.data())
def test_frames_come_through_in_whatever_pieces_they_arrive(frames: list[WireFrame], data: st.DataObject) -> None:
    stream = b"".join(encode(*frame) for frame in frames)
    cuts = sorted(data.draw(st.lists(st.integers(0, len(stream)), max_size=6)))
    decoder = Decoder()
    pieces = [stream[a:b] for a, b in zip([0, *cuts], [*cuts, len(stream)], strict=True)]
    assert [frame for piece in pieces for frame in decoder.feed(piece)] == frames
    assert decoder.bad_frames == decoder.bad_crc == 0


@given(st.binary(max_size=60), FRAMES)
def test_garbage_before_a_frame_does_not_swallow_it(garbage: bytes, frame: WireFrame) -> None:
    assert Decoder().feed(garbage + encode(*frame))[-1] == frame


def framing_bits(wire: bytes) -> set[tuple[int, int]]:
    """Places of a wired frame and bits whose flip changes where it ends or where its zeros are: its checksum may fit
    then, with a chance of 1 in 65,536."""
    at, bits = 1, {(k, wire[k].bit_length() - 1) for k in range(1, len(wire) - 1) if wire[k].bit_count() == 1}
    while at < len(wire) - 1:
        bits |= {(at, bit) for bit in range(8)}
        at += wire[at]
    return bits


@given(FRAMES, st.data())
def test_a_flipped_bit_never_gives_another_frame(frame: WireFrame, data: st.DataObject) -> None:
    wire = encode(*frame)
    bits = sorted({(k, bit) for k in range(1, len(wire) - 1) for bit in range(8)} - framing_bits(wire))
    decoder = Decoder()
    changed = bytearray(wire)
    at, bit = data.draw(st.sampled_from(bits))
    changed[at] ^= 1 << bit
    assert decoder.feed(bytes(changed)) == []
    assert decoder.bad_frames + decoder.bad_crc >= 1


def test_a_bit_that_is_flipped_in_the_framing_gives_another_frame_as_rarely_as_the_checksum_lets_one_through() -> None:
    rng, tried, passed = np.random.default_rng(0), 0, 0
    for _ in range(1500):
        wire = encode(int(rng.integers(256)), int(rng.integers(256)), rng.bytes(int(rng.integers(20))))
        for at, bit in framing_bits(wire):
            changed = bytearray(wire)
            changed[at] ^= 1 << bit
            tried, passed = tried + 1, passed + bool(Decoder().feed(bytes(changed)))
    assert tried > 10_000 and passed <= 4, "some 0.3 are expected of so many"


def test_an_endless_frame_does_not_fill_the_memory() -> None:
    decoder = Decoder()
    for _ in range(100):
        decoder.feed(b"\x55" * 1000)
    assert len(decoder._part) <= 2 * LONGEST


def test_the_longest_frame_goes_through_and_a_longer_one_is_refused() -> None:
    assert LONGEST == 254, "as long as COBS needs one byte more"
    longest = WireFrame(1, 2, bytes([7]) * (LONGEST - 4))
    assert Decoder().feed(encode(*longest)) == [longest]
    with pytest.raises(ValueError, match="a payload of 251 bytes, at most 250"):
        encode(1, 2, bytes(LONGEST - 3))


def test_each_piece_that_is_no_frame_is_counted_as_what_it_is() -> None:
    decoder = Decoder()
    good, spoilt = encode(1, 2, b"ab"), bytearray(encode(1, 2, b"ab"))
    spoilt[4] ^= 0x20
    assert decoder.feed(good + b"\0\0\0" + bytes(spoilt)) == [WireFrame(1, 2, b"ab")]
    assert (decoder.bad_frames, decoder.bad_crc) == (0, 1)
    decoder.feed(b"\0\x09a\0" + b"\0" + stuff(b"abc") + b"\0")
    assert (decoder.bad_frames, decoder.bad_crc) == (2, 1), "no COBS, and too short"
    assert decoder.feed(encode(9, 9)) == [WireFrame(9, 9, b"")], "four bytes are enough"


def test_a_frame_that_arrives_byte_by_byte_after_a_long_rest_is_whole() -> None:
    decoder, frame = Decoder(), WireFrame(3, 4, bytes(range(250)))
    found = [each for byte in encode(*frame) for each in decoder.feed(bytes([byte]))]
    assert found == [frame] and decoder.bad_frames == decoder.bad_crc == 0
