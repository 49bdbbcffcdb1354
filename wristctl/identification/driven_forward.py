"""The forward model of a wrist whose tendons' tensions are given: the bend that it takes, as one arc in two planes.

All of it is over the stiffness that the straight wrist shows, its springs' less what weight takes. That is 1: damping
has [s], inertia [s^2], torques of friction [rad] and pulls [1/m]. Candidates run side by side, one a lane, on the
plant, the tendons and the integrator of the simulation. A pull that is given is a spool behind a tendon so soft that
nothing the wrist does in a step changes it (`wristctl.simulation.spool_driven`), so that friction along the tendon is
the same element as on spools.
"""

from collections.abc import Iterator, Sequence
from functools import cache
from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.lanes.blocks import to_blocks
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import beyond, lanes_like, part, rows_of
from wristctl.simulation.nonideal import faults_of, nonideal_of, unmoved
from wristctl.wrist.dahl import InnerFrictionInSpace, inner_in_lanes, inner_state
from wristctl.wrist.plant import advance_or_stop, kernel_of, parameters_of, path_before
from wristctl.wrist.spatial.pcc_in_space import PCC_IN_SPACE
from wristctl.wrist.spatial.posture import tip_bend
from wristctl.wrist.spatial.spatial_model import spatial_terms
from wristctl.wrist.spatial.spatial_segments import FIELDS, OF_A_TENDON, own_values, rows_of_tendons
from wristctl.wrist.spatial.spooled_tendons import RealPlaces, read_faults
from wristctl.wrist.tendon_layout import TendonLayout
from wristctl.wrist.tendon_mechanics import Nonideal, read_nonideal, shortening

STEP = 4e-3
"""Integration step [s]: half of it changes no interval of a slow motion by a hundredth."""
SETTLE = 0.5
"""Time [s] that a wrist is given to come to rest under its first tensions."""
# Stiffness of the soft tendons over the wrist's [1/m^2].
_SOFT = 1.0
_NONIDEAL = len(Nonideal._fields)
_COORDINATES = 2


class DrivenArc(NamedTuple):
    """A wrist of one arc and its tendons as they may be; over its stiffness."""

    damping: float
    """[s]"""
    inertia: float
    """Of bending as one arc from the straight wrist [s^2]."""
    places: Array
    """Places of the tendons in the cross-section (M, 2) [m], toward ulnar and toward flexion."""
    pulls: Array
    """Pull of each tendon for its column of the log (M,) [1/m over the column's unit]."""
    friction: float = 0.0
    """Coefficient of the tendons' friction."""
    sheath: float = 0.0
    """Exponent that it adds before the wrist: coefficient times angle."""
    presliding: float = 1.0
    """Path in which that turns round [m]."""
    inner: float = 0.0
    """Torque of friction inside the wrist [rad]."""
    inner_presliding: float = 1.0
    """Bend in which that turns round [rad]."""
    creep: float = 0.0
    """Share of the stiffness that relaxes."""
    creep_time: float = 1.0
    """Time constant of that [s]."""
    weight: float = 0.0
    """Share of its straight stiffness that weight takes away from it as it stands; less than 0 of one that hangs."""


class _Shapes(NamedTuple):
    """Tuples with an entry, of no meaning, for each coordinate and each tendon."""

    cut: Any
    of_pulls: Any


def _follow(
    model: Any, values: Any, inner: Any, state: Any, driven: Any, steps: tuple[float, int], out: Any, shapes: Any
) -> None:
    h, settle = steps
    rows, states = rows_of(values), rows_of(state)
    m, count = len(shapes.cut), len(shapes.of_pulls)
    wrist, first = parameters_of(model, rows, shapes.of_pulls), FIELDS + OF_A_TENDON * count
    stiffness, scale = part(rows, first, shapes.of_pulls), part(rows, first + count, shapes.of_pulls)
    nonideal = beyond(rows, first + 2 * count)
    tendons = RealPlaces(
        stiffness, read_nonideal(nonideal), read_faults(beyond(nonideal, _NONIDEAL), shapes.of_pulls),
        beyond(states, 2 * m), inner_in_lanes(inner), shapes.of_pulls,
    )  # fmt: skip
    q, rate, spools = part(states, 0, shapes.cut), part(states, m, shapes.cut), lanes_like(scale)
    zero = zero_like(scale[0])
    alive = 1.0 + zero
    for k in range(-settle, driven.shape[0]):
        now, path = max(k, 0), path_before(tendons, wrist, q)
        for t in range(count):
            spools[t] = driven[now, t] * scale[t] / stiffness[t] + shortening(path, t)
        if k >= 0:
            row = rows_of(out[k])
            row[0], row[1], row[2], row[3], _ = tip_bend(wrist.segment, q, rate)
        alive, _ = advance_or_stop(wrist, q, rate, spools, tendons, h + zero, alive)


def courses_of_pulls(
    candidates: Sequence[DrivenArc], wrist: WristParameters, driven: Array
) -> Iterator[tuple[int, Array]]:
    """Number and course of each candidate: bends [rad] and their rates [rad/s] (T, 4) at steps of STEP.

    Parameters
    ----------
    candidates : wrists with M tendons each
    wrist : its geometry, masses, of which the shares count, and the ratio of its springs
    driven : columns of the log (T, M), held over each step; at first the wrist is at rest
    """
    tendons, count = driven.shape[1], len(candidates)
    shapes, follow = _Shapes((0,) * _COORDINATES, (0,) * tendons), kernel_of(_follow, PCC_IN_SPACE)
    chosen = list(candidates) * 2 if count == 1 else list(candidates)  # one width is compiled
    blocks = to_blocks(np.array([_values(candidate, wrist) for candidate in chosen]))
    torque = to_blocks(np.array([[candidate.inner] for candidate in chosen]))
    slope = to_blocks(np.array([[1.0 / candidate.inner_presliding] for candidate in chosen]))
    bristles = to_blocks(np.tile(inner_state(np.zeros(_COORDINATES)), (len(chosen), 1)))
    pulls, wide = np.ascontiguousarray(driven, float), blocks.shape[2]
    at_rest = unmoved(np.zeros(tendons), np.zeros(2 * tendons), np.zeros(tendons), np.zeros(_COORDINATES))
    begin = np.append(np.zeros(2 * _COORDINATES), at_rest)
    for k, values in enumerate(blocks):
        course, state = np.empty((len(pulls), 4, wide)), np.repeat(begin[:, None], wide, axis=1)
        inner = InnerFrictionInSpace(torque[k], slope[k], bristles[k])
        follow(PCC_IN_SPACE, values, inner, state, pulls, (STEP, round(SETTLE / STEP)), course, shapes)
        for lane in range(min(wide, count - k * wide)):
            yield k * wide + lane, np.ascontiguousarray(course[..., lane])


def inertia_of_arc(wrist: WristParameters) -> float:
    """Inertia of bending as one arc, at the straight wrist [kg m^2]."""
    return wrist.mass * wrist.length**2 / 20.0 + wrist.hand_mass * (0.5 * wrist.length + wrist.hand_offset) ** 2


@cache
def _softening(length: float, mass: float, hand_mass: float, hand_offset: float) -> float:
    """Stiffness that weight takes from the straight wrist as it stands, over gravity's acceleration [kg m/rad]."""
    wrist = WristParameters(
        length=length, mass=mass, hand_mass=hand_mass, hand_offset=hand_offset, gravity=(-1.0, 0.0)
    )  # fmt: skip
    bend = np.array([1e-4, 0.0])
    layout = TendonLayout.four(wrist.tendon_radius)
    return -float(spatial_terms(own_values(wrist, 1, layout), bend, 0.0 * bend).bias[0] / bend[0])


def _values(arc: DrivenArc, wrist: WristParameters) -> Array:
    heavier = arc.inertia / inertia_of_arc(wrist)
    softens = heavier * _softening(wrist.length, wrist.mass, wrist.hand_mass, wrist.hand_offset)
    scaled = wrist.model_copy(
        update={
            "stiffness": 1.0 + arc.weight, "damping": arc.damping, "mass": heavier * wrist.mass,
            "hand_mass": heavier * wrist.hand_mass, "gravity": (-arc.weight / softens, 0.0), "gravity_flexion": 0.0,
        }
    )  # fmt: skip
    own, count = own_values(scaled, 1, TendonLayout.four(wrist.tendon_radius)), len(arc.places)
    tendons = Actuator(level="tendon")
    plant = TrueWrist(creep=arc.creep, creep_time=arc.creep_time)
    nonideal = nonideal_of(plant, tendons, TendonFacts(), STEP)._replace(
        friction=arc.friction, sheath=arc.sheath / arc.friction if arc.friction > 0.0 else 0.0,
        bristle=1.0 / arc.presliding,
    )  # fmt: skip
    faults = faults_of(tendons, TendonFacts(), np.ones(count))
    return np.concatenate(
        [own[:FIELDS], rows_of_tendons(arc.places, 1.0), np.full(count, _SOFT), arc.pulls, nonideal, faults.ravel()]
    )
