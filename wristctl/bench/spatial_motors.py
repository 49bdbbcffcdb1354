"""Four steppers with their spools, and the wrist in two planes that up to four tendons pull, in steps of 1 ms.

Motors and spools are those of `wristctl.bench.motors`; each tendon has its place, stretches and rubs by itself. The
first axes wind one each, the others none.
"""

from typing import Any, NamedTuple

from wristctl.bench.motors import CYCLES, PERIOD, turn_spools
from wristctl.board.messages import AXES
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.nonideal import place_after_slip
from wristctl.wrist.dahl import inner_in_lanes
from wristctl.wrist.plant import advance_or_stop, disturbed, parameters_of, path_before
from wristctl.wrist.spatial.spooled_tendons import RealPlaces, read_faults
from wristctl.wrist.tendon_mechanics import PLAY, read_nonideal, row_of, shortening, spool_pull


class SpatialHanging(NamedTuple):
    """Load of the motors: plant and tendons, in the order of the axes.

    The plant (its model and the values of its parameters), a tendon's stiffness [N/m] and that of each (T,), the values
    of Nonideal, those of Fault of each, the tendons' state, friction inside the wrist; the motors, steps of the
    integration in a period; and tuples with an entry, of no meaning, for each coordinate and tendon.
    """

    model: Any
    values: Any
    stiffness: float
    stiffnesses: Any
    nonideal: Any
    faults: Any
    tendons: Any
    inner: Any
    motor: Any
    substeps: int
    coordinates: Any
    pulls: Any


def follow_in_space(
    hanging: Any, spools: Any, state: Any, acting: Any, edges: Any, first: int, start: float, out: Any
) -> int:
    """Advance spools and wrist by a period for each row (tip force (3,), stiffness scale) of `acting`; the edges used.

    As `wristctl.bench.motors.follow`; a wrist that leaves what its series hold for stays where it was.
    """
    undisturbed, m = parameters_of(hanging.model, rows_of(hanging.values), hanging.pulls), len(hanging.coordinates)
    motor, substeps = hanging.motor, hanging.substeps
    reeled, pull = part(rows_of(spools.reeled), 0, hanging.pulls), part(rows_of(spools.pull), 0, hanging.pulls)
    q, rate = part(rows_of(state), 0, hanging.coordinates), part(rows_of(state), m, hanging.coordinates)
    tendons = RealPlaces(
        part(rows_of(hanging.stiffnesses), 0, hanging.pulls), read_nonideal(rows_of(hanging.nonideal)),
        read_faults(rows_of(hanging.faults), hanging.pulls), rows_of(hanging.tendons), inner_in_lanes(hanging.inner),
        hanging.pulls,
    )  # fmt: skip
    on_spool, zero = lanes_like(reeled), zero_like(reeled[0])
    edge = 0
    for k in range(acting.shape[0]):
        middle = (first + k) * CYCLES + CYCLES // 2
        plant = disturbed(undisturbed, (acting[k, 0], acting[k, 1], acting[k, 2]), acting[k, 3])
        time, path = (first + k) * PERIOD - start + zero, path_before(tendons, undisturbed, q)
        for t in range(len(hanging.pulls)):
            pull[t] = spool_pull(tendons, tendons.state[row_of(t, PLAY)], t, shortening(path, t))
        edge = turn_spools(spools, motor, hanging.stiffness, edges, edge, middle)
        for t in range(len(hanging.pulls)):
            x = shortening(path, t)
            on_spool[t] = place_after_slip(tendons, t, reeled[t], zero, time, x)
            pull[t] = spool_pull(tendons, on_spool[t], t, x)
        for _ in range(substeps):
            advance_or_stop(plant, q, rate, on_spool, tendons, PERIOD / substeps + zero, 1.0 + zero)
        for i in range(2 * m):
            out[k, i] = state[i]
        for axis in range(AXES):
            out[k, 2 * m + axis] = spools.pull[axis]
            out[k, 2 * m + AXES + axis] = spools.reeled[axis]
        out[k, 2 * m + 2 * AXES] = 0.0
    return edge
