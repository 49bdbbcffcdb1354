"""What ideal tendons and springs leave out, from a study's leaves: values, states, and spools that slip."""

import math
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TendonFacts, TrueActuator, TrueWrist
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip, maximum, minimum
from wristctl.lanes.lane import where
from wristctl.wrist.elastic import (
    LOST,
    OF_A_TENDON,
    PATH,
    PLAY,
    SHARE,
    SLIPPED,
    Nonideal,
    row_of,
    spool_pull,
    state_rows,
)
from wristctl.wrist.tendons import TENDONS_PER_SIDE

_FULL_STEPS_PER_TURN = 4
"""Electrical, of a two-phase motor."""


def electrical_turn(actuator: Actuator) -> float:
    """Length of tendon [m] that passes while a motor's field turns once."""
    return _FULL_STEPS_PER_TURN * actuator.microstep * actuator.step_length


def nonideal_of(plant: TrueWrist, actuator: Actuator, facts: TendonFacts, step: float) -> Nonideal:
    """The values of a world at an integration step [s]."""
    elastic = actuator.level == "tendon"
    torque, top_speed = (facts.torque, facts.top_speed) if isinstance(facts, TrueActuator) else (None, None)
    return Nonideal(
        held=float(not elastic),
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


def is_ideal(own: Nonideal) -> bool:
    """Whether these values change nothing."""
    shares = own.friction, own.tendon_creep, own.spring_creep, own.backlash
    times = own.stop, own.broken_at, own.slips_at, own.torque
    return not any(shares) and not any(map(math.isfinite, times))


def wears(own: Nonideal) -> bool:
    """Whether tendons may have reeled in something else than their spools."""
    return own.backlash > 0.0 or any(map(math.isfinite, (own.broken_at, own.slips_at, own.torque)))


def _time(given: float | None) -> float:
    return math.inf if given is None else given


def unmoved(given: Array, path: Array, crept: Array, q: Array) -> Array:
    """The state of tendons that have reeled in `given` (t,) [m] and crept so far (t,) [m], at rest at q (k,).

    `path` (3,) is both sides' travel there [m] and the bend [rad].
    """
    state = np.zeros(state_rows(len(given), len(q)))
    state[:PATH] = path
    own = of_tendons(state, len(given))
    own[:, 1], own[:, SHARE - PATH], own[:, PLAY - PATH] = crept, 1.0, given
    state[len(state) - len(q) :] = q
    return state


def of_tendons(state: Array, count: int) -> Array:
    """A view of a state's rows of so many tendons, (count, rows of each)."""
    own: Array = state[PATH : PATH + len(OF_A_TENDON) * count].reshape(count, -1)
    return own


@compiled
def worn_tendon(tendons: Any, t: int, given: Any, speed: Any, time: Any, x: Any, left: float) -> Any:
    """What one of the tendons has reeled in, of what its motor delivers [m] at a speed [m/s].

    It falls back where its motor is pulled harder than it holds, lags within the backlash, slips, and breaks, so that
    the share `left` of it is left; both of the last for good, and with `left` 1 not at all. Pulls [N] stay as they are,
    but where it breaks.
    """
    nonideal, state = tendons.nonideal, tendons.state
    share, play, lost, slip = row_of(t, SHARE), row_of(t, PLAY), row_of(t, LOST), row_of(t, SLIPPED)
    zero = 0.0 * given
    state[share] = minimum(state[share], where(time >= nonideal.broken_at, left + zero, 1.0 + zero))
    if t % 2 == 0:
        state[slip] = maximum(state[slip], where(time >= nonideal.slips_at, nonideal.slip, zero))
    holds = nonideal.torque * maximum(1.0 - abs(speed) / nonideal.top_speed, zero)
    state[lost] = state[lost] + where(spool_pull(tendons, state[play], t, x) > holds, nonideal.turn, zero)
    wound = given - state[lost] - state[slip]
    state[play] = clip(state[play], wound, wound + nonideal.backlash)
    return where(nonideal.held > 0.0, state[share] * given, state[play])


@compiled
def worn(tendons: Any, given: Any, speeds: Any, time: Any, path: Any) -> Any:
    """What both sides' tendons have reeled in, of what their motors deliver (plus, minus) at these speeds [m/s]."""
    if tendons is None:
        return given
    return _nonideal(tendons, tendons.nonideal, given, speeds, time, path)


@compiled
def _nonideal(tendons: Any, nonideal: Any, given: Any, speeds: Any, time: Any, path: Any) -> Any:
    if nonideal is None:
        return given
    plus = worn_tendon(tendons, 0, given[0], speeds[0], time, path[0], 1.0 - 1.0 / TENDONS_PER_SIDE)
    return plus, worn_tendon(tendons, 1, given[1], speeds[1], time, path[1], 1.0)
