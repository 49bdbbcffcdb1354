"""The compiled closed loop of blocks of lanes.

reference -> law -> allocation -> actuator -> plant with its disturbances -> metrics, sensor and observer -> law.
"""

from __future__ import annotations

from typing import Any

from wristctl.control.law import now_of, wrist_of
from wristctl.control.response import respond
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import ARC_LIMIT
from wristctl.lanes.lane import where
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.actuator import actuate, pulls
from wristctl.simulation.disturbances import disturb
from wristctl.simulation.metrics import SUMS, gather, goals_of
from wristctl.simulation.observer import expect, of_block, watch
from wristctl.wrist.allocation import TENDONS_PER_SIDE, torque_of
from wristctl.wrist.integrator import step
from wristctl.wrist.segments import load_segments

RECORDED = (
    "theta", "rate", "torque_wanted", "torque", "tension_plus", "tension_minus", "acting_plus", "acting_minus", "seen",
)  # fmt: skip
"""Columns of a recorded sample, followed by the angle of each segment: tensions as commanded and as they act, and the
angle that the law sees. theta is nan where the lane has failed."""

_ALIVE = SUMS.index("alive")
_COLUMNS = len(RECORDED)
_SIDE = float(TENDONS_PER_SIDE)
_NAN = float("nan")


@compiled
def run_blocks(
    law: Any, plant: Any, model: Any, limits: Any, gains: Any, goals: Any, courses: Any, which: Any, memory: Any,
    state: Any, sums: Any, record: Any, drive: Any, motors: Any, watched: Any, disturbed: Any, now: Any, target: Any,
    period: float, substeps: int, ticks: int, begin: int, end: int, first: int, last: int,
    segments: Any,
) -> None:  # fmt: skip
    """Advance blocks `begin` to `end`, one by one, from sample `first` to `last`, `ticks` control periods each.

    `gains`, `goals`, `which`, `memory`, `state`, `sums`, `record`, `motors` and `watched` have the block as their
    first axis. Each lane follows `courses[which]`, [motion, sample, (angle, rate, acceleration)], continued between
    samples by its own derivatives; `state`, `memory` and `sums` carry the loop on, so that a long run may be done in
    pieces. `record` takes each sample's values, or has no samples. `drive` with its state `motors` are the actuators,
    `watched` is a camera with its observer, `disturbed` holds (tip force, stiffness scale) of each sample; each of the
    three is None where it is ideal or absent, and then not compiled in. `now` and `target` are scratch rows. A lane
    leaves the game when a segment bends beyond a full turn.
    """
    for block in range(begin, end):
        _run_block(
            law, plant, model, limits, gains[block], goals[block], courses, which[block], memory[block], state[block],
            sums[block], record[block], drive, motors[block], of_block(watched, block), disturbed, now, target,
            period, substeps, ticks, first, last, segments,
        )  # fmt: skip


@compiled
def _run_block(
    law: Any, plant: Any, model: Any, limits: Any, gains: Any, goals: Any, courses: Any, which: Any, memory: Any,
    state: Any, sums: Any, record: Any, drive: Any, motors: Any, watched: Any, disturbed: Any, now: Any, target: Any,
    period: float, substeps: int, ticks: int, first: int, last: int, segments: Any,
) -> None:  # fmt: skip
    undisturbed = load_segments(rows_of(plant))
    wrist = undisturbed
    motor = rows_of(motors)
    known, seen, view = load_segments(rows_of(model)), wrist_of(model), now_of(now)
    bound, gain, goal, kept, sum_ = rows_of(limits), rows_of(gains), goals_of(goals), rows_of(memory), rows_of(sums)
    low, high = _SIDE * bound[0], _SIDE * bound[1]
    signals, reference = rows_of(now), rows_of(target)
    n = len(segments)
    theta, omega = part(rows_of(state), 0, segments), part(rows_of(state), n, segments)
    old_theta, old_omega = lanes_like(theta), lanes_like(theta)
    zero = 0.0 * low
    h = period / substeps + zero
    targets = target.reshape(3, len(which))
    for sample in range(first, last):
        for signal in range(3):
            for lane in range(len(which)):
                targets[signal, lane] = courses[which[lane], sample, signal]
        if disturbed is not None:
            wrist = disturb(undisturbed, disturbed[sample, 0], disturbed[sample, 1])
        for tick in range(ticks):
            since = tick * period
            angle, rate = zero, zero
            for i in range(n):
                angle = angle + theta[i]
                rate = rate + omega[i]
            angle_seen, rate_seen = angle, rate
            now_tick = sample * ticks + tick
            if watched is not None:
                camera, observer = watched
                watch(camera, observer, drive, known, now_tick, angle, period)
                angle_seen, rate_seen = rows_of(observer.now)[0], rows_of(observer.now)[1]
            wanted, torque_low, torque_high, plus, minus = respond(
                law, view, signals, seen, known, gain, kept, angle_seen, rate_seen, reference, since, low, high, period
            )
            theta_ref = view.theta_ref
            given_plus, given_minus = actuate(drive, motor, known, theta_ref, plus, minus, period)
            acting_plus, acting_minus = pulls(drive, wrist, theta, omega, 1.0, given_plus, given_minus)
            saturated = where((wanted > torque_high) | (wanted < torque_low), 1.0, zero)
            time = now_tick * period + zero
            gather(sum_, goal, time, angle, theta_ref, acting_plus / _SIDE, acting_minus / _SIDE, saturated)
            if tick == 0 and sample < record.shape[0]:
                row = rows_of(record[sample])
                row[0] = where(sum_[_ALIVE] > zero, angle, _NAN)
                row[1] = rate
                row[2] = wanted
                row[3] = torque_of(angle_seen, known, plus, minus)
                row[4] = plus / _SIDE
                row[5] = minus / _SIDE
                row[6] = acting_plus / _SIDE
                row[7] = acting_minus / _SIDE
                row[8] = angle_seen
                for i in range(n):
                    row[_COLUMNS + i] = theta[i]
            if watched is not None:
                _, observer = watched
                expect(observer, drive, known, now_tick, given_plus, given_minus, period)
            for _ in range(substeps):
                for i in range(n):
                    old_theta[i] = theta[i]
                    old_omega[i] = omega[i]
                if drive is not None:
                    acting_plus, acting_minus = pulls(drive, wrist, theta, omega, 1.0, given_plus, given_minus)
                step(wrist, theta, omega, acting_plus, acting_minus, h)
                alive = sum_[_ALIVE]
                for i in range(n):
                    alive = where(abs(theta[i]) < ARC_LIMIT, alive, zero)
                for i in range(n):
                    theta[i] = where(alive > zero, theta[i], old_theta[i])
                    omega[i] = where(alive > zero, omega[i], zero)
                sum_[_ALIVE] = alive
