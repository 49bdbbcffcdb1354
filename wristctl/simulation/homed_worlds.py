"""Worlds as a trial meets them: their controllers know what the rig's own check and its homing have measured.

A rig is checked before it is homed: strokes of one motor tell how old pictures are, and frames are dated by that.
Homing reels in one tendon after the other. The steps that a radian takes tell together how far tendons stretch, what
rubs in their sheaths, how stiff the springs with the hand's weight are, and the tendons' lever; spools wind by that.
"""

import math

from wristctl.config.hw_run import Homing
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.worlds import World
from wristctl.wrist.lone_tendons import length_per_radian, stiffness_by_length
from wristctl.wrist.tendon_layout import TendonLayout

# Share of `homing.pull` over which a tendon's line is measured.
_MEASURED = 0.7


def homed(wrist: WristParameters, loop: Loop, error: float = 0.0, late: float = 0.0) -> Loop:
    """The loop whose controller believes what check and homing measure on its plant; of ideal motors as it is.

    Steps per radian err by `error` standard deviations of what the camera's noise makes of them; pictures are dated
    `late` [s].
    """
    if not loop.actuator.winds:
        return loop
    world = World(loop, wrist)
    stiffness, frames = world.actuator.tendon_stiffness, world.sensor.delay_frames
    measured = _stiffness(wrist, world, error)
    as_it_is = {
        "actuator": loop.plant.actuator.model_copy(update={"tendon_stiffness": stiffness}),
        "sensor": loop.plant.sensor.model_copy(update={"delay_frames": frames, "dated_late": late}),
    }
    return loop.model_copy(
        update={
            "actuator": loop.actuator.model_copy(update={"tendon_stiffness": measured}),
            "sensor": loop.sensor.model_copy(update={"delay_frames": frames}),
            "plant": loop.plant.model_copy(update=as_it_is),
        }
    )


def _stiffness(wrist: WristParameters, world: World, error: float) -> float:
    """Stiffness of the believed wrist's tendons [N/m] that take the steps per radian which the world's take."""
    motors = world.actuator
    rigid, pull = length_per_radian(wrist)
    path, harder = length_per_radian(world.plant)
    length = path + harder * math.exp(motors.friction * motors.sheath) / motors.tendon_stiffness
    length *= 1.0 + error * _slope_error(wrist, world, length)
    return stiffness_by_length(world.loop.actuator.tendon_stiffness, pull, length - rigid)


def _slope_error(wrist: WristParameters, world: World, length: float) -> float:
    """Standard deviation of the mean steps per radian that homing takes, as a share of them.

    By least squares of readings, means of so many frames, at equal moves of a tendon of so much a radian [m/rad].
    """
    homing, sensor = Homing(), world.sensor
    if sensor.level != "camera":
        return 0.0
    reading = math.radians(sensor.noise_deg) / math.sqrt(homing.frames)
    span = _MEASURED * homing.pull
    count = span / homing.move + 1.0
    spread = span / length * math.sqrt(count * (count + 1.0) / (12.0 * (count - 1.0)))
    tendons = sum(place.radius > 0.0 for place in TendonLayout.of(wrist).places)
    return reading / spread / math.sqrt(tendons)
