"""What a rig in two planes knows of its wrist, for compiled code: the one-segment model, its tendons and motors."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Compensated, Places, belief_in_lanes
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import drive_of
from wristctl.simulation.observer import Known, known_of_sides
from wristctl.wrist.directions import ACTIVE, TENDONS, in_plane
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.pcc_in_space import placed_values
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.spatial.spatial_tendons import lengths_along, moment_arms_of
from wristctl.wrist.spatial.spooled_tendons import straight_length
from wristctl.wrist.tendon_layout import TendonLayout

# Planes of the two bends, in their order: also that of the cameras.
PLANES = ("ulnar", "flexion")
# Directions of bending [deg], from ulnar toward flexion.
TOWARD = {
    "ulnar": 0.0, "ulnar-flexion": 45.0, "flexion": 90.0, "radial-flexion": 135.0, "radial": 180.0,
    "radial-extension": 225.0, "extension": 270.0, "ulnar-extension": 315.0,
}  # fmt: skip


def known_of_rig(wrist: WristParameters, actuator: Actuator, planes: int) -> Known:
    """Knowledge of a wrist as one plane sees it, its places the + and the - side, or in two planes of each axis."""
    return known_of_sides(wrist, actuator) if planes == 1 else known_of_axes(wrist, actuator)


def known_of_axes(wrist: WristParameters, actuator: Actuator) -> Known:
    """Knowledge of a wrist that this actuator winds. Raises UserError for tendons that no axis winds."""
    values, alike = placed_values(wrist, layout_of_axes(wrist), 1), np.ones(AXES)
    models = np.array([segments(in_plane(wrist, plane), 1) for plane in PLANES])
    pulls = (0,) * AXES
    belief = Places(models, alike, values, (0,) * (OF_A_TENDON * AXES), pulls, Compensated())
    return Known(belief, drive_of(actuator, alike), (0, 0), pulls, (0,) * (2 * AXES))


def layout_of_axes(wrist: WristParameters) -> TendonLayout:
    """Places of the tendons that the board's axes wind. Raises UserError where they are not the paper's 1, 2, 4, 5."""
    layout = TendonLayout.four(wrist.tendon_radius)
    places = TendonLayout.of(wrist)
    around = [place for place in places.places if place.radius > 0.0]
    if len(around) != AXES or not np.allclose([place.angle % math.tau for place in around], _angles(layout)):
        fix = f"angle_deg {', '.join(f'{math.degrees(angle):.0f}' for angle in _angles(layout))}, in this order"
        raise UserError("a rig in two planes winds the four tendons 1, 2, 4 and 5", "wrist.tendons", fix)
    return layout


def _angles(layout: TendonLayout) -> list[float]:
    return [place.angle % math.tau for place in layout.places]


def pull_directions() -> Array:
    """Direction (4,) [rad], from ulnar toward flexion, in which the tendon of each axis bends the wrist."""
    places = np.array([TENDONS[tendon] for tendon in ACTIVE], float)
    directions: Array = np.arctan2(places[:, 1], places[:, 0])
    return directions


def unit_toward(degrees: float) -> Array:
    """Unit vector (2,) toward so many degrees from ulnar toward flexion; exact along the planes."""
    unit = np.array([math.cos(math.radians(degrees)), math.sin(math.radians(degrees))])
    unit[np.abs(unit) < 1e-15] = 0.0
    return unit


class SpatialPaths:
    """The tendons' paths through the one-segment wrist in two planes, for each axis of the board."""

    def __init__(self, known: Known) -> None:
        self._known, self._found = known, np.zeros(3 * AXES)

    def taut(self, bend: Sequence[float] | Array) -> tuple[Array, Array]:
        """Reeled-in lengths (4,) of tendons that are just taut at this bend (2,) [m], and their changes by the bend
        (4, 2) [m/rad]."""
        _paths(self._known, np.ascontiguousarray(bend, np.float64), self._found)
        return self._found[:AXES].copy(), self._found[AXES:].reshape(AXES, 2).copy()


@kernel
def _paths(known: Any, bend: Any, found: Any) -> None:
    wrist, row = belief_in_lanes(known.belief).wrist, rows_of(found)
    at = part(rows_of(bend), 0, known.bend)
    arms, lengths = lanes_like(at), lanes_like(part(row, 0, known.pulls))
    lengths_along(wrist, at, lengths)
    zero = zero_like(at[0])
    for t in range(len(lengths)):
        moment_arms_of(wrist, at, t, arms)
        row[t] = straight_length(wrist, t) - lengths[t] + zero
        row[len(lengths) + 2 * t] = arms[0]
        row[len(lengths) + 2 * t + 1] = arms[1]
