"""A rehearsal's bus behind a pseudo-terminal, in real time: any program that speaks to Dynamixel servos can open it."""

from __future__ import annotations

import threading
import time
from collections import deque
from types import TracebackType
from typing import Self

from wristctl.board.emulator.serve import PtyLine
from wristctl.servos.emulated import ServoRehearsal

# Longest wait for a byte [s].
_WAIT = 1e-3


class PseudoTerminal:
    """Within the block the bus is at `path`, and the simulated servos move as time passes.

    `lock` is held while they do.
    """

    def __init__(self, rehearsal: ServoRehearsal) -> None:
        self._rehearsal, self._ended, self._line = rehearsal, threading.Event(), PtyLine()
        self.path, self.lock = self._line.address, threading.Lock()
        self._thread = threading.Thread(target=self._serve, name="servo bus", daemon=True)

    def __enter__(self) -> Self:
        self._thread.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._ended.set()
        self._thread.join()
        self._line.close()

    def _serve(self) -> None:
        clock = self._rehearsal.clock
        began, coming = time.monotonic() - clock.now(), deque[tuple[float, bytes]]()
        while not self._ended.is_set():
            now = time.monotonic() - began
            with self.lock:
                clock.wait_until(now)
            while coming and coming[0][0] <= now:
                self._line.send(coming.popleft()[1])
            wait = min(_WAIT, max(0.0, coming[0][0] - now)) if coming else _WAIT
            self._line.wait(wait)
            if data := self._line.receive():  # also the last of a client that has gone
                with self.lock:
                    coming.extend(self._rehearsal.receive(data))
