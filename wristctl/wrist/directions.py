"""The four anatomical directions: bending planes, tendons that pull, and gravity as each plane sees it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from wristctl.config.wrist import WristParameters

if TYPE_CHECKING:
    from wristctl.arrays import Array


class Direction(NamedTuple):
    """One of the four anatomical directions: its bending plane, the sign of theta and the tendons that pull."""

    name: str
    plane: str
    """Name of +y in the bending plane."""
    sign: int
    tendons: tuple[int, int]


DIRECTIONS = {
    each.name: each
    for each in (
        Direction("ulnar", "ulnar", 1, (4, 5)),
        Direction("radial", "ulnar", -1, (1, 2)),
        Direction("flexion", "flexion", 1, (2, 5)),
        Direction("extension", "flexion", -1, (1, 4)),
    )
}
# Places in the cross-section, +X ulnar and +Y flexion, in units of the tendon offset c.
TENDONS = {1: (-1, -1), 2: (-1, 1), 3: (0, 0), 4: (1, -1), 5: (1, 1)}
# Tendons that a motor winds, in the order of the board's axes; the one in the centre bends nothing.
ACTIVE = tuple(number for number, place in TENDONS.items() if any(place))
# Pairs of axes whose tendons lie opposite each other.
OPPOSITE_AXES = tuple((ACTIVE.index(one), ACTIVE.index(other)) for one, other in ((1, 5), (2, 4)))


_NAMES = {0.0: "ulnar", 90.0: "flexion", 180.0: "radial", 270.0: "extension"}


def toward_words(angle_deg: float) -> str:
    """A direction [deg from ulnar toward flexion] in words: its anatomical name, or else its angle."""
    return f"toward {_NAMES.get(round(angle_deg, 6) % 360.0, f'{angle_deg:.3g} deg from ulnar')}"


def away_of(plane: str, positive: str) -> tuple[int, ...]:
    """1 for each tendon of `ACTIVE` that pulls the wrist away from a camera that looks at this bending plane, -1 for
    one that pulls it toward the camera, which sees theta > 0 on its `positive` side, right or left.

    Tangent, ulnar and flexion are right-handed axes.
    """
    ulnar, flexion = away_from_camera(plane, positive)
    return tuple(int(ulnar * TENDONS[tendon][0] + flexion * TENDONS[tendon][1]) for tendon in ACTIVE)


def away_from_camera(plane: str, positive: str) -> Array:
    """Unit vector (2,), toward ulnar and flexion, away from the camera of `away_of`."""
    import numpy as np

    side = 1.0 if positive == "right" else -1.0
    return np.array([0.0, side] if plane == "ulnar" else [-side, 0.0])


def tendons_of(plane: str) -> tuple[int, int, int, int]:
    """The four tendons as a bending plane (ulnar or flexion) sees them: two of its + side, two of its - side."""
    plus, minus = (direction.tendons for direction in DIRECTIONS.values() if direction.plane == plane)
    return *plus, *minus


def in_plane(wrist: WristParameters, direction: str) -> WristParameters:
    """The wrist as its motion in this direction's bending plane sees it: stiffness and gravity across are that plane's.

    The cross-section is square, so the planes differ in these alone. Seen twice it is as before. Springs that are
    softer along an oblique axis are as each plane alone meets them.
    """
    if wrist.stiffness_axis_deg:
        wrist = _along_planes(wrist)
    if DIRECTIONS[direction].plane == "ulnar":
        return wrist
    along, ulnar = wrist.gravity
    turned = {
        "gravity": (along, wrist.gravity_flexion),
        "gravity_flexion": ulnar,
        "stiffness": wrist.stiffness * wrist.flexion_ratio,
        "flexion_ratio": 1.0 / wrist.flexion_ratio,
    }
    return wrist.model_copy(update=turned)


def _along_planes(wrist: WristParameters) -> WristParameters:
    """The wrist with the stiffness that each plane alone meets, along the planes themselves."""
    axis = math.radians(wrist.stiffness_axis_deg)
    c, s = math.cos(axis) ** 2, math.sin(axis) ** 2
    ulnar, flexion = c + s * wrist.flexion_ratio, s + c * wrist.flexion_ratio
    along = {"stiffness": ulnar * wrist.stiffness, "flexion_ratio": flexion / ulnar, "stiffness_axis_deg": 0.0}
    return wrist.model_copy(update=along)
