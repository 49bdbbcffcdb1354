"""What the operating system knows of the USB adapter behind a serial port."""

from __future__ import annotations

from pathlib import Path

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
    """How to have it hand over at once."""
    file = system / Path(port).resolve().name / "latency_timer"
    return f"echo 1 | sudo tee {file}; for good: the udev rule of docs/hardware/rig.md"
