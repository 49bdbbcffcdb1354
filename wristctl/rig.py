"""What a rig is to a trial: something that takes targets of tendons and gives bends.

A robot of one's own is a class with this contract in a Python file, `wristctl hw-run --rig my_rig.py:RIG`; the motor
board with its cameras and the emulated bench are rigs too (`wristctl.trial.board_rig`). All quantities are SI but where
a name says otherwise. docs/your-own-rig.md has an example.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, NamedTuple, Protocol, runtime_checkable

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Clock", "Drive", "Facts", "Fault", "Limits", "Look", "Lost", "Reeled", "Refused", "Rig", "RigError", "Sensor",
    "Spread", "Tendon", "VirtualClock", "WallClock", "most", "value",
]  # fmt: skip


class Spread(NamedTuple):
    """A quantity that is not known exactly: its value, and the range that `recommend` draws it from."""

    value: float
    low: float
    high: float


Quantity = float | Spread


def value(quantity: Quantity) -> float:
    """The value of a quantity."""
    return quantity.value if isinstance(quantity, Spread) else float(quantity)


def most(quantity: Quantity) -> float:
    """The largest value that a quantity may have."""
    return quantity.high if isinstance(quantity, Spread) else float(quantity)


class RigError(Exception):
    """The rig cannot go on; the trial stops."""


class Lost(RigError):
    """The rig does not answer: a cable, a port, a process or a message that did not come."""


class Refused(RigError):
    """The rig does not do what it was told: a target that is no number or beyond its limits. Nothing has moved."""


class Fault(RigError):
    """The rig has stopped its motors by itself. `name` says why: overload, heat, silence, ..."""

    def __init__(self, name: str) -> None:
        super().__init__(name)
        self.name = name


@dataclass(frozen=True)
class Tendon:
    """A tendon that a motor winds, by its place in the wrist's cross-section: where it bends the wrist to."""

    angle_deg: float
    """Direction from the wrist's axis [deg], from ulnar (0) toward flexion (90)."""
    radius: float
    """Distance from the wrist's axis [m]."""


@dataclass(frozen=True)
class Limits:
    """Limits that the rig keeps by itself: it refuses targets beyond them."""

    travel: float
    """Furthest that a tendon may be reeled in or paid out from where it stood when connected [m]."""
    rate: float
    """Largest change of a target in time [m/s]."""
    tension: float
    """Largest tension that a motor can make, or that the tendon bears [N]."""


@dataclass(frozen=True)
class Drive:
    """Motors and tendons between a target and a pull; each quantity a number or a `Spread`."""

    delay: Quantity = 0.0
    """From `send` until the motors begin to follow the target [s]."""
    lag: Quantity = 0.0
    """Time constant of the motors behind their targets [s]; 0: they follow at once."""
    resolution: Quantity = 0.0
    """Smallest change of the length of a tendon [m]; 0: finer than matters."""
    backlash: Quantity = 0.0
    """Dead band between motor and tendon [m]."""
    stiffness: Quantity = 20e3
    """Stiffness of one tendon [N/m]."""


@dataclass(frozen=True)
class Sensor:
    """The measurement of the bend; each quantity a number or a `Spread`."""

    rate: Quantity
    """Looks that are news, per second."""
    delay: Quantity = 0.0
    """Age of a bend when `look` has it [s]."""
    noise_deg: Quantity = 0.1
    """Standard deviation of a bend [deg]."""


@dataclass(frozen=True)
class Facts:
    """What a rig is known to be, before it is connected. `check-rig` holds them against the rig itself."""

    planes: int
    """Planes in which the bend is measured: 1, or 2 (ulnar, flexion)."""
    tendons: Sequence[Tendon]
    """In the order of the targets."""
    limits: Limits
    sensor: Sensor
    drive: Drive = field(default_factory=Drive)
    unit: str = "m"
    """Unit of a target, in words: mm, rad, steps, counts."""
    metres_per_unit: float = 1.0
    """Length of tendon that one unit of a target reels in [m]."""
    silence: float | None = None
    """Seconds without `send` after which the rig stops by itself and raises Fault; None: it never does."""
    wrist: Mapping[str, Any] = field(default_factory=dict)
    """What is known of the wrist, by the keys of a study's section `wrist`; a study file goes before it."""


class Reeled(NamedTuple):
    """Where the motors are by sensors of their own."""

    targets: ArrayLike
    """Targets (T,) [facts.unit] that they have reached."""
    time: float
    """When, on the rig's clock [s]."""


class Look(NamedTuple):
    """One look at the wrist."""

    bend: ArrayLike
    """Bend of the last disc (P,) [rad], toward ulnar and, in two planes, toward flexion; nan where it is not seen."""
    time: float
    """When it was true, on the rig's clock [s]. The same time again is no news."""
    tension: ArrayLike | None = None
    """Measured tension of each tendon (T,) [N], or None."""
    reeled: Reeled | None = None
    """Where the motors are; None: they are believed to follow their targets as `facts.drive` says."""
    tip: ArrayLike | None = None
    """Place of the last disc (P + 1,) [m] at that time, from the first one: along the straight wrist, toward ulnar and,
    in two planes, toward flexion; None where it is not measured. `gen-data` takes samples of it."""


class Clock(Protocol):
    """The rig's clock [s], which only moves forward."""

    def now(self) -> float:
        """Seconds on it."""

    def wait_until(self, moment: float) -> None:
        """Return at this moment, or at once where it has passed."""


class WallClock:
    """Time as it passes."""

    virtual = False

    def now(self) -> float:
        """Seconds, monotonic."""
        return time.monotonic()

    def wait_until(self, moment: float) -> None:
        """Sleep until then."""
        if (left := moment - time.monotonic()) > 0.0:
            time.sleep(left)


class VirtualClock:
    """Time that passes only while it is waited for: `advance(begin, end)` moves the simulated robot along.

    It is called with steps of at most `step` seconds.
    """

    virtual = True

    def __init__(self, advance: Callable[[float, float], None], step: float = math.inf) -> None:
        self._advance, self._step, self._time = advance, step, 0.0

    def now(self) -> float:
        """Seconds since the clock was made."""
        return self._time

    def wait_until(self, moment: float) -> None:
        """Advance the robot until then."""
        while self._time < moment:
            end = min(moment, self._time + self._step)
            self._advance(self._time, end)
            self._time = end


@runtime_checkable
class Rig(Protocol):
    """A robot that a trial can be run on; T tendons, P planes.

    A call that takes longer than the trial's tick makes a late tick. Any of them may raise Lost or Fault.
    """

    facts: Facts
    clock: Clock

    def connect(self) -> ArrayLike:
        """Make ready to move, and return the targets (T,) at which the motors stand: sending them moves nothing."""

    def send(self, targets: NDArray[np.float64]) -> ArrayLike:
        """Follow these targets (T,) [facts.unit]; a larger one reels in. Returns what was really sent, after rounding.

        Does not wait for the motors. Raises Refused for a target that is no number or beyond the limits.
        """

    def look(self) -> Look:
        """The newest bend; does not wait for another."""

    def stop(self) -> None:
        """Stop the motors as soon as they can, and stay; may be called at any time, and again."""

    def close(self) -> None:
        """Give everything back; the motors stand or are without power."""
