"""How quickly the emulated board answers and how fast its chip runs: `python benchmarks/board.py` (or `make bench`)."""

from __future__ import annotations

import subprocess
import sys
import time

from wristctl.board.check import RoundTrips, round_trips
from wristctl.board.driver import Board
from wristctl.board.emulator import Atmega2560
from wristctl.board.emulator.atmega2560 import VirtualTransport
from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import BAUD, Command
from wristctl.board.transport import SerialTransport, Transport

COUNT, PERIOD, CYCLES = 1000, 0.005, 2000


def show(where: str, times: RoundTrips) -> None:
    print(f"{where:24} {times.command:8} {1e3 * times.median:10.2f} {1e3 * times.p99:10.2f} {1e3 * times.worst:10.2f}")


def loop(board: Board) -> tuple[int, float]:
    """A 200 Hz command-status loop: deadlines missed, and the longest cycle in seconds."""
    wire, missed, longest = board.transport, 0, 0.0
    due = wire.now()
    for k in range(CYCLES):
        board.turn((2000.0, -2000.0, 5.0 * k, 0.0))
        longest = max(longest, wire.now() - due)
        missed += wire.now() > due + PERIOD
        due = max(due + PERIOD, wire.now())
        wire.wait(max(0.0, due - wire.now()))
    board.stop()
    return missed, longest


def speed(rates: tuple[float, float, float, float]) -> float:
    """Seconds of virtual time per second of processor time."""
    wire = VirtualTransport()
    board = Board(wire)
    board.connect()
    board.enable()
    board.home()
    began, cycles = time.process_time(), wire.chip.cycles
    for _ in range(40):
        board.turn(rates)
        wire.wait(0.05)
    return (wire.chip.cycles - cycles) / FREQUENCY / (time.process_time() - began)


def answers(*wires: tuple[str, Transport]) -> None:
    """Print round trips and the command-status loop over each wire."""
    print(f"\nround trips at {BAUD} baud, {COUNT} each")
    print(f"{'':24} {'command':8} {'median ms':>10} {'p99 ms':>10} {'worst ms':>10}")
    for where, wire in wires:
        with Board(wire) as board:
            for command in (Command.PING, Command.STATUS):
                show(where, round_trips(board, command, COUNT))
            board.enable()
            board.home()
            missed, longest = loop(board)
            print(f"{where:24} 200 Hz command-status loop: {missed} of {CYCLES} missed, longest {1e3 * longest:.2f} ms")


def main() -> None:
    began = time.perf_counter()
    Atmega2560()
    print(f"first chip ready after {time.perf_counter() - began:.1f} s")
    command = [sys.executable, "-c", "from wristctl.cli.app import main; main()", "hw", "emulate", "-q"]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as serving:
        try:
            assert serving.stdout is not None
            port = serving.stdout.readline().strip()
            answers(("virtual time", VirtualTransport()), ("pty, real time", SerialTransport(port, BAUD)))
        finally:
            serving.terminate()
    print("\nvirtual seconds a processor second")
    for what, rates in (
        ("drives on, at rest", (0.0, 0.0, 0.0, 0.0)),
        ("2 axes at 20,000 steps/s", (20_000.0, -20_000.0, 0.0, 0.0)),
        ("4 axes at 10,000 steps/s", (10_000.0, -10_000.0, 10_000.0, -10_000.0)),
    ):
        print(f"{what:24} {speed(rates):6.1f}")


if __name__ == "__main__":
    main()
