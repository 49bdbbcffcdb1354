"""The planar wrist as a plant: piecewise constant curvature, n segments with their angles as coordinates (E1-E11)."""

from __future__ import annotations

from typing import Any

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import turn
from wristctl.lanes.parts import replacing
from wristctl.lanes.rows import planes_like
from wristctl.wrist.arcs import ARC_LIMIT, Chords, chords, tip
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.elastic import travel
from wristctl.wrist.integrator import step
from wristctl.wrist.kinematics import chain_tip
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.shape import arcs_backbone
from wristctl.wrist.statics import equilibrium

_load = replacing("stiffness", "force_y")


@compiled
def _tip_angle(plant: Any, q: Any, rate: Any) -> Any:
    zero = 0.0 * plant.length
    angle, turning = zero, zero
    for k in range(len(q)):
        angle = angle + q[k]
        turning = turning + rate[k]
    return angle, turning


@compiled
def _within(plant: Any, q: Any) -> Any:
    inside = abs(q[0]) < ARC_LIMIT
    for k in range(1, len(q)):
        inside = inside & (abs(q[k]) < ARC_LIMIT)
    return inside


@compiled
def _disturbed(plant: Any, force: Any, scale: Any) -> Any:
    return _load(plant, (scale * plant.stiffness, force + plant.force_y))


@compiled
def _tip_pose(plant: Any, q: Any) -> Any:
    return tip(q, plant.length)


@compiled
def _tip_jacobian(plant: Any, q: Any, place: Any, angle: Any) -> None:
    """Segment k turns all that lies beyond it: d(tip)/d(theta_k) = dz_k + i (tip - end of segment k)."""
    arc = Chords(planes_like(q), planes_like(q), planes_like(q), planes_like(q))
    chords(q, plant.length, arc)
    beyond = 0.0 * plant.length * arc.z[0]
    for k in range(len(q) - 1, -1, -1):
        place[k] = arc.dz[k] + turn(beyond)
        angle[k] = 1.0 + 0.0 * plant.length
        beyond = beyond + arc.z[k]


def _taut(wrist: WristParameters, theta: Array) -> Array:
    own = terms(segments(wrist, len(theta)), theta, 0.0 * theta)
    both: Array = own.tendon_lengths.sum(axis=0)
    return both


PCC = PlantModel(
    name="pcc",
    parameters=Segments,
    coordinates=lambda n: n,
    values=segments,
    advance=step,
    tip_angle=_tip_angle,
    travel=travel,
    within=_within,
    disturbed=_disturbed,
    tip_pose=_tip_pose,
    tip_jacobian=_tip_jacobian,
    angle=lambda theta: theta.sum(axis=-1),
    tips=lambda wrist, theta: chain_tip(theta, wrist.length),
    taut=_taut,
    backbone=arcs_backbone,
    equilibrium=equilibrium,
)
