"""Bending of the wrist across the plane in which it moves: small bends, of constant curvature."""

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import where
from wristctl.wrist.dahl import bristle, bristle_slope
from wristctl.wrist.directions import ACTIVE

_TENDONS = len(ACTIVE)


class Across(NamedTuple):
    """The bend across, linear in it; SI units, positive away from the camera."""

    stiffness: float
    """Springs, less what upright gravity takes [N m/rad]."""
    damping: float
    inertia: float
    """Inertia of the straight wrist with its hand [kg m^2]."""
    moment: float
    """Moment of gravity across the straight wrist [N m]."""
    levers: Array
    """(4,) by axis: what a tendon's pull bends by, and what the bend takes off its path [m]."""


# Of a wrist that bends in no way across.
IN_PLANE = Across(1.0, 1.0, 1.0, 0.0, np.zeros(_TENDONS))


def across_of(wrist: WristParameters, away: Sequence[int]) -> Across:
    """Values across of a wrist as its other plane knows it; `away` says to which side each axis pulls (`away_of`).

    A bend b of constant curvature moves the point s by s^2 b/(2 L) aside and lowers it by s^3 b^2/(6 L^2); the hand,
    h beyond the tip, by (L/2 + h) b and (L/6 + h/2) b^2. That plane's + side is the last tendon's, 5.
    """
    length, hand = wrist.length, wrist.hand_offset
    along, aside = wrist.gravity
    lowering = wrist.mass * length / 12.0 + wrist.hand_mass * (length / 3.0 + hand)
    beside = wrist.mass * length / 6.0 + wrist.hand_mass * (0.5 * length + hand)
    inertia = wrist.mass * length**2 / 20.0 + wrist.hand_mass * (0.5 * length + hand) ** 2
    levers = wrist.tendon_offset * np.array(away, float)
    return Across(wrist.stiffness + along * lowering, wrist.damping, inertia, aside * beside * float(away[-1]), levers)


@compiled
def advance_across(bent: Any, pulls: Any, levers: Any, across: Any, rubbing: Any, stiffness: Any, h: float) -> None:
    """Advance the bend across by h [s], linearly implicit in damping, stiffness and friction; lanes.

    Parameters
    ----------
    bent : rows of the bend [rad], its rate [rad/s], and the bristle of friction inside the wrist
    pulls, levers : a row for each of the four tendons of this stiffness [N/m], whose pull [N] and lever [m] these are
    across : the constants of `Across`
    rubbing : that friction's torque [N m], and one over the bend in which it turns round [1/rad]
    """
    torque, slope = rubbing
    rate = bent[1]
    resisting = across.stiffness + torque * bristle_slope(bent[2], rate, slope)
    moment = across.moment - across.stiffness * bent[0] - torque * bent[2]
    for axis in range(_TENDONS):
        moment = moment + levers[axis] * pulls[axis]
        resisting = resisting + where(pulls[axis] > 0.0, stiffness * levers[axis] * levers[axis], 0.0)
    push = moment - (across.damping + h * resisting) * rate
    rate = rate + h * push / (across.inertia + h * across.damping + h * h * resisting)
    bent[0] = bent[0] + h * rate
    bent[1] = rate
    bent[2] = bristle(bent[2], h * rate, slope)
