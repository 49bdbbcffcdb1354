"""The emulated bench: motors, tendons and the wrist behind an emulated board, the camera before it, and faults."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from wristctl.config.injected import InjectedFault
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist
from wristctl.config.section import Section, choice, quantity
from wristctl.config.vision import SceneSettings


class Motors(Section):
    """What a stepper and its spool do beyond the steps they are sent; one entry for tendons 1, 2, 4, 5 each."""

    slack: tuple[float, float, float, float] = quantity(
        (3e-4, 2e-4, 4e-4, 2.5e-4), "m", "slack of each tendon at power-on, of the straight wrist", "assumed"
    )
    reversed: tuple[bool, bool, bool, bool] = choice(
        (False, False, False, False), "whether the motor is wired the other way round, so that it pays out"
    )
    order: tuple[int, int, int, int] = choice(
        (0, 1, 2, 3), "axis of the board to whose cable the motor of tendon 1, 2, 4 and 5 is connected"
    )
    step_scale: tuple[float, float, float, float] = quantity(
        (1.0, 1.0, 1.0, 1.0), "", "tendon per step, over what actuator says: a drive's own switches, or its pulley"
    )
    holding_torque: float = quantity(1.2, "N m", "beyond it an energised motor slips four full steps", "assumed", gt=0)
    top_speed: float | None = quantity(
        None, "1/s", "microsteps per second at which its torque has fallen to none; null: it does not fall", gt=0
    )
    detent_torque: float = quantity(0.03, "N m", "what a released motor still holds", "assumed: NEMA 23", ge=0)
    release_time: float = quantity(
        5e-3, "s", "time constant with which a released motor lets its tendon go", "assumed", gt=0
    )


class RenderedCamera(Section):
    """The camera before the bench."""

    frame_rate: float = quantity(60.0, "1/s", "frames per second", "assumed", gt=0, le=1000)
    delay_frames: float = quantity(
        2.0, "", "frames from the middle of an exposure to its arrival", "assumed", ge=0, le=20
    )
    exposure: float = quantity(4e-3, "s", "exposure; a motion in it smears the picture", "assumed", gt=0, le=0.1)
    dropped: float = quantity(0.05, "", "share of frames that never arrive", "assumed", ge=0, lt=1)
    scene: SceneSettings = SceneSettings()

    @model_validator(mode="after")
    def _one_exposure_at_a_time(self) -> Self:
        if self.exposure * self.frame_rate > 1.0:
            raise ValueError(f"an exposure of {self.exposure} s is longer than a frame at {self.frame_rate} per second")
        return self


class SerialLine(Section):
    """The wire between the host and the emulated board."""

    latency_timer: float = quantity(
        1e-3, "s", "the USB adapter hands over what the board says at this interval", "USB's frames", ge=1e-3, le=0.255
    )


class WeakenedPlant(TrueWrist):
    """The wrist as it is; a controller knows it with its stiffness when new."""

    stiffness_scale: float = quantity(0.7, "", "stiffness over the controller's", "paper: springs lose stiffness", gt=0)


class StepperActuator(Actuator, TendonFacts):
    """Elastic tendons on the stepper motors that the board turns."""

    level: Literal["tendon"] = choice("tendon", "the simulation's actuator with motors and elastic tendons")


class Person(Section):
    """Whoever is asked to do something at the emulated rig, as at a real one."""

    takes: float = quantity(10.0, "s", "from a question to its answer", "assumed", ge=0)
    force: float = quantity(
        0.0, "N", "with which a wrist that the motors hold is bent to one side and the other meanwhile"
    )


class BenchSettings(Section):
    """The emulated bench."""

    segments: int = choice(4, "constant-curvature segments of the wrist", "assumed", ge=1, le=8)
    plant: WeakenedPlant = WeakenedPlant()
    actuator: StepperActuator = StepperActuator()
    motors: Motors = Motors()
    camera: RenderedCamera = RenderedCamera()
    line: SerialLine = SerialLine()
    person: Person = Person()
    faults: tuple[InjectedFault, ...] = choice((), "what goes wrong")
