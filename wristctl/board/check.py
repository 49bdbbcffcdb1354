"""Is the board well: round-trip times, and a look at the wiring of one drive."""

from pathlib import Path
from typing import NamedTuple

from wristctl.board.driver import Board
from wristctl.board.messages import Command, Configure, Status

# A twentieth of a turn at 1/16 step.
WIRING_STEPS = 160
# Seconds of silence that the board bears: moves end at their goals, whatever becomes of this computer.
_SILENCE = 0.5


class RoundTrips(NamedTuple):
    """Seconds from a command's first byte to its answer's last."""

    command: str
    rounds: int
    median: float
    p99: float
    worst: float


def round_trips(board: Board, command: Command, count: int) -> RoundTrips:
    """Ask `count` times."""
    times = []
    for _ in range(count):
        board.ping() if command is Command.PING else board.read()
        times.append(board.round_trip)
    times.sort()
    return RoundTrips(command.name, count, times[count // 2], times[min(count - 1, count * 99 // 100)], times[-1])


def move_a_little(board: Board, axis: int) -> Status:
    """Energise the drives, creep axis `axis` forward by WIRING_STEPS and back, and release them."""
    board.set_up(Configure(watchdog=_SILENCE))
    start = list(board.enable().position)
    moved = [position + WIRING_STEPS * (k == axis) for k, position in enumerate(start)]
    board.jog(moved)
    board.jog(start)
    return board.disable()


SYSTEM = Path("/sys/bus/usb-serial/devices")


def latency_timer(port: str, system: Path = SYSTEM) -> float | None:
    """Seconds for which the adapter holds back what the board says while its buffer is not full; None: unknown.

    FTDI's adapters have one, of 16 ms unless told; a Mega's own USB chip has none.
    """
    try:
        return 1e-3 * int((system / Path(port).resolve().name / "latency_timer").read_text())
    except (OSError, ValueError):
        return None


def shorter(port: str, system: Path = SYSTEM) -> str:
    """Advice that makes a USB adapter hand over at once."""
    file = system / Path(port).resolve().name / "latency_timer"
    return f"echo 1 | sudo tee {file}; for good: the udev rule of docs/hardware/rig.md"
