"""Four steppers with their spools and tendons, and the wrist in two planes that these pull, in steps of 1 ms.

Motors and spools are those of `wristctl.bench.motors`; each tendon has its place, stretches and rubs by itself.
"""

from typing import Any, NamedTuple

from wristctl.bench.motors import CYCLES, PERIOD, hear_edges, turn_spools
from wristctl.board.messages import AXES
from wristctl.lanes.compiled import kernel
from wristctl.lanes.functions import clip, maximum
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialWrist, load_spatial_segments, load_tip
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spatial_tendons import lengths_along
from wristctl.wrist.spatial.spooled_tendons import RubbingTendons, remember_travel, travel_of

# Bend of a segment [rad] up to which the plant's series hold.
_MOST = 3.1


class SpatialHanging(NamedTuple):
    """Load of the motors: plant and tendons, in the order of the axes.

    The plant's values, a tendon's stiffness [N/m], its coefficient of friction, its sheath's angle [rad], one over the
    path in which friction turns round [1/m], the backlash [m], times (4,) at which tendons break [s]; what tendons
    remember of friction, then in the backlash [m], and the share (4,) that is left of each; the motors, steps of the
    integration in a period; and tuples with an entry, of no meaning, for each coordinate, value of tendons and tendon.
    """

    values: Any
    stiffness: float
    friction: float
    sheath: float
    slope: float
    backlash: float
    broken_at: Any
    rubbed: Any
    play: Any
    left: Any
    motor: Any
    substeps: int
    coordinates: Any
    of_tendons: Any
    pulls: Any


@kernel
def follow_in_space(
    hanging: Any, spools: Any, state: Any, acting: Any, edges: Any, first: int, start: float, out: Any
) -> int:
    """Advance spools and wrist by a period for each row (tip force (3,), stiffness scale) of `acting`; the edges used.

    As `wristctl.bench.motors.follow`; a wrist that leaves what its series hold for stays where it was.
    """
    rows, m = rows_of(hanging.values), len(hanging.coordinates)
    still, places = load_spatial_segments(rows), part(rows, FIELDS, hanging.of_tendons)
    motor, substeps = hanging.motor, hanging.substeps
    reeled, pull = part(rows_of(spools.reeled), 0, hanging.pulls), part(rows_of(spools.pull), 0, hanging.pulls)
    q, rate = part(rows_of(state), 0, hanging.coordinates), part(rows_of(state), m, hanging.coordinates)
    rubbed, play, left = rows_of(hanging.rubbed), rows_of(hanging.play), rows_of(hanging.left)
    broken_at = rows_of(hanging.broken_at)
    before, stiffness, on_spool, lengths = lanes_like(q), lanes_like(reeled), lanes_like(reeled), lanes_like(reeled)
    zero = zero_like(still.length)
    friction, sheath, slope = hanging.friction + zero, hanging.sheath + zero, hanging.slope + zero
    edge = 0
    for k in range(acting.shape[0]):
        middle = (first + k) * CYCLES + CYCLES // 2
        edge = hear_edges(spools, motor, edges, edge, middle)
        turn_spools(spools, motor, hanging.stiffness)
        time, scale = (first + k) * PERIOD - start, acting[k, 3]
        segment = load_tip(
            still,
            (
                still.force_x + acting[k, 0], still.force_y + acting[k, 1], still.force_z + acting[k, 2],
                scale * still.stiffness_yy, scale * still.stiffness_yz, scale * still.stiffness_zz,
            ),
        )  # fmt: skip
        plant = SpatialWrist(segment, places)
        lengths_along(plant, q, lengths)
        for t in range(AXES):
            left[t] = where(time >= broken_at[t], zero, left[t])
            stiffness[t] = left[t] * hanging.stiffness
            play[t] = clip(play[t], reeled[t], reeled[t] + hanging.backlash)
            on_spool[t] = play[t]
            pull[t] = stiffness[t] * maximum(0.0, on_spool[t] - travel_of(plant, t, lengths[t]))
        tendons = RubbingTendons(stiffness, friction, sheath, slope, rubbed)
        for _ in range(substeps):
            for i in range(m):
                before[i] = q[i]
            spatial_step(plant, q, rate, on_spool, tendons, PERIOD / substeps + zero)
            well = 1.0 + zero
            for i in range(m // 2):
                size = q[2 * i] * q[2 * i] + q[2 * i + 1] * q[2 * i + 1]
                well = where(size < _MOST * _MOST, well, zero)
            for i in range(m):
                q[i] = where(well > 0.0, q[i], before[i])
                rate[i] = where(well > 0.0, rate[i], zero)
            remember_travel(tendons, plant, q)
        for i in range(2 * m):
            out[k, i] = state[i]
        for axis in range(AXES):
            out[k, 2 * m + axis] = spools.pull[axis]
            out[k, 2 * m + AXES + axis] = spools.reeled[axis]
        out[k, 2 * m + 2 * AXES] = 0.0
    return edge
