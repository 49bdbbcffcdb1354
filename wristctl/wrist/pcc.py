"""The planar wrist as a plant: piecewise constant curvature, n segments with their angles as coordinates (E1-E11)."""

from typing import Any

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.lanes.compiled import compiled
from wristctl.wrist.arcs import ARC_LIMIT
from wristctl.wrist.chain import bend_along, disturbed_chain
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.integrator import step
from wristctl.wrist.kinematics import arcs_backbone, chain_tip
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.segments import Segments, segments
from wristctl.wrist.statics import equilibrium
from wristctl.wrist.tendon_mechanics import travel


@compiled
def _within(plant: Any, q: Any) -> Any:
    inside = abs(q[0]) < ARC_LIMIT
    for k in range(1, len(q)):
        inside = inside & (abs(q[k]) < ARC_LIMIT)
    return inside


def check_even(wrist: WristParameters, n: int) -> None:
    """UserError for a taper, which segments of constant curvature do not have."""
    if n > 1 and wrist.taper != 1.0:
        raise UserError("segments of plant pcc are equally stiff", "wrist.taper", "plant.model: hinges, or no taper")


def _values(wrist: WristParameters, n: int) -> Array:
    check_even(wrist, n)
    return segments(wrist, n)


def _taut(wrist: WristParameters, theta: Array) -> Array:
    at_theta = terms(segments(wrist, len(theta)), theta, 0.0 * theta)
    lengths: Array = at_theta.tendon_lengths.sum(axis=0)
    return lengths


PCC = PlantModel(
    name="pcc",
    parameters=Segments,
    coordinates=lambda n: n,
    values=_values,
    advance=step,
    bend_of=bend_along,
    travel=travel,
    within=_within,
    disturbed=disturbed_chain,
    angle=lambda theta: theta.sum(axis=-1),
    tips=lambda wrist, theta: chain_tip(theta, wrist.length),
    taut=_taut,
    backbone=arcs_backbone,
    equilibrium=equilibrium,
)
