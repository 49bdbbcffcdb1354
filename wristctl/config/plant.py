"""Motors, tendons and camera between command and measurement, and how the simulated world differs from the model."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from functools import lru_cache
from typing import Annotated, Any, Literal, Self

from pydantic import AfterValidator, Field, SerializerFunctionWrapHandler, model_serializer, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from wristctl.config.choices import DISTURBANCES, PLANTS
from wristctl.config.section import OneOf, OpenSection, Parameter, Section, choice, quantity, seldom

_SCALE = re.compile(r"x ?([0-9]+\.?[0-9]*(?:e[+-]?[0-9]+)?)", re.IGNORECASE)


def _scale(text: str) -> str:
    match = _SCALE.fullmatch(text)
    if match is None or float(match[1]) <= 0.0:
        raise PydanticCustomError("scale", "Input should be a number, or a multiple of what is believed, as x1.05")
    return text


Scale = Annotated[str, AfterValidator(_scale)]
Positive = Annotated[float, Field(gt=0)] | Scale | None
# A leaf as it is: a value, a multiple of the believed one, or None where it is as believed.
NotNegative = Annotated[float, Field(ge=0)] | Scale | None


def truth(unit: str, meaning: str) -> Any:
    """A leaf as it is in the world; config.yaml leaves it out where it is as believed."""
    return seldom(None, unit, f"{meaning}, or x1.05 of what is believed")


def fact(default: Any, unit: str, meaning: str, **constraints: Any) -> Any:
    """A leaf of the world that no controller believes anything of; config.yaml leaves it out where it is not given."""
    return quantity(default, unit, meaning, "assumed", ("unsaid",), **constraints)


def unsaid(default: Overrides) -> Any:
    """A section of such leaves, left out of config.yaml where nothing in it is given."""
    return Field(default, json_schema_extra={"unsaid": True})


def actual(believed: Any, difference: Any) -> Any:
    """A leaf as it is, from what is believed of it and what was given."""
    if difference is None:
        return believed
    if isinstance(difference, str):
        return type(believed)(believed * float(difference.lower().removeprefix("x")))
    return difference


def is_unsaid(field: FieldInfo) -> bool:
    """Whether a field is left out of what is written where it has its default."""
    extra = field.json_schema_extra
    return isinstance(extra, dict) and bool(extra.get("unsaid"))


@lru_cache
def _shared(facts: type[Section], believed: type[Section]) -> tuple[str, ...]:
    """Names of the leaves of facts that override one that is believed."""
    return tuple(
        name for name, field in facts.model_fields.items() if is_unsaid(field) and name in believed.model_fields
    )


class Overrides(Section):
    """Leaves that override those of the same names in another section; what is as believed is not written out."""

    @classmethod
    def between(cls, believed: Any, actual: Any) -> Self:
        """Leaves in which the actual section differs from the believed one."""
        shared_fields = {n: f for n, f in cls.model_fields.items() if n in type(actual).model_fields}
        believed_values = {n: getattr(believed, n, f.default) for n, f in shared_fields.items()}
        return cls(**{n: getattr(actual, n) for n in shared_fields if getattr(actual, n) != believed_values[n]})

    def of(self, believed: Any) -> Any:
        """The other section with what is true of it."""
        kind: type[Section] = type(believed)
        differences = {name: value for name in _shared(type(self), kind) if (value := getattr(self, name)) is not None}
        changed = {name: actual(getattr(believed, name), difference) for name, difference in differences.items()}
        return believed.model_copy(update=changed) if changed else believed

    @model_serializer(mode="wrap")
    def _without_the_unsaid(self, handler: SerializerFunctionWrapHandler) -> dict[str, Any]:
        fields = {field.alias or name: field for name, field in type(self).model_fields.items()}
        unsaid = {key for key, field in fields.items() if is_unsaid(field)}
        written = handler(self)
        return {
            key: entry
            for key, entry in written.items()
            if key not in unsaid or entry not in (fields[key].default, {}, [])
        }


PlantName = Annotated[str, OneOf(PLANTS)]


class TendonFacts(Section):
    """Effects of tendons on spools that no controller models."""

    backlash: float = fact(0.0, "m", "dead band between motor and tendon; homing leaves it where it reels in", ge=0)
    creep: float = fact(0.0, "", "share of a tendon's stiffness that relaxes (one Maxwell branch)", ge=0, lt=1)
    creep_time: float = fact(10.0, "s", "time constant of that", gt=0)
    broken_at: float | None = fact(
        None, "s", "when one of the + side's two tendons breaks, in two planes one of a place's; null: never", ge=0
    )
    broken_tendon: int = fact(1, "", "at which place a tendon breaks, of a wrist in two planes", ge=1)
    slack: tuple[float, ...] = fact(
        (), "m", "slack that homing left in each place's tendons, in two planes", strict=False
    )
    slips_at: float | None = fact(
        None, "s", "when the + side's tendons slip on their spool, in two planes a place's; null: never", ge=0
    )
    slipping_tendon: int = fact(1, "", "at which place tendons slip, of a wrist in two planes", ge=1)
    slip: float = fact(1e-3, "m", "by how much", gt=0)


def check_speeds(corner: float, top: float | None) -> None:
    """ValueError where a motor's torque would be gone before it begins to fall."""
    if top is not None and corner >= top:
        raise ValueError(f"corner_speed ({corner:g} 1/s) must be below top_speed ({top:g} 1/s)")


class TrueActuator(Overrides, TendonFacts):
    """Motors and tendons as they are, where that is not what the controller believes."""

    lag: NotNegative = truth("s", "time constant of the motor's force (lagged), or behind its target (servo)")
    tendon_stiffness: Positive = truth("N/m", "stiffness of one tendon")
    friction: NotNegative = truth("", "coefficient of the tendons' friction; the observer counts on none")
    sheath: NotNegative = truth("rad", "angle by which each tendon is wrapped before it reaches the wrist (tendon)")
    presliding: Positive = truth("m", "path in which friction turns round (tendon)")
    pulley_radius: Positive = truth("m", "radius of the pulley: motors report steps, not metres")
    step_rate: Positive = truth("1/s", "largest rate of microsteps")
    step_acceleration: Positive = truth("1/s^2", "largest change of that rate by the host (tendon)")
    ramp: Positive = truth("1/s^2", "change of that rate by the board, within a tick (tendon)")
    command_delay: NotNegative = truth("s", "from a tick until the board has its rates, or motors follow their targets")
    update: Positive = truth("s", "between two changes of an axis' rate by the board (tendon)")
    torque: float | None = fact(
        None, "N m", "of a standing motor: pulled harder it falls back by four full steps; null: never (tendon)", gt=0
    )
    corner_speed: float = fact(0.0, "1/s", "microsteps per second up to which it has all of that torque", ge=0)
    top_speed: float | None = fact(
        None, "1/s", "those at which it has none, in a straight line from the corner; null: its torque does not fall",
        gt=0,
    )  # fmt: skip

    @model_validator(mode="after")
    def _falls_after_its_corner(self) -> Self:
        check_speeds(self.corner_speed, self.top_speed)
        return self


class TrueSensor(Overrides):
    """The camera as it is, where that is not what the controller believes."""

    delay_frames: NotNegative = truth("", "frames between capture and use; the observer dates them by what it believes")
    noise_deg: NotNegative = truth("deg", "standard deviation of the angle")
    dropped: NotNegative = truth("", "share of frames without a result")
    burst: float = fact(1.0, "", "frames that are lost in a row, on average; 1: each by itself", ge=1)
    zero_deg: float = fact(0.0, "deg", "angle that each camera shows of a straight wrist")
    dated_late: float = fact(0.0, "s", "by how much later than they are taken pictures are dated; negative: earlier")


class TrueWrist(Overrides):
    """The wrist as it is: leaves by value or as a multiple (`x1.05`); scales, payload and spreads come on top."""

    model: PlantName = choice("pcc", "what is simulated: segments of constant curvature, or hinges between rigid links")
    stiffness_scale: float = quantity(1.0, "", "stiffness over the controller's", "paper: springs lose stiffness", gt=0)
    damping_scale: float = quantity(1.0, "", "damping over the controller's", gt=0)
    payload: float = quantity(0.0, "kg", "mass added to the hand, which the controller does not know", ge=0)
    stiffness_spread: float = quantity(
        0.0, "", "each repetition's stiffness is drawn anew, evenly within this share above and below", ge=0, lt=1
    )
    damping_spread: float = quantity(0.0, "", "the same of the damping", ge=0, lt=1)
    payload_spread: float = quantity(0.0, "kg", "each repetition's payload is drawn anew, up to so much more", ge=0)
    length: Positive = truth("m", "arc length from the first to the last disc")
    mass: Positive = truth("kg", "moving mass of the wrist itself")
    hand_mass: NotNegative = truth("kg", "mass of the hand")
    hand_offset: NotNegative = truth("m", "hand's centre of mass beyond the last disc")
    stiffness: Positive = truth("N m/rad", "bending stiffness of the whole wrist")
    flexion_ratio: Positive = truth("", "stiffness toward flexion over that toward ulnar")
    stiffness_axis_deg: float | None = truth("deg", "direction of the bends that meet `stiffness`")
    taper: Positive = truth("", "stiffness at the base over that at the tip (hinges)")
    damping: NotNegative = truth("N m s/rad", "bending damping of the whole wrist")
    tendon_radius: Positive = truth("m", "radius of the circle of tendons")
    tilt_deg: float = fact(0.0, "deg", "by how much its base leans toward theta > 0, gravity being as believed")
    creep: float = fact(0.0, "", "share of the stiffness that relaxes (one Maxwell branch)", ge=0, lt=1)
    creep_time: float = fact(10.0, "s", "time constant of that", gt=0)
    inner_friction: float = fact(0.0, "N m", "torque of friction on the bend itself, inside the wrist", ge=0)
    inner_presliding_deg: float = fact(0.5, "deg", "bend in which that turns round", gt=0)
    end_stop_deg: float | None = fact(
        None, "deg", "bend at which the wrist meets its end stops, in two planes in any direction", gt=0, le=180
    )
    end_stop_stiffness: float = fact(20.0, "N m/rad", "of the whole wrist's end stops", gt=0)
    end_stop_dissipation: float = fact(1.0, "s/rad", "Hunt and Crossley's: share of that per rate of impact", ge=0)


class Plant(TrueWrist):
    """Differences of the simulated world from the controller's model: wrist, motors with tendons, camera."""

    actuator: TrueActuator = unsaid(TrueActuator())
    sensor: TrueSensor = unsaid(TrueSensor())


class Push(Section):
    """A person's push on the last disc: half a sine in time."""

    force: float = quantity(0.0, "N", "largest force, across the straight wrist; + is the direction of theta > 0")
    start: float = quantity(2.5, "s", "time at which it begins", "assumed", ge=0)
    duration: float = quantity(0.5, "s", "how long it lasts", "assumed", gt=0)


class Drift(Section):
    """Stiffness that changes linearly in time, then stays."""

    scale: float = quantity(1.0, "", "final stiffness over the first", "paper: springs lose stiffness", gt=0)
    start: float = quantity(0.0, "s", "time at which it begins", "assumed", ge=0)
    duration: float = quantity(5.0, "s", "how long it takes", "assumed", gt=0)


class Grasp(Section):
    """An object that the hand takes up while the forearm is level, so that its weight lies across the straight wrist.

    Its inertia is left out: at 5 rad/s^2 it is a twentieth of the weight.
    """

    mass: float = quantity(0.0, "kg", "mass of the object; + weighs toward theta > 0, - to the other side")
    start: float = quantity(1.0, "s", "time at which its weight begins to be felt", "assumed", ge=0)
    duration: float = quantity(0.2, "s", "time until all of it is", "assumed", gt=0)


class Disturbances(OpenSection):
    """Disturbances of the wrist, unknown to its controller."""

    push: Push = Push()
    load: float = quantity(0.0, "N", "constant force on the last disc, across the straight wrist")
    drift: Drift = Drift()
    grasp: Grasp = Grasp()
    toward_deg: float = seldom(
        0.0, "deg", "direction of push, load and grasp in two planes, from ulnar (0) toward flexion (90)"
    )

    def added(self) -> Mapping[str, Parameter]:
        """Parameters that disturbances from outside the package add."""
        added_names = (name for name in DISTURBANCES if name not in type(self).model_fields)
        return {name: parameter for kind in added_names for name, parameter in DISTURBANCES[kind].parameters.items()}


class Actuator(Section):
    """Motors and tendons. ideal: tension = command; lagged: first-order lag, in steps; tendon: stepper, elastic.

    servo: motors that follow targets by themselves, after `command_delay`, with `lag`, at `step_rate` at most.
    """

    level: Literal["ideal", "lagged", "tendon", "servo"] = choice(
        "ideal", "how much of motors and tendons is simulated"
    )
    lag: float = quantity(
        5e-3, "s", "time constant of the motor's force (lagged), or behind its target (servo)", "assumed", ge=0
    )
    resolution: float = seldom(0.0, "m", "smallest change of a target (servo); 0: finer than matters", ge=0)
    tendon_stiffness: float = quantity(20e3, "N/m", "stiffness of one tendon", "assumed; sweep 2-50 kN/m", gt=0)
    friction: float = quantity(0.1, "", "coefficient of the tendons' friction (tendon)", "assumed", ge=0)
    sheath: float = quantity(
        0.0, "rad", "angle by which each tendon is wrapped before it reaches the wrist (tendon)", "assumed; 0-3", ge=0
    )
    presliding: float = quantity(
        2e-5, "m", "path in which friction turns round: Dahl's bristle (tendon)", "assumed; 5-100 um", gt=0
    )
    motor_steps: int = choice(200, "full steps per revolution", "assumed", gt=0)
    microstep: int = choice(16, "microsteps per full step", "assumed", gt=0)
    pulley_radius: float = quantity(7.5e-3, "m", "radius of the pulley", "assumed", gt=0)
    step_rate: float = quantity(20_000.0, "1/s", "largest rate of microsteps", "assumed", gt=0)
    step_acceleration: float = quantity(
        50_000.0, "1/s^2", "largest change of that rate by the host (tendon)",
        "a NEMA 23 at 34 N follows 390,000, with a drum of 0.44 kg 92,000", gt=0,
    )  # fmt: skip
    ramp: float = quantity(
        200_000.0, "1/s^2", "change of that rate by the board, within a tick (tendon)",
        "the board's most; a NEMA 23 at 34 N follows 810,000, with a drum of 0.44 kg 95,000", gt=0,
    )  # fmt: skip
    command_delay: float = quantity(
        1.98e-3, "s", "from a tick until the board has read its rates (tendon), or motors follow their targets (servo)",
        "half a frame of USB, 26 bytes at 250 kBd, 0.44 ms of the firmware", ge=0, le=0.1,
    )  # fmt: skip
    update: float = quantity(
        3e-3, "s", "between two changes of an axis' rate by the board (tendon)",
        "firmware: 2 ms, up to 4 where it looks after one axis a millisecond", gt=0, le=0.1,
    )  # fmt: skip

    @property
    def winds(self) -> bool:
        """Whether motors wind elastic tendons onto spools."""
        return self.level in ("tendon", "servo")

    @property
    def step_length(self) -> float:
        """Tendon moved by one microstep [m]."""
        return 2.0 * math.pi * self.pulley_radius / (self.motor_steps * self.microstep)


class Sensor(Section):
    """ideal: angle and rate as they are; camera: late, noisy, dropped frames, and an observer for every controller."""

    level: Literal["ideal", "camera"] = choice("ideal", "how the angle is measured")
    frame_rate: float = quantity(60.0, "1/s", "frames per second", "assumed", gt=0)
    delay_frames: float = quantity(2.0, "", "frames between capture and use", "assumed", ge=0, le=20)
    noise_deg: float = quantity(0.1, "deg", "standard deviation of the angle", "rendered markers: 0.025", ge=0)
    dropped: float = quantity(0.05, "", "share of frames without a result", "assumed", ge=0, lt=1)
    torque_noise: float = quantity(5e-4, "N m s^0.5", "observer: white torque that its model does not know", gt=0)
    load_drift: float = quantity(0.03, "N m/s^0.5", "observer: random walk of the load that it estimates", gt=0)
