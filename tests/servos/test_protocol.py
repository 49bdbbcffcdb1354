"""Packets of the emulated servos: the maker's published examples, and the maker's library as the oracle."""

from __future__ import annotations

from dynamixel_sdk import Protocol2PacketHandler
from hypothesis import example, given
from hypothesis import strategies as st

from wristctl.servos.emulated_servo import crc16, packet, packets_of
from wristctl.servos.servo_bus import packet_handler

# Examples of the e-manual's page of the protocol 2.0: ping of id 1 and its answer, read of 4 bytes at 132 and its.
PUBLISHED = {
    "FF FF FD 00 01 03 00 01 19 4E": (1, 0x01, ""),
    "FF FF FD 00 01 07 00 55 00 06 04 26 65 5D": (1, 0x55, "00 06 04 26"),
    "FF FF FD 00 01 07 00 02 84 00 04 00 1D 15": (1, 0x02, "84 00 04 00"),
    "FF FF FD 00 01 08 00 55 00 A6 00 00 00 8C C0": (1, 0x55, "00 A6 00 00 00"),
}

BODIES = st.binary(max_size=60) | st.lists(st.sampled_from([0xFF, 0xFD, 0x00]), max_size=60).map(bytes)


def test_published_packets_are_written_and_read() -> None:
    for text, (number, instruction, parameters) in PUBLISHED.items():
        data = bytes.fromhex(text)
        assert packet(number, instruction, bytes.fromhex(parameters)) == data
        assert list(packets_of(bytearray(data))) == [(number, instruction, bytes.fromhex(parameters))]


class _Wire:
    """A port that keeps what the SDK writes, and reads what it is given."""

    is_using = False

    def __init__(self, coming: bytes = b"") -> None:
        self.written, self.coming = b"", coming

    def clearPort(self) -> None:
        pass

    def writePort(self, data: list[int]) -> int:
        self.written += bytes(data)
        return len(data)

    def readPort(self, length: int) -> bytes:
        taken, self.coming = self.coming[:length], self.coming[length:]
        return taken

    def setPacketTimeout(self, length: int) -> None:
        pass

    def isPacketTimeout(self) -> bool:
        return not self.coming


@given(BODIES, st.integers(0, 252))
@example(b"\xff\xff\xfd\xff\xff\xfd\xfd", 7)
def test_the_makers_library_writes_the_same_bytes(body: bytes, number: int) -> None:
    wire = _Wire()
    packet_handler().writeTxOnly(wire, number, 0xFFFF, len(body), list(body))
    assert wire.written == packet(number, 3, b"\xff\xff" + body)
    assert list(packets_of(bytearray(wire.written))) == [(number, 3, b"\xff\xff" + body)]


@given(BODIES)
def test_the_makers_library_reads_what_servos_answer(body: bytes) -> None:
    data, result, error = packet_handler().readRx(_Wire(packet(9, 0x55, b"\x00" + body)), 9, len(body))
    assert (bytes(data), result, error) == (body, 0, 0)


@given(st.binary(min_size=1, max_size=40), st.data())
def test_a_spoilt_packet_is_none_and_the_next_one_is_read(body: bytes, data: st.DataObject) -> None:
    whole = bytearray(packet(3, 0x55, body))
    at = data.draw(st.integers(8, len(whole) - 1))
    whole[at] ^= 1 << data.draw(st.integers(0, 7))
    assert (3, 0x55, body) not in list(packets_of(whole))
    noise = bytearray(b"\x00\xff" + packet(4, 0x55, body) + packet(5, 1, b"")[:4])
    assert list(packets_of(noise)) == [(4, 0x55, body)] and bytes(noise) == packet(5, 1, b"")[:4]


@given(st.binary(max_size=80))
def test_the_crc_is_the_makers(data: bytes) -> None:
    assert crc16(data) == Protocol2PacketHandler().updateCRC(0, data, len(data))
