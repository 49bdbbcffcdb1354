"""The world that a rollout runs in, which may differ from what its controller knows."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import NamedTuple, TypeVar

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator, Sensor, TrueWrist, is_unsaid
from wristctl.config.section import Section
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.seeds import Entropy, stream
from wristctl.study_files.keys import unit_of
from wristctl.wrist.directions import in_plane

P = TypeVar("P", bound=TrueWrist)

# Angle by which a wrist may pass its range [deg].
LEEWAY_DEG = 5.0


class World(NamedTuple):
    """A loop, and the wrist as its controller knows it; what is true of wrist, actuator and sensor follows."""

    loop: Loop
    wrist: WristParameters

    @property
    def plant(self) -> WristParameters:
        """The wrist as it is."""
        return plant_of(self.wrist, self.loop.plant)

    @property
    def actuator(self) -> Actuator:
        """The actuator as it is."""
        actual: Actuator = self.loop.plant.actuator.of(self.loop.actuator)
        return actual

    @property
    def sensor(self) -> Sensor:
        """The sensor as it is."""
        actual: Sensor = self.loop.plant.sensor.of(self.loop.sensor)
        return actual


def bending_limit(wrist: WristParameters, end_stop_deg: float | None = None) -> float:
    """Bending angle [rad] beyond which a wrist has left its range or its end stops, and its loop has failed."""
    return math.radians(max(wrist.range_deg, end_stop_deg or 0.0) + LEEWAY_DEG)


def check_stops(worlds: Sequence[World], references: Array) -> None:
    """UserError where end stops lie inside the range of the references [rad]."""
    stops = [world.loop.plant.end_stop_deg for world in worlds if world.loop.plant.end_stop_deg is not None]
    if stops and min(stops) <= (most := math.degrees(np.abs(references).max())):
        problem = f"the end stop at {min(stops):g} deg lies inside the reference's range, {most:.4g} deg"
        raise UserError(problem, "loop.plant.end_stop_deg", "a larger one, or a smaller motion")


class Mismatch(NamedTuple):
    """A leaf of wrist, actuator or sensor that is not what the controller believes."""

    key: str
    believed: float | None
    """None: nothing of the kind."""
    actual: float
    unit: str


def mismatches(world: World) -> list[Mismatch]:
    """All that the world of a loop has, and its controller does not know of; spreads are not drawn."""
    loop, differences = world.loop, list[Mismatch]()
    sides: dict[str, tuple[Section, Section]] = {
        "": (world.wrist, world.plant),
        "actuator.": (loop.actuator, world.actuator),
        "sensor.": (loop.sensor, world.sensor),
    }
    for begin, (believed, actual) in sides.items():
        for name, field in type(believed).model_fields.items():
            values = getattr(believed, name), getattr(actual, name)
            if values[0] != values[1] and name != "gravity":  # which differs by a tilt, told below
                differences.append(Mismatch(begin + name, *values, unit_of(field)))
    facts = {"": loop.plant, "actuator.": loop.plant.actuator, "sensor.": loop.plant.sensor}
    for begin, section in facts.items():
        for name, field in type(section).model_fields.items():
            value = getattr(section, name)
            own_fact = is_unsaid(field) and name not in type(sides[begin][0]).model_fields
            if not own_fact or value == field.default or isinstance(value, Section):
                continue
            if isinstance(value, tuple):  # of each tendon
                named = {f"{begin}{name}.{number}": one for number, one in enumerate(value, 1)}
                differences += [Mismatch(key, None, one, unit_of(field)) for key, one in named.items()]
            else:
                differences.append(Mismatch(begin + name, field.default, value, unit_of(field)))
    return differences


def plant_of(wrist: WristParameters, plant: TrueWrist) -> WristParameters:
    """The wrist as it is: with the plant's own leaves, its scales of stiffness and damping, and its payload."""
    actual: WristParameters = plant.of(wrist)
    return actual.model_copy(
        update={
            "stiffness": actual.stiffness * plant.stiffness_scale,
            "damping": actual.damping * plant.damping_scale,
            "hand_mass": actual.hand_mass + plant.payload,
            "gravity": _leaning(actual.gravity, math.radians(plant.tilt_deg)),
        }
    )


def facing(wrist: WristParameters, plant: P, direction: str) -> tuple[WristParameters, P]:
    """A wrist as it is known, and the plant that it is, as this direction's bending plane sees them."""
    believed, own = in_plane(wrist, direction), plant.of(wrist)
    true = in_plane(own, direction)
    if believed is wrist and true is own:
        return wrist, plant
    actual = TrueWrist.between(believed, true)
    leaves = TrueWrist.model_fields.keys() & WristParameters.model_fields.keys()
    return believed, plant.model_copy(update={name: getattr(actual, name) for name in leaves})


def _leaning(gravity: tuple[float, float], tilt: float) -> tuple[float, float]:
    """Gravity in the axes of a base that leans by tilt [rad] toward theta > 0."""
    if tilt == 0.0:
        return gravity
    c, s = math.cos(tilt), math.sin(tilt)
    return c * gravity[0] + s * gravity[1], c * gravity[1] - s * gravity[0]


def drawn(plant: P, stream: Entropy) -> P:
    """The plant with its spreads drawn; the same stream draws every plant the same way, each by its own spreads."""
    if plant.stiffness_spread == plant.damping_spread == plant.payload_spread == 0.0:
        return plant
    stiffness, damping, payload = np.random.default_rng(stream).random(3).tolist()
    return plant.model_copy(
        update={
            "stiffness_scale": plant.stiffness_scale * (1.0 + plant.stiffness_spread * (2.0 * stiffness - 1.0)),
            "damping_scale": plant.damping_scale * (1.0 + plant.damping_spread * (2.0 * damping - 1.0)),
            "payload": plant.payload + plant.payload_spread * payload,
            "stiffness_spread": 0.0,
            "damping_spread": 0.0,
            "payload_spread": 0.0,
        }
    )


def loop_facing(wrist: WristParameters, loop: Loop, direction: str) -> tuple[WristParameters, Loop]:
    """A wrist as it is known, and the loop around the plant that it is, as this direction's bending plane sees them."""
    believed, plant = facing(wrist, loop.plant, direction)
    return believed, loop if plant is loop.plant else loop.model_copy(update={"plant": plant})


def loops_of(loop: Loop, streams: Sequence[Entropy]) -> list[Loop]:
    """The loop with its plant drawn by each of the streams."""
    plants = [drawn(loop.plant, entropy) for entropy in streams]
    return [loop if plant is loop.plant else loop.model_copy(update={"plant": plant}) for plant in plants]


@dataclass(frozen=True)
class Draws:
    """The streams under a root seed. What is tuned on and what is judged on have different `purpose`s: other noise."""

    seed: int
    purpose: str = "judged"

    def camera(self, scenario: str, repetition: int) -> Entropy:
        """Noise and dropped frames of a scenario, by the name of its reference and direction."""
        return *stream(self.seed, self._camera(scenario)), repetition

    def plant(self, repetition: int) -> Entropy:
        """The drawn plant."""
        return *stream(self.seed, self._plant()), repetition

    def names(self, loops: Iterable[Loop], scenarios: Iterable[str]) -> list[str]:
        """The named streams that such loops draw from: what a run notes of them."""
        chosen = list(loops)
        cameras = [self._camera(scenario) for scenario in scenarios] if any(map(sees_noise, chosen)) else []
        return [*dict.fromkeys(cameras), *([self._plant()] if any(map(has_drawn_plant, chosen)) else [])]

    def _camera(self, scenario: str) -> str:
        return f"{self.purpose} camera: {scenario}"

    def _plant(self) -> str:
        return f"{self.purpose} plant"


def sees_noise(loop: Loop) -> bool:
    """Whether a camera draws noise and lost frames."""
    return loop.sensor.level == "camera"


def has_drawn_plant(loop: Loop) -> bool:
    """Whether each repetition has a plant of its own."""
    return any((loop.plant.stiffness_spread, loop.plant.damping_spread, loop.plant.payload_spread))


def is_random(loop: Loop) -> bool:
    """Whether repetitions of this loop differ."""
    return sees_noise(loop) or has_drawn_plant(loop)
