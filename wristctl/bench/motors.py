"""Four steppers with their spools and tendons, and the wrist these pull, in steps of 1 ms.

An energised motor stands where its drive counts, and turns back by whole electrical turns (four full steps) when its
tendon pulls harder than it can hold. A released one is held by its detent torque alone: its tendon pays out until it
pulls no harder, and nothing reels that in again. Energised anew, the rotor falls into the nearest place that
fits the drive's count: up to two full steps away, so that positions are lost with the release.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES
from wristctl.config.bench import BenchSettings
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import where, zero_like
from wristctl.lanes.rows import part, rows_of
from wristctl.simulation.nonideal import electrical_turn, tendon_after_slip
from wristctl.wrist.dahl import bristle, bristle_slope, inner_in_lanes
from wristctl.wrist.plant import advance_or_stop, disturbed, parameters_of, travel
from wristctl.wrist.tendon_mechanics import RealTendons, read_nonideal, spool_pull

PERIOD = 1e-3
CYCLES = round(PERIOD * FREQUENCY)

_PORT_A, _PORT_C = ord("A"), ord("C")


class Stepper(NamedTuple):
    """Constants that the four motors have in common; lengths of tendon [m] and pulls [N] at the spool."""

    turn: float  # of the field: four full steps
    holding: float
    top_speed: float  # at which it holds nothing; inf: it holds as much at any speed
    detent: float
    release: float  # share of its surplus stretch that a released tendon loses in one period


def stepper_of(settings: BenchSettings) -> Stepper:
    """The motors of these settings."""
    actuator, motors = settings.actuator, settings.motors
    return Stepper(
        turn=electrical_turn(actuator),
        holding=motors.holding_torque / actuator.pulley_radius,
        top_speed=math.inf if motors.top_speed is None else motors.top_speed * actuator.step_length,
        detent=motors.detent_torque / actuator.pulley_radius,
        release=PERIOD / (motors.release_time + PERIOD),
    )


class SpoolState(NamedTuple):
    """State of the four axes, (4,); `latch` holds port A as last heard of.

    `reeled` [m] counts from where the tendon of the straight wrist is taut without pulling.
    """

    step: Any  # [m] of tendon that a microstep reels in
    counted: Any  # microsteps reeled in
    slipped: Any  # electrical turns that the rotor is ahead of the count
    energised: Any
    stepped: Any  # cycle of the last step, -1: never
    sense: Any  # 1, or -1 where the motor is wired the other way round
    slack: Any  # [m] at power-on
    latch: Any
    reeled: Any
    pull: Any
    bent: Any  # (3,) across the plane, away from the camera [rad], its rate [rad/s], and the bristle of friction there


def spool_state_of(settings: BenchSettings) -> SpoolState:
    """The axes at power-on: released, each tendon with its slack."""
    slack = np.array(settings.motors.slack)
    none = np.zeros(AXES, np.int64)
    return SpoolState(
        step=settings.actuator.step_length * np.array(settings.motors.step_scale),
        counted=none.copy(),
        slipped=none.copy(),
        energised=none.copy(),
        stepped=none - 1,
        sense=np.where(settings.motors.reversed, -1, 1),
        slack=slack,
        latch=np.zeros(1, np.int64),
        reeled=-slack,
        pull=np.zeros(AXES),
        bent=np.zeros(3),
    )


@compiled
def hear_edge(spools: Any, motor: Any, cycle: int, port: int, value: int) -> None:
    """Take in one change of an output latch: STEP and DIR alternate on port A, ENA (high: off) is on port C."""
    if port == _PORT_A:
        risen = value & ~spools.latch[0]
        for axis in range(AXES):
            if risen >> 2 * axis & 1:
                turned = -1 if value >> (2 * axis + 1) & 1 else 1
                spools.counted[axis] += turned * spools.sense[axis]
                spools.stepped[axis] = cycle
        spools.latch[0] = value
    elif port == _PORT_C:
        for axis in range(AXES):
            on = 1 - (value >> axis & 1)
            if on and not spools.energised[axis]:
                counted = spools.step[axis] * spools.counted[axis] - spools.slack[axis]
                spools.slipped[axis] = int(np.rint((spools.reeled[axis] - counted) / motor.turn))
            spools.energised[axis] = on


@compiled
def hear_edges(spools: Any, motor: Any, edges: Any, heard: int, until: int) -> int:
    """Take in the changes (cycle, port, value) from `heard` on that come before a cycle; how many are heard then."""
    while heard < edges.shape[0] and edges[heard, 0] < until:
        hear_edge(spools, motor, edges[heard, 0], edges[heard, 1], edges[heard, 2])
        heard += 1
    return heard


@compiled
def turn_spools(spools: Any, motor: Any, stiffness: float) -> None:
    """Turn the spools for a period, by the pulls at its start."""
    for axis in range(AXES):
        pull = spools.pull[axis]
        if spools.energised[axis]:
            stepped = spools.step[axis] * spools.counted[axis] - spools.slack[axis]
            speed = abs(stepped + motor.turn * spools.slipped[axis] - spools.reeled[axis]) / PERIOD
            if pull > motor.holding * max(0.0, 1.0 - speed / motor.top_speed):
                spools.slipped[axis] -= 1
            spools.reeled[axis] = stepped + motor.turn * spools.slipped[axis]
        else:
            spools.reeled[axis] -= motor.release * max(0.0, pull - motor.detent) / stiffness


class Hanging(NamedTuple):
    """Load of the motors: plant and tendons.

    The plant (its model and the values of its parameters), a tendon's stiffness [N/m], the values of Nonideal and the
    state that go with four of them, friction inside the wrist, the motors, the axes of two tendons on the + and two on
    the - side, and what bends across the plane (`Across`) against friction inside the wrist: its torque [N m], and one
    over the bend in which it turns round [1/rad].
    """

    model: Any
    values: Any
    stiffness: float
    nonideal: Any
    tendons: Any
    inner: Any
    motor: Any
    sides: Any
    across: Any
    rubbing: tuple[float, float]


@compiled
def _bend_across(bent: Any, pulls: Any, levers: Any, across: Any, rubbing: Any, stiffness: float) -> None:
    """A period of the bend across the plane, linearly implicit in damping, stiffness and friction; lanes."""
    torque, slope = rubbing
    rate = bent[1]
    resisting = across.stiffness + torque * bristle_slope(bent[2], rate, slope)
    moment = across.moment - across.stiffness * bent[0] - torque * bent[2]
    for axis in range(AXES):
        moment = moment + levers[axis] * pulls[axis]
        resisting = resisting + where(pulls[axis] > 0.0, stiffness * levers[axis] * levers[axis], 0.0)
    push = moment - (across.damping + PERIOD * resisting) * rate
    rate = rate + PERIOD * push / (across.inertia + PERIOD * across.damping + PERIOD * PERIOD * resisting)
    bent[0] = bent[0] + PERIOD * rate
    bent[1] = rate
    bent[2] = bristle(bent[2], PERIOD * rate, slope)


def follow(
    hanging: Any, spools: Any, state: Any, acting: Any, edges: Any, first: int, start: float, out: Any, cut: Any
) -> int:
    """Advance spools and wrist by a period for each row (tip force, stiffness scale) of `acting`; the edges used up.

    `edges` (E, 3) are changes of latches (cycle, port, value), `first` the period's number since power-on. A row of
    `out` is what is so at a period's end: coordinates, rates; and what was in its middle: pulls at the spools, reeled
    lengths; and the bend across. Tendons break and slip so long after `start` [s].
    """
    undisturbed = parameters_of(hanging.model, rows_of(hanging.values))
    motor, sides = hanging.motor, hanging.sides
    across, bent = hanging.across, rows_of(spools.bent)
    levers = rows_of(across.levers)
    reeled, pull = rows_of(spools.reeled), rows_of(spools.pull)
    n = len(cut)
    q, rate = part(rows_of(state), 0, cut), part(rows_of(state), n, cut)
    zero = zero_like(reeled[0])
    nonideal, inner = read_nonideal(rows_of(hanging.nonideal)), inner_in_lanes(hanging.inner)
    tendons = RealTendons(hanging.stiffness + zero, nonideal, rows_of(hanging.tendons), inner)
    ahead, behind, ahead_too, behind_too = sides[0], sides[2], sides[1], sides[3]
    edge = 0
    for k in range(acting.shape[0]):
        middle = (first + k) * CYCLES + CYCLES // 2
        edge = hear_edges(spools, motor, edges, edge, middle)
        turn_spools(spools, motor, hanging.stiffness)
        plant = disturbed(undisturbed, (0.0, acting[k, 0], 0.0), acting[k, 1])
        time, path = (first + k) * PERIOD - start + zero, travel(plant, q)
        on_spools = (
            tendon_after_slip(tendons, 0, reeled[ahead] - levers[ahead] * bent[0], zero, time, path[0], 0.0),
            tendon_after_slip(tendons, 1, reeled[behind] - levers[behind] * bent[0], zero, time, path[1], 1.0),
            tendon_after_slip(tendons, 2, reeled[ahead_too] - levers[ahead_too] * bent[0], zero, time, path[0], 1.0),
            tendon_after_slip(tendons, 3, reeled[behind_too] - levers[behind_too] * bent[0], zero, time, path[1], 1.0),
        )
        pull[ahead] = spool_pull(tendons, on_spools[0], 0, path[0])
        pull[behind] = spool_pull(tendons, on_spools[1], 1, path[1])
        pull[ahead_too] = spool_pull(tendons, on_spools[2], 2, path[0])
        pull[behind_too] = spool_pull(tendons, on_spools[3], 3, path[1])
        _bend_across(bent, pull, levers, across, hanging.rubbing, hanging.stiffness)
        advance_or_stop(plant, q, rate, on_spools, tendons, PERIOD + zero, 1.0 + zero)
        for i in range(2 * n):
            out[k, i] = state[i]
        for axis in range(AXES):
            out[k, 2 * n + axis] = spools.pull[axis]
            out[k, 2 * n + AXES + axis] = spools.reeled[axis]
        out[k, 2 * n + 2 * AXES] = spools.bent[0]
    return edge
