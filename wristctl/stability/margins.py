"""How much more, or less, gain and how much more delay a linear loop bears, and how much it amplifies.

Margins where the loop's transfer crosses the real axis and the unit circle (Astrom and Murray 2008, section 9.3),
each tried by counting the closed loop's unstable poles on both sides of it: a crossing need not be a stability limit,
and a loop whose frames fall unevenly on its ticks has more to its stability than one transfer.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wristctl.arrays import Array
from wristctl.stability.encirclements import PoleCount
from wristctl.stability.sampled_loop import Complex, SampledLoop

NEUTRAL = 1e-3
"""Growth [1/s] below which a mode stays as it is: an integrator that nothing drives, a slow leak."""
_LEAST_OMEGA, _PER_DECADE = 1e-2, 120
_LIGHT, _CLOSE = 0.1, (0.0, 0.1, 0.3, 1.0, 3.0)
"""Damping of poles near which a response is looked at too, and at which distances from their frequency, in it."""


class Crossing(NamedTuple):
    """A frequency [rad/s], and what is asked for there: a gain's factor, or a phase margin [rad]."""

    omega: float
    value: float

    @property
    def delay(self) -> float:
        """Of a phase margin, the delay [s] that takes it up."""
        return (self.value % (2.0 * math.pi)) / self.omega


@dataclass(frozen=True)
class Margins:
    """Of a loop as it is where `stable`; else where it would be stable, if anywhere, and no delay."""

    stable: bool
    growth: float
    """Of the least stable mode [1/s]."""
    least: Crossing
    """Of the factors of the loop's gain in which it is stable; a factor 0 where none is too small, nan where none is
    right. At this limit it swings at `omega`."""
    most: Crossing
    """inf: none is too large."""
    delay: float
    """The least delay more that makes it unstable [s]; inf: none does, nan where it is unstable without."""
    delay_omega: float
    phase: Crossing
    """The smallest phase margin [rad]; inf where the gain is nowhere 1."""
    gain_crossings: Sequence[Crossing]
    phase_crossings: Sequence[Crossing]
    sensitivity: Crossing
    """Ms, the largest |1/(1 + L)|."""
    complementary: Crossing
    """Mt, the largest |L/(1 + L)|."""


def frequencies(loop: SampledLoop) -> Array:
    """Where to look at a loop [rad/s], up to half its sampling rate: evenly by decades, and closely about its poles."""
    most = half_rate(loop)
    count = max(2, round(_PER_DECADE * math.log10(most / _LEAST_OMEGA)))
    found = [np.geomspace(min(_LEAST_OMEGA, 0.1 * most), most, count)]
    for pole in swinging(loop):
        found.append(abs(pole.imag) + np.outer((-1.0, 1.0), _CLOSE).ravel() * abs(pole.real))
    every = np.unique(np.concatenate(found))
    return np.asarray(every[(every >= found[0][0]) & (every <= most)])


def swinging(loop: SampledLoop) -> Complex:
    """Lightly damped poles [1/s] of the loop and of the open one, at every frequency that they may stand for."""
    z = np.concatenate([loop.multipliers(factor) for factor in (0.0, 1.0)])
    logs = np.log(z[np.abs(z) > 1e-9]) / loop.lasts
    turns = 2.0j * np.pi / loop.lasts * np.arange(-len(loop.cuts), len(loop.cuts) + 1)
    every = (logs[:, None] + turns).ravel()
    return np.asarray(every[np.abs(every.real) < _LIGHT * np.abs(every.imag)])


def half_rate(loop: SampledLoop) -> float:
    """Half the rate of the cuts [rad/s], on average."""
    return math.pi * len(loop.cuts) / loop.lasts


def margins(loop: SampledLoop) -> Margins:
    """The margins of a loop. A loop that nothing comes back in has none: all are infinite."""
    omega = frequencies(loop)
    response = loop.response(omega)
    gains, phases = crossings(loop, omega, response)
    poles = PoleCount(loop, NEUTRAL)
    stable = poles.unstable(1.0) == 0
    least, most = _stable_gains(loop, poles, [each for each in phases if each.value > 0.0], stable)
    delay, at = (math.nan, math.nan) if not stable else _delay(loop, poles, gains)
    amplified = np.abs(1.0 / (1.0 + response))
    carried = np.abs(response) * amplified
    smallest = min(gains, key=lambda each: abs(each.value), default=Crossing(math.nan, math.inf))
    return Margins(
        stable, loop.growth(), least, most, delay, at, smallest, gains, phases,
        *(_peak(loop, omega, each, of) for each, of in ((amplified, _amplified), (carried, _carried))),
    )  # fmt: skip


def crossings(loop: SampledLoop, omega: Array, response: Complex) -> tuple[list[Crossing], list[Crossing]]:
    """Where |L| is 1, with phase margins in (-pi, pi], and where L is real and negative, with the gain's factor there.

    At frequency 0, and at half the sampling rate of a loop of one rate, L is real: there the loop runs away, or turns
    with every sample. Where an integrator holds it at frequency 0, it cannot run away.
    """
    gains = [
        Crossing(at, float(np.angle(-_at(loop, at))))
        for at in _zeros(omega, np.log(np.abs(response) + 1e-300), lambda at: math.log(abs(_at(loop, at)) + 1e-300))
    ]
    end = len(omega) - loop.is_steady  # at half the rate rounding decides the sign of what is 0
    turns = _zeros(omega[:end], response.imag[:end], lambda at: _at(loop, at).imag)
    turns += omega[end:].tolist()
    values = [(at, _at(loop, at).real) for at in turns]
    still = _at(loop, _STILL * float(omega[0]))
    if abs(still.imag) < _STILL * abs(still.real) < 1.0:
        values.append((0.0, still.real))
    return gains, [Crossing(at, -1.0 / value) for at, value in values if value < -_NOTHING]


_STILL = 1e-3
_NOTHING = 1e-9
"""Of a transfer, below which nothing comes back."""


def _at(loop: SampledLoop, omega: float) -> complex:
    return complex(loop.response(np.array([omega]))[0])


def _amplified(response: complex) -> float:
    return abs(1.0 / (1.0 + response))


def _carried(response: complex) -> float:
    return abs(response / (1.0 + response))


def _zeros(omega: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """Where values over omega change their sign, found as closely as numbers allow."""
    found = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        found.append(float(brentq(function, omega[k], omega[k + 1], xtol=1e-15 * omega[k + 1], rtol=1e-14)))
    return found


def _peak(loop: SampledLoop, omega: Array, values: Array, of: Callable[[complex], float]) -> Crossing:
    """The largest value, refined by golden sections between its neighbours."""
    k = int(np.argmax(values))
    low, high = omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)]
    for _ in range(_SECTIONS):
        inner = low + _GOLDEN * (high - low), high - _GOLDEN * (high - low)
        if of(_at(loop, inner[0])) > of(_at(loop, inner[1])):
            high = inner[1]
        else:
            low = inner[0]
    middle = 0.5 * (low + high)
    return Crossing(float(middle), max(float(values[k]), of(_at(loop, middle))))


_GOLDEN, _SECTIONS = 0.381966, 40


def _stable_gains(
    loop: SampledLoop, poles: PoleCount, crossed: Sequence[Crossing], stable: bool
) -> tuple[Crossing, Crossing]:
    """The factors between which the loop is stable: about 1, or, where it is not stable there, the nearest to it."""
    at = sorted(crossed, key=lambda each: each.value)
    edges = [0.0, *(each.value for each in at), math.inf]
    between = [_between(low, high) for low, high in pairwise(edges)]
    good = [poles.unstable(each) == 0 for each in between]
    here = next(k for k in range(len(between)) if edges[k] <= 1.0 <= edges[k + 1])
    if stable:
        good[here] = True
    if not any(good):
        nothing = Crossing(math.nan, math.nan)
        return nothing, nothing
    chosen = min((k for k, each in enumerate(good) if each), key=lambda k: abs(k - here))
    low = high = chosen
    while low > 0 and good[low - 1]:
        low -= 1
    while high + 1 < len(good) and good[high + 1]:
        high += 1
    inside = 1.0 if stable else between[chosen]
    least = Crossing(math.nan, 0.0) if low == 0 else _limit(loop, poles, at[low - 1], between[low - 1], inside)
    most = Crossing(math.nan, math.inf) if high == len(at) else _limit(loop, poles, at[high], between[high + 1], inside)
    return least, most


def _between(low: float, high: float) -> float:
    if low == 0.0:
        return 0.5 * high if math.isfinite(high) else 1.0
    return math.sqrt(low * high) if math.isfinite(high) else 2.0 * low


def _limit(loop: SampledLoop, poles: PoleCount, crossing: Crossing, bad: float, good: float) -> Crossing:
    """A limit near this crossing: the crossing itself in a loop of one rate, else by halving."""
    if loop.is_steady:
        return crossing
    while abs(bad - good) > _EXACT * good:
        middle = math.sqrt(bad * good)
        bad, good = (bad, middle) if poles.unstable(middle) == 0 else (middle, good)
    return Crossing(2.0 * math.pi * loop.modes(bad)[0].frequency, good)


_EXACT = 1e-6


def _delay(loop: SampledLoop, poles: PoleCount, crossed: Sequence[Crossing]) -> tuple[float, float]:
    """The least delay that makes a stable loop unstable, and where it then swings [rad/s].

    A crossing of a loop of one rate counts where one of the two whole ticks that follow makes it unstable.
    """
    at, good = sorted(crossed, key=lambda each: each.delay), 0.0
    for k, each in enumerate(at):
        if loop.is_steady:
            next_ = math.ceil(each.delay / loop.period)
            if any(poles.unstable(1.0, loop.period * ticks) for ticks in (next_, next_ + 1)):
                return each.delay, each.omega
            continue
        bad = 0.5 * (each.delay + at[k + 1].delay) if k + 1 < len(at) else 1.1 * each.delay
        if poles.unstable(1.0, bad) == 0:
            good = bad
            continue
        while bad - good > _EXACT * bad:
            middle = 0.5 * (bad + good)
            bad, good = (bad, middle) if poles.unstable(1.0, middle) == 0 else (middle, good)
        return good, each.omega
    return math.inf, math.nan
