"""A rig's facts as the settings of trials: planes, motors, sensor, tendons and limits that a study does not give."""

import inspect
import math
from collections.abc import Mapping
from typing import Any

import numpy as np
from pydantic import ValidationError

from wristctl.config.hw_run import HwRunSettings
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.errors import UserError, meant
from wristctl.rig import Facts, Rig, Spread, Tendon, value
from wristctl.wrist.tendon_layout import TendonLayout

# Microsteps of a motor's turn, by which a rig's resolution is a length on a pulley.
_MICROSTEPS = 3200
# Resolutions that a homing move is worth at least.
_FINE = 4.0
# Relative difference below which two levers are alike.
_ALIKE = 1e-3
# How far a tendon may be from where a rig's facts have it, over its radius: some 17 deg; and what is no distance [m].
_NEAR, _NOWHERE = 0.3, 1e-6
_METHODS = ("connect", "send", "look", "stop", "close")


def rig_of(entry: Any, where: str) -> Rig:
    """The rig that a file.py:NAME names: an object, or a class that is made without arguments. UserError otherwise."""
    if inspect.isclass(entry):
        from wristctl.plugins.places import contained

        with contained(f"making {entry.__name__}()", where):
            entry = entry()
    lacking = [name for name in _METHODS if not callable(getattr(entry, name, None))]
    clock = getattr(entry, "clock", None)
    lacking += [f"clock.{name}" for name in ("now", "wait_until") if not callable(getattr(clock, name, None))]
    if lacking:
        raise UserError(f"the rig has no {', '.join(lacking)}", where, "wristctl new rig NAME writes one that has all")
    check_facts(getattr(entry, "facts", None), where)
    rig: Rig = entry
    return rig


def check_facts(facts: Any, where: str) -> Facts:
    """The facts of a rig. UserError, with the name of the fact, where they cannot be."""
    if not isinstance(facts, Facts):
        raise UserError("the rig has no facts", where, "facts = Facts(...) of wristctl.rig, in the class")
    if facts.planes not in (1, 2):
        raise UserError(f"facts.planes is {facts.planes!r}", where, "1, or 2")
    numbers: dict[str, Any] = {
        **{f"limits.{name}": getattr(facts.limits, name) for name in ("travel", "rate", "tension")},
        **{f"drive.{name}": getattr(facts.drive, name) for name in facts.drive.__dataclass_fields__},
        **{f"sensor.{name}": getattr(facts.sensor, name) for name in facts.sensor.__dataclass_fields__},
        "metres_per_unit": facts.metres_per_unit,
    }
    if facts.silence is not None:
        numbers["silence"] = facts.silence
    positive = ("limits.", "metres_per_unit", "sensor.rate", "silence", "drive.stiffness")
    for name, number in numbers.items():
        parts = tuple(number) if isinstance(number, Spread) else (number,)
        if not all(isinstance(part, int | float) and math.isfinite(part) for part in parts):
            raise UserError(f"facts.{name} is {number!r}, no number", where, "a number, or a Spread(value, low, high)")
        if min(parts) < 0.0 or (name.startswith(positive) and min(parts) == 0.0):
            raise UserError(
                f"facts.{name} is {number!r}", where, "above 0" if name.startswith(positive) else "0 or more"
            )
        if isinstance(number, Spread) and not number.low <= number.value <= number.high:
            raise UserError(f"facts.{name} is {number!r}", where, "Spread(value, low, high) with low <= value <= high")
    layout_of_facts(facts, where)
    return facts


def layout_of_facts(facts: Facts, where: str) -> TendonLayout:
    """Places of a rig's tendons. UserError where they cannot bend the wrist in the rig's planes."""
    if not all(isinstance(tendon, Tendon) and tendon.radius > 0.0 for tendon in facts.tendons):
        raise UserError("facts.tendons are places off the axis", where, "Tendon(angle_deg, radius) for each target")
    for number, tendon in enumerate(facts.tendons, 1):
        if not (math.isfinite(tendon.angle_deg) and math.isfinite(tendon.radius)):
            raise UserError(f"facts.tendons: number {number} is {tendon}", where, "finite angle_deg and radius")
    try:
        layout = TendonLayout.of(WristParameters(tendons=_places(facts)))
    except UserError as error:
        raise UserError(str(error.what), f"{where}: facts.tendons", error.fix) from error
    if facts.planes == 2 and layout.planes == 1:
        fix = "facts.planes = 1, or tendons all around"
        raise UserError("facts.tendons bend the wrist in one plane, and facts.planes is 2", where, fix)
    if facts.planes == 1:
        levers = layout.cross_section[:, 0]
        plus, minus = levers[levers > 0.0], levers[levers < 0.0]
        if len(plus) != len(minus) or np.ptp(np.abs(levers)) > _ALIKE * np.abs(levers).max():
            fix = "facts.planes = 2 with a sensor of both bends"
            raise UserError("in one plane as many tendons pull to either side, with one lever", where, fix)
    return layout


def _places(facts: Facts) -> tuple[TendonPlace, ...]:
    return tuple(TendonPlace(angle_deg=float(one.angle_deg), radius=float(one.radius)) for one in facts.tendons)


def wrist_of(facts: Facts, wrist: WristParameters, where: str) -> WristParameters:
    """The wrist with the tendons of a rig, and what its facts know of it where the study gives nothing else.

    A study may place each tendon near where the facts have it, as identification finds it. UserError where it has other
    tendons.
    """
    for key in facts.wrist:
        if key not in WristParameters.model_fields or key == "tendons":
            raise UserError(f"facts.wrist has {key!r}", where, meant(key, WristParameters.model_fields))
    given = {name: getattr(wrist, name) for name in wrist.model_fields_set}
    own: dict[str, Any] = {"tension_limit": facts.limits.tension, **facts.wrist}
    places = _places(facts)
    if "tendons" in given:
        there, here = TendonLayout.of(wrist), TendonLayout.of(WristParameters(tendons=places))
        wound = [place for place in there.cross_section if place.any()]
        alike = len(wound) == len(here.places)
        off = np.hypot(*(np.array(wound) - here.cross_section).T) if alike else np.full(len(here.places), np.inf)
        if (off > _NEAR * np.array([place.radius for place in here.places])).any():
            fix = "leave the key out: the rig's facts say where its tendons are"
            raise UserError("the study's tendons are not those of the rig", "wrist.tendons", fix)
        if (off > _NOWHERE).any():
            places = tuple(TendonPlace(angle_deg=math.degrees(place.angle), radius=place.radius)
                           for place in there.places if place.radius > 0.0)  # fmt: skip
    try:
        return WristParameters.model_validate({**own, **given, "tendons": places})
    except ValidationError as error:
        problem = error.errors()[0]
        key = ".".join(map(str, problem["loc"]))
        raise UserError(
            f"facts.wrist: {problem['msg']}", f"{where}: {key}", "see wristctl hw-run --dry-run --all"
        ) from None


def settings_of(facts: Facts, settings: HwRunSettings, where: str) -> HwRunSettings:
    """Settings of trials with a rig's facts where the study gives nothing else. UserError where they do not fit."""
    given = settings.model_fields_set
    changes: dict[str, Any] = {"planes": facts.planes}
    if "planes" in given and settings.planes != facts.planes:
        raise UserError(f"the rig has {facts.planes} planes", "hw-run.planes", "leave the key out")
    changes["actuator"] = _actuator(facts, settings.actuator if "actuator" in given else Actuator())
    if "sensor" not in given:
        changes["sensor"] = _sensor(facts, settings.control_period)
    if "push" not in given:
        changes["push"] = settings.push.model_copy(update={"force": 0.0})
    if "directions" not in given and facts.planes == 1:
        changes["directions"] = ("ulnar", "radial")
    changes["homing"] = settings.homing.model_copy(update=_missing(settings.homing, _homing(facts, settings)))
    changes["safety"] = settings.safety.model_copy(update=_missing(settings.safety, _safety(facts, settings)))
    try:
        return HwRunSettings.model_validate({name: getattr(settings, name) for name in given} | changes)
    except ValidationError as error:
        problem = error.errors()[0]
        raise UserError(f"the rig's facts do not fit: {problem['msg']}", where, "see hw-run's settings") from None


def _missing(section: Any, values: Mapping[str, Any]) -> dict[str, Any]:
    return {name: each for name, each in values.items() if name not in section.model_fields_set}


def _actuator(facts: Facts, given: Actuator) -> Actuator:
    """Motors that follow targets as the facts say, where the study gives nothing else.

    Where motors are is counted in steps of the resolution, or of a usual microstep if that is longer.
    """
    drive = facts.drive
    step = max(value(drive.resolution), Actuator().step_length)
    own = {
        "lag": value(drive.lag),
        "resolution": value(drive.resolution),
        "tendon_stiffness": value(drive.stiffness),
        "pulley_radius": step * _MICROSTEPS / (2.0 * math.pi),
        "step_rate": facts.limits.rate / step,
        "command_delay": min(0.1, value(drive.delay)),
    }
    return given.model_copy(update={"level": "servo", **_missing(given, own)})


def _sensor(facts: Facts, period: float) -> Sensor:
    """No more than a look a tick counts."""
    rate = min(value(facts.sensor.rate), 1.0 / period)
    frames = min(20.0, value(facts.sensor.delay) * rate)
    noise = value(facts.sensor.noise_deg)
    return Sensor(level="camera", frame_rate=rate, delay_frames=frames, noise_deg=noise, dropped=0.0)


def _homing(facts: Facts, settings: HwRunSettings) -> dict[str, Any]:
    move = max(settings.homing.move, _FINE * value(facts.drive.resolution))
    return {"move": move, "pull": max(settings.homing.pull, 10.0 * move)}


def _safety(facts: Facts, settings: HwRunSettings) -> dict[str, Any]:
    stiffness, usual = facts.drive.stiffness, settings.safety
    softest = stiffness.low if isinstance(stiffness, Spread) else min(usual.softest, value(stiffness))
    return {
        "motor_pull": facts.limits.tension,
        "travel": min(usual.travel, facts.limits.travel),
        "softest": softest,
    }  # fmt: skip


def share_of_pair(layout: TendonLayout | None, planes: int) -> float:
    """Tension of a rig's tendons that one of the model's has, which in one plane has two on either side."""
    return 1.0 if layout is None or planes == 2 else 0.25 * len(layout.places)


def as_modelled(wrist: WristParameters, layout: TendonLayout | None, planes: int) -> WristParameters:
    """The wrist as models of a rig with these tendons have it; None: of a board with its four.

    In one plane the model's tendons have the lever of this layout's.
    """
    if layout is None or planes == 2:
        return wrist
    lever = float(np.abs(layout.cross_section[:, 0]).max())
    return wrist.model_copy(update={"tendons": "four", "tendon_radius": math.sqrt(2.0) * lever})
