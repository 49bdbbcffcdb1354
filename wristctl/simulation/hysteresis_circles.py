"""Circles of a wrist whose tendons have friction: bent about its straight pose, by tendons that would hold it there.

The bend lags behind on its way around, and its circle is smaller than without friction. Each is driven with ever more
integration steps until it stays what it is, as loops in one direction are.
"""

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
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.simulation.convergence import ABSOLUTE, RELATIVE
from wristctl.simulation.hysteresis import Driven, converged, friction_cases, largest_change
from wristctl.simulation.spatial_references import circumduction
from wristctl.simulation.spool_driven import Spooled, SpooledWrist, spooled
from wristctl.simulation.strokes import FrictionCase, held_in_space

# Turns until the wrist goes around its circle at an even speed, and friction is that of its way around.
_RUN_UP = 0.75
# Step along the circle at which the statics are solved [rad]; chords between them are 1e-9 m off.
_FINE = math.radians(0.1)
# Lag [rad] below which a change is compared with that.
_LEAST_LAG = ABSOLUTE / RELATIVE


class CircleCase(NamedTuple):
    """A circle: its friction, turns per second, and the bend that it would have without friction [rad]."""

    tendons: FrictionCase
    frequency: float
    radius: float


@dataclass(frozen=True)
class HysteresisCircle(Driven):
    """One turn from ulnar through flexion; its last sample is where it begins."""

    case: CircleCase
    time: Array
    """(T,) [s]"""
    unhindered: Array
    """Bends without friction on these spools, (T, 2) [rad]."""
    course: Spooled
    """Courses of the wrist, (T,) each."""
    step: float
    """Integration step [s]."""
    drift: float = 0.0
    """Largest relative change of lag, size and works with the integration step, at the shortest tried; 0: converged."""

    @property
    def lag(self) -> float:
        """Mean distance along the circle by which the bend comes behind that without friction [rad]."""
        along = np.stack([-self.unhindered[:-1, 1], self.unhindered[:-1, 0]], axis=1) / self.case.radius
        return float(np.mean(np.einsum("tp,tp->t", (self.unhindered - self.course.bends)[:-1], along)))

    @property
    def narrower(self) -> float:
        """Mean bend less than that without friction [rad]."""
        return self.case.radius - float(np.mean(np.hypot(*self.course.bends[:-1].T)))

    def change(self, coarse: HysteresisCircle, /) -> float:
        """Largest relative change of lag, radius and works from a longer step to this one."""
        pairs = [(self.lag, coarse.lag), (self.narrower, coarse.narrower)]
        moved = [abs(fine - before) / max(abs(fine), _LEAST_LAG) for fine, before in pairs]
        return largest_change([*moved, *self.changes_of_works(coarse)])


def circle_cases(settings: HysteresisSettings) -> list[CircleCase]:
    """Every circle, by radius, friction and speed."""
    every = itertools.product(settings.circles_deg, friction_cases(settings), settings.frequencies)
    return [CircleCase(tendons, frequency, math.radians(radius)) for radius, tendons, frequency in every]


class _Held(NamedTuple):
    """Tendons along a circle, by turns (G,) since the start from the straight wrist."""

    turns: Array
    told: Array
    """What drives each place (G, places): spools [m], or pulls of winches [N]."""
    straight: Array
    """Coordinates of the wrist at the start (q,) [rad]."""


def _held(wrist: WristParameters, settings: HysteresisSettings, radius: float) -> _Held:
    most = 1.0 + _RUN_UP
    turns = np.linspace(0.0, most, 1 + math.ceil(most * 2.0 * math.pi * radius / _FINE))
    theta, reeled, pulls = held_in_space(wrist, settings, circumduction(turns, radius, 1.0)[:, 0].T)
    return _Held(turns, pulls if settings.drive == "tensions" else reeled, theta[0])


def check_circles(wrist: WristParameters, settings: HysteresisSettings) -> None:
    """UserError where the wrist cannot be held on a circle."""
    for radius in settings.circles_deg:
        if radius > wrist.range_deg:
            problem = f"a circle of {radius:g} deg is beyond the wrist's range, {wrist.range_deg:g} deg"
            raise UserError(problem, "hysteresis.circles_deg", "a smaller circle")
        _held(wrist, settings, math.radians(radius))


def circles(
    wrist: WristParameters, settings: HysteresisSettings, progress: Callable[[float], None] = lambda share: None
) -> list[HysteresisCircle]:
    """Every circle of the settings; `progress` is called with the share that is done."""
    cases, driven = circle_cases(settings), dict[CircleCase, HysteresisCircle]()
    for radius in dict.fromkeys(case.radius for case in cases):
        held = _held(wrist, settings, radius)
        for frequency in settings.frequencies:
            alike = [case for case in cases if (case.radius, case.frequency) == (radius, frequency)]
            driven |= {circle.case: circle for circle in _driven(wrist, settings, held, alike)}
            progress(len(driven) / len(cases))
    return [driven[case] for case in cases]


def _driven(
    wrist: WristParameters, settings: HysteresisSettings, held: _Held, cases: Sequence[CircleCase]
) -> list[HysteresisCircle]:
    """Circles of one size and speed."""
    frequency, radius, samples = cases[0].frequency, cases[0].radius, settings.samples
    winch, begun = settings.drive == "tensions", round(_RUN_UP * samples)
    wrists = [SpooledWrist(wrist, settings.actuator(*case.tendons), held.straight, winch, planes=2) for case in cases]
    kept = np.arange(begun, begun + samples + 1)
    unhindered = circumduction(kept / samples, radius, 1.0)[:, 0].T

    def run(which: NDArray[np.int64], every: int) -> list[HysteresisCircle]:
        h = 1.0 / (frequency * samples * every)

        def told(time: Array, lanes: NDArray[np.int64]) -> Array:
            places = np.stack([np.interp(frequency * time, held.turns, place) for place in held.told.T], axis=1)
            return np.repeat(places[:, :, None], len(lanes), axis=2)

        courses = spooled([wrists[index] for index in which], told, kept[-1] * every + 1, h, every)
        time = h * every * np.arange(0.0, samples + 1)
        return [
            HysteresisCircle(cases[index], time, unhindered, Spooled(*(column[lane, kept] for column in courses)), h)
            for lane, index in enumerate(which.tolist())
        ]

    return converged(run, len(cases), math.ceil(1.0 / (frequency * settings.step * samples) * (1.0 - 1e-9)))
