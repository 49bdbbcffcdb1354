"""Loops of a wrist whose tendons have friction, and the dead band in which held spools leave it.

Each is driven with half of its integration steps too, and then with 2, 4, ... times as many, until it stays what it is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.simulation.convergence import ABSOLUTE, FINER, RELATIVE
from wristctl.simulation.spool_driven import FrictionCase, Spooled, Strokes, spooled

_HOLD = 1.5
"""How long a wrist is held at the end of a ramp [s]."""
_FULLY = 5.0
"""Path, over presliding, after which a bristle is bent fully: to exp(-5)."""
_LEAST_WORK = 0.01
"""Share of the raw loop's area below which a work is compared with that share."""
_LEAST_WIDTH = ABSOLUTE / RELATIVE
"""Width [rad] below which an angle is compared with that."""


class LoopCase(NamedTuple):
    """A loop: its friction, cycles per second, and between which angles it would go without friction [rad]."""

    tendons: FrictionCase
    frequency: float
    low: float
    high: float


@dataclass(frozen=True)
class HysteresisLoop:
    """The last of one and a half cycles, from the range's high end back to it; its last sample is the first again."""

    case: LoopCase
    time: Array
    """(T,) [s]"""
    unhindered: Array
    """Angle of a wrist at rest without friction on these spools, (T,) [rad]."""
    course: Spooled
    """What the wrist did, (T,) each."""
    exact_width: float
    """Dead band in the middle of the range, by the statics [rad]."""
    step: float
    """Integration step [s]."""
    drift: float = 0.0
    """Largest relative change of width and works with the integration step, at the shortest tried; 0: converged."""

    @property
    def width(self) -> float:
        """By how much more it is bent on its way back than on its way there, in the middle of the range [rad]."""
        quarter = (len(self.time) - 1) // 4
        return float(self.course.theta[quarter] - self.course.theta[3 * quarter])

    @property
    def friction_work(self) -> float:
        """What friction took [J]."""
        return _gained(self.course.friction)

    @property
    def raw_work(self) -> float:
        """Area of the loop of pulls at the spools over the tendons' path [J]."""
        return _gained(self.course.raw)

    @property
    def damped_work(self) -> float:
        """What the wrist's damping took [J]."""
        return _gained(self.course.damped)

    def change(self, coarse: HysteresisLoop) -> float:
        """Largest relative change of width and works from a longer step to this one."""
        of_width = abs(self.width - coarse.width) / max(abs(self.width), _LEAST_WIDTH)
        least = max(_LEAST_WORK * abs(self.raw_work), 1e-12)
        names = "friction_work", "raw_work", "damped_work"
        pairs = [(getattr(self, name), getattr(coarse, name)) for name in names]
        return _largest([of_width, *(abs(fine - before) / max(abs(fine), least) for fine, before in pairs)])


def _gained(work: Array) -> float:
    return float(work[-1] - work[0])


def _largest(changes: Sequence[float]) -> float:
    """The largest; what is no number has changed beyond all."""
    return max(each if math.isfinite(each) else math.inf for each in changes)


@dataclass(frozen=True)
class DeadBand:
    """Where held spools leave a wrist that comes from below and from above [rad]."""

    tendons: FrictionCase
    unhindered: float
    """Where they would without friction."""
    exact_below: float
    """By the statics."""
    exact_above: float
    below: float
    """At the end of a ramp."""
    above: float
    slid: bool
    """Whether its tendons slid far enough on both ramps that their bristles were bent fully."""
    step: float
    """Integration step [s]."""
    drift: float = 0.0
    """Largest change of an end with the integration step, over the width, at the shortest tried; 0: converged."""

    @property
    def exact_width(self) -> float:
        """By the statics [rad]."""
        return self.exact_above - self.exact_below

    @property
    def width(self) -> float:
        """As it was simulated [rad]."""
        return self.above - self.below

    def change(self, coarse: DeadBand) -> float:
        """Largest change of an end from a longer step to this one, over the width."""
        least = max(abs(self.width), _LEAST_WIDTH)
        return _largest([abs(self.below - coarse.below) / least, abs(self.above - coarse.above) / least])


Found = TypeVar("Found", HysteresisLoop, DeadBand)


def _converged(run: Callable[[NDArray[np.int64], int], list[Found]], count: int, steps: int) -> list[Found]:
    """What `run` finds of `count` wrists, each with as many integration steps as it takes.

    `run` drives some of them with so many steps in an interval of its own, `steps` or a multiple. The first number of
    steps whose result is within 1 % (or 0.002 deg) of that with half of them is taken.
    """
    left, coarse = np.arange(count), max(1, steps // 2)
    found, before = run(left, coarse), dict[int, Found]()
    for times in (1, *FINER):
        if times * steps == coarse:
            continue
        before |= zip(left.tolist(), (found[at] for at in left), strict=True)
        for at, fine in zip(left.tolist(), run(left, times * steps), strict=True):
            found[at] = fine
        left = np.array([at for at in left.tolist() if found[at].change(before[at]) > RELATIVE], np.int64)
        if not len(left):
            break
    for at in left.tolist():
        found[at] = replace(found[at], drift=found[at].change(before[at]))
    return found


def friction_cases(settings: HysteresisSettings) -> list[FrictionCase]:
    """Every combination; without a coefficient there is one, since neither sheath nor presliding does anything."""
    every = itertools.product(settings.frictions, settings.sheaths, settings.preslidings)
    none = 0.0, settings.preslidings[0]
    cases = [FrictionCase(friction, *(rest if friction > 0.0 else none)) for friction, *rest in every]
    return list(dict.fromkeys(cases))


def main_case(settings: HysteresisSettings) -> FrictionCase:
    """The one that words are about: first coefficient and presliding, middle sheath."""
    return with_sheaths(settings)[len(settings.sheaths) // 2 if settings.frictions[0] > 0.0 else 0]


def with_sheaths(settings: HysteresisSettings) -> list[FrictionCase]:
    """Every sheath, shortest first, with the first coefficient and presliding."""
    first = {"frictions": settings.frictions[:1], "preslidings": settings.preslidings[:1]}
    return friction_cases(settings.model_copy(update={**first, "sheaths": tuple(sorted(settings.sheaths))}))


def with_preslidings(settings: HysteresisSettings) -> list[FrictionCase]:
    """Every presliding, shortest first, of the main one."""
    return [main_case(settings)._replace(presliding=each) for each in sorted(settings.preslidings)]


def loop_cases(settings: HysteresisSettings) -> list[LoopCase]:
    """Every loop, by range, friction and speed."""
    ranges = [(math.radians(low), math.radians(high)) for low, high in settings.ranges_deg]
    every = itertools.product(ranges, friction_cases(settings), settings.frequencies)
    return [LoopCase(tendons, frequency, *ends) for ends, tendons, frequency in every]


def loops(own: Strokes, progress: Callable[[float], None] = lambda share: None) -> list[HysteresisLoop]:
    """Every loop of the settings; `progress` is called with the share that is done."""
    settings, cases = own.settings, loop_cases(own.settings)
    share = {each: 1.0 / each / sum(1.0 / other for other in settings.frequencies) for each in settings.frequencies}
    found: dict[LoopCase, HysteresisLoop] = {}
    done = 0.0
    for frequency in settings.frequencies:
        found |= _driven(own, frequency, [each for each in cases if each.frequency == frequency])
        done += share[frequency]
        progress(done)
    return [found[each] for each in cases]


def _driven(own: Strokes, frequency: float, cases: Sequence[LoopCase]) -> dict[LoopCase, HysteresisLoop]:
    """The loops of one speed."""
    settings = own.settings
    low, high = np.array([(each.low, each.high) for each in cases]).T
    ends = own.exact([each.tendons for each in cases], 0.5 * (low + high))
    wrists = [own.lane(each.tendons, each.low) for each in cases]
    cycle = np.arange(settings.samples // 2, 3 * settings.samples // 2 + 1)
    swing = _swing(cycle / settings.samples, settings.shape)

    def run(which: NDArray[np.int64], every: int) -> list[HysteresisLoop]:
        h = 1.0 / (frequency * settings.samples * every)
        first, rises = low[which], (high - low)[which]

        def told(time: Array, lanes: NDArray[np.int64]) -> Array:
            return own.told(first[lanes] + rises[lanes] * _swing(frequency * time, settings.shape)[:, None])

        done = spooled([wrists[at] for at in which], told, 3 * settings.samples * every // 2 + 1, h, every)
        time = h * every * np.arange(0.0, settings.samples + 1)
        return [
            HysteresisLoop(
                cases[at], time, low[at] + (high - low)[at] * swing, Spooled(*(each[lane, cycle] for each in done)),
                float(ends[at, 1] - ends[at, 0]), h,
            )
            for lane, at in enumerate(which.tolist())
        ]  # fmt: skip

    every = math.ceil(1.0 / (frequency * settings.step * settings.samples) * (1.0 - 1e-9))
    return {each.case: each for each in _converged(run, len(cases), every)}


def _swing(phase: Array, shape: str) -> Array:
    """From 0 to 1 and back in each cycle."""
    if shape == "sine":
        return 0.5 - 0.5 * np.cos(2.0 * np.pi * phase)
    return 1.0 - np.abs(1.0 - 2.0 * (phase % 1.0))


def dead_bands(own: Strokes) -> list[DeadBand]:
    """At every angle of the settings, of every friction: where held spools leave a wrist, approached by ramps."""
    settings = own.settings
    every = [(case, math.radians(angle)) for case in friction_cases(settings) for angle in settings.angles_deg]
    if not every:
        return []
    angle, ends = np.array([angle for _, angle in every]), np.radians(settings.ranges_deg[0])
    exact = own.exact([tendons for tendons, _ in every], angle)
    lasts = settings.ramp + _HOLD

    def run(which: NDArray[np.int64], steps: int) -> list[DeadBand]:
        begin, goal = np.repeat(ends, len(which)), np.tile(angle[which], 2)

        def told(time: Array, lanes: NDArray[np.int64]) -> Array:
            s = np.minimum(time / settings.ramp, 1.0)[:, None]
            return own.told(begin[lanes] + (goal - begin)[lanes] * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

        wrists = [own.lane(every[at][0], float(end)) for end in ends for at in which]
        done = spooled(wrists, told, steps + 1, lasts / steps, steps)
        path = own.wrist.tendon_offset * np.abs(done.theta[:, -1] - begin).reshape(2, -1).min(axis=0)
        slid = path > _FULLY * np.array([every[at][0].presliding for at in which])
        below, above = done.theta[:, -1].reshape(2, -1).tolist()
        return [
            DeadBand(
                every[at][0], every[at][1], float(exact[at, 0]), float(exact[at, 1]),
                below[k], above[k], bool(slid[k]), lasts / steps,
            )
            for k, at in enumerate(which.tolist())
        ]  # fmt: skip

    return _converged(run, len(every), max(2, round(lasts / settings.step)))
