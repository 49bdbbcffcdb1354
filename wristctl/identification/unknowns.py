"""What can be identified, and in which coordinate: logarithms of what is positive, friction and delay as they are."""

from __future__ import annotations

import math
from typing import NamedTuple


class Unknown(NamedTuple):
    """A parameter that identification may find.

    `low` and `high` bound the search: factors of the starting value where it is searched in its logarithm, values
    elsewhere. `tolerance` is the scale of its widest interval: 1 (a relative width) or a value in its own unit.
    """

    name: str
    unit: str
    meaning: str
    log: bool
    low: float
    high: float
    tolerance: float

    def coordinate(self, value: float, start: float) -> float:
        """Where the search stands at this value, having begun at `start`."""
        return math.log(value / start) if self.log else value

    def value(self, coordinate: float, start: float) -> float:
        """The value at a coordinate."""
        return start * math.exp(coordinate) if self.log else coordinate

    def bounds(self) -> tuple[float, float]:
        """Least and largest coordinate."""
        return (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)


UNKNOWNS = {
    each.name: each
    for each in (
        Unknown("stiffness", "N m/rad", "bending stiffness of the whole wrist", True, 0.05, 20.0, 1.0),
        Unknown("damping", "N m s/rad", "bending damping of the whole wrist", True, 0.02, 50.0, 1.0),
        Unknown("tendon_stiffness", "N/m", "stiffness of one tendon", True, 0.05, 20.0, 1.0),
        Unknown("friction", "", "capstan friction: coefficient times bend", False, 0.0, 2.0, 0.4),
        Unknown("delay", "s", "how much older a picture is than its time stamp", False, -0.05, 0.2, 0.02),
        Unknown("tendon_radius", "m", "radius of the tendons' circle, the pulley's as known", True, 0.8, 1.25, 1.0),
    )
}
"""The table of parameters. All but tendon_radius begin without any knowledge beyond the bounds."""

SIMULATED = ("stiffness", "damping", "tendon_stiffness", "friction", "tendon_radius")
"""Those that the forward model holds; the delay shifts its outcome in time."""
