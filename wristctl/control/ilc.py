"""Iterative learning control: feedforward, PID, and a torque that is learned from each repetition of a motion for the
next one.

u <- Q(u + L e), e the error of the repetition before (Bristow, Tharayil and Alleyne, IEEE Control Systems Magazine 26
(2006) 96): L is the inverse of the loop by the one-segment model, read as much later as the loop is late, and Q a
low-pass without lag. The error falls monotonically in each frequency at which |Q (1 - L P)| < 1, P from the learned
torque to the angle. Error and torque are held in averages over SPACING, so that the noise of a tick is not learned.
"""

from typing import Any

from wristctl.control import pid_ff
from wristctl.control.clamped_integral import held, integrated
from wristctl.control.filters import BIQUAD, low_pass_both_ways
from wristctl.control.law import BY_TRIAL, Conditions, Controller, Gain
from wristctl.control.model import one_segment_terms
from wristctl.control.pd_ff import fed_forward_pd
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum, minimum
from wristctl.lanes.lane import common_integer, floor, where, zero_like
from wristctl.lanes.rows import beyond

# Time of an average [s], no less than a control period, and the number of them: what comes later keeps the last torque.
SPACING, COUNT = 0.01, 1024
# Averages that the learning may read ahead.
_AHEAD = 16
# Places in memory: tick of this repetition, the average that is being taken and its ticks so far, the filter's state,
# and all averages of torque and of error; behind what is kept the integral.
_TICK, _AVERAGE, _TAKEN, _FILTER = 0, 1, 2, 3
_TORQUES = _FILTER + BIQUAD
_ERRORS = _TORQUES + COUNT
LEARNED = _ERRORS + COUNT


@compiled
def _learn(wrist: Any, gains: Any, inertia: Any, spacing: Any, count: int, memory: Any) -> None:
    """Learn from the first `count` averages of the error."""
    torques, errors, zero = beyond(memory, _TORQUES), beyond(memory, _ERRORS), zero_like(spacing)
    lead = minimum(gains.lead / spacing, float(_AHEAD))
    for i in range(count):
        later = zero
        for k in range(_AHEAD + 1):
            later = later + maximum(1.0 - abs(lead - float(k)), 0.0) * errors[min(i + k, count - 1)]
        errors[i] = later
    stiff, damp, integral = wrist.stiffness + gains.Kp, wrist.damping + gains.Kd, zero
    for i in range(count):
        before, error, after = errors[max(i - 1, 0)], errors[i], errors[min(i + 1, count - 1)]
        integral = integral + spacing * error
        rate, acceleration = 0.5 * (after - before) / spacing, (after - 2.0 * error + before) / (spacing * spacing)
        missing = inertia * acceleration + damp * rate + stiff * error + gains.Ki * integral
        torques[i] = torques[i] - gains.share * missing
    low_pass_both_ways(torques, count, gains.cutoff, spacing, memory, _FILTER)


@compiled
def _learned(memory: Any, place: Any) -> Any:
    """The learned torque at a place among its averages, between two of them along a line."""
    torques, below = beyond(memory, _TORQUES), floor(place)
    i = common_integer(below)
    before, after = torques[min(max(i, 0), COUNT - 1)], torques[min(max(i + 1, 0), COUNT - 1)]
    return before + (place - below) * (after - before)


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """pid-ff with the learned torque: M theta_ref'' + load(theta_ref, rate_ref) + u - Kp e - Ki int(e) - Kd de/dt.

    Between repetitions u changes by -share (M e'' + (D + Kd) e' + (K + Kp) e + Ki int(e)), e read `lead` later, and is
    low-passed both ways. Errors that would drive a saturated tendon on are not learned.
    """
    spacing, tick, zero = maximum(SPACING, now.period), memory[_TICK], zero_like(now.period)
    if common_integer(tick) == 0:
        inertia, _, _ = one_segment_terms(wrist, now.theta)
        _learn(wrist, gains, inertia, spacing, min(common_integer(memory[_AVERAGE]) + 1, COUNT), memory)
        memory[_AVERAGE] = zero - 1.0
    place = tick * now.period / spacing
    integral = integrated(now, memory[LEARNED])
    torque = fed_forward_pd(now, wrist, gains) + _learned(memory, place - 0.5) - gains.Ki * integral
    memory[LEARNED] = held(now, torque, memory[LEARNED], integral)
    average, errors = floor(place + 1e-6), beyond(memory, _ERRORS)
    begins = average > memory[_AVERAGE]
    taken = where(begins, zero, memory[_TAKEN])
    i = common_integer(average)
    if i < COUNT:
        before, error = where(begins, zero, errors[i]), held(now, torque, zero, now.theta - now.theta_ref)
        errors[i] = before + (error - before) / (taken + 1.0)
    memory[_AVERAGE], memory[_TAKEN], memory[_TICK] = average, taken + 1.0, tick + 1.0
    return torque


ILC = Controller(
    name="ilc",
    law=law,
    source="Bristow, Tharayil and Alleyne, IEEE Control Systems Magazine 26 (2006) 96; model inversion about pid-ff",
    gains=pid_ff.GAINS
    | {
        "share": Gain("", "share of the error that a repetition takes away by the model", 1e-6, 1e0),
        "cutoff": Gain("rad/s", "frequency from which on it does not learn", 1e-1, 1e5),
        "lead": Gain("s", "time that the loop is late by", 1e-6, 1e0),
    },
    presets={
        "default": {"Kp": 1.0, "Kd": 0.1, "Ki": 5.0, "share": 0.7, "cutoff": 60.0, "lead": 1e-3},
        "hardware": {"Kp": 5.0, "Kd": 0.1, "Ki": 60.0, "share": 0.5, "cutoff": 20.0, "lead": 0.05},
    },
    memory=LEARNED + 1,
    learning=8,
    learned=LEARNED,
    notes={"hardware": BY_TRIAL},
    conditions={"default": Conditions((5e-3, 1e-2), (8e3, 1e5)), "hardware": Conditions((5e-3, 1e-2), (8e3, 1e5))},
)
