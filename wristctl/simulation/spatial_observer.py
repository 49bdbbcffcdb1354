"""The observer of a wrist in two planes: that of one plane for each, with what the planes do to each other between.

Its state is x = (bend, rate, load) toward ulnar, then toward flexion. A frame shows both bends or none. Frames are
taken at the same ticks in all lanes; noise and lost frames are each lane's own.
"""

from typing import Any, NamedTuple

from wristctl.control.model import one_segment
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, rows_of, square_like
from wristctl.simulation.observer import NoCamera
from wristctl.simulation.spatial_actuator import believed_pulls, held_stiffness
from wristctl.wrist.spatial.posture import bend_segments, posture_like
from wristctl.wrist.spatial.spatial_dynamics import momenta_like, spatial_bias, spatial_mass_matrix
from wristctl.wrist.spatial.spatial_tendons import arms_about_bend

# Rows of the state of one plane.
OF_A_PLANE = 3


class Ignored(NamedTuple):
    """What the planes do to each other is a disturbance to both."""


class Compensated(NamedTuple):
    """What the planes do to each other is known by the one-segment model in two planes."""


class Knowledge(NamedTuple):
    """What a controller's side knows in two planes.

    The one-segment wrist with its tendons, each plane's Segments, the number of tendons at each place, the drive,
    Ignored or Compensated, and 1 where spools run ahead of the reference, else 0.
    """

    wrist: Any
    model_y: Any
    model_z: Any
    alike: Any
    drive: Any
    coupling: Any


class SpatialSchedule(NamedTuple):
    """Ticks at which frames are taken (F,), how many later they arrive, and are believed to arrive, (1,) each."""

    captures: Any
    late: Any
    believed: Any


class SpatialWatch(NamedTuple):
    """One block's camera and observer.

    What is added to each frame's bends and whether it is seen (F, 3); pictures taken (F, 2); the next frame to take and
    to arrive, and the tick of the last fused one (3,); gains (6,); what was delivered (ring, T); x at the last fused
    frame and now (6,).
    """

    readings: Any
    pictures: Any
    turn: Any
    gain: Any
    delivered: Any
    fused: Any
    now: Any


@by_type
def coupling(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    """Torque (2 rows) [N m] that the planes do to each other at bends, rates and accelerations (2 rows each).

    It is what the one-segment model in two planes asks for beyond each plane's own.
    """
    raise NotImplementedError("compiled code only")


@implements(coupling, Ignored)
def _ignored(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    extra[0] = zero_like(bend[0])
    extra[1] = zero_like(bend[0])


@implements(coupling, Compensated)
def _compensated(kind: Any, known: Any, bend: Any, rate: Any, acceleration: Any, extra: Any) -> None:
    segment, zero = known.wrist.segment, zero_like(bend[0])
    posture, momenta, mass, free = posture_like(bend), momenta_like(bend), square_like(bend), lanes_like(bend)
    free[0], free[1] = zero, zero
    tangent = bend_segments(segment, bend, posture)
    spatial_mass_matrix(segment, posture, tangent, mass, momenta)
    spatial_bias(segment, bend, rate, posture, tangent, free, extra)
    inertia_y, load_y = one_segment(known.model_y, bend[0], rate[0])
    inertia_z, load_z = one_segment(known.model_z, bend[1], rate[1])
    a_y, a_z = acceleration[0], acceleration[1]
    extra[0] = extra[0] - load_y + (mass[0, 0] - inertia_y) * a_y + mass[0, 1] * a_z
    extra[1] = extra[1] - load_z + (mass[1, 1] - inertia_z) * a_z + mass[1, 0] * a_y


@compiled
def propagate_bends(known: Any, x: Any, counts: Any, bend: Any, h: float) -> None:
    """Advance x by one control period h [s] with these counts; `bend` are 2 rows to work on.

    Linearly implicit in each plane's damping and stiffness, as in one plane.
    """
    pulls, arms_y, arms_z = lanes_like(counts), lanes_like(counts), lanes_like(counts)
    rate, still, extra = lanes_like(bend), lanes_like(bend), lanes_like(bend)
    zero = zero_like(x[0])
    bend[0], bend[1], rate[0], rate[1], still[0], still[1] = x[0], x[3], x[1], x[4], zero, zero
    believed_pulls(known.drive, known.wrist, known.alike, bend, counts, pulls)
    torque_y, torque_z, stiff_y, stiff_z = zero, zero, zero, zero
    arms_about_bend(known.wrist, bend, arms_y, arms_z)
    for t in range(len(pulls)):
        stiffness = held_stiffness(known.drive, known.alike[t])
        torque_y, stiff_y = torque_y + pulls[t] * arms_y[t], stiff_y + stiffness * arms_y[t] * arms_y[t]
        torque_z, stiff_z = torque_z + pulls[t] * arms_z[t], stiff_z + stiffness * arms_z[t] * arms_z[t]
    coupling(known.coupling, known, bend, rate, still, extra)
    x[0], x[1] = _advanced(known.model_y, x[0], x[1], torque_y + x[2] - extra[0], stiff_y, h)
    x[3], x[4] = _advanced(known.model_z, x[3], x[4], torque_z + x[5] - extra[1], stiff_z, h)


@compiled
def _advanced(model: Any, angle: Any, speed: Any, torque: Any, tendons: Any, h: float) -> Any:
    inertia, resisting = one_segment(model, angle, speed)
    stiffness = model.stiffness + tendons
    push = torque - resisting - h * stiffness * speed
    speed = speed + h * push / (inertia + h * model.damping + h * h * stiffness)
    return angle + h * speed, speed


@compiled
def go_over(delivered: Any, known: Any, x: Any, ticks: Any, counts: Any, bend: Any, h: float) -> None:
    """Advance x over the ticks from the first up to the last, by what is remembered as delivered (ring, T).

    `counts` and `bend` are rows to work on.
    """
    first, last = ticks
    for past in range(first, last):
        _recall(delivered[past % delivered.shape[0]], counts)
        propagate_bends(known, x, counts, bend, h)


@compiled
def correct_bend(x: Any, gain: Any, plane: int, innovation: Any) -> None:
    """Correct one plane's part of x (6 rows) by the innovation of its bend [rad]."""
    for i in range(OF_A_PLANE * plane, OF_A_PLANE * (plane + 1)):
        x[i] = x[i] + gain[i] * innovation


@by_type
def sense_bends(watch: Any, schedule: Any, known: Any, tick: int, at: Any, before: Any, h: float, out: Any) -> None:
    """What the laws see at a tick, bend, rate and load of each plane, into `out` (6 rows).

    `at` has the true bends and rates (y, z, y, z). Without a camera the laws see these. `before` are the motors' counts
    and the bends that were seen at the last tick.
    """
    raise NotImplementedError("compiled code only")


@implements(sense_bends, NoCamera)
def _as_it_is(watch: Any, schedule: Any, known: Any, tick: int, at: Any, before: Any, h: float, out: Any) -> None:
    zero = zero_like(out[0])
    out[0], out[1], out[2] = at[0], at[2], zero
    out[3], out[4], out[5] = at[1], at[3], zero


@implements(sense_bends, SpatialWatch)
def _observed(watch: Any, schedule: Any, known: Any, tick: int, at: Any, before: Any, h: float, out: Any) -> None:
    turn, frames, (counts, bend) = watch.turn, len(schedule.captures), before
    now = rows_of(watch.now)
    taken, arrived = turn[0], turn[1]
    if taken < frames and schedule.captures[taken] == tick:
        picture, reading = rows_of(watch.pictures[taken]), rows_of(watch.readings[taken])
        picture[0] = at[0] + reading[0]
        picture[1] = at[1] + reading[1]
        taken += 1
        turn[0] = taken
    if arrived < taken and schedule.captures[arrived] + schedule.late[0] == tick:
        captured = max(tick - schedule.believed[0], 0)
        fused, gain = rows_of(watch.fused), rows_of(watch.gain)
        picture, reading = rows_of(watch.pictures[arrived]), rows_of(watch.readings[arrived])
        sent = lanes_like(counts)
        go_over(watch.delivered, known, fused, (turn[2], captured), sent, bend, h)
        for plane in range(2):
            correct_bend(fused, gain, plane, reading[2] * (picture[plane] - fused[OF_A_PLANE * plane]))
        for i in range(2 * OF_A_PLANE):
            now[i] = fused[i]
        go_over(watch.delivered, known, now, (captured, tick), sent, bend, h)
        turn[1], turn[2] = arrived + 1, captured
    for i in range(2 * OF_A_PLANE):
        out[i] = now[i]


@compiled
def _recall(row: Any, sent: Any) -> None:
    before = rows_of(row)
    for t in range(len(sent)):
        sent[t] = before[t]


@by_type
def predict_bends(watch: Any, known: Any, tick: int, counts: Any, bend: Any, h: float) -> None:
    """Remember what is counted over this tick and go on over it; nothing without a camera."""
    raise NotImplementedError("compiled code only")


@implements(predict_bends, NoCamera)
def _nothing(watch: Any, known: Any, tick: int, counts: Any, bend: Any, h: float) -> None:
    pass


@implements(predict_bends, SpatialWatch)
def _predict(watch: Any, known: Any, tick: int, counts: Any, bend: Any, h: float) -> None:
    sent = rows_of(watch.delivered[tick % watch.delivered.shape[0]])
    for t in range(len(counts)):
        sent[t] = counts[t]
    propagate_bends(known, rows_of(watch.now), counts, bend, h)
