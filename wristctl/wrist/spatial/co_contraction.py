"""Co-contraction: how stiff a wrist is on held motors, and how stiff tendons that pull against each other make it.

Pulls along the null space of the moment arms change no torque. With linear tendons they leave the slope of torque over
bend as it is, less what they press on the bent wrist: stiffness of held pulls even falls. What they do is to keep
tendons taut further: where one goes slack its stiffness is gone. So over a bend of some degrees, from the torque at
its end, co-contraction stiffens the wrist up to the stiffness of all its tendons together.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.spatial.spatial_model import spatial_linearised, spatial_terms
from wristctl.wrist.spatial.spatial_segments import spatial_values
from wristctl.wrist.tendon_layout import TendonLayout

# Share of the range of pulls up to which tendons pull against each other: the rest bends the wrist.
_MOST = 0.5
_HALVINGS = 40
# Weight of no torque over pulls alike, and directions all around in which a wrist is bent.
_NO_TORQUE, _AROUND = 1e6, 72


class HeldWrist(NamedTuple):
    """A straight wrist on held motors: pulls of all tendons of each place (T,) [N], and their stiffness (T,) [N/m];
    0 where pulls are held."""

    wrist: WristParameters
    layout: TendonLayout
    pulls: Array
    stiffness: Array

    def torque(self, bends: Array) -> Array:
        """Torque (B, 2) [N m] that holds it at bends (B, 2) [rad], as one segment."""
        values = spatial_values(self.wrist, self.layout, 1, axis=np.radians(self.wrist.stiffness_axis_deg))
        straight = spatial_terms(values, 0.0 * bends[:1], 0.0 * bends[:1]).lengths
        longer = spatial_terms(values, bends, 0.0 * bends).lengths - straight
        pulls = (self.pulls + self.stiffness * longer).clip(0.0)
        still = 0.0 * bends
        torque: Array = spatial_linearised(values, bends, still, still, pulls)[0]
        return torque

    def over(self, bend: float) -> tuple[float, float]:
        """Least and largest stiffness of all directions of its layout's planes over a bend [rad]: the torque along it
        less that of the straight wrist, over the bend [N m/rad]."""
        around = np.linspace(0.0, 2.0 * np.pi, _AROUND if self.layout.planes == 2 else 2, endpoint=False)
        ways = np.stack([np.cos(around), np.sin(around)], axis=1)
        more = self.torque(bend * ways) - self.torque(np.zeros((1, 2)))
        along = (more * ways).sum(axis=1) / bend
        return float(along.min()), float(along.max())


def against_each_other(wrist: WristParameters, layout: TendonLayout) -> Array:
    """Pulls of all tendons of each place (T,), the largest of one tendon 1, that give no torque on the straight wrist.

    They are as near to one for each tendon as there is without a push; what bends nothing has none.
    """
    from scipy.optimize import nnls

    arms = layout.moment_arms(np.zeros(2), wrist.length, wrist.discs) * layout.multiplicity[:, None]
    size = np.abs(arms).max()
    rows = np.concatenate([_NO_TORQUE * arms.T / size, np.eye(len(arms))])
    bends = np.hypot(*arms.T) > 0.0
    each, _ = nnls(rows, np.concatenate([np.zeros(2), bends]))
    each[~bends] = 0.0
    pulls: Array = layout.multiplicity * each / each.max()
    return pulls


def held_wrist(wrist: WristParameters, loop: Loop, layout: TendonLayout | None, pull: float = 0.0) -> HeldWrist:
    """The straight wrist on what its motors hold, tendons pulling `pull` [N] at most against each other beside
    pretension; in one plane, without a layout, by both sides."""
    places = layout or TendonLayout.pair_of_sides(wrist.tendon_offset)
    stretches = loop.actuator.tendon_stiffness if loop.actuator.winds else 0.0
    pulls = wrist.pretension * places.multiplicity + pull * against_each_other(wrist, places)
    return HeldWrist(wrist, places, pulls, stretches * places.multiplicity.astype(float))


def least_pulls(wrist: WristParameters, loop: Loop, layout: TendonLayout | None) -> Array:
    """Least pull of all tendons of each place (T,) [N] with which the wrist has the loop's `stiffness`.

    Raises UserError where no pull within half of the tendons' range makes it so stiff, or where nothing stretches.
    """
    wanted, over = loop.stiffness, math.radians(loop.stiffness_over_deg)
    if wanted is None:
        return held_wrist(wrist, loop, layout).pulls
    if not loop.actuator.winds:
        fix = "actuator.level: tendon, or stiffness: null"
        raise UserError("held pulls stiffen no wrist, only tendons that stretch do", "loop.stiffness", fix)
    pull, low, high = _pull_for(wrist, loop.actuator.tendon_stiffness, layout, wanted, over)
    if pull is None:
        at = f"over {loop.stiffness_over_deg:g} deg tendons make this wrist no stiffer than {high:.3g} N m/rad"
        fix = f"{low:.3g} to {high:.3g}, a larger actuator.tendon_stiffness, or a smaller stiffness_over_deg"
        raise UserError(f"{wanted:g} N m/rad is out of reach: {at}", "loop.stiffness", fix)
    return held_wrist(wrist, loop, layout, pull).pulls


@lru_cache(maxsize=64)
def _pull_for(
    wrist: WristParameters, tendon_stiffness: float, layout: TendonLayout | None, wanted: float, over: float
) -> tuple[float | None, float, float]:
    """Pull [N] with which the least stiffness over a bend [rad] is the wanted one; the least and the most there is."""
    loop = Loop.model_validate({"actuator": {"level": "tendon", "tendon_stiffness": tendon_stiffness}})
    most = _MOST * (wrist.tension_limit - wrist.pretension)

    def least(pull: float) -> float:
        return held_wrist(wrist, loop, layout, pull).over(over)[0]

    pulls = np.linspace(0.0, most, 25)
    sizes = [least(pull) for pull in pulls]
    low, high = sizes[0], max(sizes)
    if wanted > high:
        return None, low, high
    upper = float(pulls[next(k for k, size in enumerate(sizes) if size >= wanted)])
    if upper == 0.0:
        return 0.0, low, high
    lower = upper - float(pulls[1])
    for _ in range(_HALVINGS):
        middle = 0.5 * (lower + upper)
        lower, upper = (lower, middle) if least(middle) >= wanted else (middle, upper)
    return upper, low, high


def most_stiffness(wrist: WristParameters, loop: Loop, layout: TendonLayout | None, bend: float) -> float:
    """The most that tendons that pull against each other make of the least stiffness over a bend [rad], [N m/rad]."""
    pulls = np.linspace(0.0, _MOST * (wrist.tension_limit - wrist.pretension), 25)
    return max(held_wrist(wrist, loop, layout, float(pull)).over(bend)[0] for pull in pulls)
