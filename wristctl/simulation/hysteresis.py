"""Loops of a wrist whose tendons have friction, and the dead band in which held spools leave it."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.simulation.spooled import Spooled, spooled
from wristctl.simulation.strokes import FrictionCase, Strokes

_HOLD = 1.5
"""How long a wrist is held at the end of a ramp [s]."""
_FULLY = 5.0
"""Path, over presliding, after which a bristle is bent fully: to exp(-5)."""


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


def _gained(work: Array) -> float:
    return float(work[-1] - work[0])


class DeadBand(NamedTuple):
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

    @property
    def exact_width(self) -> float:
        """By the statics [rad]."""
        return self.exact_above - self.exact_below

    @property
    def width(self) -> float:
        """As it was simulated [rad]."""
        return self.above - self.below


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
    every = math.ceil(1.0 / (frequency * settings.step * settings.samples) * (1.0 - 1e-9))
    h = 1.0 / (frequency * settings.samples * every)

    def told(time: Array, which: NDArray[np.int64]) -> Array:
        return own.told(low[which] + (high - low)[which] * _swing(frequency * time, settings.shape)[:, None])

    wrists = [own.lane(each.tendons, each.low) for each in cases]
    done = spooled(wrists, told, 3 * settings.samples * every // 2 + 1, h, every)
    cycle = np.arange(settings.samples // 2, 3 * settings.samples // 2 + 1)
    time, swing = h * every * np.arange(0.0, settings.samples + 1), _swing(cycle / settings.samples, settings.shape)
    return {
        case: HysteresisLoop(
            case, time, case.low + (case.high - case.low) * swing, Spooled(*(each[at, cycle] for each in done)),
            float(ends[at, 1] - ends[at, 0]),
        )
        for at, case in enumerate(cases)
    }  # fmt: skip


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
    at, ends = np.array([angle for _, angle in every]), np.radians(settings.ranges_deg[0])
    exact = own.exact([tendons for tendons, _ in every], at)
    begin, goal = np.repeat(ends, len(every)), np.tile(at, 2)

    def told(time: Array, which: NDArray[np.int64]) -> Array:
        s = np.minimum(time / settings.ramp, 1.0)[:, None]
        return own.told(begin[which] + (goal - begin)[which] * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

    wrists = [own.lane(tendons, float(end)) for end in ends for tendons, _ in every]
    steps = round((settings.ramp + _HOLD) / settings.step)
    done = spooled(wrists, told, steps + 1, settings.step, steps)
    path = own.wrist.tendon_offset * np.abs(done.theta[:, -1] - begin).reshape(2, -1).min(axis=0)
    slid = path > _FULLY * np.array([tendons.presliding for tendons, _ in every])
    below, above = done.theta[:, -1].reshape(2, -1).tolist()
    return [
        DeadBand(tendons, angle, float(exact[k, 0]), float(exact[k, 1]), below[k], above[k], bool(slid[k]))
        for k, (tendons, angle) in enumerate(every)
    ]
