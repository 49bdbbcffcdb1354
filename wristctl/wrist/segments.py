"""The n-segment wrist as the compiled model sees it: one row of lanes per parameter."""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.config.wrist import WristParameters
from wristctl.lanes.named_tuples import tuple_of


class Segments(NamedTuple):
    """Parameters of a wrist of n equal segments; SI units. This is their one order, in memory and everywhere."""

    length: Any
    mass: Any
    hand_mass: Any
    hand_offset: Any
    gravity_x: Any
    gravity_y: Any
    tendon_offset: Any
    spans: Any
    stiffness: Any
    damping: Any
    force_x: Any
    force_y: Any


# Segments of lanes from rows of lanes, in compiled code.
load_segments = tuple_of(Segments)


def segments(wrist: WristParameters, n: int, force: tuple[float, float] = (0.0, 0.0)) -> NDArray[np.float64]:
    """The wrist cut into n equal segments: springs in series, so each has n times the stiffness and damping.

    `force` is an external force at the tip [N] in base axes. Returns one value for each field of Segments.
    """
    return np.array(
        Segments(
            length=wrist.length / n,
            mass=wrist.mass / n,
            hand_mass=wrist.hand_mass,
            hand_offset=wrist.hand_offset,
            gravity_x=wrist.gravity[0],
            gravity_y=wrist.gravity[1],
            tendon_offset=wrist.tendon_offset,
            spans=(wrist.discs - 1) / n,
            stiffness=wrist.stiffness * n,
            damping=wrist.damping * n,
            force_x=force[0],
            force_y=force[1],
        ),
        dtype=np.float64,
    )
