"""Effects that ideal tendons and springs leave out, from a study's leaves: values, states, and spools that slip."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.errors import UserError
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import where
from wristctl.wrist.dahl import Inner, InnerFriction, InnerFrictionInSpace, NoInnerFriction, inner_state
from wristctl.wrist.tendon_mechanics import (
    CREPT,
    LOST,
    OF_A_TENDON,
    PLAY,
    SHARE,
    SLIPPED,
    WRAPPED,
    ElasticTendons,
    Nonideal,
    NoTendons,
    PulledTendons,
    RealTendons,
    X,
    row_of,
    shortening,
    spool_pull,
    state_rows,
)
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Electrical, of a two-phase motor.
_FULL_STEPS_PER_TURN = 4


def electrical_turn(actuator: Actuator) -> float:
    """Length of tendon [m] that passes while a motor's field turns once."""
    return _FULL_STEPS_PER_TURN * actuator.microstep * actuator.step_length


def nonideal_of(
    plant: TrueWrist, actuator: Actuator, facts: TendonFacts, step: float, alike: int = TENDONS_PER_SIDE
) -> Nonideal:
    """The values of a world at an integration step [s]; in one plane a tendon stands for so many that are `alike`."""
    elastic = actuator.winds
    motor = facts if isinstance(facts, TrueActuator) else TrueActuator()
    return Nonideal(
        friction=actuator.friction * elastic,
        sheath=actuator.sheath,
        bristle=1.0 / actuator.presliding,
        tendon_creep=facts.creep * elastic,
        tendon_keep=math.exp(-step / facts.creep_time),
        spring_creep=plant.creep,
        spring_keep=math.exp(-step / plant.creep_time),
        stop=math.inf if plant.end_stop_deg is None else math.radians(plant.end_stop_deg),
        stop_stiffness=plant.end_stop_stiffness,
        stop_dissipation=plant.end_stop_dissipation,
        backlash=facts.backlash * elastic,
        broken_at=_time(facts.broken_at),
        left=1.0 - 1.0 / alike,
        slips_at=_time(facts.slips_at) if elastic else math.inf,
        slip=facts.slip,
        torque=math.inf if motor.torque is None else alike * motor.torque / actuator.pulley_radius,
        corner_speed=motor.corner_speed * actuator.step_length,
        top_speed=math.inf if motor.top_speed is None else motor.top_speed * actuator.step_length,
        turn=electrical_turn(actuator),
    )


def faults_of(actuator: Actuator, facts: TendonFacts, alike: Array, section: str = "loop.plant.actuator") -> Array:
    """Rows of Fault of each place of a layout with so many tendons alike (T,), (4, T).

    Raises UserError for a place that there is not, with its key in the `section` of the facts.
    """
    places, never = len(alike), math.inf
    elastic = actuator.winds
    torque = facts.torque if isinstance(facts, TrueActuator) else None
    faults = np.array([np.full(places, never), 1.0 - 1.0 / alike, np.full(places, never), np.full(places, never)])
    for row, time, place, key in (
        (0, facts.broken_at, facts.broken_tendon, "broken_tendon"),
        (2, facts.slips_at if elastic else None, facts.slipping_tendon, "slipping_tendon"),
    ):
        if time is not None:
            if place > places:
                what = f"tendon {place} of {places} cannot {'break' if row == 0 else 'slip'}"
                raise UserError(what, f"{section}.{key}", f"1 to {places}")
            faults[row, place - 1] = time
    if torque is not None:
        faults[3] = alike * torque / actuator.pulley_radius
    return faults


def faults_of_sides(nonideal: Nonideal, tendons: int) -> Array:
    """Rows of Fault of a plane's tendons (4, tendons), of either side in turn: the + side's slip, the first breaks."""
    number = np.arange(tendons)
    broken_at = np.where(number == 0, nonideal.broken_at, math.inf)
    slips_at = np.where(number % 2 == 0, nonideal.slips_at, math.inf)
    return np.array([broken_at, np.full(tendons, nonideal.left), slips_at, np.full(tendons, nonideal.torque)])


def is_ideal(nonideal: Nonideal) -> bool:
    """Whether these values change nothing."""
    shares = nonideal.friction, nonideal.tendon_creep, nonideal.spring_creep, nonideal.backlash
    times = nonideal.stop, nonideal.broken_at, nonideal.slips_at, nonideal.torque
    return not any(shares) and not any(map(math.isfinite, times))


def wears(nonideal: Nonideal) -> bool:
    """Whether tendons may have reeled in something else than their spools."""
    return nonideal.backlash > 0.0 or any(map(math.isfinite, (nonideal.broken_at, nonideal.slips_at, nonideal.torque)))


def inner_of(
    plants: Sequence[TrueWrist], q: Array, z: Array, blocks: Callable[[Array], Array], planes: int = 1
) -> Inner:
    """Friction inside wrists (B,) at rest at coordinates q (B, n), their bristles bent by z (B,).

    `blocks` makes blocks of lanes of rows (B, values). Where no wrist has any there is none.
    """
    if not any(plant.inner_friction for plant in plants):
        return NoInnerFriction()
    torque, segments = np.array([[plant.inner_friction] for plant in plants]), q.shape[1] // planes
    slope = np.array([[segments / math.radians(plant.inner_presliding_deg)] for plant in plants])
    state = np.array([inner_state(angles, bent) for angles, bent in zip(q, z, strict=True)])
    kind = InnerFriction if planes == 1 else InnerFrictionInSpace
    return kind(blocks(torque), blocks(slope), blocks(state))


def _time(time: float | None) -> float:
    return math.inf if time is None else time


def unmoved(reeled: Array, path: Array, crept: Array, q: Array) -> Array:
    """The state of tendons that have reeled in `reeled` (t,) [m] and crept so far (t,) [m], at rest at q (k,).

    `path` there is both sides' travel [m] and the bend [rad], (3,), or each tendon's travel, then what each is wrapped
    by, (2 t,).
    """
    count, paths = len(reeled), (len(path) + 1) // 2
    state = np.zeros(state_rows(count, len(q)))
    tendon, number = of_tendons(state, count), np.arange(count)
    tendon[:, CREPT], tendon[:, SHARE], tendon[:, PLAY] = crept, 1.0, reeled
    tendon[:, X], tendon[:, WRAPPED] = path[number % paths], path[paths + number % (len(path) - paths)]
    state[len(state) - len(q) :] = q
    return state


def of_tendons(state: Array, count: int) -> Array:
    """A view of a state's rows of so many tendons, (count, rows of each)."""
    values: Array = state[: len(OF_A_TENDON) * count].reshape(count, -1)
    return values


@compiled
def torque_share(speed: Any, corner_speed: Any, top_speed: Any) -> Any:
    """Share of its standing torque that a stepper has at a speed: all up to the corner, from there a line to none.

    A chopper drive keeps its current up to the corner. There the supply's voltage is used up by the winding's
    inductance and the voltage that the rotor induces (Acarnley, Stepping Motors, 4th ed., ch. 5 and 6).
    """
    return maximum(0.0, 1.0 - maximum(0.0, abs(speed) - corner_speed) / (top_speed - corner_speed))


@compiled
def _break(tendons: Any, t: int, time: Any) -> None:
    """Leave a share of a place's tendons from the time on at which one of them breaks, for good."""
    state, share, faults = tendons.state, row_of(t, SHARE), tendons.faults
    state[share] = minimum(state[share], where(time >= faults.broken_at[t], faults.left[t], 1.0))


@compiled
def place_after_slip(tendons: Any, t: int, delivered: Any, speed: Any, time: Any, x: Any) -> Any:
    """Length [m] that a tendon, or all of a place, has reeled in, of what its motor delivers at a speed [m/s].

    It falls back where its motor is pulled harder than it holds, lags within the backlash, slips, and breaks; both of
    the last for good.
    """
    nonideal, state, faults = tendons.nonideal, tendons.state, tendons.faults
    play, lost, slip = row_of(t, PLAY), row_of(t, LOST), row_of(t, SLIPPED)
    _break(tendons, t, time)
    state[slip] = maximum(state[slip], where(time >= faults.slips_at[t], nonideal.slip, 0.0))
    holds = faults.holds[t] * torque_share(speed, nonideal.corner_speed, nonideal.top_speed)
    state[lost] = state[lost] + where(spool_pull(tendons, state[play], t, x) > holds, nonideal.turn, 0.0)
    on_spool = delivered - state[lost] - state[slip]
    state[play] = clip(state[play], on_spool, on_spool + nonideal.backlash)
    return state[play]


@by_type
def spools_after_slip(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any, held: Any) -> None:
    """Write the pulls [N] or reeled lengths [m] of each place, of those that their motors deliver (T rows each).

    `speeds` are the spools' [m/s].
    """


@implements(spools_after_slip, NoTendons, ElasticTendons)
def _as_delivered(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any, held: Any) -> None:
    for t in range(len(held)):
        held[t] = delivered[t]


@implements(spools_after_slip, PulledTendons)
def _pulls_that_are_left(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any, held: Any) -> None:
    for t in range(len(held)):
        _break(tendons, t, time)
        held[t] = tendons.state[row_of(t, SHARE)] * delivered[t]


@implements(spools_after_slip, RealTendons)
def _after_slip(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any, held: Any) -> None:
    for t in range(len(held)):
        held[t] = place_after_slip(tendons, t, delivered[t], speeds[t], time, shortening(path, t))
