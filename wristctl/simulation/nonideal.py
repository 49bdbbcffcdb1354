"""Effects that ideal tendons and springs leave out, from a study's leaves: values, states, and spools that slip."""

import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import where
from wristctl.wrist.dahl import Inner, InnerFriction, NoInnerFriction, inner_state
from wristctl.wrist.spatial.spooled_tendons import ElasticPlaces, HeldPlaces, RubbingPlaces
from wristctl.wrist.tendon_mechanics import (
    LOST,
    OF_A_TENDON,
    PATH,
    PLAY,
    SHARE,
    SLIPPED,
    ElasticTendons,
    Nonideal,
    NoTendons,
    PulledTendons,
    RealTendons,
    row_of,
    spool_pull,
    state_rows,
)
from wristctl.wrist.tendons import TENDONS_PER_SIDE

# Electrical, of a two-phase motor.
_FULL_STEPS_PER_TURN = 4
# Share of a side's tendons that is left where one of them breaks.
_ONE_OF_A_SIDE_LESS = 1.0 - 1.0 / TENDONS_PER_SIDE


def electrical_turn(actuator: Actuator) -> float:
    """Length of tendon [m] that passes while a motor's field turns once."""
    return _FULL_STEPS_PER_TURN * actuator.microstep * actuator.step_length


def nonideal_of(plant: TrueWrist, actuator: Actuator, facts: TendonFacts, step: float) -> Nonideal:
    """The values of a world at an integration step [s]."""
    elastic = actuator.level == "tendon"
    torque, top_speed = (facts.torque, facts.top_speed) if isinstance(facts, TrueActuator) else (None, None)
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
        slips_at=_time(facts.slips_at) if elastic else math.inf,
        slip=facts.slip,
        torque=math.inf if torque is None else TENDONS_PER_SIDE * torque / actuator.pulley_radius,
        top_speed=math.inf if top_speed is None else top_speed * actuator.step_length,
        turn=electrical_turn(actuator),
    )


def is_ideal(nonideal: Nonideal) -> bool:
    """Whether these values change nothing."""
    shares = nonideal.friction, nonideal.tendon_creep, nonideal.spring_creep, nonideal.backlash
    times = nonideal.stop, nonideal.broken_at, nonideal.slips_at, nonideal.torque
    return not any(shares) and not any(map(math.isfinite, times))


def wears(nonideal: Nonideal) -> bool:
    """Whether tendons may have reeled in something else than their spools."""
    return nonideal.backlash > 0.0 or any(map(math.isfinite, (nonideal.broken_at, nonideal.slips_at, nonideal.torque)))


def inner_of(plants: Sequence[TrueWrist], q: Array, z: Array, blocks: Callable[[Array], Array]) -> Inner:
    """Friction inside wrists (B,) at rest at coordinates q (B, n), their bristles bent by z (B,).

    `blocks` makes blocks of lanes of rows (B, values). Where no wrist has any there is none.
    """
    if not any(plant.inner_friction for plant in plants):
        return NoInnerFriction()
    torque = np.array([[plant.inner_friction] for plant in plants])
    slope = np.array([[q.shape[1] / math.radians(plant.inner_presliding_deg)] for plant in plants])
    state = np.array([inner_state(angles, bent) for angles, bent in zip(q, z, strict=True)])
    return InnerFriction(blocks(torque), blocks(slope), blocks(state))


def _time(time: float | None) -> float:
    return math.inf if time is None else time


def unmoved(reeled: Array, path: Array, crept: Array, q: Array) -> Array:
    """The state of tendons that have reeled in `reeled` (t,) [m] and crept so far (t,) [m], at rest at q (k,).

    `path` (3,) is both sides' travel there [m] and the bend [rad].
    """
    state = np.zeros(state_rows(len(reeled), len(q)))
    state[:PATH] = path
    tendon = of_tendons(state, len(reeled))
    tendon[:, 1], tendon[:, SHARE - PATH], tendon[:, PLAY - PATH] = crept, 1.0, reeled
    state[len(state) - len(q) :] = q
    return state


def of_tendons(state: Array, count: int) -> Array:
    """A view of a state's rows of so many tendons, (count, rows of each)."""
    values: Array = state[PATH : PATH + len(OF_A_TENDON) * count].reshape(count, -1)
    return values


@compiled
def _broken(tendons: Any, t: int, time: Any, left: float) -> None:
    """Leave the share `left` of a tendon from the time on at which it breaks, for good; with 1 it does not break."""
    state, share = tendons.state, row_of(t, SHARE)
    state[share] = minimum(state[share], where(time >= tendons.nonideal.broken_at, left, 1.0))


@compiled
def tendon_after_slip(tendons: Any, t: int, delivered: Any, speed: Any, time: Any, x: Any, left: float) -> Any:
    """Length [m] that one of the RealTendons has reeled in, of the length that its motor delivers at a speed [m/s].

    It falls back where its motor is pulled harder than it holds, lags within the backlash, slips, and breaks, so that
    the share `left` of it is left; both of the last for good.
    """
    nonideal, state = tendons.nonideal, tendons.state
    play, lost, slip = row_of(t, PLAY), row_of(t, LOST), row_of(t, SLIPPED)
    _broken(tendons, t, time, left)
    if t % 2 == 0:
        state[slip] = maximum(state[slip], where(time >= nonideal.slips_at, nonideal.slip, 0.0))
    holds = nonideal.torque * maximum(0.0, 1.0 - abs(speed) / nonideal.top_speed)
    state[lost] = state[lost] + where(spool_pull(tendons, state[play], t, x) > holds, nonideal.turn, 0.0)
    on_spool = delivered - state[lost] - state[slip]
    state[play] = clip(state[play], on_spool, on_spool + nonideal.backlash)
    return state[play]


@by_type
def spools_after_slip(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    """Pulls [N] or reeled lengths [m] of both sides, of those that their motors deliver (plus, minus).

    `speeds` are the spools' [m/s].
    """
    raise NotImplementedError("compiled code only")


@implements(spools_after_slip, NoTendons, ElasticTendons)
def _as_delivered(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    return delivered


@implements(spools_after_slip, PulledTendons)
def _pulls_that_are_left(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    _broken(tendons, 0, time, _ONE_OF_A_SIDE_LESS)
    return tendons.state[row_of(0, SHARE)] * delivered[0], delivered[1]


@implements(spools_after_slip, RealTendons)
def _after_slip(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    plus = tendon_after_slip(tendons, 0, delivered[0], speeds[0], time, path[0], _ONE_OF_A_SIDE_LESS)
    return plus, tendon_after_slip(tendons, 1, delivered[1], speeds[1], time, path[1], 1.0)


@implements(spools_after_slip, HeldPlaces)
def _pulls_at_places(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    for t in range(len(delivered)):
        tendons.left[t] = where(time >= tendons.broken_at[t], 0.0, 1.0) * delivered[t]
    return tendons.left


@implements(spools_after_slip, ElasticPlaces, RubbingPlaces)
def _lengths_at_places(tendons: Any, delivered: Any, speeds: Any, time: Any, path: Any) -> Any:
    reeled = tendons.reeled
    for t in range(len(delivered)):
        tendons.stiffness[t] = where(time >= tendons.broken_at[t], 0.0, 1.0) * tendons.whole[t]
        reeled[t] = clip(reeled[t], delivered[t], delivered[t] + tendons.backlash)
        delivered[t] = reeled[t]
    return reeled
