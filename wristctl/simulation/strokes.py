"""What spools do, or pull, that would hold a wrist without friction at each angle of a range.

The side that does not pull stays at pretension. What friction does is what differs from that.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.spooled import SpooledWrist
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.dead_band import FROM_ABOVE, FROM_BELOW, HeldTendons, at_rest_with
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import equilibria_at
from wristctl.wrist.tendons import TENDONS_PER_SIDE

_FINE = math.radians(0.05)
"""Between two angles at which the statics are solved [rad]; chords between them are 1e-10 m off."""


class FrictionCase(NamedTuple):
    """Friction of a wrist's tendons: coefficient, the sheath's angle [rad], the path in which it turns round [m]."""

    friction: float
    sheath: float
    presliding: float


@dataclass(frozen=True)
class Strokes:
    """What holds a wrist without friction at each of the angles (G,) [rad]; of a side both tendons together."""

    wrist: WristParameters
    settings: HysteresisSettings
    angle: Array
    theta: Array
    """Segments' angles (G, n) [rad]."""
    reeled: Array
    """(G, 2) [m]"""
    pulls: Array
    """(G, 2) [N]"""

    @property
    def winch(self) -> bool:
        """Whether pulls are held instead of spools."""
        return self.settings.drive == "tensions"

    def given(self, angle: Array) -> Array:
        """What drives both sides at angles (...): spools [m], or pulls of winches [N]; (2, ...)."""
        course = self.pulls if self.winch else self.reeled
        return np.stack([np.interp(angle, self.angle, side) for side in course.T])

    def told(self, angle: Array) -> Array:
        """The same of angles (T, L), as `spooled` wants it: (T, 2, L)."""
        return np.moveaxis(self.given(angle), 0, 1)

    def theta_at(self, angle: Array) -> Array:
        """Segments' angles at angles (...), (..., n)."""
        return np.stack([np.interp(angle, self.angle, each) for each in self.theta.T], axis=-1)

    def lane(self, tendons: FrictionCase, begin: float) -> SpooledWrist:
        """A wrist that rests at this angle [rad] at first."""
        return SpooledWrist(self.wrist, self.settings.actuator(*tendons), self.theta_at(np.array(begin)), self.winch)

    def exact(self, tendons: Sequence[FrictionCase], angle: Array) -> Array:
        """Angles at rest from below and from above (B, 2) [rad] where without friction they are `angle` (B,)."""
        values = np.tile(segments(self.wrist, self.settings.segments), (len(angle), 1))
        stiffness = 0.0 if self.winch else TENDONS_PER_SIDE * self.settings.tendon_stiffness
        friction, sheath, _ = np.array(tendons, float).T
        held = HeldTendons(self.given(angle).T, np.full(len(angle), stiffness), friction, sheath)
        guess = self.theta_at(angle)
        ends = [at_rest_with(values, held, z, guess).sum(axis=1) for z in (FROM_BELOW, FROM_ABOVE)]
        return np.stack(ends, axis=1)


def strokes(wrist: WristParameters, settings: HysteresisSettings) -> Strokes:
    """Of all angles of all ranges. Raises UserError where the wrist cannot be held there."""
    ends = np.radians(settings.ranges_deg)
    angle = np.linspace(ends.min(), ends.max(), 1 + math.ceil(float(np.ptp(ends)) / _FINE))
    if math.degrees(float(np.abs(angle).max())) > wrist.range_deg:
        what = f"a loop goes beyond the wrist's range, {wrist.range_deg:g} deg"
        raise UserError(what, "hysteresis.ranges_deg", "smaller ranges")
    values = np.tile(segments(wrist, settings.segments), (len(angle), 1))
    found = equilibria_at(values, settings.segments, angle, TENDONS_PER_SIDE * wrist.pretension)
    if settings.drive == "tensions" and not found.stable.all():
        raise UserError("the wrist buckles on held pulls", "hysteresis.drive", "drive: spools, or a lighter hand")
    most = float(found.pulls.max()) / TENDONS_PER_SIDE
    if most > wrist.tension_limit:
        what = f"it takes {most:.3g} N a tendon, above wrist.tension_limit ({wrist.tension_limit:g} N)"
        raise UserError(what, "hysteresis.ranges_deg", "smaller ranges")
    taut = terms(values, found.theta, 0.0 * found.theta).tendon_lengths.sum(axis=1)
    reeled = found.pulls / (TENDONS_PER_SIDE * settings.tendon_stiffness) + wrist.length - taut
    return Strokes(wrist, settings, angle, found.theta, reeled, found.pulls)
