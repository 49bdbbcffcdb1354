"""Gain, delay and phase margins of a linear loop, and its peaks of sensitivity.

Margins where the loop's transfer crosses the real axis and the unit circle (Astrom and Murray 2008, section 9.3),
each tried by counting the closed loop's unstable poles on both sides of it: a crossing need not be a stability limit,
and a loop whose frames fall unevenly on its ticks has more to its stability than one transfer.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import pairwise
from typing import NamedTuple

import numpy as np
from scipy.optimize import brentq, linear_sum_assignment

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
        self._open = self._back[:, loop.rows_at(loop.cuts)]
        self._loci = loci_of(self._open).T if loop.planes > 1 else None
        self._turns = self._winding(1.0, 0.0)

    def unstable(self, factor: float, delay: float = 0.0) -> int:
        """Count the unstable poles with the loop's gain times a factor and an added delay [s]."""
        return self._poles_beyond + self._turns - self._winding(factor, delay)

    def _winding(self, factor: float, delay: float) -> int:
        """Winding number of the determinant about 0, from half the circle: the other half is its mirror image.

        Two planes alike cross the circle together: in these the loci are followed one by one.
        """
        if delay == 0.0 and self._loci is not None:
            factors = 1.0 - factor * self._loci
        else:
            back = self._open if delay == 0.0 else self._late(delay)
            factors = np.linalg.det(np.eye(back.shape[-1]) - factor * back)[:, None]
        return round(float(np.sum(np.angle(factors[1:] / factors[:-1]))) / math.pi)

    def _late(self, delay: float) -> Complex:
        """Delay the signals that return at the cuts by a time [s], linearly between two ticks."""
        count, ticks = len(self._loop.ticks), delay / self._loop.period
        whole_ticks = math.floor(ticks)
        delayed = np.zeros_like(self._back[:, self._loop.rows_at(self._loop.cuts)])
        for number, cut in enumerate(self._loop.cuts):
            rows = self._loop.rows_at([number])
            for back, share in ((whole_ticks, 1.0 + whole_ticks - ticks), (whole_ticks + 1, ticks - whole_ticks)):
                cycles, tick = divmod(cut - back, count)
                delayed[:, rows] += share * (self._z**cycles)[:, None, None] * self._back[:, self._loop.rows_at([tick])]
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


class EachPlane(NamedTuple):
    """Factors of a plane's gain, or its phase [rad] to either side, that leave a stable loop stable (disk margin).

    Of the disk of radius 1/Ms about -1 (Lehtomaki, Sandell and Athans, IEEE Trans. Automatic Control 26 (1981) 75).
    """

    least: float
    most: float
    phase: float


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

    @property
    def of_each(self) -> EachPlane:
        """Gains and phases that each plane bears by itself, whatever the others bear at the same time."""
        disk = 1.0 / self.sensitivity.value
        most = 1.0 / (1.0 - disk) if disk < 1.0 else math.inf
        return EachPlane(1.0 / (1.0 + disk), most, 2.0 * math.asin(min(1.0, 0.5 * disk)))


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
    """The margins of a loop. A loop that nothing comes back in has none: all are infinite.

    In two planes they are of both planes' gains times one factor, and of one delay in both: of the eigenvalues of the
    loop's transfer (its characteristic loci). Sensitivities are largest singular values.
    """
    omega = frequencies(loop)
    transfer = loop.transfer(omega)
    gains, phases = crossings(loop, omega, loci_of(transfer))
    poles = PoleCount(loop, NEUTRAL)
    stable = poles.unstable(1.0) == 0
    least, most = _stable_gains(loop, poles, [crossing for crossing in phases if crossing.value > 0.0], stable)
    delay, delay_omega = (math.nan, math.nan) if not stable else _delay(loop, poles, gains)
    smallest = min(gains, key=lambda crossing: abs(crossing.value), default=Crossing(math.nan, math.inf))
    return Margins(
        stable, loop.growth(), least, most, delay, delay_omega, smallest, gains, phases,
        *(_peak(loop, omega, of(transfer), of) for of in (amplified, carried)),
    )  # fmt: skip


def loci_of(transfer: Complex) -> Complex:
    """Eigenvalues of a transfer (n, P, P) over its frequencies, each followed from one to the next, (P, n)."""
    loci = np.linalg.eigvals(transfer)
    for before, now in pairwise(loci):
        now[:] = now[linear_sum_assignment(np.abs(before[:, None] - now))[1]]
    return np.asarray(loci.T)


def crossings(loop: SampledLoop, omega: Array, loci: Complex) -> tuple[list[Crossing], list[Crossing]]:
    """Crossings of loci L (P, n): of gain 1, with phase margins in (-pi, pi], and of phase -180 deg, with gain factors.

    At frequency 0, and at half the sampling rate of a loop of one rate, L is real: there the loop runs away, or turns
    with every sample. Where an integrator holds it at frequency 0, it cannot run away.
    """
    gains, values = list[Crossing](), list[tuple[float, float]]()
    end = len(omega) - 1  # at half the rate rounding decides the sign of what is 0
    for locus in loci:
        at = partial(_locus_at, loop, omega, locus)
        sizes = np.log(np.abs(locus) + 1e-300)
        crossed = _zeros(omega, sizes, partial(_log_size, at))
        gains += [Crossing(frequency, float(np.angle(-at(frequency)))) for frequency in crossed]
        turns = _zeros(omega[:end], locus.imag[:end], partial(_imaginary, at))
        values += [(frequency, at(frequency).real) for frequency in (*turns, *omega[end:].tolist())]
    for still in _loci_at(loop, _STILL * float(omega[0])):
        if abs(still.imag) < _STILL * abs(still.real) < 1.0:
            values.append((0.0, still.real))
    return gains, [Crossing(frequency, -1.0 / value) for frequency, value in values if value < -_NOTHING]


_STILL = 1e-3
# Size of a transfer below which the loop counts as open.
_NOTHING = 1e-9


def _locus_at(loop: SampledLoop, omega: Array, locus: Complex, frequency: float) -> complex:
    """The one of a transfer's eigenvalues at a frequency that a locus (n,) leads to, known at frequencies omega."""
    near = complex(np.interp(frequency, omega, locus.real), np.interp(frequency, omega, locus.imag))
    return min(_loci_at(loop, frequency), key=lambda value: abs(value - near))


def _log_size(at: Callable[[float], complex], frequency: float) -> float:
    return math.log(abs(at(frequency)) + 1e-300)


def _imaginary(at: Callable[[float], complex], frequency: float) -> float:
    return at(frequency).imag


def _loci_at(loop: SampledLoop, omega: float) -> list[complex]:
    values: list[complex] = np.linalg.eigvals(loop.transfer(np.array([omega]))[0]).tolist()
    return values


def amplified(transfer: Complex) -> Array:
    """|1/(1 + L)| of a transfer (n, P, P): largest singular values, (n,)."""
    return np.asarray(np.linalg.norm(_sensitivity(transfer), 2, axis=(-2, -1)))


def carried(transfer: Complex) -> Array:
    """|L/(1 + L)| of a transfer (n, P, P): largest singular values, (n,)."""
    return np.asarray(np.linalg.norm(transfer @ _sensitivity(transfer), 2, axis=(-2, -1)))


def _sensitivity(transfer: Complex) -> Complex:
    return np.asarray(np.linalg.inv(np.eye(transfer.shape[-1]) + transfer))


def _zeros(omega: Array, values: Array, function: Callable[[float], float]) -> list[float]:
    """Roots of a function between the frequencies at which its values change their sign."""
    roots = []
    for k in np.flatnonzero(values[:-1] * values[1:] < 0.0):
        roots.append(float(brentq(function, omega[k], omega[k + 1], xtol=1e-15 * omega[k + 1], rtol=1e-14)))
    return roots


def _peak(loop: SampledLoop, omega: Array, values: Array, of: Callable[[Complex], Array]) -> Crossing:
    """The largest value, refined by golden sections between its neighbours."""
    k = int(np.argmax(values))
    low, high = omega[max(k - 1, 0)], omega[min(k + 1, len(omega) - 1)]
    for _ in range(_SECTIONS):
        inner = low + _GOLDEN * (high - low), high - _GOLDEN * (high - low)
        first, second = of(loop.transfer(np.array(inner)))
        if first > second:
            high = inner[1]
        else:
            low = inner[0]
    middle = 0.5 * (low + high)
    return Crossing(float(middle), max(float(values[k]), float(of(loop.transfer(np.array([middle])))[0])))


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
