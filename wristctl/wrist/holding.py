"""Whether the tendons can hold a wrist bent, by the statics of one segment, and what would do where they cannot.

Springs, gravity and a constant force at the tip ask for a torque; both sides' pulls, each between pretension and the
tension limit, give one. Friction is left out, which helps to hold and hinders to get there.
"""

import math
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE

_ANGLES = 2001
"""At which a range of bending is looked at."""


class Balance(NamedTuple):
    """What holds one arc at some angles, (T,) each."""

    asked: Array
    """Torque that holds it there [N m]."""
    least: Array
    """The tendons' least and largest torque there [N m], as `wristctl.wrist.allocation.reach` has it."""
    most: Array
    arm_plus: Array
    """Moment arms of the + and the - side [m]."""
    arm_minus: Array


class Shortfall(NamedTuple):
    """Where the tendons fall short by most, and what would hold the wrist there."""

    theta: float
    """Bending angle [rad]."""
    asked: float
    """Torque that holds it there [N m]."""
    given: float
    """The tendons' torque nearest to that [N m]."""
    angle: float
    """How far toward theta they hold it, from straight [rad]; nan where they do not hold it straight."""
    tension_limit: float
    """Least limit of each tendon's tension that would do [N]."""
    tendon_radius: float
    """Least radius of the circle of tendons that would do [m]."""


def balance(wrist: WristParameters, theta: Array, force: float = 0.0) -> Balance:
    """What holds the wrist at angles (T,) [rad] under a force at the tip, across the straight wrist [N]."""
    here = terms(segments(wrist, 1, (0.0, force)), theta[:, None], 0.0 * theta[:, None])
    plus, minus = here.moment_arms[:, 0].T
    low, high = TENDONS_PER_SIDE * wrist.pretension, TENDONS_PER_SIDE * wrist.tension_limit
    asked = here.bias[:, 0] + wrist.stiffness * theta
    return Balance(asked, plus * low + minus * high, plus * high + minus * low, plus, minus)


def shortfall(wrist: WristParameters, low: float, high: float, force: float = 0.0) -> Shortfall | None:
    """Where between two bending angles [rad] the tendons cannot hold the wrist; None where they can everywhere.

    `force` is a constant one at the tip, across the straight wrist [N].
    """
    theta = np.linspace(low, high, _ANGLES)
    found = balance(wrist, theta, force)
    beyond = np.maximum(found.asked - found.most, found.least - found.asked)
    worst = int(beyond.argmax())
    if beyond[worst] <= 0.0:
        return None
    asked, least, most, plus, minus = (float(each[worst]) for each in found)
    ahead = asked > most
    pulls, other = (plus, minus) if ahead else (minus, plus)
    limit = (asked / TENDONS_PER_SIDE - other * wrist.pretension) / pulls
    squeezed = 0.5 * (plus + minus) * (wrist.tension_limit + wrist.pretension)
    per_radius = 0.5 * (plus - minus) * (wrist.tension_limit - wrist.pretension) / wrist.tendon_radius
    radius = abs(asked / TENDONS_PER_SIDE - squeezed) / per_radius
    angle = _held_to(wrist, float(theta[worst]), force)
    return Shortfall(float(theta[worst]), asked, most if ahead else least, angle, limit, radius)


def _held_to(wrist: WristParameters, theta: float, force: float) -> float:
    way = np.linspace(0.0, theta, _ANGLES)
    found = balance(wrist, way, force)
    spare = np.minimum(found.asked - found.least, found.most - found.asked)
    first = int((spare < 0.0).argmax())
    if first == 0:
        return math.nan
    share = spare[first - 1] / (spare[first - 1] - spare[first])
    return float(way[first - 1] + share * (way[first] - way[first - 1]))
