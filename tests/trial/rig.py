"""A rig without physics: a board that does at once what it is told, a marker that shows what a test says."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from wristctl.board.messages import AXES, Fault, Flag, State, Status
from wristctl.vision.marker import Sighting, SightingVerdict


class Clock:
    """Time passes while it is waited on."""

    name = "rig"

    def __init__(self, time: float = 100.0) -> None:
        self.time = time
        self.closed = False

    def now(self) -> float:
        return self.time

    def wait(self, seconds: float) -> None:
        self.time += seconds

    def close(self) -> None:
        self.closed = True


class RigBoard:
    """Keeps a list of what it was told; positions are those of `jog`, or what rates have added up to."""

    def __init__(self, start: Sequence[int] = (0,) * AXES) -> None:
        self.transport = Clock()
        self.position = np.array(start, float)
        self.sent = np.zeros(AXES)
        self.told: list[Any] = []
        self.state, self.faults, self.flags = State.ENABLED, Fault(0), Flag(0)
        self.round_trip = self.takes = 0.003
        self.posted = deque[tuple[float, Status]]()
        self.lost: set[int] = set()
        """Numbers of the rates, from 1 on, whose answers do not come."""
        self.pings: list[float] = []
        self.lapses = 0
        self.lives: list[float] = []
        self.traffic = SimpleNamespace(resent=0)
        self.hello: Any = SimpleNamespace(boot_nonce=7)
        self.cells = None

    def read(self) -> Status:
        position: Any = tuple(int(each) for each in np.rint(self.position))
        at, still = self.transport.now(), (0, 0, 0, 0)
        return Status(at, self.state, self.faults, self.flags, 0.1, position, still, self.lapses)

    def ping(self) -> None:
        self.pings.append(self.transport.now())

    def jog(self, positions: Sequence[int]) -> None:
        self.told.append(("jog", tuple(map(int, positions))))
        self.position[:] = positions

    def go_to(self, positions: Sequence[int], rate: int) -> Status:
        self.told.append(("go to", tuple(positions), rate))
        return self.read()

    def home(self, positions: Sequence[int] = (0,) * AXES) -> None:
        self.told.append(("home", tuple(positions)))

    def send(self, message: Any) -> None:
        self.told.append(message)

    def set_up(self, *messages: Any) -> None:
        self.told += messages

    def clear(self) -> None:
        self.told.append("clear")

    def enable(self) -> None:
        self.told.append("enable")

    def post_turn(self, rates: Sequence[float], life: float) -> tuple[tuple[float, ...], float]:
        """Take the rates over, and say later where the axes were by then."""
        self.lives.append(life)
        self.sent = np.rint(rates)
        self.told.append(("turn", tuple(rates)))
        if len(self.lives) not in self.lost:
            self.posted.append((self.transport.now(), self.read()))
        return tuple(float(each) for each in self.sent), self.transport.now()

    def answered(self, until: float) -> tuple[float, Status] | None:
        """What came, or comes by then."""
        if not self.posted:
            return None
        now, comes = self.transport.now(), self.posted[0][0] + self.takes
        self.transport.wait(max(0.0, min(comes, until) - now))
        return self.posted.popleft() if comes <= max(now, until) else None


class Marker:
    """Tracking that sees a new frame at each look, showing what `angle` gives (nan: unusable)."""

    pace, apart = None, 0.0

    def __init__(self, board: RigBoard, angle: Callable[[], float], verdict: SightingVerdict | None = None) -> None:
        self._board, self._angle, self._verdict = board, angle, verdict
        self.zero, self.number, self.delay = (0.0,), -1, 0.0

    def look(self) -> list[Sighting]:
        self.number += 1
        theta = self._angle()
        verdict = self._verdict or (SightingVerdict.OK if np.isfinite(theta) else SightingVerdict.NO_TIP)
        time = self._board.transport.now() - self.delay
        return [Sighting(time, self.number, theta - self.zero[0], verdict, np.zeros((2, 4, 2)))]

    def stand_square(self, sightings: Sequence[Sighting]) -> None:
        """It is square."""

    def close(self) -> None:
        """Nothing is open."""
