"""The forward model of a wrist whose tendons' tensions are given: the bend that it takes, as one arc in two planes.

All of it is over the stiffness that the straight wrist shows, its springs' less what weight takes. That is 1: damping
has [s], inertia [s^2], torques of friction [rad] and pulls [1/m].
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import cache

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_robot import ABSENT, inertia_of_arc
from wristctl.identification.forward import Places, Supposed, courses
from wristctl.lanes.types import LANES
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import own_values
from wristctl.wrist.tendon_layout import TendonLayout

STEP = 4e-3
"""Integration step [s]: half of it changes no interval of a slow motion by a hundredth."""
# Stiffness of the soft tendons over the wrist's [1/m^2].
_SOFT = 1.0


def courses_of_pulls(candidates: Sequence[Supposed], driven: Array) -> Iterator[Array]:
    """Course of each candidate: bends [rad] and their rates [rad/s] (T, 4) at steps of STEP.

    `driven` are columns of the log (T, M), held over each step; at first the wrist is at rest.
    """
    for first in range(0, len(candidates), LANES):
        some = candidates[first : first + LANES]
        both = [*some, *some] if len(some) == 1 else some  # one width is compiled
        yield from courses(both, driven, STEP, 1, rates=True)[: len(some)]


@cache
def _softening(length: float, mass: float, hand_mass: float, hand_offset: float) -> float:
    """Stiffness that weight takes from the straight wrist as it stands, over gravity's acceleration [kg m/rad]."""
    wrist = WristParameters(
        length=length, mass=mass, hand_mass=hand_mass, hand_offset=hand_offset, gravity=(-1.0, 0.0)
    )  # fmt: skip
    bend = np.array([1e-4, 0.0])
    layout = TendonLayout.four(wrist.tendon_radius)
    return -float(spatial_terms(own_values(wrist, 1, layout), bend, 0.0 * bend).bias[0] / bend[0])


def driven_arc(wrist: WristParameters, values: Mapping[str, float], places: Array, pulls: Array) -> Supposed:
    """A wrist of one arc with these unknowns, a missing one of no effect; over its stiffness.

    Parameters
    ----------
    wrist : its geometry, masses, of which the shares count, and the ratio of its springs
    places : of the tendons in the cross-section (M, 2) [m], toward ulnar and toward flexion
    pulls : of each tendon for its column of the log (M,) [1/m over the column's unit]
    """
    own, weight = {**ABSENT, **values}, values.get("weight", 0.0)
    heavier = own["inertia"] / inertia_of_arc(wrist)
    softens = heavier * _softening(wrist.length, wrist.mass, wrist.hand_mass, wrist.hand_offset)
    scaled = wrist.model_copy(
        update={
            "stiffness": 1.0 + weight, "damping": own["damping"], "mass": heavier * wrist.mass,
            "hand_mass": heavier * wrist.hand_mass, "gravity": (-weight / softens, 0.0), "gravity_flexion": 0.0,
        }
    )  # fmt: skip
    tendons = Actuator(level="tendon", tendon_stiffness=_SOFT).model_copy(
        update={
            "friction": own["friction"], "presliding": own["presliding"],
            "sheath": own["sheath"] / own["friction"] if own["friction"] > 0.0 else 0.0,
        }
    )  # fmt: skip
    plant = TrueWrist().model_copy(
        update={
            "creep": own["creep"], "creep_time": own["creep_time"], "inner_friction": own["inner_friction"],
            "inner_presliding_deg": math.degrees(own["inner_presliding"]),
        }
    )  # fmt: skip
    each = np.ones(len(places))
    where = Places(places, each, each.astype(np.int64))
    return Supposed(scaled, tendons, places=where, plant=plant, pulls=tuple(pulls.tolist()))
