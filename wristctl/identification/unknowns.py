"""Identifiable parameters and their coordinates: logarithms of what is positive, friction and delay as they are."""

import json
import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, Sensor
from wristctl.config.study import Study
from wristctl.config.wrist import TendonPlace, WristParameters
from wristctl.identification.measured_trials import MOST_DELAYED
from wristctl.simulation.planes import Asked, planes_of
from wristctl.study_files.strict_yaml import parse_yaml
from wristctl.wrist.directions import ACTIVE
from wristctl.wrist.spatial.spatial_segments import ellipse
from wristctl.wrist.tendon_layout import TendonPlace as Place
from wristctl.wrist.tendon_layout import off_both_sides


class Unknown(NamedTuple):
    """A parameter that identification may find.

    `low` and `high` bound the search: factors of the starting value where it is searched in its logarithm, values
    elsewhere. `tolerance` is the scale of its widest interval, relative or in its own unit; infinite where what is
    known beforehand is always enough.
    """

    name: str
    unit: str
    meaning: str
    log: bool
    low: float
    high: float
    tolerance: float

    def coordinate(self, value: float, start: float) -> float:
        """Coordinate of the search at a value, having begun at `start`."""
        return math.log(value / start) if self.log else value

    def value(self, coordinate: float, start: float) -> float:
        """The value at a coordinate."""
        return start * math.exp(coordinate) if self.log else coordinate

    def bounds(self) -> tuple[float, float]:
        """Least and largest coordinate."""
        return (math.log(self.low), math.log(self.high)) if self.log else (self.low, self.high)


# The table of parameters. All but tendon_radius and presliding begin without any knowledge beyond the bounds.
UNKNOWNS = {
    each.name: each
    for each in (
        Unknown("stiffness", "N m/rad", "bending stiffness of the whole wrist", True, 0.05, 20.0, 1.0),
        Unknown("flexion_ratio", "", "stiffness toward flexion over that toward ulnar", True, 0.2, 5.0, 1.0),
        Unknown("damping", "N m s/rad", "bending damping of the whole wrist", True, 0.02, 50.0, 1.0),
        Unknown("tendon_stiffness", "N/m", "stiffness of one tendon", True, 0.05, 20.0, 1.0),
        Unknown("friction", "", "capstan friction: coefficient times bend", False, 0.0, 2.0, 0.4),
        Unknown("sheath_friction", "", "sheaths' friction: coefficient times angle", False, 0.0, 4.0, 0.4),
        Unknown("presliding", "m", "path in which friction turns round", True, 0.1, 10.0, math.inf),
        Unknown("delay", "s", "how much older a picture is than its time stamp", False, -0.05, 0.2, 0.02),
        Unknown("tendon_radius", "m", "radius of the tendons' circle, the pulley's as known", True, 0.8, 1.25, 1.0),
    )
}

# Coefficient that stands for none, where sheaths have friction.
_LEAST_FRICTION = 1e-9


def tendons_of_values(values: Mapping[str, float]) -> dict[str, float]:
    """The leaves of an actuator that these parameters say: stiffness, friction and presliding, its sheaths' angle."""
    leaves = {name: values[name] for name in ("tendon_stiffness", "presliding") if name in values}
    if "friction" in values:
        leaves["friction"] = friction = max(values["friction"], _LEAST_FRICTION)
        if "sheath_friction" in values:
            leaves["sheath"] = values["sheath_friction"] / friction
    return leaves


def believed_of(wrist: WristParameters, actuator: Actuator) -> dict[str, float]:
    """The parameters as a controller believes them, of a camera whose pictures are as old as their time stamps."""
    wrist_values = {name: getattr(wrist, name) for name in ("stiffness", "flexion_ratio", "damping", "tendon_radius")}
    tendons = {name: float(getattr(actuator, name)) for name in ("tendon_stiffness", "friction", "presliding")}
    return wrist_values | tendons | {"sheath_friction": actuator.friction * actuator.sheath, "delay": 0.0}


# Parameters with a lower bound of zero, which they may reach.
NOT_NEGATIVE = ("friction", "sheath_friction")

# What wrists in one plane and in two have alike.
SHARED = ("stiffness", "damping", "tendon_stiffness", "friction", "sheath_friction", "presliding", "delay")
# Largest part of the springs' mean that an axis may have more or less, and error of a tendon's direction [rad].
_OBLIQUE, _ASIDE = 0.6, 0.6


def unknowns_of_places(places: Mapping[int, Place]) -> dict[str, Unknown]:
    """The table of parameters in two planes, with a direction and a gain of each tendon; `places` are as believed.

    The springs' stiffness is m (1 + [[p, q], [q, -p]]) over bends toward ulnar and flexion: its mean m, and two numbers
    that are well behaved where the springs are nearly alike all around and their axis is not to be told. They stand in
    a run's table as the stiffness along the ellipse's axis, that across, and the axis' direction.
    """
    found = {name: UNKNOWNS[name] for name in SHARED}
    found["stiffness"] = UNKNOWNS["stiffness"]._replace(meaning="bending stiffness, mean of all directions")
    for name, meaning in (("oblique_cos", "ulnar less flexion"), ("oblique_sin", "between the planes")):
        found[name] = Unknown(name, "", f"of the springs, {meaning}", False, -_OBLIQUE, _OBLIQUE, 0.4)
    for number, place in places.items():
        ends = place.angle - _ASIDE, place.angle + _ASIDE
        direction, gain = f"direction_{number}", f"gain_{number}"
        found[direction] = Unknown(direction, "rad", "of a tendon, from ulnar toward flexion", False, *ends, 0.2)
        found[gain] = Unknown(gain, "", "bend for a length reeled in, over that believed", True, 0.8, 1.25, 1.0)
    return found


def oblique_of(wrist: WristParameters) -> tuple[float, float, float]:
    """Mean stiffness [N m/rad] and the two numbers of the ellipse."""
    across = wrist.stiffness * wrist.flexion_ratio
    yy, yz, zz = ellipse(wrist.stiffness, across, math.radians(wrist.stiffness_axis_deg))
    mean = 0.5 * (yy + zz)
    return float(mean), float(0.5 * (yy - zz) / mean), float(yz / mean)


def springs_of(mean: float, p: float, q: float) -> dict[str, float]:
    """Stiffness, flexion_ratio and stiffness_axis_deg of a wrist; the axis is within 45 deg of ulnar."""
    side = 1.0 if p >= 0.0 else -1.0
    size = side * math.hypot(p, q)
    axis = 0.5 * math.degrees(math.atan2(side * q, side * p))
    return {
        "stiffness": mean * (1.0 + size),
        "flexion_ratio": (1.0 - size) / (1.0 + size),
        "stiffness_axis_deg": axis,
    }


_WRIST = ("stiffness", "flexion_ratio", "stiffness_axis_deg", "damping", "tendon_radius")


def identified_yaml(
    values: Mapping[str, float],
    camera: Mapping[str, float],
    places: Sequence[TendonPlace] = (),
    known: WristParameters | None = None,
) -> str:
    """A study file: the wrist, and the actuator and sensor of `simulate`, with these parameters.

    `places` are those of the tendons, where they are not those of `wrist.tendons`. With a
    `known` wrist the file has what of it was not to be found, too: geometry, masses and pose.
    """
    found = {name: values[name] for name in _WRIST if name in values}
    whole = known.model_dump(mode="json") if known else {}
    lines = ["wrist:", *(f"  {name}: {json.dumps(value)}" for name, value in (whole | found).items())]
    if places:
        lines.append("  tendons:")
        shown = (place.model_dump(exclude_defaults=True) for place in places)
        lines += [f"    - {{{', '.join(f'{key}: {value!r}' for key, value in place.items())}}}" for place in shown]
    lines += ["simulate:", "  loop:"]
    lines += [
        "    actuator:",
        "      level: tendon",
        *(f"      {name}: {value!r}" for name, value in tendons_of_values(values).items()),
    ]
    lines += ["    sensor:", "      level: camera", *(f"      {name}: {value!r}" for name, value in camera.items())]
    return "\n".join(lines) + "\n"


def with_identified(study: Study, command: str, text: str) -> Study:
    """The study with the values of an identified.yaml in its wrist and in every actuator and sensor of the command.

    Their levels stay as they are, and so does what its section names as kept. Places of the four of a square are for a
    loop in two planes: in one they stand on it.
    """
    mapping = parse_yaml(text, "identified.yaml").data
    loop = mapping["simulate"]["loop"]
    parts = {name: {k: v for k, v in loop[name].items() if k != "level"} for name in ("actuator", "sensor")}
    name = command.replace("-", "_")
    settings = getattr(study, name)
    changed: dict[str, Any] = {}

    def known(own: Any, place: str = "") -> dict[str, Any]:
        """Actuator and sensor of a loop, or of trials, whose keys begin with `place`."""
        told = {
            part: {key: value for key, value in values.items() if f"{place}{part}.{key}" not in settings.kept}
            for part, values in parts.items()
        }
        found = {part: getattr(own, part).model_copy(update=values) for part, values in told.items()}
        return found | {"sensor": _once_a_tick(found["sensor"], parts["sensor"], told["sensor"], own.control_period)}

    def loops_of(loops: Mapping[str, Loop], place: str) -> dict[str, Loop]:
        return {key: loop.model_copy(update=known(loop, f"{place}.{key}.")) for key, loop in loops.items()}

    for leaf in type(settings).model_fields:
        value = getattr(settings, leaf)
        if isinstance(value, Loop):
            changed[leaf] = value.model_copy(update=known(value, f"{leaf}."))
        elif leaf == "loops":
            changed[leaf] = loops_of(value, leaf)
        elif leaf == "tuning" and value is not None:  # a search that comes first, on loops of its own
            changed[leaf] = value.model_copy(update={"loops": loops_of(value.loops, f"{leaf}.loops")})
    if parts.keys() <= type(settings).model_fields.keys():
        changed |= known(settings)
    found = {key: value for key, value in mapping["wrist"].items() if f"wrist.{key}" not in settings.kept}
    places = tuple(TendonPlace.model_validate(place) for place in found.pop("tendons", ()))
    wrist = study.wrist.model_copy(update=found)
    chosen, with_places = study.simulate, wrist.model_copy(update={"tendons": places})
    in_two = (
        command == "simulate" and planes_of(study.wrist, [Asked(chosen.loop, chosen.reference, chosen.direction)]) == 2
    )
    if places and (in_two or len(places) != len(ACTIVE) or off_both_sides(study.wrist) is not None):
        wrist = with_places
    return study.model_copy(update={"wrist": wrist, name: settings.model_copy(update=changed)})


def _once_a_tick(sensor: Sensor, log: Mapping[str, Any], told: Mapping[str, Any], period: float) -> Sensor:
    """The sensor, at one reading a tick where the log has more, and with the log's delay at the rate that it has.

    `told` is what of the `log` nobody gave otherwise.
    """
    rate, changed = sensor.frame_rate, dict[str, Any]()
    if sensor.level == "camera" and "frame_rate" in told and rate * period > 1.0 - 1e-9:
        changed["frame_rate"] = rate = 1.0 / period
    if "delay_frames" in told and log.get("frame_rate", rate) != rate:
        changed["delay_frames"] = min(told["delay_frames"] * rate / log["frame_rate"], MOST_DELAYED)
    return sensor.model_copy(update=changed)
