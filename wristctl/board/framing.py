"""Frames on the wire: `00 | COBS(code, sequence, payload, CRC) | 00`.

COBS (Cheshire and Baker, 1999) keeps zeros out of a frame, so that a zero always begins a new one; the leading zero
ends whatever a cut-off frame has left behind. The CRC is CRC-16/CCITT-FALSE, high byte first.
"""

from binascii import crc_hqx
from typing import NamedTuple

# Bytes that code, sequence, payload and CRC may have together.
LONGEST = 254


class WireFrame(NamedTuple):
    """One message."""

    code: int
    sequence: int
    payload: bytes


def encode(code: int, sequence: int, payload: bytes = b"") -> bytes:
    """The bytes of one frame, both zeros among them. ValueError for a payload that is too long."""
    body = bytes((code, sequence)) + payload
    body += crc(body).to_bytes(2, "big")
    if len(body) > LONGEST:
        raise ValueError(f"a payload of {len(payload)} bytes, at most {LONGEST - 4}")
    return b"\0" + stuff(body) + b"\0"


def crc(data: bytes) -> int:
    """CRC-16/CCITT-FALSE."""
    return crc_hqx(data, 0xFFFF)


def stuff(data: bytes) -> bytes:
    """COBS of at most LONGEST bytes: each run of bytes without zero behind its length plus one."""
    out = bytearray()
    for run in data.split(b"\0"):
        out.append(len(run) + 1)
        out += run
    return bytes(out)


def unstuff(data: bytes) -> bytes:
    """The bytes that `stuff` was given. ValueError where that cannot be."""
    out, position = bytearray(), 0
    while position < len(data):
        end = position + data[position]
        if data[position] == 0 or end > len(data):
            raise ValueError("not COBS")
        out += data[position + 1 : end]
        if end < len(data) and data[position] != 0xFF:
            out.append(0)
        position = end
    return bytes(out)


class Decoder:
    """Takes bytes as they come and gives whole frames; counts what was none."""

    def __init__(self) -> None:
        self.bad_frames = self.bad_crc = 0
        self._part = bytearray()

    def feed(self, data: bytes) -> list[WireFrame]:
        """The frames that these bytes complete."""
        *pieces, remainder = (bytes(self._part) + data).split(b"\0")
        self._part[:] = remainder[-2 * LONGEST :]
        return [frame for piece in pieces if piece and (frame := self._frame(piece))]

    def _frame(self, stuffed: bytes) -> WireFrame | None:
        try:
            body = unstuff(stuffed)
        except ValueError:
            body = b""
        if len(body) < 4:
            self.bad_frames += 1
            return None
        if crc(body[:-2]) != int.from_bytes(body[-2:], "big"):
            self.bad_crc += 1
            return None
        return WireFrame(body[0], body[1], body[2:-2])
