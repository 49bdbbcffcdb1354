"""Loops of a wrist whose tendons have friction, and the dead band in which held spools leave it.

Each is driven with half of its integration steps too, and then with 2, 4, ... times as many, until it stays what it is.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.hysteresis import HysteresisSettings
from wristctl.simulation.convergence import ABSOLUTE, FINER, RELATIVE
from wristctl.simulation.spool_driven import Spooled, spooled
from wristctl.simulation.strokes import FrictionCase, Strokes

# Share of the longest moment arm from which on a tendon slides as the wrist bends.
_SLIDING = 0.1
# Time for which a wrist is held at the end of a ramp [s].
_HOLD = 1.5
# Path, over presliding, after which a bristle is bent fully: to exp(-5).
_FULLY = 5.0
# Share of the raw loop's area below which a work is compared with that share.
_LEAST_WORK = 0.01
# Width [rad] below which an angle is compared with that.
_LEAST_WIDTH = ABSOLUTE / RELATIVE


class LoopCase(NamedTuple):
    """A loop: its friction, cycles per second, and between which angles it would go without friction [rad]."""

    tendons: FrictionCase
    frequency: float
    low: float
    high: float


class Driven:
    """A wrist that was driven to where it began: energies of its course."""

    course: Spooled

    @property
    def friction_work(self) -> float:
        """Energy that friction took [J]."""
        return float(self.course.friction[-1] - self.course.friction[0])

    @property
    def raw_work(self) -> float:
        """Energy that the spools gave: area of the loop of pulls at the spools over the tendons' path [J]."""
        return float(self.course.raw[-1] - self.course.raw[0])

    @property
    def damped_work(self) -> float:
        """Energy that the wrist's damping took [J]."""
        return float(self.course.damped[-1] - self.course.damped[0])

    def changes_of_works(self, coarse: Driven) -> list[float]:
        """Relative change of each from a longer step to this one."""
        least = max(_LEAST_WORK * abs(self.raw_work), 1e-12)
        names = "friction_work", "raw_work", "damped_work"
        pairs = [(getattr(self, name), getattr(coarse, name)) for name in names]
        return [abs(fine - before) / max(abs(fine), least) for fine, before in pairs]


@dataclass(frozen=True)
class HysteresisLoop(Driven):
    """The last of one and a half cycles, from the range's high end back to it; its last sample is the first again."""

    case: LoopCase
    time: Array
    """(T,) [s]"""
    unhindered: Array
    """Angle of a wrist at rest without friction on these spools, (T,) [rad]."""
    course: Spooled
    """Courses of the wrist, (T,) each."""
    exact_width: float
    """Dead band in the middle of the range, by the statics [rad]."""
    step: float
    """Integration step [s]."""
    drift: float = 0.0
    """Largest relative change of width and works with the integration step, at the shortest tried; 0: converged."""
    toward: tuple[float, ...] = (1.0,)
    """Direction of the bends in the planes that it bends in."""

    @property
    def bend(self) -> Array:
        """Bend along the direction, (T,) [rad]."""
        bends = self.course.bends
        return bends[:, 0] if len(self.toward) == 1 else bends @ np.array(self.toward)

    @property
    def aside(self) -> float:
        """The furthest that it leaves the line of its bends [rad]; 0 in one plane."""
        if len(self.toward) == 1:
            return 0.0
        across = self.course.bends @ np.array([-self.toward[1], self.toward[0]])
        return float(np.abs(across).max())

    @property
    def width(self) -> float:
        """Bend on the way back less that on the way out, in the middle of the range [rad]."""
        quarter = (len(self.time) - 1) // 4
        return float(self.bend[quarter] - self.bend[3 * quarter])

    def change(self, coarse: HysteresisLoop) -> float:
        """Largest relative change of width and works from a longer step to this one."""
        of_width = abs(self.width - coarse.width) / max(abs(self.width), _LEAST_WIDTH)
        return largest_change([of_width, *self.changes_of_works(coarse)])


def largest_change(changes: Sequence[float]) -> float:
    """The largest of relative changes; what is no number has changed beyond all."""
    return max(change if math.isfinite(change) else math.inf for change in changes)


@dataclass(frozen=True)
class DeadBand:
    """Angles at which held spools leave a wrist that comes from below and from above [rad]."""

    tendons: FrictionCase
    unhindered: float
    """Angle at which they would leave it without friction."""
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
        return largest_change([abs(self.below - coarse.below) / least, abs(self.above - coarse.above) / least])


class _Drifting(Protocol):
    """What is driven with ever shorter integration steps."""

    @property
    def drift(self) -> float: ...

    def change(self, coarse: Any, /) -> float: ...


Found = TypeVar("Found", bound=_Drifting)


def converged(run: Callable[[NDArray[np.int64], int], list[Found]], count: int, steps: int) -> list[Found]:
    """Results of `run` for `count` wrists, each with as many integration steps as it takes.

    `run` drives some of them with so many steps in an interval of its own, `steps` or a multiple. The first number of
    steps whose result is within 1 % (or 0.002 deg) of that with half of them is taken.
    """
    left, coarse = np.arange(count), max(1, steps // 2)
    results, before = run(left, coarse), dict[int, Found]()
    for times in (1, *FINER):
        if times * steps == coarse:
            continue
        before |= zip(left.tolist(), (results[index] for index in left), strict=True)
        for index, fine in zip(left.tolist(), run(left, times * steps), strict=True):
            results[index] = fine
        left = np.array([index for index in left.tolist() if results[index].change(before[index]) > RELATIVE], np.int64)
        if not len(left):
            break
    for index in left.tolist():
        last: Any = results[index]
        results[index] = replace(last, drift=last.change(before[index]))
    return results


def friction_cases(settings: HysteresisSettings) -> list[FrictionCase]:
    """Every combination; without a coefficient there is one, since neither sheath nor presliding does anything."""
    every = itertools.product(settings.frictions, settings.sheaths, settings.preslidings)
    none = 0.0, settings.preslidings[0]
    cases = [
        FrictionCase(friction, *(sheath_and_presliding if friction > 0.0 else none))
        for friction, *sheath_and_presliding in every
    ]
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
    return [main_case(settings)._replace(presliding=presliding) for presliding in sorted(settings.preslidings)]


def loop_cases(settings: HysteresisSettings) -> list[LoopCase]:
    """Every loop, by range, friction and speed."""
    ranges = [(math.radians(low), math.radians(high)) for low, high in settings.ranges_deg]
    every = itertools.product(ranges, friction_cases(settings), settings.frequencies)
    return [LoopCase(tendons, frequency, *ends) for ends, tendons, frequency in every]


def loops(held: Strokes, progress: Callable[[float], None] = lambda share: None) -> list[HysteresisLoop]:
    """Every loop of the settings; `progress` is called with the share that is done."""
    settings, cases = held.settings, loop_cases(held.settings)
    share = {speed: 1.0 / speed / sum(1.0 / f for f in settings.frequencies) for speed in settings.frequencies}
    driven: dict[LoopCase, HysteresisLoop] = {}
    finished = 0.0
    for frequency in settings.frequencies:
        driven |= _driven(held, frequency, [case for case in cases if case.frequency == frequency])
        finished += share[frequency]
        progress(finished)
    return [driven[case] for case in cases]


def _driven(held: Strokes, frequency: float, cases: Sequence[LoopCase]) -> dict[LoopCase, HysteresisLoop]:
    """The loops of one speed."""
    settings = held.settings
    low, high = np.array([(case.low, case.high) for case in cases]).T
    ends = held.exact([case.tendons for case in cases], 0.5 * (low + high))
    wrists = [held.lane(case.tendons, case.low) for case in cases]
    cycle = np.arange(settings.samples // 2, 3 * settings.samples // 2 + 1)
    swing = _swing(cycle / settings.samples, settings.shape)

    def run(which: NDArray[np.int64], every: int) -> list[HysteresisLoop]:
        h = 1.0 / (frequency * settings.samples * every)
        first, rises = low[which], (high - low)[which]

        def told(time: Array, lanes: NDArray[np.int64]) -> Array:
            return held.told(first[lanes] + rises[lanes] * _swing(frequency * time, settings.shape)[:, None])

        courses = spooled([wrists[index] for index in which], told, 3 * settings.samples * every // 2 + 1, h, every)
        time = h * every * np.arange(0.0, settings.samples + 1)
        return [
            HysteresisLoop(
                cases[index], time, low[index] + (high - low)[index] * swing,
                Spooled(*(column[lane, cycle] for column in courses)),
                float(ends[index, 1] - ends[index, 0]), h, toward=tuple(held.toward.tolist()),
            )
            for lane, index in enumerate(which.tolist())
        ]  # fmt: skip

    every = math.ceil(1.0 / (frequency * settings.step * settings.samples) * (1.0 - 1e-9))
    return {loop.case: loop for loop in converged(run, len(cases), every)}


def _swing(phase: Array, shape: str) -> Array:
    """From 0 to 1 and back in each cycle."""
    if shape == "sine":
        return 0.5 - 0.5 * np.cos(2.0 * np.pi * phase)
    return 1.0 - np.abs(1.0 - 2.0 * (phase % 1.0))


def dead_bands(held: Strokes) -> list[DeadBand]:
    """At every angle of the settings, of every friction: where held spools leave a wrist, approached by ramps."""
    settings = held.settings
    every = [(case, math.radians(angle)) for case in friction_cases(settings) for angle in settings.angles_deg]
    if not every:
        return []
    angle, ends = np.array([angle for _, angle in every]), np.radians(settings.ranges_deg[0])
    exact = held.exact([tendons for tendons, _ in every], angle)
    lasts = settings.ramp + _HOLD

    def run(which: NDArray[np.int64], steps: int) -> list[DeadBand]:
        begin, goal = np.repeat(ends, len(which)), np.tile(angle[which], 2)

        def told(time: Array, lanes: NDArray[np.int64]) -> Array:
            s = np.minimum(time / settings.ramp, 1.0)[:, None]
            return held.told(begin[lanes] + (goal - begin)[lanes] * s**3 * (10.0 - 15.0 * s + 6.0 * s**2))

        wrists = [held.lane(every[index][0], float(end)) for end in ends for index in which]
        courses = spooled(wrists, told, steps + 1, lasts / steps, steps)
        bend = held.along(courses.bends[:, -1])
        path = _least_arm(held) * np.abs(bend - begin).reshape(2, -1).min(axis=0)
        slid = path > _FULLY * np.array([every[index][0].presliding for index in which])
        below, above = bend.reshape(2, -1).tolist()
        return [
            DeadBand(
                every[index][0], every[index][1], float(exact[index, 0]), float(exact[index, 1]),
                below[k], above[k], bool(slid[k]), lasts / steps,
            )
            for k, index in enumerate(which.tolist())
        ]  # fmt: skip

    return converged(run, len(every), max(2, round(lasts / settings.step)))


def _least_arm(held: Strokes) -> float:
    """The least moment arm [m] of the tendons that slide as the wrist bends along its line."""
    arms = np.abs(held.arms)
    return float(arms[arms > _SLIDING * arms.max()].min())
