"""The compiled closed loop of blocks of lanes, of P planes and T places of tendons.

reference -> law of each plane -> allocation -> actuator -> plant with its disturbances -> metrics, sensor and
observer -> law. P and T are lengths of tuples: what is compiled for one plane and two sides has no loops over them.
"""

from typing import Any, NamedTuple

from wristctl.control.belief import Limits, belief_in_lanes
from wristctl.control.law import now_at
from wristctl.control.response import FULL, OF_A_PLANE, Controlled, Seen, look_ahead, respond, room_like
from wristctl.lanes.compiled import by_type, compiled, implements, nothing, spelled_out
from wristctl.lanes.functions import norm
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.named_tuples import block_of, borrowed
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import Aim, actuate, deliver
from wristctl.simulation.nonideal import spools_after_slip
from wristctl.simulation.observer import Knowing, go_on, sense
from wristctl.simulation.simulated_drives import IdealDrive, LaggedDrive, ServoDrive, SpoolDrive, drive_in_lanes
from wristctl.simulation.sums import SUMS, gather, watch_range
from wristctl.wrist.plant import advance_or_stop, bend_of, disturbed, parameters_of, path_before
from wristctl.wrist.tendon_mechanics import acting_pulls, tendons_in_lanes

_ALIVE, _STEP_ERROR = SUMS.index("alive"), SUMS.index("step_error")
_NAN = float("nan")


# What is recorded of each plane, and of each place.
_OF_PLANES = ("bend", "rate", "torque_wanted", "torque", "seen", "load")
_KINDS = (*_OF_PLANES[:4], "tension", "acting", *_OF_PLANES[4:], "delivered")


def parts_of_sample(planes: int, places: int) -> dict[str, slice]:
    """Where a recorded sample of P planes and T places has each kind of value; the plant's coordinates come last.

    Tensions are those of one tendon of a place, as commanded and as they act. After them come the bends that the law
    sees, the load that its observer estimates, and what motors deliver: pulls [N], or lengths on spools [m]. In two
    planes the share of the wanted torque that the tendons could give is last. The bend is nan where the lane has
    failed.
    """
    parts, begin = dict[str, slice](), 0
    for kind in _KINDS:
        parts[kind] = slice(begin, begin := begin + (planes if kind in _OF_PLANES else places))
    if planes > 1:
        parts["share"] = slice(begin, begin := begin + 1)
    return parts | {"coordinates": slice(begin, None)}


def columns_of_sample(planes: int, places: int) -> tuple[str, ...]:
    """Columns of `parts_of_sample` by their names, but for the coordinates."""
    of_planes = ("_ulnar", "_flexion") if planes > 1 else ("",)
    of_places = tuple(f"_{t + 1}" for t in range(places)) if planes > 1 else ("_plus", "_minus")
    names = [f"{kind}{end}" for kind in _KINDS for end in (of_planes if kind in _OF_PLANES else of_places)]
    return (*names, "share") if planes > 1 else ("theta", *names[1:])


def columns_of_brief(planes: int) -> int:
    """Number of columns that are recorded where no more are asked for: bends, rates, torques wanted and given."""
    return 4 * planes


# Columns in one plane, and those that are recorded where no more are asked for.
RECORDED = columns_of_sample(1, 2)
BRIEFLY = RECORDED[: columns_of_brief(1)]


class Setup(NamedTuple):
    """Values that all lanes share.

    `coordinates`, `bend`, `pulls`, `arms` and `seen` are tuples with an entry, whose value means nothing, for each of
    the plant's coordinates, each plane, each place of tendons, each moment arm (P T) and each value seen (3 P). The law
    looks `preview` periods ahead.
    """

    law: Any
    plant: Any
    coordinates: Any
    bend: Any
    pulls: Any
    arms: Any
    seen: Any
    period: float
    substeps: int
    ticks: int
    preview: int


class Undisturbed(NamedTuple):
    """Nothing acts on the wrist unknown to its controller."""


class Disturbed(NamedTuple):
    """Disturbances [case, (tip force along the base, toward ulnar and toward flexion, stiffness scale), sample].

    In one plane the second is toward that plane, and the third is nothing.
    """

    cases: Any


class LoopCourse(NamedTuple):
    """Course of references and disturbances over time, on the sample grid.

    `references` [motion, (bend, rate, acceleration) of each plane, sample], continued between samples by its own
    derivatives; `acting` is Disturbed or Undisturbed.
    """

    references: Any
    acting: Any


class LoopValues(NamedTuple):
    """Values that stay, [block, row, lane]; with one block only they are every block's.

    `plant` and `winding` are what is, `belief`, `limits` and `drive` what the controller's side believes; limits are
    the least and the greatest pull at each place, then the bend beyond which a wrist has failed. `lead` is 1 where
    spools move with the reference, else 0. `schedule` has the ticks of frames, or is NoCamera.
    """

    plant: Any
    belief: Any
    limits: Any
    drive: Any
    lead: Any
    winding: Any
    gains: Any
    goals: Any
    schedule: Any


class LoopState(NamedTuple):
    """State of the rollouts, by block first: a long run may be done in pieces.

    `which` and `case` are each lane's motion and case of disturbances, `memory` is the law's in each plane,
    `coordinates` the plant's with their rates, `tendons` as they are with their state
    (`wristctl.wrist.tendon_mechanics`). `record` [block, sample, column, lane] takes each sample's values, all or
    briefly, or has no samples. `watch` is the camera with its observer, or NoCamera.
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
    """Rows to work on: what the law sees and the reference (3,) of each plane, and the disturbance (4,)."""

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
    of_all, room = borrowed(course), borrowed(scratch)
    for block in range(span.begin, span.end):
        _run_block(setup, of_all, block_of(world, block), block_of(state, block), room, span.first, span.last)


@spelled_out
def _run_block(setup: Any, course: Any, world: Any, state: Any, scratch: Any, first: int, last: int) -> None:
    coordinates, period, ticks = setup.coordinates, setup.period, setup.ticks
    planes, count, n = len(setup.bend), len(setup.pulls), len(coordinates)
    undisturbed = parameters_of(setup.plant, rows_of(world.plant), setup.pulls)
    known, drive = belief_in_lanes(world.belief), drive_in_lanes(world.drive)
    tendons = tendons_in_lanes(state.tendons)
    winding, lead = rows_of(world.winding), rows_of(world.lead)[0]
    control = Controlled(setup.law, scratch.now, world.belief.models, world.gains, state.memory, scratch.target)
    bound, goals = rows_of(world.limits), rows_of(world.goals)
    motor, sum_ = rows_of(state.motors), rows_of(state.sums)
    every = rows_of(state.coordinates)
    q, rates = part(every, 0, coordinates), part(every, n, coordinates)
    limits = Limits(part(bound, 0, setup.pulls), part(bound, count, setup.pulls))
    bend, speed = lanes_like(part(every, 0, setup.bend)), lanes_like(part(every, 0, setup.bend))
    wish, wish_rate = lanes_like(bend), lanes_like(bend)
    pulls, counts, acts = lanes_like(limits.least), lanes_like(limits.least), lanes_like(limits.least)
    delivered, speeds, held = lanes_like(limits.least), lanes_like(limits.least), lanes_like(limits.least)
    room = room_like(bend, part(every, 0, setup.arms))
    aim, knowing = Aim(wish, wish_rate, lanes_like(room.arms)), Knowing(known, drive, bend, pulls, room.arms)
    rows = lanes_like(part(every, 0, setup.seen))
    seen = Seen(rows, part(motor, 2 * count, setup.bend), part(motor, 2 * count + planes, setup.bend))
    zero, of_one = zero_like(bound[0]), lanes_like(pulls)
    for t in range(count):
        of_one[t] = 1.0 / known.alike[t]
    h = period / setup.substeps + zero
    targets = scratch.target.reshape(3 * planes, len(state.which))
    acting, acting_lanes = rows_of(scratch.acting), scratch.acting.reshape(4, len(state.case))
    for sample in range(first, last):
        gather_lanes(course.references, state.which, sample, targets)
        plant = _under(course.acting, state.case, sample, acting_lanes, acting, undisturbed)
        for tick in range(ticks):
            now_tick = sample * ticks + tick
            bend_of(plant, q, rates, bend, speed)
            sense(state.watch, world.schedule, knowing, now_tick, bend, speed, period, rows)
            for ahead in range(1, setup.preview + 1):
                to_come = min((now_tick + ahead) // ticks, course.references.shape[2] - 1)
                gather_lanes(course.references, state.which, to_come, targets)
                look_ahead(control, bend, ahead, (now_tick + ahead - to_come * ticks) * period)
            if setup.preview > 0:
                gather_lanes(course.references, state.which, sample, targets)
            share = respond(control, known, seen, limits, room, tick * period, period, pulls)
            for p in range(planes):
                view = now_at(scratch.now, p)
                wish[p] = view.theta_ref
                wish_rate[p] = lead * view.rate_ref
            actuate(drive, motor, known, aim, pulls, period, counts)
            time, path = now_tick * period + zero, path_before(tendons, plant, q)
            told = motor, winding, counts, bend, period
            deliver(drive, told, zero, (delivered, speeds))
            spools_after_slip(tendons, delivered, speeds, time, path, held)
            acting_pulls(tendons, held, path, acts)
            watch_range(sum_, time, bend, bound[2 * count])
            for t in range(count):
                acts[t] = acts[t] * of_one[t]
            limited = where(norm(seen.withheld) > 0.0, 1.0, zero)
            gather(sum_, goals, time, bend, wish, acts, where(share < FULL, 1.0, zero), limited)
            if tick == 0 and sample < state.record.shape[0]:
                row = rows_of(state.record[sample])
                for p in range(planes):
                    row[p] = where(sum_[_ALIVE] > zero, bend[p], _NAN)
                    row[planes + p] = speed[p]
                    row[2 * planes + p] = room.wanted[p]
                    row[3 * planes + p] = room.torque[p]
                if state.record.shape[1] > 4 * planes:
                    for t in range(count):
                        pulls[t] = pulls[t] * of_one[t]
                    _record(row, (pulls, acts, delivered), rows, share, q)
            go_on(state.watch, knowing, now_tick, counts, period)
            for step in range(setup.substeps):
                _onward(drive, told, (time, step * h, h), (delivered, speeds, held), tendons, plant, q)
                sum_[_ALIVE], error = advance_or_stop(plant, q, rates, held, tendons, h, sum_[_ALIVE])
                sum_[_STEP_ERROR] = sum_[_STEP_ERROR] + error


@by_type
def _onward(drive: Any, told: Any, step: Any, spools: Any, tendons: Any, plant: Any, q: Any) -> None:
    """Write what drives the tendons over a step into the last of `spools` (delivered, speeds, held).

    `step` is the tick's time, by how much later the step begins, and how long it is [s].
    """


implements(_onward, IdealDrive, LaggedDrive)(nothing)


@implements(_onward, SpoolDrive, ServoDrive)
def _turns_on(drive: Any, told: Any, step: Any, spools: Any, tendons: Any, plant: Any, q: Any) -> None:
    (tick, since, h), (delivered, speeds, held) = step, spools
    deliver(drive, told, since + 0.5 * h, (delivered, speeds))
    spools_after_slip(tendons, delivered, speeds, tick + since, path_before(tendons, plant, q), held)


@compiled
def _record(row: Any, tensions: Any, seen: Any, share: Any, q: Any) -> None:
    """Record what is not recorded briefly: tensions commanded and acting, what is seen, delivered, shared, and q."""
    commanded, acts, delivered = tensions
    count, planes = len(acts), len(seen) // OF_A_PLANE
    at = 4 * planes
    for t in range(count):
        row[at + t] = commanded[t]
        row[at + count + t] = acts[t]
        row[at + 2 * count + 2 * planes + t] = delivered[t]
    for p in range(planes):
        row[at + 2 * count + p] = seen[OF_A_PLANE * p]
        row[at + 2 * count + planes + p] = seen[OF_A_PLANE * p + 2]
    last = at + 3 * count + 2 * planes
    if planes > 1:
        row[last] = share
        last += 1
    for i in range(len(q)):
        row[last + i] = q[i]


@compiled
def gather_lanes(tables: Any, which: Any, sample: int, out: Any) -> None:
    """Gather every lane's values of one sample, from tables [case, value, sample] into [value, lane]."""
    for value in range(out.shape[0]):
        for lane in range(len(which)):
            out[value, lane] = tables[which[lane], value, sample]


@by_type
def _under(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    """The plant under one sample's disturbances, which are gathered into `out`, the memory of the rows."""


@implements(_under, Undisturbed)
def _undisturbed(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    return plant


@implements(_under, Disturbed)
def _disturbed(acting: Any, which: Any, sample: int, out: Any, rows: Any, plant: Any) -> Any:
    gather_lanes(acting.cases, which, sample, out)
    return disturbed(plant, rows, rows[3])
