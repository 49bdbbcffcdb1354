"""Does a loop come to rest, or does it swing, hunt or chatter: what is left at rest, and what its tensions do.

Half the peak-to-peak of the angle over the last second, its trend removed; over the last half of that where a swing
beyond LIMIT_CYCLE dies out, as after a push. Of a reference that never rests it is the error's, over the last second or
the last two of its periods, with all up to four times its frequency removed.
"""

import math
from collections.abc import Iterator
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from wristctl.arrays import Array
from wristctl.simulation.trajectory import Trajectory

# Half peak-to-peak [rad] above which a loop is said to swing.
LIMIT_CYCLE = np.deg2rad(0.1)
# Time at the end over which a swing is looked for [s].
WINDOW = 1.0
# Rest [s] from which a swing is the loop's own: one to settle, in which a move's tail dies out, and one to look at.
REST = 2.0 * WINDOW
# No wrist follows what is faster [1/s].
FASTEST = 25.0
# Rest [s] that shows whether a loop hunts.
LONG_HOLD = 20.0
_HARMONICS = 4.0
# Share of the swing of the half second before below which that of the last half second dies out, and periods in it from
# which that can be told.
_DIES_OUT, _PERIODS = 0.5, 1.5
# Share of a reference's range within one sample that is a jump.
_JUMP = 0.25
# [rad] below which there is nothing but rounding.
_STILL = 1e-9
_UNKNOWN = math.nan
# Between samples that show how fast a reference goes [s].
_ENOUGH = 0.5 / FASTEST


def oscillation(course: Trajectory) -> float:
    """Half the peak-to-peak [rad] that is left at rest, of the plane that swings most.

    nan where the wrist has failed or there is no time to rest.
    """
    planes = np.arange(course.planes)
    amplitude = float(np.max(oscillations(course.bend.T, course.bend_ref.T, planes, _step(course))))
    return _UNKNOWN if math.isnan(amplitude) else amplitude


def oscillations(theta: Array, references: Array, which: NDArray[np.int64], step: float) -> Array:
    """Oscillation of many loops (L,), of their angles (L, T) `step` [s] apart, and which (L,) of references (M, T) each
    follows."""
    amplitudes = np.full(len(theta), _UNKNOWN)
    for indices, left in _remaining(theta, references, which, step):
        amplitudes[indices] = np.ptp(left, axis=1) / 2.0
        rests = np.ptp(references[:, -left.shape[1] :], axis=1)[which[indices]] == 0.0
        swings = rests & (amplitudes[indices] > LIMIT_CYCLE)
        if swings.any():
            angle = theta[indices[swings], -left.shape[1] :]
            amplitudes[indices[swings]] = _unless_it_dies_out(angle, left[swings], step)
    return amplitudes


def _unless_it_dies_out(angle: Array, left: Array, step: float) -> Array:
    """Half the peak-to-peak (L,) of angles (L, W) without trend, `left`; of a dying swing that of the last half."""
    middle = angle.shape[1] // 2
    amplitudes: Array = np.ptp(left, axis=1) / 2.0
    about = angle - angle[:, middle:].mean(axis=1, keepdims=True)
    quick = _strongest(about, step) * angle.shape[1] * step >= 2.0 * _PERIODS
    if quick.any():
        late = np.ptp(_without_trend(angle[quick, -middle:]), axis=1)
        before = np.ptp(left[quick, :middle], axis=1)
        amplitudes[quick] = np.where(late < _DIES_OUT * before, late / 2.0, amplitudes[quick])
    return amplitudes


def sustained(theta: Array, references: Array, which: NDArray[np.int64], step: float) -> Array:
    """Amplitude [rad] of a sinusoid that is as far from zero for half of the time as what `oscillations` looks at.

    Of a swing that goes on it is the swing's amplitude. What a friction that turns leaves is large for a short time,
    twice a period, and small here. Arguments and shape are those of `oscillations`. Unknown where a reference jumps: no
    wrist jumps, and what is left then is its answer to the jump.
    """
    amplitudes = np.full(len(theta), _UNKNOWN)
    for indices, left in _remaining(theta, references, which, step):
        amplitudes[indices] = math.sqrt(2.0) * np.median(np.abs(left), axis=1)
    jumps = np.abs(np.diff(references, axis=1)).max(axis=1) > _JUMP * np.ptp(references, axis=1)
    amplitudes[jumps[which]] = _UNKNOWN
    return amplitudes


def at_rest(course: Trajectory) -> bool:
    """Whether the reference rests for the last 2 s, so that what is left at the end is a swing of the loop's own."""
    samples = round(REST / _step(course))
    return len(course.time) >= samples and not np.ptp(course.bend_ref[-samples:], axis=0).any()


def chatter(variation: ArrayLike, tension_range: ArrayLike, places: ArrayLike = 2) -> Array:
    """Frequency of tensions between their limits [1/s], where that is faster than any wrist follows; else 0.

    `variation` [N/s] is that of one tendon of each of so many places together, the metric `chattering`; in one plane
    the places are two sides. `tension_range` [N] is the wrist's, from pretension to limit, also where a loop's tensions
    have no limit. What lies near: docs/chattering.md.
    """
    to_and_fro = 2.0 * np.asarray(places, float) * np.asarray(tension_range, float)
    rate = np.asarray(variation, float) / to_and_fro
    return np.where(rate > FASTEST, rate, 0.0)


def hunting(course: Trajectory) -> float:
    """Half the peak-to-peak [rad] over the last half of a hold of at least LONG_HOLD; nan where there is none.

    Friction and slow integrals creep with periods of 5 to 20 s, which one second cannot show.
    """
    moved = np.flatnonzero(np.diff(course.bend_ref, axis=0).any(axis=1))
    begun = int(moved[-1]) + 1 if len(moved) else 0
    held = course.bend[(begun + len(course.time)) // 2 :]
    if (len(course.time) - begun) * _step(course) < LONG_HOLD or not np.isfinite(held).all():
        return _UNKNOWN
    return max(_creeping(plane) for plane in held.T)


def _creeping(held: Array) -> float:
    """Half the peak-to-peak of angles (W,), their trend removed [rad]."""
    place = np.linspace(-1.0, 1.0, len(held))
    trend = np.polynomial.polynomial.polyfit(place, held, 1)
    return float(np.ptp(held - np.polynomial.polynomial.polyval(place, trend)) / 2.0)


def oscillation_frequency(course: Trajectory) -> float:
    """Strongest frequency of the remaining swing [1/s], of the plane that swings most; nan where there is none."""
    most, frequency = _STILL, _UNKNOWN
    for _, left in _remaining(course.bend.T, course.bend_ref.T, np.arange(course.planes), _step(course)):
        swings = np.ptp(left, axis=1)
        if swings.max() >= most:
            most, frequency = float(swings.max()), float(_strongest(left[[np.argmax(swings)]], _step(course))[0])
    return frequency


def _remaining(
    theta: Array, references: Array, which: NDArray[np.int64], step: float
) -> Iterator[tuple[NDArray[np.intp], Array]]:
    """Residual at the end of each course (l, W) [rad], by loops that are judged alike, its trend or what follows
    its reference removed: nan where a wrist has failed. Of none, where there is no time to rest."""
    window, samples = round(WINDOW / step), references.shape[1]
    if window > samples:
        return
    rests = np.ptp(references[:, -window:], axis=1) == 0.0
    if rests.any():  # whichever it follows
        indices = np.flatnonzero(rests[which])
        yield indices, _without_trend(theta[indices, -window:])
    if rests.all():
        return
    frequency = _strongest(references, step, max(1, round(_ENOUGH / step)), references.mean(axis=1))
    windows = np.clip(np.rint(2.0 / (frequency * step)), window, samples).astype(int)
    waves = math.pi * _HARMONICS * frequency * step * windows  # a polynomial follows so many waves, and no more
    degrees = np.minimum(4 + np.rint(waves).astype(int), windows // 2)
    for most, degree in dict.fromkeys(zip(windows[~rests].tolist(), degrees[~rests].tolist(), strict=True)):
        indices = np.flatnonzero((~rests & (windows == most) & (degrees == degree))[which])
        basis = _polynomials(most, degree)
        error = theta[indices, -most:] - references[which[indices], -most:]
        yield indices, error - error @ basis @ basis.T


@lru_cache(32)
def _polynomials(samples: int, degree: int) -> Array:
    """An orthonormal basis of the polynomials up to a degree, (samples, degree + 1)."""
    basis: Array = np.linalg.qr(np.polynomial.legendre.legvander(np.linspace(-1.0, 1.0, samples), degree))[0]
    return basis


def _without_trend(angle: Array) -> Array:
    """The angles (L, W) less their trend, told apart from that of a swing that is cut in its middle.

    It is a cubic: a wrist that still creeps to its place does so along an exponential, and does not swing.
    """
    basis = _polynomials(angle.shape[1], min(3, angle.shape[1] - 1))
    left: Array = angle - angle @ basis @ basis.T
    moving = np.ptp(left, axis=1) >= _STILL
    if moving.any():
        left[moving] = _without_swing(angle[moving], left[moving], basis)
    return left


def _without_swing(angle: Array, left: Array, trend: Array) -> Array:
    """The angles (L, W) less the trend of a fit of trend and the strongest swing of what is left without it."""
    place = np.linspace(-1.0, 1.0, angle.shape[1])
    phase = math.pi * _strongest(left, 1.0)[:, None] * len(place) * place
    swing = np.stack([np.cos(phase), np.sin(phase)], axis=2)  # (L, W, 2)
    swing_left = swing - trend @ (trend.T @ swing)
    # least squares on what of the swing is no trend; the trend is then what of the angle that swing does not explain
    normal = np.swapaxes(swing_left, 1, 2) @ swing_left
    size = np.linalg.pinv(normal, rcond=1e-12, hermitian=True) @ (np.swapaxes(swing_left, 1, 2) @ left[:, :, None])
    unexplained = angle - (swing @ size)[:, :, 0]
    detrended: Array = angle - unexplained @ trend @ trend.T
    return detrended


def _strongest(values: Array, step: float, every: int = 1, mean: Array | float = 0.0) -> Array:
    """The strongest frequency [1/s] of each row (L, T) of values `step` [s] apart less its mean, (L,), by one in
    `every`."""
    taken, count = slice(None, None, every), round(8 * values.shape[1] / every)
    windowed = (values[:, taken] - np.reshape(mean, (-1, 1))) * np.hanning(values.shape[1])[taken]
    power = np.abs(np.fft.rfft(windowed, count, axis=1))
    return np.asarray((np.argmax(power[:, 8:], axis=1) + 8) / (count * every * step))


def _step(course: Trajectory) -> float:
    return float(course.time[1] - course.time[0]) if len(course.time) > 1 else WINDOW
