"""Where wanted bends come from: a UDP socket, or a stream of the lab streaming layer (LSL, extra `live`).

Both give datagrams as the socket has them, each with its sender, and nothing where none is waiting.
"""

import json
import socket
from typing import Any

from wristctl.errors import UserError

# What a setting has before the name of a stream.
STREAM = "lsl:"
# Bytes of the longest datagram.
LONGEST = 1024
# Seconds within which a stream must be found and answer; hundreds of its samples that wait for a reader at most.
_PATIENCE, _WAITING = 3.0, 1
# liblsl says on the error stream what it does: errors alone.
_QUIET = "[log]\nlevel = -2\n"


class Datagrams:
    """A UDP socket at HOST:PORT: its address, also in words, and whether no other computer can be its sender."""

    def __init__(self, listen: str) -> None:
        host, _, port = listen.rpartition(":")
        self._socket = socket.socket(socket.AF_INET6 if ":" in host else socket.AF_INET, socket.SOCK_DGRAM)
        try:
            self._socket.setblocking(False)
            self._socket.bind((host.strip("[]"), int(port)))
        except (OSError, OverflowError) as error:
            self._socket.close()
            fix = "end the program that listens there, or another HOST:PORT of this computer"
            reason = getattr(error, "strerror", None) or str(error)
            raise UserError(f"cannot listen at {listen}: {reason}", "reference.listen", fix) from error
        bound, number = self._socket.getsockname()[:2]
        self.address = f"{bound}:{number}"
        self.words, self.guarded = f"{self.address} (UDP)", bound.startswith(("127.", "::1"))

    def received(self) -> tuple[bytes, Any] | None:
        """The next datagram with its sender; None where none is waiting."""
        try:
            return self._socket.recvfrom(LONGEST + 1)
        except OSError:  # nothing more has come
            return None

    def close(self) -> None:
        """Give it back."""
        self._socket.close()


class LslStream:
    """An LSL stream of this name, whose channels are the wanted bend [deg] toward ulnar and toward flexion, or one.

    Each sample is as a datagram with the time of the sample, from the stream's own computer. Raises UserError without
    pylsl, and where no stream or more than one has the name.
    """

    guarded = False

    def __init__(self, name: str) -> None:
        try:
            import pylsl
            from pylsl.util import LostError, TimeoutError
        except (ImportError, RuntimeError) as error:  # pylsl raises RuntimeError where liblsl is not there
            fix = "pip install 'wristctl[live]', or a bridge to UDP"
            raise UserError("pylsl is not installed", "reference.listen", fix) from error
        if hasattr(pylsl, "set_config_content"):
            pylsl.set_config_content(_QUIET)
        found = pylsl.resolve_byprop("name", name, 1, _PATIENCE)
        if len(found) != 1:
            what = f"{len(found)} LSL streams are named {name!r}"
            fix = "start the sender first" if not found else "names of their own"
            raise UserError(what, "reference.listen", fix)
        (stream,) = found
        if stream.channel_format() == pylsl.cf_string:
            raise UserError(f"the LSL stream {name!r} is of texts", "reference.listen", "a stream of numbers [deg]")
        self.address, self.words = name, f"the LSL stream {name!r} of {stream.hostname()}"
        self._inlet = pylsl.StreamInlet(stream, max_buflen=_WAITING)
        try:
            self._inlet.open_stream(timeout=_PATIENCE)
        except (LostError, TimeoutError) as error:
            raise UserError(f"{self.words} does not answer", "reference.listen", "see its program") from error
        self._lost = LostError

    def received(self) -> tuple[bytes, Any] | None:
        """As of a socket; none of a stream that has ended."""
        try:
            sample, time = self._inlet.pull_sample(0.0)
        except self._lost:
            return None
        if sample is None:
            return None
        return json.dumps({"bend": sample if len(sample) > 1 else sample[0], "t": time}).encode(), self.address

    def close(self) -> None:
        """Give it back."""
        self._inlet.close_stream()


def source_of(listen: str) -> Datagrams | LslStream:
    """The source that a setting names, HOST:PORT or lsl:NAME. Raises UserError where it cannot be listened to."""
    return LslStream(listen.removeprefix(STREAM)) if listen.startswith(STREAM) else Datagrams(listen)
