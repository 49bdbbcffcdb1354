"""Four steppers with their spools and tendons, and the wrist that these pull in one plane or two, in steps of 1 ms.

An energised rotor hangs on the magnetic spring of its field, which stands where the drive counts. It swings about the
field and lags behind it by the angle at which it holds its tendon. Pulled harder than it can hold, or driven faster
than it follows, it loses whole electrical turns (four full steps). Without inertia it stands where the drive counts. A
released motor is held by its detent torque alone: its tendon pays out until it pulls no harder, and nothing reels that
in again. Energised anew, the rotor falls into the nearest place that fits the drive's count: up to two full steps away,
so that positions are lost with the release.
"""

import math
from typing import Any, NamedTuple

import numpy as np

from wristctl.board.emulator.chip import FREQUENCY
from wristctl.board.messages import AXES
from wristctl.config.bench import BenchSettings
from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import zero_like
from wristctl.lanes.rows import lanes_like, part, rows_of
from wristctl.simulation.nonideal import electrical_turn, place_after_slip, torque_share
from wristctl.wrist.out_of_plane import advance_across
from wristctl.wrist.plant import advance_or_stop, disturbed, parameters_of, path_along
from wristctl.wrist.tendon_mechanics import PLAY, row_of, shortening, spool_pull, tendons_in_lanes

PERIOD = 1e-3
CYCLES = round(PERIOD * FREQUENCY)

_PORT_A, _PORT_C = ord("A"), ord("C")
_TURN = 2.0 * math.pi
# Largest phase [rad] of a rotor's swing in one substep: leapfrog's frequency is off by its square over 24, 4e-4.
_PHASE = 0.1


class Stepper(NamedTuple):
    """Constants that the four motors have in common; lengths of tendon [m] and pulls [N] at the spool."""

    turn: float  # of the field: four full steps
    holding: float
    corner_speed: float  # up to which it holds as much as standing
    top_speed: float  # at which it holds nothing; inf: it holds as much at any speed
    mass: float  # [kg] inertia of rotor and spool over the radius squared; 0: no inertia
    damping: float  # [N s/m]
    substeps: int  # of a rotor in one period
    detent: float
    release: float  # share of its surplus stretch that a released tendon loses in one period


def stepper_of(settings: BenchSettings) -> Stepper:
    """The motors of these settings."""
    actuator, motors = settings.actuator, settings.motors
    turn, holding = electrical_turn(actuator), motors.holding_torque / actuator.pulley_radius
    inertia = motors.rotor_inertia + motors.spool_inertia if motors.rotor_inertia > 0.0 else 0.0
    mass = inertia / actuator.pulley_radius**2
    frequency = math.sqrt(_TURN * holding / (turn * mass)) if mass else 0.0
    return Stepper(
        turn=turn,
        holding=holding,
        corner_speed=motors.corner_speed * actuator.step_length,
        top_speed=math.inf if motors.top_speed is None else motors.top_speed * actuator.step_length,
        mass=mass,
        damping=motors.damping / actuator.pulley_radius**2,
        substeps=max(1, math.ceil(PERIOD * frequency / _PHASE)),
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
    spacing: Any  # cycles from the step before it, inf: never
    sense: Any  # 1, or -1 where the motor is wired the other way round
    slack: Any  # [m] at power-on
    latch: Any
    reeled: Any
    speed: Any  # [m/s] of a rotor with inertia
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
        spacing=np.full(AXES, math.inf),
        sense=np.where(settings.motors.reversed, -1, 1),
        slack=slack,
        latch=np.zeros(1, np.int64),
        reeled=-slack,
        speed=np.zeros(AXES),
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
                spools.spacing[axis] = cycle - spools.stepped[axis]
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
def _follow_count(spools: Any, motor: Any, axis: int) -> None:
    """Put a rotor without inertia where its drive counts, or an electrical turn behind that."""
    stepped = spools.step[axis] * spools.counted[axis] - spools.slack[axis]
    speed = (stepped + motor.turn * spools.slipped[axis] - spools.reeled[axis]) / PERIOD
    if spools.pull[axis] > motor.holding * torque_share(speed, motor.corner_speed, motor.top_speed):
        spools.slipped[axis] -= 1
    spools.reeled[axis] = stepped + motor.turn * spools.slipped[axis]


@compiled
def _swing(spools: Any, motor: Any, axis: int, cycle: int, taut_at: float, stiffness: float) -> None:
    """Advance a rotor by a substep of leapfrog about a cycle; its tendon is taut from `taut_at` [m] on.

    mass dv/dt = holding sin(2 pi (field - rotor)/turn) - pull - damping v, with what it holds at the field's speed
    (Acarnley, Stepping Motors, 4th ed., ch. 4).
    """
    step = PERIOD / motor.substeps
    place = spools.reeled[axis] + 0.5 * step * spools.speed[axis]
    speed = spools.speed[axis]
    field = spools.step[axis] * spools.counted[axis] - spools.slack[axis]
    field_speed = spools.step[axis] * FREQUENCY / max(spools.spacing[axis], cycle - spools.stepped[axis])
    holds = motor.holding * torque_share(field_speed, motor.corner_speed, motor.top_speed)
    push = holds * math.sin(_TURN / motor.turn * (field - place)) - stiffness * max(0.0, place - taut_at)
    resisting = 0.5 * step * motor.damping
    speed = ((motor.mass - resisting) * speed + step * push) / (motor.mass + resisting)
    spools.speed[axis] = speed
    spools.reeled[axis] = place + 0.5 * step * speed


@compiled
def turn_spools(spools: Any, motor: Any, stiffness: float, edges: Any, heard: int, until: int) -> int:
    """Turn the spools for the period before a cycle, by the edges from `heard` on.

    The pulls are those of the spools at its start and of the paths in its middle: were the paths older, the rotors
    would give way to the wrist late, which damps it. A tendon that pulls then pulls by its stiffness [N/m] harder or
    less as its spool turns; a slack one stays slack. Returns the number of edges heard.
    """
    if motor.mass > 0.0:
        taut_at = (
            _taut_at(spools, 0, stiffness), _taut_at(spools, 1, stiffness),
            _taut_at(spools, 2, stiffness), _taut_at(spools, 3, stiffness),
        )  # fmt: skip
        for part in range(motor.substeps):
            middle = until - CYCLES + CYCLES * (2 * part + 1) // (2 * motor.substeps)
            heard = hear_edges(spools, motor, edges, heard, middle)
            for axis in range(AXES):
                if spools.energised[axis]:
                    _swing(spools, motor, axis, middle, taut_at[axis], stiffness)
    heard = hear_edges(spools, motor, edges, heard, until)
    for axis in range(AXES):
        if not spools.energised[axis]:
            spools.speed[axis] = 0.0
            spools.reeled[axis] -= motor.release * max(0.0, spools.pull[axis] - motor.detent) / stiffness
        elif motor.mass == 0.0:
            _follow_count(spools, motor, axis)
    return heard


@compiled
def _taut_at(spools: Any, axis: int, stiffness: float) -> float:
    """Length on a spool [m] from which its tendon pulls; inf of a slack one."""
    pull = spools.pull[axis]
    return spools.reeled[axis] - pull / stiffness if pull > 0.0 else math.inf


class Hanging(NamedTuple):
    """Load of the motors: plant, tendons, and what bends across the plane.

    The plant (its model and the values of its parameters), its tendons (RealTendons),
    the stiffness of one [N/m] and the axis that winds each; what bends across the plane (`Across`) against friction
    inside the wrist: its torque [N m], and one over the bend in which it turns round [1/rad]; the motors, steps of the
    integration in a period; and tuples with an entry, of no meaning, for each coordinate and tendon.
    """

    model: Any
    values: Any
    tendons: Any
    stiffness: float
    axes: Any
    across: Any
    rubbing: tuple[float, float]
    motor: Any
    substeps: int
    coordinates: Any
    pulls: Any


def follow(hanging: Any, spools: Any, state: Any, acting: Any, edges: Any, first: int, start: float, out: Any) -> int:
    """Advance spools and wrist by a period for each row (tip force (3,), stiffness scale) of `acting`; the edges used.

    `edges` (E, 3) are changes of latches (cycle, port, value), `first` the period's number since power-on. A row of
    `out` is what is so at a period's end: coordinates, rates; and what was in its middle: pulls at the spools, reeled
    lengths; and the bend across. Tendons break and slip so long after `start` [s]. A wrist that leaves what its series
    hold for stays where it was.
    """
    undisturbed, n = parameters_of(hanging.model, rows_of(hanging.values), hanging.pulls), len(hanging.coordinates)
    motor, substeps, axes, across = hanging.motor, hanging.substeps, hanging.axes, hanging.across
    levers, bent = rows_of(across.levers), rows_of(spools.bent)
    reeled, pull = rows_of(spools.reeled), rows_of(spools.pull)
    q, rate = part(rows_of(state), 0, hanging.coordinates), part(rows_of(state), n, hanging.coordinates)
    tendons, on_spools = tendons_in_lanes(hanging.tendons), lanes_like(part(pull, 0, hanging.pulls))
    zero, edge = zero_like(reeled[0]), 0
    for k in range(acting.shape[0]):
        middle = (first + k) * CYCLES + CYCLES // 2
        plant = disturbed(undisturbed, (acting[k, 0], acting[k, 1], acting[k, 2]), acting[k, 3])
        time, path = (first + k) * PERIOD - start + zero, path_along(tendons, plant, q)
        for t in range(len(hanging.pulls)):
            pull[axes[t]] = spool_pull(tendons, tendons.state[row_of(t, PLAY)], t, shortening(path, t))
        edge = turn_spools(spools, motor, hanging.stiffness, edges, edge, middle)
        for t in range(len(hanging.pulls)):
            axis, x = axes[t], shortening(path, t)
            on_spools[t] = place_after_slip(tendons, t, reeled[axis] - levers[axis] * bent[0], zero, time, x)
            pull[axis] = spool_pull(tendons, on_spools[t], t, x)
        advance_across(bent, pull, levers, across, hanging.rubbing, hanging.stiffness, PERIOD)
        for _ in range(substeps):
            advance_or_stop(plant, q, rate, on_spools, tendons, PERIOD / substeps + zero, 1.0 + zero)
        for i in range(2 * n):
            out[k, i] = state[i]
        for axis in range(AXES):
            out[k, 2 * n + axis] = spools.pull[axis]
            out[k, 2 * n + AXES + axis] = spools.reeled[axis]
        out[k, 2 * n + 2 * AXES] = spools.bent[0]
    return edge
