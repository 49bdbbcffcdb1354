"""Where a wrist comes to rest on tendons with friction: roots of the statics, with its bristles in a given state.

Held spools (or pulls) leave a band of angles: friction holds the wrist wherever its tendons pull less at the wrist than
at the spool by at most exp(mu phi). Approached from below the + side slides towards its spool and the - side away from
it, z = (1, -1); from above it is (-1, 1). Between these two roots lies the dead band.
"""

from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.segments import Segments

FROM_BELOW, FROM_ABOVE, UNBENT = (1.0, -1.0), (-1.0, 1.0), (0.0, 0.0)
"""States of the + and the - side's bristle."""


class HeldTendons(NamedTuple):
    """Both sides' tendons of wrists at rest, one value a wrist (B,)."""

    given: Array
    """(B, 2) what both sides have reeled in since they were taut and free of tension on the straight wrist [m]; pulls
    at the spools [N] where these are held."""
    stiffness: Array
    """Of a side's tendons together [N/m]; 0 where pulls are held."""
    friction: Array
    sheath: Array
    """[rad]"""


def at_rest_with(parameters: Array, tendons: HeldTendons, z: tuple[float, float], guess: Array) -> Array:
    """Segments' angles (B, n) [rad] at rest with both sides' bristles in this state, by Newton's method from a guess.

    `parameters` are rows of Segments, (B, 12). Raises UserError where there is no such rest.
    """
    theta: Array = np.array(guess, float)
    still, side = 0.0 * theta, np.asarray(z)
    length = parameters[:, Segments._fields.index("length")] * theta.shape[1]
    springy, held = tendons.stiffness[:, None] > 0.0, tendons.stiffness[:, None] <= 0.0
    for _ in range(100):
        own = terms(parameters, theta, still)
        stretch = tendons.given - (length[:, None] - own.tendon_lengths.sum(axis=1))
        at_spool = np.where(held, tendons.given, tendons.stiffness[:, None] * stretch.clip(0.0))
        wrapped = tendons.sheath + np.abs(theta).sum(axis=1)
        left = np.exp(-tendons.friction[:, None] * wrapped[:, None] * side)
        pulls = at_spool * left
        r, tangent, _ = linearised(parameters, theta, still, still, pulls)
        stiff = np.where(springy & (stretch > 0.0), tendons.stiffness[:, None] * left, 0.0)
        arms = own.moment_arms
        softer = (tendons.friction[:, None] * side * pulls)[:, None, :] * np.sign(theta)[:, :, None]
        slope = stiff[:, None, :] * arms + softer
        tangent = tangent + np.einsum("bis,bjs->bij", arms, slope)
        change = np.linalg.solve(tangent, -r[..., None])[..., 0]
        theta = theta + change * np.minimum(1.0, 0.3 / np.abs(change).max(axis=1, initial=1e-300))[:, None]
        if np.abs(change).max() < 1e-13:
            return theta
    raise UserError(
        "no rest was found on held tendons with this friction", "wrist", "less friction, sheath or bend, or more pull"
    )
