"""The compiled closed loop of a wrist in two planes: a scalar law once for each plane, and one allocation for both.

reference -> law of each plane -> allocation to the tendons -> plant with its disturbances -> bend measured -> laws.
Each law knows its plane's one-segment model; what the planes do to each other is a disturbance to both. Tensions act as
commanded, and the bend is measured as it is.
"""

from typing import Any, NamedTuple

from wristctl.control.response import Controlled, Estimate, look_ahead, perceive_within, wanted_torque
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import planar, sqrt, where, zero_like
from wristctl.lanes.rows import lanes_like, part, planes_like, rows_of
from wristctl.wrist.allocation import allocate
from wristctl.wrist.spatial.posture import tip_bend
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialWrist, load_spatial_segments, load_tip
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spatial_tendons import moment_arms_of
from wristctl.wrist.tendon_mechanics import NoTendons

# Columns of a recorded sample, followed by the pull at each place of tendons [N] and the plant's coordinates. The share
# is what of the wanted torque the tendons could give; the bend is nan where the wrist has failed.
SPATIAL_RECORDED = (
    "bend_ulnar", "bend_flexion", "rate_ulnar", "rate_flexion", "torque_wanted_ulnar", "torque_wanted_flexion",
    "torque_ulnar", "torque_flexion", "share",
)  # fmt: skip
_COLUMNS = len(SPATIAL_RECORDED)
# Bend of a segment [rad] up to which the plant's series hold.
_MOST = 3.1
_NAN = float("nan")


class SpatialSetup(NamedTuple):
    """Values that all lanes share.

    `coordinates`, `tendons`, `pulls` and `bend` are tuples with an entry, of no meaning, for each of the plant's
    coordinates, each value of tendons, each place of tendons, and both planes. The law looks `preview` periods ahead.
    """

    law: Any
    coordinates: Any
    tendons: Any
    pulls: Any
    bend: Any
    period: float
    substeps: int
    ticks: int
    preview: int


class SpatialCourse(NamedTuple):
    """References [plane, (bend, rate, acceleration), sample]; what acts, [(force x, y, z, stiffness scale), sample]."""

    references: Any
    acting: Any


class SpatialValues(NamedTuple):
    """Values that stay, [block, row, lane].

    The plant as it is and as one segment that the allocation believes in; each plane's one-segment model (Segments);
    gains; and limits: least and greatest pull at each place of tendons [N], then the bend [rad] beyond which a wrist
    has failed.
    """

    plant: Any
    believed: Any
    model_y: Any
    model_z: Any
    gains: Any
    limits: Any


class SpatialState(NamedTuple):
    """State of the rollouts, [block, row, lane]; `record` is [block, sample, column, lane]."""

    coordinates: Any
    memory_y: Any
    memory_z: Any
    alive: Any
    record: Any


class SpatialScratch(NamedTuple):
    """Rows to work on: what each plane's law sees, and its reference (3,)."""

    now_y: Any
    now_z: Any
    target_y: Any
    target_z: Any


@kernel
def run_spatial(setup: Any, course: Any, values: Any, state: Any, scratch: Any, first: int, last: int) -> None:
    """Advance all blocks over the samples `first` to `last` of `setup.ticks` control periods each.

    A wrist that bends beyond its limit stays where it was for good.
    """
    period, ticks, m, count = setup.period, setup.ticks, len(setup.coordinates), len(setup.pulls)
    for block in range(values.plant.shape[0]):
        rows, model = rows_of(values.plant[block]), rows_of(values.believed[block])
        still = load_spatial_segments(rows)
        believed = SpatialWrist(load_spatial_segments(model), part(model, FIELDS, setup.tendons))
        gains = values.gains[block]
        control_y = Controlled(
            setup.law, scratch.now_y, values.model_y[block], gains, state.memory_y[block], scratch.target_y
        )
        control_z = Controlled(
            setup.law, scratch.now_z, values.model_z[block], gains, state.memory_z[block], scratch.target_z
        )
        target_y, target_z = rows_of(scratch.target_y), rows_of(scratch.target_z)
        limits, alive = rows_of(values.limits[block]), rows_of(state.alive[block])
        least, greatest = part(limits, 0, setup.pulls), part(limits, count, setup.pulls)
        coordinates = rows_of(state.coordinates[block])
        q, rate = part(coordinates, 0, setup.coordinates), part(coordinates, m, setup.coordinates)
        before, pulls, lever = lanes_like(q), lanes_like(least), lanes_like(part(q, 0, setup.bend))
        bend, arms = lanes_like(lever), planes_like(least)
        zero = zero_like(still.length)
        for sample in range(first, last):
            acting = course.acting
            scale = acting[3, sample] + zero
            segment = load_tip(
                still,
                (
                    still.force_x + acting[0, sample], still.force_y + acting[1, sample],
                    still.force_z + acting[2, sample], scale * still.stiffness_yy, scale * still.stiffness_yz,
                    scale * still.stiffness_zz,
                ),
            )  # fmt: skip
            plant = SpatialWrist(segment, part(rows, FIELDS, setup.tendons))
            for tick in range(ticks):
                now_tick = sample * ticks + tick
                bend_y, bend_z, rate_y, rate_z = tip_bend(segment, q, rate)
                bent = sqrt(bend_y * bend_y + bend_z * bend_z)
                alive[0] = where(bent < limits[2 * count], alive[0], zero)
                for ahead in range(1, setup.preview + 1):
                    to_come = min((now_tick + ahead) // ticks, course.references.shape[2] - 1)
                    for i in range(3):
                        target_y[i] = course.references[0, i, to_come] + zero
                        target_z[i] = course.references[1, i, to_come] + zero
                    since = (now_tick + ahead - to_come * ticks) * period
                    look_ahead(control_y, ahead, since)
                    look_ahead(control_z, ahead, since)
                for i in range(3):
                    target_y[i] = course.references[0, i, sample] + zero
                    target_z[i] = course.references[1, i, sample] + zero
                bend[0] = bend_y
                bend[1] = bend_z
                low_y, high_y, low_z, high_z = zero, zero, zero, zero
                for t in range(count):
                    moment_arms_of(believed, bend, t, lever)
                    arms[t] = planar(lever[0], lever[1])
                    forth, back = least[t], greatest[t]
                    low_y = low_y + lever[0] * where(lever[0] > 0.0, forth, back)
                    high_y = high_y + lever[0] * where(lever[0] > 0.0, back, forth)
                    low_z = low_z + lever[1] * where(lever[1] > 0.0, forth, back)
                    high_z = high_z + lever[1] * where(lever[1] > 0.0, back, forth)
                perceive_within(control_y, Estimate(bend_y, rate_y, zero), zero, (low_y, high_y), tick * period, period)
                perceive_within(control_z, Estimate(bend_z, rate_z, zero), zero, (low_z, high_z), tick * period, period)
                wanted_y, wanted_z = wanted_torque(control_y), wanted_torque(control_z)
                share = allocate(arms, planar(wanted_y, wanted_z), least, greatest, pulls)
                if tick == 0:
                    row = rows_of(state.record[block, sample])
                    torque_y, torque_z = zero, zero
                    for t in range(count):
                        moment_arms_of(believed, bend, t, lever)
                        torque_y = torque_y + pulls[t] * lever[0]
                        torque_z = torque_z + pulls[t] * lever[1]
                        row[_COLUMNS + t] = pulls[t]
                    row[0] = where(alive[0] > 0.0, bend_y, _NAN)
                    row[1] = where(alive[0] > 0.0, bend_z, _NAN)
                    row[2] = rate_y
                    row[3] = rate_z
                    row[4] = wanted_y
                    row[5] = wanted_z
                    row[6] = torque_y
                    row[7] = torque_z
                    row[8] = share
                    for i in range(m):
                        row[_COLUMNS + count + i] = q[i]
                for _ in range(setup.substeps):
                    for i in range(m):
                        before[i] = q[i]
                    spatial_step(plant, q, rate, pulls, NoTendons(), period / setup.substeps + zero)
                    well = alive[0]
                    for k in range(m // 2):
                        size = q[2 * k] * q[2 * k] + q[2 * k + 1] * q[2 * k + 1]
                        well = where(size < _MOST * _MOST, well, zero)
                    alive[0] = well
                    for i in range(m):
                        q[i] = where(well > 0.0, q[i], before[i])
                        rate[i] = where(well > 0.0, rate[i], zero)
