"""What a rig's loop knows of its wrist, in compiled code: the one-segment model, its tendons and motors."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import WristParameters
from wristctl.control.belief import Compensated, Places, belief_in_lanes, lengths_at, moment_arms_at, straight_at
from wristctl.errors import UserError
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.observer import Knowing, known_of_sides
from wristctl.simulation.simulated_drives import drive_of
from wristctl.simulation.stationary_filter import Belief, as_pairs, stationary_gains
from wristctl.trial.spools import on_plus_side
from wristctl.wrist.directions import ACTIVE, TENDONS, in_plane
from wristctl.wrist.segments import segments
from wristctl.wrist.spatial.pcc_in_space import placed_values
from wristctl.wrist.spatial.spatial_segments import OF_A_TENDON
from wristctl.wrist.tendon_layout import TendonLayout, wound_by

# Planes of the two bends, in their order: also that of the cameras.
PLANES = ("ulnar", "flexion")
# Directions of bending [deg], from ulnar toward flexion.
TOWARD = {
    "ulnar": 0.0, "ulnar-flexion": 45.0, "flexion": 90.0, "radial-flexion": 135.0, "radial": 180.0,
    "radial-extension": 225.0, "extension": 270.0, "ulnar-extension": 315.0,
}  # fmt: skip


class RigBelief:
    """Knowledge of a rig's loop in P planes: the one-segment wrist, its drive, and T places of tendons.

    In one plane the places are the + and the - side, and the wrist is as this plane sees it; in two each motor winds
    the tendon of its own place. `layout` has the tendons that motors wind, None: the board's four. Raises UserError for
    tendons that no axis winds.
    """

    def __init__(
        self, wrist: WristParameters, actuator: Actuator, planes: Sequence[str], layout: TendonLayout | None = None
    ) -> None:
        self.planes, self.wrist, self._actuator = tuple(planes), wrist, actuator
        self._place = places_of_tendons(self.planes, layout)
        if len(self.planes) == 1:
            alike = np.bincount(self._place).astype(float)
            self.known, self._facing = known_of_sides(wrist, actuator, alike), [wrist]
        else:
            layout = layout or layout_of_axes(wrist)
            turned = [in_plane(wrist, plane) for plane in self.planes]
            self.known = _known_of_places(wrist, turned, layout, actuator)
            self._facing = [as_pairs(facing, layout, axis) for axis, facing in enumerate(turned)]
        wound = np.eye(len(self.known.pulls))[:, self._place]
        self._means = wound / wound.sum(axis=1, keepdims=True)
        self._found = np.zeros(len(self.known.pulls) + len(self.known.arms))

    def gains(self, sensor: Sensor, period: float) -> Array:
        """Gain of the observer behind each plane's camera (3 P,)."""
        beliefs = [Belief(sensor, self._actuator, facing, period) for facing in self._facing]
        return stationary_gains(beliefs).ravel()

    def at_places(self, values: Array) -> Array:
        """Values of the motors, their mean at each place (T,)."""
        means: Array = self._means @ values
        return means

    def of_axes(self, values: Array) -> Array:
        """Values of the places (T,), for each motor."""
        return values[self._place]

    def taut(self, bend: Sequence[float] | Array) -> tuple[Array, Array]:
        """Reeled-in lengths (M,) of each motor's tendon that is just taut at this bend (P,) [m], and their changes by
        the bend (M, P) [m/rad]."""
        _paths(self.known, np.ascontiguousarray(bend, np.float64), self._found)
        of_places = self._found.reshape(1 + len(self.planes), -1).take(self._place, axis=1)
        return of_places[0], np.ascontiguousarray(of_places[1:].T)


def places_of_tendons(planes: Sequence[str], layout: TendonLayout | None = None) -> NDArray[np.int64]:
    """Place of the tendon that each motor winds (M,): in one plane that of its side, + or -.

    `layout` has the tendons that motors wind, None: the board's four.
    """
    if len(planes) == 1:
        plus = on_plus_side(planes[0]) if layout is None else layout.cross_section[:, 0] > 0.0
        return np.where(plus, 0, 1)
    return np.arange(AXES if layout is None else len(layout.places))


def numbers_of(layout: TendonLayout | None) -> tuple[int, ...]:
    """Numbers of the tendons that motors wind, in the order of these; None: of the board's four."""
    return ACTIVE if layout is None else tuple(range(1, 1 + len(layout.places)))


def names_of_planes(planes: int, plane: str) -> tuple[str, ...]:
    """Names of a rig's planes: the one that it bends in, or both."""
    return (plane,) if planes == 1 else PLANES


def _known_of_places(
    wrist: WristParameters, turned: Sequence[WristParameters], layout: TendonLayout, actuator: Actuator
) -> Knowing:
    count = len(layout.places)
    values, alike = placed_values(wrist, layout, 1), np.ones(count)
    models = np.array([segments(facing, 1) for facing in turned])
    pulls = (0,) * count
    belief = Places(models, alike, values, (0,) * (OF_A_TENDON * count), pulls, Compensated())
    return Knowing(belief, drive_of(actuator, alike), (0,) * len(turned), pulls, (0,) * (len(turned) * count))


def layout_of_axes(wrist: WristParameters) -> TendonLayout:
    """Places of the tendons that the board's axes wind. Raises UserError where they are not the paper's 1, 2, 4, 5."""
    four = TendonLayout.four(wrist.tendon_radius)
    if wound_by(wrist, AXES) is not None:
        fix = f"angle_deg {', '.join(f'{angle % 360.0:.0f}' for angle in np.degrees(four.directions))}, in this order"
        raise UserError("a rig in two planes winds the four tendons 1, 2, 4 and 5", "wrist.tendons", fix)
    return four


def layout_of_rig(settings: HwRunSettings, wrist: WristParameters) -> TendonLayout | None:
    """Tendons that the motors of a rig wind; None: the paper's four on a board.

    Raises UserError for a board in two planes that has too few axes for them.
    """
    if settings.rig is None:
        return None if settings.planes == 1 else wound_by(wrist, AXES)
    return TendonLayout(tuple(place for place in TendonLayout.of(wrist).places if place.radius > 0.0))


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


@kernel
def _paths(known: Any, bend: Any, found: Any) -> None:
    wrist, row, count = belief_in_lanes(known.belief).wrist, rows_of(found), len(known.pulls)
    at, taut, arms = part(rows_of(bend), 0, known.bend), part(row, 0, known.pulls), part(row, count, known.arms)
    lengths_at(wrist, at, taut)
    moment_arms_at(wrist, at, arms)
    for t in range(count):
        taut[t] = straight_at(wrist, t) - taut[t]
