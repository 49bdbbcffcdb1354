"""The compiled closed loop of a wrist in two planes: a scalar law once for each plane, and one allocation for both.

reference -> law of each plane -> allocation to the tendons -> motors and tendons -> plant with its disturbances ->
camera and observer -> laws. Each law knows its plane's one-segment model; what the planes do to each other is added to
what the laws want, or left to them as a disturbance. Without motors tensions act as commanded, and without a camera the
bend is measured as it is.
"""

from typing import Any, NamedTuple

from wristctl.control.response import Controlled, look_ahead
from wristctl.lanes.compiled import kernel
from wristctl.lanes.lane import sqrt, where, zero_like
from wristctl.lanes.named_tuples import block_of
from wristctl.lanes.rows import lanes_like, part, planes_like, rows_of
from wristctl.simulation.actuator import Aim, drive_in_lanes
from wristctl.simulation.bend_sums import Errors, gather_bends, watch_bends
from wristctl.simulation.spatial_actuator import deliver, drive_tendons, friction_in_lanes, lose, tendons_on
from wristctl.simulation.spatial_observer import Knowledge, predict_bends, sense_bends
from wristctl.simulation.spatial_response import Laws, Room, Seen, respond_in_planes
from wristctl.wrist.segments import load_segments
from wristctl.wrist.spatial.posture import spatial_tip, tip_bend
from wristctl.wrist.spatial.spatial_segments import FIELDS, SpatialWrist, load_spatial_segments, load_tip
from wristctl.wrist.spatial.spatial_step import spatial_step
from wristctl.wrist.spatial.spooled_tendons import pulls_of_tendons, remember_travel

# Columns of a recorded sample, followed by the commanded pull at each place of tendons [N], those that act, what each
# motor delivers (pulls [N], or lengths on spools [m]), and the plant's coordinates. The share is what of the wanted
# torque the tendons could give; the bend is nan where the wrist has failed.
SPATIAL_RECORDED = (
    "bend_ulnar", "bend_flexion", "rate_ulnar", "rate_flexion", "torque_wanted_ulnar", "torque_wanted_flexion",
    "torque_ulnar", "torque_flexion", "share", "seen_ulnar", "seen_flexion", "load_ulnar", "load_flexion",
)  # fmt: skip
# Columns that are recorded where no more are asked for: the bend.
SPATIAL_BRIEFLY = SPATIAL_RECORDED[:2]
_COLUMNS, _BRIEFLY = len(SPATIAL_RECORDED), len(SPATIAL_BRIEFLY)
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
    coupling: Any


class SpatialCourse(NamedTuple):
    """References [plane, (bend, rate, acceleration), sample], continued between samples by their own derivatives;
    what acts, [(force x, y, z, stiffness scale), sample]; the number of samples in the last part of the horizon; the
    ticks of frames, or NoCamera."""

    references: Any
    acting: Any
    late: int
    schedule: Any


class SpatialValues(NamedTuple):
    """Values that stay, [block, row, lane].

    The plant as it is and as one segment that the controller's side believes in; each plane's one-segment model
    (Segments); gains; and limits: least and greatest pull at each place of tendons [N], then the bend [rad] beyond
    which a wrist has failed. Of the motors: the drive as its host counts, the scale of the counts and the offset at
    each place. Of each place's tendons: their number, all their stiffness [N/m], the time at which they break, and the
    backlash of all; 1 where spools move with the reference, else 0. Friction is that of tendons, or NoFriction.
    """

    plant: Any
    believed: Any
    model_y: Any
    model_z: Any
    gains: Any
    limits: Any
    drive: Any
    winding: Any
    alike: Any
    stiffness: Any
    broken_at: Any
    backlash: Any
    lead: Any
    friction: Any


class SpatialState(NamedTuple):
    """State of the rollouts, [block, row, lane].

    `record` [block, sample, column, lane] takes each sample's values, all or the SPATIAL_BRIEFLY, or has no samples.
    `motors` has two rows for each place, one for the torque that all withhold in each plane, and one for what a plane
    missed of its last torque [N m]; `delivered` is what each motor delivers, `tendons` what rubbing tendons remember,
    `watch` the camera with its observer, or NoCamera.
    """

    coordinates: Any
    memory_y: Any
    memory_z: Any
    alive: Any
    motors: Any
    delivered: Any
    tendons: Any
    sums: Any
    record: Any
    watch: Any


class SpatialScratch(NamedTuple):
    """Rows to work on: what each plane's law sees, and its reference (3,)."""

    now_y: Any
    now_z: Any
    target_y: Any
    target_z: Any


@kernel
def run_spatial(setup: Any, course: Any, world: Any, states: Any, scratch: Any, span: Any) -> None:
    """Advance the span's blocks over its samples of `setup.ticks` control periods each.

    A wrist that bends beyond its limit stays where it was for good.
    """
    period, ticks, m, count = setup.period, setup.ticks, len(setup.coordinates), len(setup.pulls)
    for block in range(span.begin, span.end):
        values, state = block_of(world, block), block_of(states, block)
        rows, model = rows_of(values.plant), rows_of(values.believed)
        still = load_spatial_segments(rows)
        believed = SpatialWrist(load_spatial_segments(model), part(model, FIELDS, setup.tendons))
        alike = part(rows_of(values.alike), 0, setup.pulls)
        drive, friction = drive_in_lanes(values.drive), friction_in_lanes(values.friction)
        known = Knowledge(
            believed, load_segments(rows_of(values.model_y)), load_segments(rows_of(values.model_z)), alike, drive,
            setup.coupling,
        )  # fmt: skip
        control_y = Controlled(setup.law, scratch.now_y, values.model_y, values.gains, state.memory_y, scratch.target_y)
        control_z = Controlled(setup.law, scratch.now_z, values.model_z, values.gains, state.memory_z, scratch.target_z)
        target_y, target_z = rows_of(scratch.target_y), rows_of(scratch.target_z)
        limits, alive = rows_of(values.limits), rows_of(state.alive)
        least, greatest = part(limits, 0, setup.pulls), part(limits, count, setup.pulls)
        winding, broken_at = rows_of(values.winding), rows_of(values.broken_at)
        whole, backlash, lead = rows_of(values.stiffness), rows_of(values.backlash)[0], rows_of(values.lead)[0]
        motors, delivered = rows_of(state.motors), part(rows_of(state.delivered), 0, setup.pulls)
        withheld, missed = part(motors, 2 * count, setup.bend), part(motors, 2 * count + 2, setup.bend)
        coordinates = rows_of(state.coordinates)
        q, rate = part(coordinates, 0, setup.coordinates), part(coordinates, m, setup.coordinates)
        before, pulls, counts, spools = lanes_like(q), lanes_like(least), lanes_like(least), lanes_like(least)
        acts, left, stiffness = lanes_like(least), lanes_like(least), lanes_like(least)
        bend, sums = lanes_like(part(q, 0, setup.bend)), rows_of(state.sums)
        speed, wish, extra = lanes_like(bend), lanes_like(bend), lanes_like(bend)
        at, seen = lanes_like(part(coordinates, 0, (0, 0, 0, 0))), lanes_like(part(coordinates, 0, (0, 0, 0, 0, 0, 0)))
        arms_y, arms_z, arms, zero = lanes_like(least), lanes_like(least), planes_like(least), zero_like(still.length)
        laws, room = Laws(control_y, control_z, least, greatest), Room(bend, speed, wish, extra, arms_y, arms_z, arms)
        for sample in range(span.first, span.last):
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
                at[0], at[1], at[2], at[3], tip = tip_bend(segment, q, rate)
                bent = sqrt(at[0] * at[0] + at[1] * at[1])
                alive[0] = where(bent < limits[2 * count], alive[0], zero)
                sense_bends(state.watch, course.schedule, known, now_tick, at, (counts, bend), period, seen)
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
                since = tick * period
                sees = Seen(seen, withheld, missed)
                wanted, torque, share = respond_in_planes(laws, known, sees, room, since, period, pulls)
                time = now_tick * period + zero
                wish[0] = target_y[0] + since * (target_y[1] + 0.5 * since * target_y[2])
                wish[1] = target_z[0] + since * (target_z[1] + 0.5 * since * target_z[2])
                speed[0] = lead * (target_y[1] + since * target_y[2])
                speed[1] = lead * (target_z[1] + since * target_z[2])
                drive_tendons(drive, motors, known, Aim(wish, speed), pulls, period, counts)
                deliver(drive, winding, backlash, counts, delivered)
                for t in range(count):
                    left[t] = where(time >= broken_at[t], zero, 1.0)
                    stiffness[t] = left[t] * whole[t]
                lose(drive, left, delivered, spools)
                tendons = tendons_on(drive, friction, stiffness, rows_of(state.tendons))
                if tick == 0:
                    pulls_of_tendons(tendons, plant, q, spools, acts)
                    wanted_tip, _, _, _ = spatial_tip(believed.segment, wish)
                    errors = Errors(at[0] - wish[0], at[1] - wish[1], tip - wanted_tip)
                    late = 1.0 if sample >= course.references.shape[2] - course.late else 0.0
                    watch_bends(sums, time, alive[0])
                    gather_bends(sums, sample, late, errors, pulls, acts, share)
                    if sample < state.record.shape[0]:
                        row = rows_of(state.record[sample])
                        row[0] = where(alive[0] > 0.0, at[0], _NAN)
                        row[1] = where(alive[0] > 0.0, at[1], _NAN)
                        if state.record.shape[1] > _BRIEFLY:
                            for t in range(count):
                                row[_COLUMNS + t] = pulls[t]
                                row[_COLUMNS + count + t] = acts[t]
                                row[_COLUMNS + 2 * count + t] = delivered[t]
                            row[2], row[3], row[4], row[5] = at[2], at[3], wanted[0], wanted[1]
                            row[6], row[7], row[8] = torque[0], torque[1], share
                            row[9], row[10], row[11], row[12] = seen[0], seen[3], seen[2], seen[5]
                            for i in range(m):
                                row[_COLUMNS + 3 * count + i] = q[i]
                predict_bends(state.watch, known, now_tick, counts, bend, period)
                for _ in range(setup.substeps):
                    for i in range(m):
                        before[i] = q[i]
                    spatial_step(plant, q, rate, spools, tendons, period / setup.substeps + zero)
                    well = alive[0]
                    for k in range(m // 2):
                        size = q[2 * k] * q[2 * k] + q[2 * k + 1] * q[2 * k + 1]
                        well = where(size < _MOST * _MOST, well, zero)
                    alive[0] = well
                    for i in range(m):
                        q[i] = where(well > 0.0, q[i], before[i])
                        rate[i] = where(well > 0.0, rate[i], zero)
                    remember_travel(tendons, plant, q)
