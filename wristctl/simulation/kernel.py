"""The compiled closed loop of blocks of lanes.

reference -> law -> allocation -> actuator -> plant with its disturbances -> metrics, sensor and observer -> law.
"""

from typing import Any, NamedTuple

from wristctl.control.law import now_of
from wristctl.control.response import Controlled, look_ahead, respond
from wristctl.lanes.compiled import compiled, spelled_out
from wristctl.lanes.lane import where
from wristctl.lanes.parts import block_of
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.actuator import Drive, actuate, read_motor, read_winding, wound
from wristctl.simulation.nonideal import worn
from wristctl.simulation.observer import go_on, sense
from wristctl.simulation.sums import SUMS, gather, goals_of, watch_range
from wristctl.wrist.allocation import torque_of
from wristctl.wrist.elastic import Tendons, pulls_at_start, read_nonideal
from wristctl.wrist.moving import advance_or_stop
from wristctl.wrist.plant import disturbed, parameters_of, path_before, tip_angle
from wristctl.wrist.segments import load_segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE

RECORDED = (
    "theta", "rate", "torque_wanted", "torque", "tension_plus", "tension_minus", "acting_plus", "acting_minus", "seen",
    "load",
)  # fmt: skip
"""Columns of a recorded sample, followed by the plant's coordinates: tensions as commanded and as they act, the
angle that the law sees, and the load that its observer estimates. theta is nan where the lane has failed."""

BRIEFLY = RECORDED[:4]
"""Those of them that are recorded where no more are asked for."""
_ALIVE, _STEP_ERROR = SUMS.index("alive"), SUMS.index("step_error")
_COLUMNS, _BRIEFLY = len(RECORDED), len(BRIEFLY)
_SIDE = float(TENDONS_PER_SIDE)
_NAN = float("nan")


class Setup(NamedTuple):
    """What is the same for all lanes. `level` is the actuator's, None where it is ideal; the law looks `preview`
    periods ahead."""

    law: Any
    plant: Any
    coordinates: Any
    level: Any
    period: float
    substeps: int
    ticks: int
    preview: int


class LoopCourse(NamedTuple):
    """What happens over time, on the sample grid.

    `references` [motion, (angle, rate, acceleration), sample], continued between samples by its own derivatives;
    `acting` [case, (tip force, stiffness scale), sample] or None.
    """

    references: Any
    acting: Any


class LoopValues(NamedTuple):
    """Values that stay, [block, row, lane]; with one block only they are every block's.

    `plant`, `tendons`, `nonideal` and `winding` are what is, `model`, `limits` and `motor` what the controller's side
    believes. `tendons` is a side's stiffness, None where pulls are held; `nonideal` None where nothing is; `schedule`
    the ticks of frames, None where sensors are ideal.
    """

    plant: Any
    model: Any
    limits: Any
    motor: Any
    tendons: Any
    nonideal: Any
    winding: Any
    gains: Any
    goals: Any
    schedule: Any


class LoopState(NamedTuple):
    """What goes on, by block first: a long run may be done in pieces.

    `which` and `case` are each lane's motion and case of disturbances, `coordinates` the plant's with their rates,
    `tendons` what is remembered of tendons and springs that are not ideal, or None.
    `record` [block, sample, column, lane] takes each sample's values, all or BRIEFLY, or has no samples. `watch` is the
    camera with its observer, None where sensors are ideal.
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

    A lane leaves the game when its wrist leaves its range (or a segment bends beyond a full turn). What is None is not
    compiled in.
    """
    for block in range(span.begin, span.end):
        _run_block(setup, course, block_of(world, block), block_of(state, block), scratch, span.first, span.last)


@spelled_out
def _run_block(setup: Any, course: Any, world: Any, state: Any, scratch: Any, first: int, last: int) -> None:
    cut, period, ticks = setup.coordinates, setup.period, setup.ticks
    undisturbed = parameters_of(setup.plant, rows_of(world.plant))
    known, drive = load_segments(rows_of(world.model)), drive_in(setup.level, world.motor)
    tendons = _tendons(world.tendons, world.nonideal, state.tendons)
    winding = read_winding(rows_of(world.winding))
    control = Controlled(setup.law, scratch.now, world.model, world.gains, state.memory, scratch.target)
    view, bound, goal = now_of(scratch.now), rows_of(world.limits), goals_of(world.goals)
    motor, sum_ = rows_of(state.motors), rows_of(state.sums)
    low, high = _SIDE * bound[0], _SIDE * bound[1]
    n = len(cut)
    q, rates = part(rows_of(state.coordinates), 0, cut), part(rows_of(state.coordinates), n, cut)
    zero = 0.0 * low
    h = period / setup.substeps + zero
    targets, acts = scratch.target.reshape(3, len(state.which)), scratch.acting.reshape(2, len(state.case))
    acting = rows_of(scratch.acting)
    for sample in range(first, last):
        gather_lanes(course.references, state.which, sample, targets)
        plant = _under(course.acting, state.case, sample, acts, acting, undisturbed)
        for tick in range(ticks):
            now_tick = sample * ticks + tick
            angle, rate = tip_angle(plant, q, rates)
            seen = sense(world.schedule, state.watch, drive, known, now_tick, angle, rate, period)
            for ahead in range(1, setup.preview + 1):
                to_come = min((now_tick + ahead) // ticks, course.references.shape[2] - 1)
                gather_lanes(course.references, state.which, to_come, targets)
                look_ahead(control, ahead, (now_tick + ahead - to_come * ticks) * period)
            if setup.preview > 0:
                gather_lanes(course.references, state.which, sample, targets)
            wanted, torque_low, torque_high, plus, minus = respond(
                control, known, seen, (low, high), tick * period, period
            )
            theta_ref = view.theta_ref
            given_plus, given_minus = actuate(drive, motor, known, theta_ref, plus, minus, period)
            time, path = now_tick * period + zero, path_before(tendons, plant, q)
            delivered = wound(drive, winding, given_plus, given_minus)
            reeled = worn(tendons, delivered, (winding.scale * motor[1], winding.scale * motor[3]), time, path)
            acting_plus, acting_minus = pulls_at_start(tendons, reeled, path)
            saturated = where((wanted > torque_high) | (wanted < torque_low), 1.0, zero)
            watch_range(sum_, time, angle, bound[2])
            gather(sum_, goal, time, angle, theta_ref, acting_plus / _SIDE, acting_minus / _SIDE, saturated)
            if tick == 0 and sample < state.record.shape[0]:
                row = rows_of(state.record[sample])
                row[0] = where(sum_[_ALIVE] > zero, angle, _NAN)
                row[1] = rate
                row[2] = wanted
                row[3] = torque_of(seen.theta, known, plus, minus)
                if state.record.shape[1] > _BRIEFLY:
                    row[4] = plus / _SIDE
                    row[5] = minus / _SIDE
                    row[6] = acting_plus / _SIDE
                    row[7] = acting_minus / _SIDE
                    row[8] = seen.theta
                    row[9] = seen.load
                    for i in range(n):
                        row[_COLUMNS + i] = q[i]
            go_on(state.watch, drive, known, now_tick, given_plus, given_minus, period)
            for _ in range(setup.substeps):
                sum_[_ALIVE], error = advance_or_stop(plant, q, rates, reeled, tendons, h, sum_[_ALIVE])
                sum_[_STEP_ERROR] = sum_[_STEP_ERROR] + error


@compiled
def drive_in(level: Any, motor: Any) -> Any:
    """The Drive of these motors' rows; None where the actuator is ideal."""
    if level is None:
        return None
    return Drive(level, read_motor(rows_of(motor)))


@compiled
def _tendons(stiffness: Any, nonideal: Any, state: Any) -> Any:
    if stiffness is None:
        return None
    return Tendons(rows_of(stiffness)[0], _nonideal(nonideal), _rows(state))


@compiled
def _nonideal(values: Any) -> Any:
    if values is None:
        return None
    return read_nonideal(rows_of(values))


@compiled
def _rows(state: Any) -> Any:
    if state is None:
        return None
    return rows_of(state)


@compiled
def gather_lanes(tables: Any, which: Any, sample: int, out: Any) -> None:
    """Each lane's own values of one sample, from tables [case, value, sample] into [value, lane]."""
    for value in range(out.shape[0]):
        for lane in range(len(which)):
            out[value, lane] = tables[which[lane], value, sample]


@compiled
def _under(tables: Any, which: Any, sample: int, out: Any, acting: Any, plant: Any) -> Any:
    """The plant under one sample's disturbances, which are gathered into `out`, the memory of the rows `acting`."""
    if tables is None:
        return plant
    gather_lanes(tables, which, sample, out)
    return disturbed(plant, acting[0], acting[1])
