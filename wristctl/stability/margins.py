"""Gain, delay and phase margins of a linear loop, and its peaks of sensitivity.

Margins where the loop's transfer crosses the real axis and the unit circle (Astrom and Murray 2008, section 9.3),
each tried by counting the closed loop's unstable poles on both sides of it: a crossing need not be a stability limit,
and a loop whose frames fall unevenly on its ticks has more to its stability than one transfer.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq

from wristctl.arrays import Array
from wristctl.stability.sampled_loop import Complex, SampledLoop

_FINE, _CONTOUR_PER_DECADE, _LEAST = 1000, 40, 1e-9
_NEAR, _CLOSE_TURNS = 0.1, (0.0, 0.1, 0.3, 1.0, 3.0)


class PoleCount:
    """Counts poles that grow faster than `neutral` [1/s], at other gains and with more delay than the loop has."""

    def __init__(self, loop: SampledLoop, neutral: float) -> None:
        self._loop = loop
        self._radius = max(math.exp(neutral * loop.lasts), 1.0 + _ROUNDING)
        closed = loop.multipliers()
        self._poles_beyond = int(np.sum(np.abs(closed) > self._radius))
        self._z = self._radius * np.exp(1j * self._angles(np.concatenate([closed, loop.multipliers(0.0)])))
        self._back = loop.returned(self._z)
        self._turns = self._winding(1.0, 0.0)

    def unstable(self, factor: float, delay: float = 0.0) -> int:
        """Count the unstable poles with the loop's gain times a factor and an added delay [s]."""
        return self._poles_beyond + self._turns - self._winding(factor, delay)

    def _winding(self, factor: float, delay: float) -> int:
        """Winding number of the determinant about 0, from half the circle: the other half is its mirror image."""
        back = self._back[:, self._loop.cuts] if delay == 0.0 else self._late(delay)
        determinants = np.linalg.det(np.eye(back.shape[-1]) - factor * back)
        return round(float(np.sum(np.angle(determinants[1:] / determinants[:-1]))) / math.pi)

    def _late(self, delay: float) -> Complex:
        """Delay the signals that return at the cuts by a time [s], linearly between two ticks."""
        count, ticks = len(self._loop.ticks), delay / self._loop.period
        whole_ticks = math.floor(ticks)
        delayed = np.zeros((len(self._z), len(self._loop.cuts), len(self._loop.cuts)), complex)
        for row, cut in enumerate(self._loop.cuts):
            for back, share in ((whole_ticks, 1.0 + whole_ticks - ticks), (whole_ticks + 1, ticks - whole_ticks)):
                cycles, tick = divmod(cut - back, count)
                delayed[:, row] += share * (self._z**cycles)[:, None] * self._back[:, tick]
        return delayed

    def _angles(self, poles: Complex) -> Array:
        """Angles of z on the upper half of its circle, denser near the poles."""
        angles, damping = np.abs(np.angle(poles)), np.abs(np.abs(poles) - self._radius)
        angles, damping = angles[damping < _NEAR * angles], damping[damping < _NEAR * angles]
        close = [np.abs(angles + side * width * damping) for width in _CLOSE_TURNS for side in (-1.0, 1.0)]
        decades = np.geomspace(_LEAST, math.pi, round(_CONTOUR_PER_DECADE * math.log10(math.pi / _LEAST)))
        every = np.unique(np.concatenate([[0.0, math.pi], np.linspace(0.0, math.pi, _FINE), decades, *close]))
        return np.asarray(every[every <= math.pi])


# Largest rounding error of a pole on the unit circle.
_ROUNDING = 1e-7


# Growth [1/s] below which a mode stays as it is: an integrator that nothing drives, a slow leak.
NEUTRAL = 1e-3
_LEAST_OMEGA, _PER_DECADE, _CLOSE_BELOW = 1e-2, 120, 40
# Damping of poles near which a response is looked at too, and at which distances from their frequency, in it.
_LIGHT, _CLOSE = 0.1, (0.0, 0.1, 0.3, 1.0, 3.0)


class Crossing(NamedTuple):
    """A frequency [rad/s], and what is asked for there: a gain's factor, or a phase margin [rad]."""

    omega: float
    value: float

    @property
    def delay(self) -> float:
        """Delay [s] that takes up a phase margin."""
        return (self.value % (2.0 * math.pi)) / self.omega


@dataclass(frozen=True)
class Margins:
    """Margins of a loop: about its own gain where it is `stable`, else the gains that make it so, and no delay."""

    stable: bool
    growth: float
    """Growth of the least stable mode [1/s]."""
    least: Crossing
    """Least factor of the gain with which the loop is stable; 0 where none is too small, nan where none is
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
    """Frequencies [rad/s] to evaluate a loop at, to half its sampling rate: even by decades, dense near its poles and
    below half the rate, where a pair may leave the unit circle just before both its poles are real."""
    most = half_rate(loop)
    count = max(2, round(_PER_DECADE * math.log10(most / _LEAST_OMEGA)))
    grids = [
        np.geomspace(min(_LEAST_OMEGA, 0.1 * most), most, count),
        most * (1.0 - np.geomspace(1e-5, 0.03, _CLOSE_BELOW)),
    ]
    for pole in swinging(loop):
        grids.append(abs(pole.imag) + np.outer((-1.0, 1.0), _CLOSE).ravel() * abs(pole.real))
    every = np.unique(np.concatenate(grids))
    return np.asarray(every[(every >= grids[0][0]) & (every <= most)])


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
    least, most = _stable_gains(loop, poles, [crossing for crossing in phases if crossing.value > 0.0], stable)
    delay, delay_omega = (math.nan, math.nan) if not stable else _delay(loop, poles, gains)
    amplified = np.abs(1.0 / (1.0 + response))
    carried = np.abs(response) * amplified
    smallest = min(gains, key=lambda crossing: abs(crossing.value), default=Crossing(math.nan, math.inf))
    return Margins(
        stable, loop.growth(), least, most, delay, delay_omega, smallest, gains, phases,
        *(_peak(loop, omega, values, of) for values, of in ((amplified, _amplified), (carried, _carried))),
    )  # fmt: skip


def crossings(loop: SampledLoop, omega: Array, response: Complex) -> tuple[list[Crossing], list[Crossing]]:
    """Crossings of a transfer L: of gain 1, with phase margins in (-pi, pi], and of phase -180 deg, with gain factors.

    At frequency 0, and at half the sampling rate of a loop of one rate, L is real: there the loop runs away, or turns
    with every sample. Where an integrator holds it at frequency 0, it cannot run away.
    """
    gains = [
        Crossing(frequency, float(np.angle(-_transfer(loop, frequency))))
        for frequency in _zeros(
            omega, np.log(np.abs(response) + 1e-300), lambda omega: math.log(abs(_transfer(loop, omega)) + 1e-300)
        )
    ]
    end = len(omega) - 1  # at half the rate rounding decides the sign of what is 0
    turns = _zeros(omega[:end], response.imag[:end], lambda frequency: _transfer(loop, frequency).imag)
    turns += omega[end:].tolist()
    values = [(frequency, _transfer(loop, frequency).real) for frequency in turns]
    still = _transfer(loop, _STILL * float(omega[0]))
    if abs(still.imag) < _STILL * abs(still.real) < 1.0:
        values.append((0.0, still.real))
    return gains, [Crossing(frequency, -1.0 / value) for frequency, value in values if value < -_NOTHING]


_STILL = 1e-3
# Size of a transfer below which the loop counts as open.
_NOTHING = 1e-9


def _transfer(loop: SampledLoop, omega: float) -> complex:
    return complex(loop.response(np.array([omega]))[0])


def _amplified(response: complex) -> float:
    return abs(1.0 / (1.0 + response))


def _carried(response: complex) -> float:
    return abs(response / (1.0 + response))


def _zeros(omega: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """Roots of a function between the frequencies at which its values change their sign."""
    roots = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        roots.append(float(brentq(function, omega[k], omega[k + 1], xtol=1e-15 * omega[k + 1], rtol=1e-14)))
    return roots


def _peak(loop: SampledLoop, omega: Array, values: Array, of: Callable[[complex], float]) -> Crossing:
    """The largest value, refined by golden sections between its neighbours."""
    k = int(np.argmax(values))
    low, high = omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)]
    for _ in range(_SECTIONS):
        inner = low + _GOLDEN * (high - low), high - _GOLDEN * (high - low)
        if of(_transfer(loop, inner[0])) > of(_transfer(loop, inner[1])):
            high = inner[1]
        else:
            low = inner[0]
    middle = 0.5 * (low + high)
    return Crossing(float(middle), max(float(values[k]), of(_transfer(loop, middle))))


_GOLDEN, _SECTIONS = 0.381966, 40


def _stable_gains(
    loop: SampledLoop, poles: PoleCount, crossed: Sequence[Crossing], stable: bool
) -> tuple[Crossing, Crossing]:
    """The factors between which the loop is stable: about 1, or, where it is not stable there, the nearest to it."""
    tried = _tried([crossing.value for crossing in crossed], *_FACTORS)
    good = [factor for factor in tried if poles.unstable(factor) == 0]
    if not stable and not good:
        return Crossing(math.nan, math.nan), Crossing(math.nan, math.nan)
    inside = 1.0 if stable else min(good, key=lambda factor: abs(math.log(factor)))
    above = next((factor for factor in tried if factor > inside and factor not in good), None)
    below = next((factor for factor in reversed(tried) if factor < inside and factor not in good), None)
    least = Crossing(math.nan, 0.0) if below is None else _gain_limit(loop, poles, crossed, inside, below)
    most = Crossing(math.nan, math.inf) if above is None else _gain_limit(loop, poles, crossed, inside, above)
    return least, most


def _gain_limit(loop: SampledLoop, poles: PoleCount, crossed: Sequence[Crossing], good: float, bad: float) -> Crossing:
    """Stability limit between two factors: a crossing, or a factor close to one in a loop of several rates."""
    limit = math.exp(_halved(lambda log: poles.unstable(math.exp(log)) == 0, math.log(good), math.log(bad)))
    if loop.is_steady and crossed:
        return min(crossed, key=lambda crossing: abs(math.log(crossing.value / limit)))
    return Crossing(2.0 * math.pi * loop.modes(limit)[0].frequency, limit)


def _delay(loop: SampledLoop, poles: PoleCount, crossed: Sequence[Crossing]) -> tuple[float, float]:
    """The least delay that makes a stable loop unstable, and where it then swings [rad/s].

    A crossing of a loop of one rate counts where one of the two whole ticks that follow makes it unstable.
    """
    by_delay = sorted(crossed, key=lambda crossing: crossing.delay)
    if loop.is_steady:
        for crossing in by_delay:
            whole_ticks = math.ceil(crossing.delay / loop.period)
            if any(poles.unstable(1.0, loop.period * ticks) for ticks in (whole_ticks, whole_ticks + 1)):
                return crossing.delay, crossing.omega
        return math.inf, math.nan
    good = 0.0
    for tried in _tried([crossing.delay for crossing in by_delay], *_DELAYS):
        if poles.unstable(1.0, tried) > 0:
            limit = _halved(lambda delay: poles.unstable(1.0, delay) == 0, good, tried)
            nearest = min(by_delay, key=lambda edge: abs(edge.delay - limit), default=Crossing(math.nan, math.nan))
            return limit, nearest.omega
        good = tried
    return math.inf, math.nan


# Factors of the gain, and delays [s], that are tried besides those between crossings: least, most, how many.
_FACTORS, _DELAYS = (1e-3, 1e3, 61), (1e-3, 1.0, 31)
_EXACT = 1e-7


def _tried(edges: Sequence[float], least: float, most: float, count: int) -> list[float]:
    """Values between all edges and beyond them, and others of a grid."""
    positive = sorted(edge for edge in edges if edge > 0.0)
    between = [math.sqrt(low * high) for low, high in pairwise(positive)]
    ends = [0.5 * positive[0], 1.1 * positive[-1]] if positive else []
    return sorted({*np.geomspace(least, most, count).tolist(), *between, *ends})


def _halved(is_good: Callable[[float], bool], good: float, bad: float) -> float:
    """The last good value before a bad one."""
    while abs(bad - good) > _EXACT * max(abs(good), abs(bad), _EXACT):
        middle = 0.5 * (good + bad)
        good, bad = (middle, bad) if is_good(middle) else (good, middle)
    return good
