"""The wrist in two planes as a plant: piecewise constant curvature, n segments with two bends each as coordinates."""

from typing import Any

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.lanes.compiled import compiled
from wristctl.lanes.named_tuples import replacing
from wristctl.lanes.rows import part
from wristctl.wrist.pcc import check_even
from wristctl.wrist.plant import PlantModel
from wristctl.wrist.spatial.posture import tip_bend
from wristctl.wrist.spatial.spatial_kinematics import spatial_frames, spatial_tips, tip_bends
from wristctl.wrist.spatial.spatial_segments import (
    FIELDS,
    SpatialWrist,
    load_spatial_segments,
    load_tip,
    own_values,
)
from wristctl.wrist.spatial.spatial_statics import spatial_equilibrium
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spooled_tendons import travel_in_space
from wristctl.wrist.tendon_layout import TendonLayout

_with_segment = replacing("segment")

# Bend of a segment [rad] up to which the plant's series hold.
_MOST = 3.1


def _read(model: Any, rows: Any, pulls: Any = ()) -> Any:
    return SpatialWrist(load_spatial_segments(rows), part(rows, FIELDS, pulls + pulls + pulls))


@compiled
def bend_in_space(plant: Any, q: Any, rate: Any, bend: Any, speed: Any) -> None:
    """Write the bend of the last disc's tangent [rad] and its rate [rad/s], two rows each."""
    bend[0], bend[1], speed[0], speed[1], _ = tip_bend(plant.segment, q, rate)


@compiled
def within_bends(plant: Any, q: Any) -> Any:
    """Lanes in which every segment is bent by less than half a turn."""
    inside = q[0] * q[0] + q[1] * q[1] < _MOST * _MOST
    for k in range(1, len(q) // 2):
        inside = inside & (q[2 * k] * q[2 * k] + q[2 * k + 1] * q[2 * k + 1] < _MOST * _MOST)
    return inside


@compiled
def load_in_space(plant: Any, force: Any, scale: Any) -> Any:
    """The plant with a force (3) more on the last disc [N] and its springs' stiffness scaled."""
    still = plant.segment
    segment = load_tip(
        still,
        (
            still.force_x + force[0], still.force_y + force[1], still.force_z + force[2],
            scale * still.stiffness_yy, scale * still.stiffness_yz, scale * still.stiffness_zz,
        ),
    )  # fmt: skip
    return _with_segment(plant, (segment,))


def placed_values(wrist: WristParameters, layout: TendonLayout, n: int) -> Array:
    """The parameters' values of a wrist with tendons like these, cut into n segments.

    UserError for a taper of several.
    """
    check_even(wrist, n)
    return own_values(wrist, n, layout)


def _equilibrium(wrist: WristParameters, n: int, tensions: tuple[float, float]) -> Array:
    layout = TendonLayout.of(wrist)
    return spatial_equilibrium(placed_values(wrist, layout, n), n, layout.multiplicity * tensions[0])


PCC_IN_SPACE = PlantModel(
    name="pcc",
    parameters=SpatialWrist,
    planes=2,
    coordinates=lambda n: 2 * n,
    values=lambda wrist, n: placed_values(wrist, TendonLayout.of(wrist), n),
    advance=spatial_step,
    bend_of=bend_in_space,
    travel=travel_in_space,
    within=within_bends,
    disturbed=load_in_space,
    tips=lambda wrist, q: spatial_tips(q, wrist.length),
    frames=lambda wrist, q, shares: spatial_frames(q, wrist.length, shares),
    read=_read,
    angle=tip_bends,
    equilibrium=_equilibrium,
)
