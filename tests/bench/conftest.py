"""A bench with its host: the board is enabled, and turned by rates as a control loop turns it."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import pytest

from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.board.messages import Flag, Target
from wristctl.config.bench import BenchSettings, Motors
from wristctl.config.wrist import WristParameters

TAUT = Motors(slack=(0.0, 0.0, 0.0, 0.0))
# The same with spools that stand exactly where the drives count.
EXACT = TAUT.model_copy(update={"rotor_inertia": 0.0})
TICK = 0.01


class Host:
    """Drives the bench's board; `start` is the clock's time when it was ready."""

    def __init__(self, bench: VirtualBench) -> None:
        self.bench = bench
        self.board = Board(bench.transport)
        self.board.connect()
        self.board.enable()
        self.board.home()
        self.start = bench.transport.now()

    def turn(self, rates: Sequence[float], seconds: float) -> None:
        """Turn at these rates for so long, then stand (ramps come on top)."""
        for _ in range(round(seconds / TICK)):
            due = self.bench.transport.now() + TICK
            self.board.turn(rates)
            self.bench.transport.wait(due - self.bench.transport.now())
        self.board.stop()

    def rest(self, seconds: float) -> None:
        """Stand still, the link kept alive."""
        for _ in range(round(seconds / (5 * TICK))):
            self.board.ping()
            self.bench.transport.wait(5 * TICK)

    def reel(self, steps: tuple[int, int, int, int], rate: int = 2000) -> None:
        """Reel the axes in to these positions (steps), and wait until they stand."""
        self.board.send(Target(steps, (rate,) * 4))
        self.board.wait_while(Flag.MOVING, timeout=10.0)


HostOn = Callable[..., Host]


@pytest.fixture
def host_on() -> HostOn:
    """Makes a host of a bench with these settings."""

    def make(settings: BenchSettings | None = None, wrist: WristParameters | None = None, seed: int = 0) -> Host:
        return Host(VirtualBench(settings or BenchSettings(motors=TAUT), wrist or WristParameters(), seed))

    return make
