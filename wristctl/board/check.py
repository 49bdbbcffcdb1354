"""Is the board well: round-trip times, and a look at the wiring of one drive."""

from pathlib import Path
from typing import NamedTuple

from wristctl.board.driver import Board
from wristctl.board.messages import Command, Configure, Status
from wristctl.board.transport import ports

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


def moved_a_little(axis: int) -> str:
    """What the board has done in a `move_a_little` that raised nothing, and what remains to be looked at."""
    return (
        f"Wiring: the board has made {WIRING_STEPS} steps of axis {axis} forward and as many back, and released the "
        "drives. It counts the steps that it makes, and not whether a motor follows: axis "
        f"{axis} alone must have turned by a twentieth of a turn at 1/16 step, and back. One that hums or stands: the "
        "drive's 5 V / 24 V selector and current switches, or two wires of different coils swapped; another axis that "
        "turns: plugs that are exchanged."
    )


SYSTEM = Path("/sys/bus/usb-serial/devices")

# Seconds between two hand-overs, by adapter: a 16U2's timer (arduino-usbserial: 256 x 256 cycles of 16 MHz), FTDI's
# latency timer unless it is told another, and a frame of USB, which every adapter waits for anyhow.
_EVERY = {"16U2": 256 * 256 / 16e6, "FTDI": 16e-3, "CH340": 1e-3, "CP210x": 1e-3}


class Adapter(NamedTuple):
    """The USB adapter between this computer and a board."""

    name: str
    """16U2 (a genuine Mega's), FTDI, CH340, CP210x; empty where that is unknown."""
    every: float | None
    """Seconds between two hand-overs of what the board says; None: unknown."""

    def __str__(self) -> str:
        if not self.name or self.every is None:
            return "unknown"
        what = "latency timer of" if self.name == "FTDI" else "hands over every"
        return f"{self.name}, {what} {1e3 * self.every:.3g} ms"


def adapter_of(port: str, system: Path = SYSTEM) -> Adapter:
    """The adapter of a port, by its USB vendor; an FTDI's latency timer as the system says."""
    device = str(Path(port).resolve()) if "://" not in port else port
    names = {str(Path(listed.device).resolve()): listed.adapter for listed in ports()}
    timer = latency_timer(port, system)
    name = names.get(device, "") or ("FTDI" if timer is not None else "")
    return Adapter(name, _EVERY.get(name) if timer is None else timer)


def latency_timer(port: str, system: Path = SYSTEM) -> float | None:
    """Seconds for which an FTDI adapter holds back what the board says while its buffer is not full.

    None where there is none: others have no such setting.
    """
    try:
        return 1e-3 * int((system / Path(port).resolve().name / "latency_timer").read_text())
    except (OSError, ValueError):
        return None


def shorter(port: str, system: Path = SYSTEM) -> str:
    """Advice that makes a USB adapter hand over at once."""
    file = system / Path(port).resolve().name / "latency_timer"
    return f"echo 1 | sudo tee {file}; for good: the udev rule (documentation: The rig)"
