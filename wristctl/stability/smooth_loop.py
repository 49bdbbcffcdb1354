"""A loop without what has no derivative, so that its compiled code can be differentiated at rest."""

import math
from fractions import Fraction
from typing import Literal

from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, Disturbances, Sensor

FrictionReading = Literal["slipping", "stuck"]

# Microsteps of a microstep: a length has no step that a difference quotient could see.
_FINER = 10**12
# A stepper's profile bends with its distance over a h^2; without end to its acceleration it is a line of slope 1/h.
_FASTER = 1e4
# Control periods after which frames fall on ticks as they did before, at most (or four frames, where that is more).
_LONGEST_CYCLE = 40


def smooth(loop: Loop, friction: FrictionReading) -> Loop:
    """The loop as it is to small signals about rest: no steps, limits, noise, play or passing disturbances.

    Motors are as fast as they have to be once a rate takes effect; a load that stays, creep, and what the world is that
    the controller does not believe, remain. `slipping` tendons have no friction (Coulomb's has no slope while it
    slides); `stuck` ones turn their bristles. A frame rate that never repeats on the grid of ticks becomes the nearest
    one that does.
    """
    actuator = _steady(loop.actuator)
    facts = {"step_rate": None, "step_acceleration": None, "ramp": None, "backlash": 0.0}
    events = {"broken_at": None, "slips_at": None, "torque": None}
    if friction == "slipping":
        actuator, facts = actuator.model_copy(update={"friction": 0.0}), facts | {"friction": None}
    sensor = loop.plant.sensor.model_copy(update={"noise_deg": None, "dropped": None, "burst": 1.0})
    world = {
        "actuator": loop.plant.actuator.model_copy(update=facts | events),
        "sensor": sensor,
        "end_stop_deg": None,
        "inner_friction": 0.0 if friction == "slipping" else loop.plant.inner_friction,
        "stiffness_spread": 0.0,
        "damping_spread": 0.0,
        "payload_spread": 0.0,
    }
    changes = {
        "actuator": actuator,
        "sensor": _clean(loop.sensor, loop.control_period),
        "plant": loop.plant.model_copy(update=world),
        "disturbances": Disturbances(load=loop.disturbances.load, toward_deg=loop.disturbances.toward_deg),
        "limits": False,
    }
    return loop.model_copy(update=changes)


def cycle_of(loop: Loop) -> tuple[int, int]:
    """Control periods after which the loop repeats, and frames within: (1, 0) where sensors are ideal."""
    if loop.sensor.level == "ideal":
        return 1, 0
    frames = _frames_per_tick(loop.sensor, loop.control_period)
    twice = 1 + (frames.numerator % 2 == 0)  # a frame midway between two ticks goes to the even one
    return twice * frames.denominator, twice * frames.numerator


def _steady(actuator: Actuator) -> Actuator:
    changes = {
        "microstep": actuator.microstep * _FINER,
        "resolution": 0.0,
        "step_rate": actuator.step_rate * _FINER * _FASTER,
        "step_acceleration": actuator.step_acceleration * _FINER * _FASTER,
        "ramp": actuator.ramp * _FINER * _FASTER,
    }
    return actuator.model_copy(update=changes)


def _frames_per_tick(sensor: Sensor, period: float) -> Fraction:
    frames = sensor.frame_rate * period
    return Fraction(frames).limit_denominator(max(_LONGEST_CYCLE, math.ceil(4.0 / frames)))


def _clean(sensor: Sensor, period: float) -> Sensor:
    rate = float(_frames_per_tick(sensor, period)) / period
    same = math.isclose(rate, sensor.frame_rate, rel_tol=1e-12)
    return sensor.model_copy(
        update={"noise_deg": 0.0, "dropped": 0.0, "frame_rate": sensor.frame_rate if same else rate}
    )
