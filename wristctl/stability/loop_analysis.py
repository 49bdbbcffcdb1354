"""All that the linearised loop tells about one resting point, with its answer to a step and its root locus."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.stability.linear_range import LinearityLimit, Swing, linearity_limits
from wristctl.stability.linearise import LinearLoop, linearise
from wristctl.stability.margins import NEUTRAL, Margins, frequencies, loci_of, margins
from wristctl.stability.sampled_loop import Complex, Mode, SampledLoop
from wristctl.stability.smooth_loop import FrictionReading

_DECAYED, _LONGEST, _SAMPLES = 1e-5, 60.0, 20_000
# Decay [1/s] of what does not end within the longest time [s]: it is left out of how long to look.
_SLOW = 30.0 * NEUTRAL


@dataclass(frozen=True)
class StepResponse:
    """The angle after a step of 1 of its reference at 0, (T,) at times [s], and what is told of it.

    Rise from 10 to 90 %, overshoot, and the time until it stays within 2 %, all of where it ends; `final` is that, as a
    share of the step. nan where the loop is unstable.
    """

    time: Array
    angle: Array
    rise: float
    overshoot: float
    settling: float
    final: float


def step_response(loop: SampledLoop, toward: Array | None = None) -> StepResponse:
    """The step response of a loop until it has settled, sampled at its ticks (every so many in a long one).

    In two planes the reference steps `toward` a direction (2,), and the answer is the bend along it.
    """
    rates = [mode.growth for mode in loop.modes()]
    if max(rates) > NEUTRAL:
        return StepResponse(np.zeros(0), np.zeros(0), *(4 * [math.nan]))
    slowest = min((-rate for rate in rates if rate < -_SLOW), default=1.0)
    lasts = min(-math.log(_DECAYED) / slowest, _LONGEST)
    time, angle = _course(loop, lasts, np.ones(loop.planes) if toward is None else toward)
    return StepResponse(time, angle, *step_info(time, angle))


def step_info(time: Array, angle: Array) -> tuple[float, float, float, float]:
    """Rise [s], overshoot (share), settling [s] and final value of a response (T,), which ends at its last sample."""
    final = float(angle[-1])
    share = angle / final
    rise = float(time[np.argmax(share >= 0.9)] - time[np.argmax(share >= 0.1)])
    outside = np.flatnonzero(np.abs(share - 1.0) >= 0.02)
    settling = float(time[outside[-1] + 1]) if len(outside) else 0.0
    return rise, max(float(share.max()) - 1.0, 0.0), settling, final


def _course(loop: SampledLoop, lasts: float, toward: Array) -> tuple[Array, Array]:
    """Every tick, or, where that were too many, every so many cycles; from one to the next they are one map."""
    count, cycle = math.ceil(lasts / loop.period), len(loop.ticks)
    cycle_map, forced = np.eye(len(loop.ticks[0].into)), np.zeros(len(loop.ticks[0].into))
    rows, pushes = [], []
    for tick in loop.ticks:
        bend = toward @ tick.outputs["theta"].reshape(len(toward), -1)
        rows.append(bend @ cycle_map)
        pushes.append(bend @ forced)
        stepped = tick.reference.reshape(len(forced), -1) @ toward
        cycle_map, forced = tick.transition @ cycle_map, tick.transition @ forced + stepped
    stride = max(1, count // (_SAMPLES * cycle))
    if stride > 1:
        rows, pushes = rows[:1], pushes[:1]
        one, push = cycle_map, forced
        for _ in range(stride - 1):
            cycle_map, forced = one @ cycle_map, one @ forced + push
    state, angles = np.zeros(len(forced)), []
    for _ in range(math.ceil(count / (cycle * stride)) + 1):
        angles.append(np.array(rows) @ state + pushes)
        state = cycle_map @ state + forced
    angle = np.concatenate(angles)
    interval = loop.period * (cycle * stride if stride > 1 else 1)
    return interval * np.arange(len(angle), dtype=np.float64), angle


_POINTS, _HALVINGS = 41, 12
# The closed loop with a gain times a factor; None where it rests nowhere near.
At = Callable[[float], SampledLoop | None]


@dataclass(frozen=True)
class RootLocus:
    """Poles as (growth [1/s], frequency [Hz]) rows (poles, 2) at each of the factors (G,) of the gain.

    `least` and `most` are the factors between which it is stable, about 1 or nearest to it; 0 and inf where no limit
    was met within what was looked at, nan where it is stable at none of them. `swings` are the frequencies [Hz] at
    these limits.
    """

    over: str
    factors: Array
    poles: Sequence[Array]
    least: float
    most: float
    swings: tuple[float, float]


def root_locus(over: str, closed: At, span: float) -> RootLocus:
    """The locus from 1/span to span times the gain, of the loop that `closed` gives."""
    factors = np.geomspace(1.0 / span, span, _POINTS)
    modes = [_modes(closed, float(factor)) for factor in factors]
    poles = [np.array([(mode.growth, mode.frequency) for mode in swings]).reshape(-1, 2) for swings in modes]
    stable = [bool(swings) and swings[0].growth < NEUTRAL for swings in modes]
    near = sorted(range(_POINTS), key=lambda k: abs(k - _POINTS // 2))
    middle = next((k for k in near if stable[k]), None)
    if middle is None:
        return RootLocus(over, factors, poles, math.nan, math.nan, (math.nan, math.nan))
    low = next((k for k in range(middle, -1, -1) if not stable[k]), None)
    high = next((k for k in range(middle, _POINTS) if not stable[k]), None)
    least, slow = (0.0, math.nan) if low is None else _limit(closed, float(factors[low + 1]), float(factors[low]))
    most, fast = (
        (math.inf, math.nan) if high is None else _limit(closed, float(factors[high - 1]), float(factors[high]))
    )
    return RootLocus(over, factors, poles, least, most, (slow, fast))


def _modes(closed: At, factor: float) -> list[Mode]:
    loop = closed(factor)
    return [] if loop is None else loop.modes()


def _limit(closed: At, good: float, bad: float) -> tuple[float, float]:
    """The limit between a factor with which it is stable and one with which it is not, and its swing there [Hz]."""
    for _ in range(_HALVINGS):
        middle = math.sqrt(good * bad)
        modes = _modes(closed, middle)
        good, bad = (middle, bad) if modes and modes[0].growth < NEUTRAL else (good, middle)
    modes_beyond = _modes(closed, bad)
    return good, modes_beyond[0].frequency if modes_beyond else math.nan


@dataclass(frozen=True)
class LoopAnalysis:
    """A loop about one resting bend; `response` is its transfer at frequencies `omega` [rad/s], `plant` the bend's
    per torque [rad/(N m)]: (n,) in one plane, (n, 2, 2) in two."""

    linear: LinearLoop
    margins: Margins
    step: StepResponse
    limits: Sequence[LinearityLimit]
    omega: Array
    response: Complex
    plant: Complex

    @property
    def transfer(self) -> Complex:
        """`response` as (n, P, P)."""
        return self.response.reshape(len(self.omega), self.linear.planes, -1)

    @cached_property
    def loci(self) -> Complex:
        """Characteristic loci of the loop's transfer, (P, n): in one plane the transfer itself."""
        return loci_of(self.transfer)

    @cached_property
    def plant_loci(self) -> Complex:
        """Characteristic loci of the plant, (P, n)."""
        return loci_of(self.plant.reshape(self.transfer.shape))

    @property
    def is_open(self) -> bool:
        """Whether nothing is fed back."""
        return bool(np.abs(self.response).max() < _NOTHING)


_NOTHING = 1e-9


@dataclass(frozen=True)
class AnalysedRow:
    """Subject of an analysis: a law with its gains, by name, in a loop of a wrist, with one reading of friction."""

    law: Controller
    gains: dict[str, float]
    loop: Loop
    wrist: WristParameters
    friction: FrictionReading

    def linear(self, theta: ArrayLike, **gains: float) -> LinearLoop | None:
        """The loop about where it rests near theta [rad], some of its gains as given; None where it does not.

        In two planes theta is (2,).
        """
        values = self.law.values(self.gains | gains)
        return linearise(self.law, values, self.loop, self.wrist, theta, self.friction)

    def analysed(self, theta: ArrayLike, toward: Array | None = None) -> LoopAnalysis | None:
        """Margins, step response and limits about theta [rad]; None where it rests nowhere near.

        In two planes theta is (2,), and the step goes `toward` a direction (2,).
        """
        with threadpool_limits(limits=1):
            linear = self.linear(theta)
            if linear is None:
                return None
            loop_margins, omega = margins(linear.closed), frequencies(linear.closed)
            factor = loop_margins.most.value if loop_margins.stable and np.isfinite(loop_margins.most.value) else 1.0
            swings = [mode for mode in linear.closed.modes(factor) if mode.frequency > 0.0]
            swing = Swing(linear, swings[0] if swings else None, factor)
            limits = linearity_limits(swing, self.loop, self.wrist, self.friction, self.law.surface, self.gains)
            response, plant = linear.closed.response(omega), linear.plant.response(omega)
            step = step_response(linear.closed, toward)
            return LoopAnalysis(linear, loop_margins, step, limits, omega, response, plant)

    def locus(self, theta: ArrayLike, over: str, span: float) -> RootLocus:
        """The root locus about theta [rad] over a gain of the law, or, where that is `loop`, over the loop's own."""
        with threadpool_limits(limits=1):
            here = self.linear(theta)
            if over == "loop":
                return root_locus(over, lambda factor: None if here is None else _times(here.closed, factor), span)

            def at(factor: float) -> SampledLoop | None:
                linear = self.linear(theta, **{over: factor * self.gains[over]})
                return None if linear is None else linear.closed

            return root_locus(over, at, span)


def _times(loop: SampledLoop, factor: float) -> SampledLoop:
    """The loop with its gain times a factor."""
    ticks = zip(loop.ticks, loop.transitions(factor), strict=True)
    return SampledLoop(loop.period, [tick._replace(transition=transition) for tick, transition in ticks])
