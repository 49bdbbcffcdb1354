"""Where a spool is at a time: what a motor board makes of the step rates that its host sends.

A rate takes effect some time after the host's tick began: it has to reach the board, which takes up a new rate of an
axis at its next update only. From there on the rate goes to the new one by jumps, one an update, no larger than the
ramp times the update. This is the one law of it: the simulated drive, its host, the observer, and a host in front of
a real board reckon by it.
"""

from typing import Any, NamedTuple

from wristctl.config.plant import Actuator
from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import maximum, minimum
from wristctl.lanes.lane import floor, where, zero_like


class Timing(NamedTuple):
    """Timing of a board; a length is in metres or in steps, as those of the rates are.

    `ramp` is the change of a rate in time, `delay` the mean time [s] from a host's tick until a rate takes effect, and
    `update` that between two changes of a rate [s].
    """

    ramp: Any
    delay: Any
    update: Any


def timing_of(actuator: Actuator, length: float = 1.0) -> Timing:
    """Timing of an actuator section's board, with microsteps of this length."""
    waits = 0.0 if actuator.level == "servo" else 0.5 * actuator.update
    return Timing(length * actuator.ramp, actuator.command_delay + waits, actuator.update)


def remembered_commands(delay: float, period: float) -> int:
    """Number of rates or targets, with the newest, that say where a spool is in a tick [s] with this `Timing.delay`."""
    return int(delay // period) + 3


@compiled
def way(timing: Any, before: Any, after: Any, time: Any) -> Any:
    """Way of a spool since a rate took effect, from the rate before to the one after; negative times are before it."""
    change, jump = abs(after - before), timing.ramp * timing.update
    jumps = floor(change / jump)
    done = minimum(jumps, maximum(floor(time / timing.update) + 1.0, zero_like(change)))
    last = (change - jumps * jump) * maximum(time - jumps * timing.update, zero_like(change))
    gained = jump * (done * time - 0.5 * timing.update * done * (done - 1.0)) + last
    return before * time + where(after < before, -gained, gained)


@compiled
def rate_after(timing: Any, before: Any, after: Any, time: Any) -> Any:
    """Rate of a spool so long after a rate took effect, from the rate before to the one after."""
    room = timing.ramp * timing.update * (floor(time / timing.update) + 1.0)
    return where(abs(after - before) <= room, after, where(after < before, before - room, before + room))


@compiled
def in_effect(timing: Any, rates: Any, back: int, h: float) -> Any:
    """Rate that was sent `back` ticks before the one that takes effect in this tick; `rates` begin with the newest.

    Of targets it is the target.
    """
    ago, rate = floor(timing.delay / h) + float(back), rates[0]
    for k in range(1, len(rates)):
        rate = where(ago >= float(k), rates[k], rate)
    return rate


@compiled
def reached(timing: Any, place: Any, moving: Any, rates: Any, h: float) -> Any:
    """Place and rate of a spool when a rate took effect in the last tick, from those in the tick before.

    The newest of `rates` is the last tick's.
    """
    after = in_effect(timing, rates, 1, h)
    return place + way(timing, moving, after, h), rate_after(timing, moving, after, h)


@compiled
def spool_at(timing: Any, place: Any, moving: Any, rates: Any, time: Any, h: float) -> Any:
    """Place and rate of a spool at a time in this tick [s] of h [s].

    It was at `place` at the rate `moving` when a rate took effect in the last tick; the newest of `rates` is this
    tick's.
    """
    since = timing.delay - h * floor(timing.delay / h)
    before, after = in_effect(timing, rates, 1, h), in_effect(timing, rates, 0, h)
    first, second = h - since + minimum(time, since), maximum(time - since, zero_like(since))
    at_change = rate_after(timing, moving, before, h)
    now = where(time < since, rate_after(timing, moving, before, first), rate_after(timing, at_change, after, second))
    return place + way(timing, moving, before, first) + way(timing, at_change, after, second), now


@compiled
def foreseen(timing: Any, place: Any, rates: Any, h: float) -> Any:
    """Place of a spool when the rate that is to be sent in this tick takes effect.

    It was at `place` when a rate took effect in the last tick, of which the newest of `rates` is. Each rate is taken
    to be reached within a tick.
    """
    whole = floor(timing.delay / h)
    for k in range(len(rates) - 2):  # the delay is shorter than so many ticks: `remembered_commands`
        place = place + where(whole >= float(k), way(timing, rates[k + 1], rates[k], h), 0.0)
    return place


@compiled
def reckoned(timing: Any, place: Any, rates: Any, time: Any, h: float) -> Any:
    """Place of a spool at a time in this tick [s], as `spool_at`, each rate taken to be reached within a tick."""
    there, _ = spool_at(timing, place, in_effect(timing, rates, 2, h), rates, time, h)
    return there


@compiled
def remember(rates: Any, newest: Any) -> None:
    """Put the newest rate, or target, before the others, the last of which is forgotten."""
    for k in range(len(rates) - 1):
        rates[len(rates) - 1 - k] = rates[len(rates) - 2 - k]
    rates[0] = newest
