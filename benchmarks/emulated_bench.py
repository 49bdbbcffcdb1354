"""What the emulated bench costs in virtual time: `python benchmarks/emulated_bench.py` (or `make bench`)."""

from __future__ import annotations

import math
import time

from wristctl.bench.virtual_bench import VirtualBench
from wristctl.board.driver import Board
from wristctl.config.bench import BenchSettings
from wristctl.config.wrist import WristParameters

SECONDS, PERIOD = 5.0, 0.005


def cost(bench: VirtualBench, board: Board, rate: float, commanded: bool, seen: bool) -> tuple[float, int]:
    """Processor seconds of SECONDS on the bench, swinging at up to `rate` steps/s; frames drawn."""
    start, began, frames, tick = bench.transport.now(), time.process_time(), 0, 0
    while bench.transport.now() < start + SECONDS - 1e-6:
        tick += 1
        if commanded:
            swing = rate * math.cos(math.pi * tick * PERIOD)
            board.turn((-swing, -swing, swing, swing))
        elif tick % 10 == 1:
            board.ping()
        if seen:
            frames += bench.cameras[0].newest() is not None
        bench.transport.wait(max(0.0, start + tick * PERIOD - bench.transport.now()))
        bench.motion()
    return time.process_time() - began, frames


def main() -> None:
    bench = VirtualBench(BenchSettings(), WristParameters(), seed=0)
    board = Board(bench.transport)
    board.connect()
    board.enable()
    board.home()
    bench.motion()
    bench.cameras[0].newest()
    print(f"processor seconds for {SECONDS:g} s on the bench")
    for what, rate, commanded, seen in (
        ("at rest, 20 pings a second", 0.0, False, False),
        ("200 commands a second, at rest", 0.0, True, False),
        ("200 commands a second, to 400 steps/s", 400.0, True, False),
        ("200 commands a second, to 2000 steps/s", 2000.0, True, False),
        ("the same with frames", 2000.0, True, True),
    ):
        took, frames = cost(bench, board, rate, commanded, seen)
        print(f"{what:40} {took:6.2f}{f', {frames} frames' if seen else ''}")


if __name__ == "__main__":
    main()
