"""The compiled closed loop of blocks of lanes.

reference -> law -> allocation -> actuator -> plant with its disturbances -> metrics, sensor and observer -> law.
"""

from typing import Any, NamedTuple

from wristctl.control.law import now_of
from wristctl.control.response import Controlled, look_ahead, respond
from wristctl.lanes.compiled import by_type, compiled, implements, spelled_out
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.named_tuples import block_of
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import WITHHELD, Aim, actuate, drive_in_lanes, read_winding, wound
from wristctl.simulation.nonideal import spools_after_slip
from wristctl.simulation.observer import go_on, sense
from wristctl.simulation.sums import SUMS, gather, goals_of, watch_range
from wristctl.wrist.plant import advance_or_stop, disturbed, parameters_of, path_before, tip_angle
from wristctl.wrist.segments import load_segments
from wristctl.wrist.tendon_mechanics import pulls_at_start, tendons_in_lanes
from wristctl.wrist.tendons import TENDONS_PER_SIDE, torque_of

# Columns of a recorded sample, followed by the plant's coordinates: tensions as commanded and as they act, the
# angle that the law sees, the load that its observer estimates, and what each side's motors deliver: pulls [N], or
# lengths on spools [m]. theta is nan where the lane has failed.
RECORDED = (
    "theta", "rate", "torque_wanted", "torque", "tension_plus", "tension_minus", "acting_plus", "acting_minus", "seen",
    "load", "delivered_plus", "delivered_minus",
)  # fmt: skip

# Columns that are recorded where no more are asked for.
BRIEFLY = RECORDED[:4]
_ALIVE, _STEP_ERROR = SUMS.index("alive"), SUMS.index("step_error")
_COLUMNS, _BRIEFLY = len(RECORDED), len(BRIEFLY)
_SIDE = float(TENDONS_PER_SIDE)
_NAN = float("nan")


class Setup(NamedTuple):
    """Values that all lanes share. `coordinates` has an entry for each of the plant's, whose values mean nothing.

    The law looks `preview` periods ahead.
    """

    law: Any
    plant: Any
    coordinates: Any
    period: float
    substeps: int
    ticks: int
    preview: int


class Undisturbed(NamedTuple):
    """Nothing acts on the wrist unknown to its controller."""


class Disturbed(NamedTuple):
    """Disturbances [case, (tip force, stiffness scale), sample]."""

    cases: Any


class LoopCourse(NamedTuple):
    """Course of references and disturbances over time, on the sample grid.

    `references` [motion, (angle, rate, acceleration), sample], continued between samples by its own derivatives;
    `acting` is Disturbed or Undisturbed.
    """

    references: Any
    acting: Any


class LoopValues(NamedTuple):
    """Values that stay, [block, row, lane]; with one block only they are every block's.

    `plant` and `winding` are what is, `model`, `limits` and `drive` what the controller's side believes. `lead` is 1
    where spools move with the reference, else 0. `schedule` has the ticks of frames, or is NoCamera.
    """

    plant: Any
    model: Any
    limits: Any
    drive: Any
    lead: Any
    winding: Any
    gains: Any
    goals: Any
    schedule: Any


class LoopState(NamedTuple):
    """State of the rollouts, by block first: a long run may be done in pieces.

    `which` and `case` are each lane's motion and case of disturbances, `coordinates` the plant's with their rates,
    `tendons` one of `wristctl.wrist.tendon_mechanics.Tendons` as they are, with their state.
    `record` [block, sample, column, lane] takes each sample's values, all or BRIEFLY, or has no samples. `watch` is the
    camera with its observer, or NoCamera.
    """

    which: Any
    case: Any
    memory: Any
    coordinates: Any
    motors: Any
    tendons: Any
    sums: Any
    record: Any
    watch: Any


class Scratch(NamedTuple):
    """Rows to work on: what the law sees, the reference (3,), and the disturbance (2,)."""

    now: Any
    target: Any
    acting: Any


class Span(NamedTuple):
    """Blocks `begin` to `end`, samples `first` to `last`."""

    begin: int
    end: int
    first: int
    last: int


def run_blocks(setup: Any, course: Any, world: Any, state: Any, scratch: Any, span: Any) -> None:
    """Advance the span's blocks, one by one, over its samples of `setup.ticks` control periods each.

    A lane leaves the game when its wrist leaves its range (or a segment bends beyond a full turn). What a loop does
    not have, NoCamera or NoTendons, is not compiled in.
    """
    for block in range(span.begin, span.end):
        _run_block(setup, course, block_of(world, block), block_of(state, block), scratch, span.first, span.last)


@spelled_out
def _run_block(setup: Any, course: Any, world: Any, state: Any, scratch: Any, first: int, last: int) -> None:
    coordinates, period, ticks = setup.coordinates, setup.period, setup.ticks
    undisturbed = parameters_of(setup.plant, rows_of(world.plant))
    believed, drive = load_segments(rows_of(world.model)), drive_in_lanes(world.drive)
    tendons = tendons_in_lanes(state.tendons)
    winding, lead = read_winding(rows_of(world.winding)), rows_of(world.lead)[0]
    control = Controlled(setup.law, scratch.now, world.model, world.gains, state.memory, scratch.target)
    view, bound, goal = now_of(scratch.now), rows_of(world.limits), goals_of(world.goals)
    motor, sum_ = rows_of(state.motors), rows_of(state.sums)
    low, high = _SIDE * bound[0], _SIDE * bound[1]
    n = len(coordinates)
    q, rates = part(rows_of(state.coordinates), 0, coordinates), part(rows_of(state.coordinates), n, coordinates)
    zero = zero_like(low)
    h = period / setup.substeps + zero
    targets, acts = scratch.target.reshape(3, len(state.which)), scratch.acting.reshape(2, len(state.case))
    acting = rows_of(scratch.acting)
    for sample in range(first, last):
        gather_lanes(course.references, state.which, sample, targets)
        plant = _under(course.acting, state.case, sample, acts, acting, undisturbed)
        for tick in range(ticks):
            now_tick = sample * ticks + tick
            angle, rate = tip_angle(plant, q, rates)
            estimate = sense(state.watch, world.schedule, drive, believed, now_tick, angle, rate, period)
            for ahead in range(1, setup.preview + 1):
                to_come = min((now_tick + ahead) // ticks, course.references.shape[2] - 1)
                gather_lanes(course.references, state.which, to_come, targets)
                look_ahead(control, ahead, (now_tick + ahead - to_come * ticks) * period)
            if setup.preview > 0:
                gather_lanes(course.references, state.which, sample, targets)
            wanted, torque_low, torque_high, plus, minus = respond(
                control, believed, estimate, motor[WITHHELD], (low, high), tick * period, period
            )
            theta_ref = view.theta_ref
            aim = Aim(theta_ref, lead * view.rate_ref)
            counted_plus, counted_minus = actuate(drive, motor, believed, aim, plus, minus, period)
            time, path = now_tick * period + zero, path_before(tendons, plant, q)
            delivered = wound(drive, winding, counted_plus, counted_minus)
            speeds = winding.scale * motor[1], winding.scale * motor[3]
            spool_input = spools_after_slip(tendons, delivered, speeds, time, path)
            acting_plus, acting_minus = pulls_at_start(tendons, spool_input, path)
            saturated = where((wanted > torque_high) | (wanted < torque_low), 1.0, zero)
            watch_range(sum_, time, angle, bound[2])
            gather(sum_, goal, time, angle, theta_ref, acting_plus / _SIDE, acting_minus / _SIDE, saturated)
            if tick == 0 and sample < state.record.shape[0]:
                row = rows_of(state.record[sample])
                row[0] = where(sum_[_ALIVE] > zero, angle, _NAN)
                row[1] = rate
                row[2] = wanted
                row[3] = torque_of(estimate.theta, believed, plus, minus)
                if state.record.shape[1] > _BRIEFLY:
                    row[4] = plus / _SIDE
                    row[5] = minus / _SIDE
                    row[6] = acting_plus / _SIDE
                    row[7] = acting_minus / _SIDE
                    row[8] = estimate.theta
                    row[9] = estimate.load
                    row[10] = delivered[0]
                    row[11] = delivered[1]
                    for i in range(n):
                        row[_COLUMNS + i] = q[i]
            go_on(state.watch, drive, believed, now_tick, counted_plus, counted_minus, period)
            for _ in range(setup.substeps):
                sum_[_ALIVE], error = advance_or_stop(plant, q, rates, spool_input, tendons, h, sum_[_ALIVE])
                sum_[_STEP_ERROR] = sum_[_STEP_ERROR] + error


@compiled
def gather_lanes(tables: Any, which: Any, sample: int, out: Any) -> None:
    """Gather every lane's values of one sample, from tables [case, value, sample] into [value, lane]."""
    for value in range(out.shape[0]):
        for lane in range(len(which)):
            out[value, lane] = tables[which[lane], value, sample]


@by_type
def _under(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    """The plant under one sample's disturbances, which are gathered into `out`, the memory of the rows."""
    raise NotImplementedError("compiled code only")


@implements(_under, Undisturbed)
def _undisturbed(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    return plant


@implements(_under, Disturbed)
def _disturbed(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    gather_lanes(acting.cases, which, sample, out)
    return disturbed(plant, rows[0], rows[1])
