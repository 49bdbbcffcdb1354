"""Phase portrait: courses of the nonlinear loop to its sliding surface from both sides of its resting angle."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop, sample_period
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller, Surface
from wristctl.simulation.batch import Start
from wristctl.simulation.closed_loop import repeat
from wristctl.simulation.motion import resting
from wristctl.simulation.worlds import Draws
from wristctl.wrist.plant import plant_in

# The name that the camera's noise goes by.
SCENARIO = "phase portrait"
_SHARES = (-1.0, -0.5, 0.5, 1.0)
_FURTHEST_DEG = 20.0


@dataclass(frozen=True)
class Approach:
    """One course (T,): error [rad], its rate [rad/s] and sigma over time [s].

    `reached` is when sigma has come into the boundary layer, never to leave it; nan where it never does.
    """

    time: Array
    error: Array
    rate: Array
    sigma: Array
    reached: float


@dataclass(frozen=True)
class PhasePortrait:
    """Courses of a loop over its sliding surface: slope de/dt = -slope e of the surface, `layer` the half width of its
    boundary layer in de/dt [rad/s]."""

    slope: float
    layer: float
    courses: Sequence[Approach]


def phase_portrait(
    law: Controller, gains: Mapping[str, float], loop: Loop, wrist: WristParameters, theta: float, horizon: float,
    draws: Draws, toward: Array | None = None,
) -> PhasePortrait | None:  # fmt: skip
    """Courses of the loop as it is (with limits, steps, noise) toward theta [rad], from rest to both sides of it.

    They begin within the wrist's range. None for a law that has no sliding surface. The integral of the error counts
    from the start. In two planes the wrist bends along a direction `toward` (2,), and error and rate are those along
    it: planes have surfaces alike.
    """
    if law.surface is None:
        return None
    toward = np.ones(1) if toward is None else toward
    planes, period = len(toward), sample_period(loop.control_period)
    segments = plant_in(planes, loop.plant.model).coordinates(loop.plant_segments) // planes
    followed = resting(theta * toward, round(horizon / period), period)
    courses = []
    for begin in _begins(theta, math.radians(wrist.range_deg)):
        (rollout,) = repeat(
            law, np.array([law.values(gains)]), [followed], np.zeros(1, np.int64), loop, wrist, [SCENARIO], draws,
            start=_from(np.tile(begin * toward / segments, segments)),
        )  # fmt: skip
        course = rollout.first.trajectory
        off, speed = (values.reshape(len(course.time), -1) @ toward for values in (course.error, course.rate))
        courses.append(_approach(law.surface, gains, course.time, off, speed))
    error, rate, _ = law.surface.weights(gains)
    return PhasePortrait(error / rate, law.surface.layer(gains) / abs(rate), courses)


def _begins(theta: float, most: float) -> list[float]:
    """Angles [rad] to both sides of theta within +-most; none on a side where theta leaves no room."""
    rooms = {sign: min(math.radians(_FURTHEST_DEG), most - sign * theta) for sign in (-1.0, 1.0)}
    return [theta + share * rooms[sign] for share in _SHARES if rooms[sign := math.copysign(1.0, share)] > 0.0]


def _from(begin: Array) -> Start:
    return lambda plant: begin


def _approach(surface: Surface, gains: Mapping[str, float], time: Array, error: Array, rate: Array) -> Approach:
    a, b, c = surface.weights(gains)
    integral = np.cumsum(error) * (time[1] - time[0])
    sigma = a * error + b * rate + c * integral
    outside = np.flatnonzero(~(np.abs(sigma) <= surface.layer(gains)))
    ends = len(outside) and outside[-1] + 1 == len(time)
    reached = math.nan if ends else float(time[outside[-1] + 1]) if len(outside) else 0.0
    return Approach(time, error, rate, sigma, reached)
