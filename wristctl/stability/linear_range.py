"""From and up to which swing of the wrist a loop is as its linearisation says, where it begins to swing."""

import cmath
import math
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Surface
from wristctl.simulation.disturbances import DISTURBANCES
from wristctl.simulation.simulated_drives import motor_of
from wristctl.simulation.worlds import World
from wristctl.stability.linearise import LinearLoop
from wristctl.stability.sampled_loop import Complex, Mode
from wristctl.stability.smooth_loop import FrictionReading
from wristctl.wrist.tendon_layout import TendonLayout

# Share of a stepper's acceleration from which its profile's lag of v/(2 a) turns a swing by 0.15 rad and more.
_SHARE = 0.3


class LinearityLimit(NamedTuple):
    """Something that linearisation leaves out: it is felt `above` or below a swing of the wrist's angle [rad].

    The swing is nan where the loop has no way to swing, `read_as` how it was linearised.
    """

    what: str
    above: bool
    swing: float
    read_as: str


@dataclass(frozen=True)
class Swing:
    """A loop that swings with an amplitude of 1 rad, in one of its modes; None: it does not swing.

    Its gain is times a factor, by which what stands behind its motors is stronger (larger pulleys, say): what its
    controller sees, and its motors count, is as without the factor.
    """

    linear: LinearLoop
    mode: Mode | None
    factor: float

    def angle(self, error: complex, rate: complex) -> float:
        """The amplitude of a weighted sum of the bend and its rate, of the plane that swings more; nan: none does."""
        return self._size(error * self._output("theta") + rate * self._output("rate"))

    def tension(self) -> float:
        """Amplitude of the largest commanded difference between the tensions of two places [N]."""
        return self._size(_differences(self._output("tension"))) / (self.factor if self.linear.at_frames else 1.0)

    def motor(self, order: int = 0, alike: Array | float = 1.0) -> float:
        """Amplitude of the largest difference between two motors' counts, or of its derivative [1/s^order].

        Counts are over the numbers of tendons `alike` (T,) at each place.
        """
        if self.mode is None:
            return math.nan
        counts = self.mode.states[:, np.array(self.linear.names) == "motor"] / alike
        return self._size(_differences(counts)) / self.factor * abs(self.turning) ** order

    @property
    def turning(self) -> complex:
        """Growth and frequency as one number [1/s]."""
        return complex(self.mode.growth, 2.0 * math.pi * self.mode.frequency) if self.mode else cmath.nan

    def _output(self, name: str) -> Complex:
        """Amplitudes at each tick, (ticks, values)."""
        if self.mode is None:
            return np.zeros((0, 2), complex)
        pairs = zip(self.linear.closed.ticks, self.mode.states, strict=True)
        return np.array([np.atleast_1d(tick.outputs[name] @ state) for tick, state in pairs])

    def _size(self, values: Complex) -> float:
        """The largest amplitude per radian of the bend, whose path in two planes is an ellipse."""
        if self.mode is None:
            return math.nan
        bends = self._output("theta")
        longest = np.sqrt(0.5 * ((np.abs(bends) ** 2).sum(axis=1) + np.abs((bends**2).sum(axis=1))))
        return float(np.abs(values).max() / longest.max())


def _differences(values: Complex) -> Complex:
    """Differences between all pairs of values (ticks, T)."""
    first, second = np.triu_indices(values.shape[1], 1)
    return np.asarray(values[:, first] - values[:, second])


def linearity_limits(
    swing: Swing, loop: Loop, wrist: WristParameters, friction: FrictionReading, surface: Surface | None,
    gains: dict[str, float],
) -> list[LinearityLimit]:  # fmt: skip
    """List the effects that linearisation leaves out of a loop, with the swings from or up to which they are felt.

    Effects that are felt from a swing on come last.
    """
    world, level, limits = World(loop, wrist), loop.actuator.level, list[LinearityLimit]()
    plant = world.plant
    one_plane = swing.linear.planes == 1
    layout = TendonLayout.pair_of_sides(plant.tendon_offset) if one_plane else TendonLayout.of(plant)
    radii, alike = np.array([place.radius for place in layout.places]), layout.multiplicity.astype(float)
    if loop.sensor.level == "camera":
        noise = math.radians(world.sensor.noise_deg)
        limits.append(LinearityLimit("the camera's noise", False, noise, "none, and no frame lost"))
    if level != "ideal":
        motor = motor_of(loop.actuator)
        scale, count = (1.0, np.ones_like(alike)) if loop.actuator.winds else (motor.stiffness, alike)
        finest = _over(0.5 * scale * motor.step, swing.motor(0, count))
        speed = scale * loop.actuator.step_length * world.actuator.step_rate
        step = "a motor's resolution" if level == "servo" else "a motor's microstep"
        limits += [LinearityLimit(step, False, finest, "no steps: any length")] if motor.step else []
        limits += [
            LinearityLimit("a motor's speed", True, _over(speed, swing.motor(1, count)), "as fast as it has to be"),
        ]
    if loop.actuator.winds:
        play = loop.plant.actuator.backlash / radii[radii > 0.0].min()
        limits += [LinearityLimit("backlash", False, play, "none")] if play else []
    if level == "tendon":
        acceleration = _SHARE * loop.actuator.step_length * world.actuator.step_acceleration
        most = _over(acceleration, swing.motor(2))
        limits += [LinearityLimit("the stepper's acceleration", True, most, "where it is told to be after a period")]
    if loop.actuator.winds:
        limits += [*_friction(world, friction, radii), _slack(world, swing.linear, radii)]
    if loop.limits:
        left = wrist.tension_limit - max(swing.linear.tensions)
        most = _over(left, swing.tension())
        limits.append(LinearityLimit("saturation", True, most, f"none: tensions rest {left:.3g} N below their limit"))
    if surface is not None:
        error, rate, integral = surface.weights(gains)
        sigma = swing.angle(error + (integral / swing.turning if swing.mode else 0.0), rate)
        most = _over(surface.layer(gains), sigma)
        limits.append(LinearityLimit("the boundary layer's end", True, most, "the sliding term as inside the layer"))
    if loop.plant.end_stop_deg is not None:
        room = math.radians(loop.plant.end_stop_deg) - float(np.hypot.reduce(np.abs(np.atleast_1d(swing.linear.theta))))
        limits.append(LinearityLimit("the end stops", True, room, "none"))
    limits += [LinearityLimit(event, True, math.nan, "left out") for event in _passing(loop)]
    return sorted(limits, key=lambda limit: (limit.above, math.isnan(limit.swing), limit.swing))


def _passing(loop: Loop) -> list[str]:
    """Names of a loop's disturbances and faults that act only at times."""
    passing = [disturbance for name, disturbance in DISTURBANCES.items() if name != "load"]
    acting = [disturbance.meaning for disturbance in passing if disturbance.acts(loop.disturbances)]
    facts = {"broken_at": "a tendon that breaks", "slips_at": "a spool that slips", "torque": "a motor that stalls"}
    return [*acting, *(fault for name, fault in facts.items() if getattr(loop.plant.actuator, name) is not None)]


def _over(most: float, amplitude: float) -> float:
    """Up to which swing a signal stays below its most; inf where it does not swing along."""
    return math.inf if amplitude == 0.0 else most / amplitude


def _slack(world: World, linear: LinearLoop, radii: Array) -> LinearityLimit:
    """A place is let go by a turn that takes up its stretch, its spool standing still."""
    takes = world.actuator.tendon_stiffness * radii[radii > 0.0]
    swing = float((np.array(linear.tensions)[radii > 0.0] / takes).min())
    return LinearityLimit("a slack tendon", True, swing, "all of them taut")


def _friction(world: World, reading: FrictionReading, radii: Array) -> list[LinearityLimit]:
    """A bristle turns round within its presliding path, which the bend makes by the tendons' arm."""
    if world.actuator.friction == 0.0:
        return []
    swing = world.actuator.presliding / radii.max()
    if reading == "slipping":
        return [LinearityLimit("friction that sticks", False, swing, "slipping: Coulomb's, which has no slope")]
    return [LinearityLimit("friction that slips", True, swing, "stuck: the springs of its bristles")]
