"""The emulated bench: motors, tendons and the wrist behind an emulated board, the camera before it, and faults."""

from typing import Literal, Self

from pydantic import model_validator

from wristctl.config.camera import SceneSettings
from wristctl.config.plant import Actuator, TendonFacts, TrueWrist, check_speeds
from wristctl.config.section import Section, choice, quantity

# Every kind of fault that can be injected: controller-exception, model-nan and disk-full are the control loop's, the
# others the bench's; from usb-latency on they are in virtual time only.
FAULTS = {
    "port-lost": "the cable is pulled: the port is gone for good",
    "board-reset": "the board restarts once: drives off, positions lost",
    "frames-dropped": "no frame arrives",
    "marker-covered": "something covers the marker on the last disc",
    "markers-swapped": "the two markers change places",
    "camera-frozen": "frames keep coming, with new times, but show what the last one before showed",
    "host-silent": "nothing that the host sends reaches the board",
    "controller-exception": "the controller raises an exception",
    "model-nan": "the model gives NaN",
    "disk-full": "nothing can be written to the run",
    "direction-flipped": "the motor turns the other way",
    "direction-stuck": "the motor reels in whatever it is told",
    "motor-stalled": "the rotor stands; its drive goes on counting",
    "drive-off": "the drive has no power; its tendon is let go",
    "supply-off": "no drive has power",
    "drive-rescaled": "the drive makes `size` times the way with each step: another microstep, or steps that are lost",
    "motors-exchanged": "the cables of the motor and of motor `size` are exchanged",
    "torque-lost": "no motor holds more than `size` N: the supply sags, or a drive is too hot",
    "tendon-detached": "the tendon is off its pulley",
    "tendon-slipped": "the tendon slips on its pulley, once, paying out `size` mm",
    "tendon-creeps": "the tendon slips on, paying out `size` mm/s; negative: its motor makes steps that nobody counts",
    "marker-turned": "the tip's marker has slipped on its disc by `size` deg",
    "marker-peels": "the tip's marker turns on its disc by `size` deg/s",
    "camera-repeats": "the camera shows its last `size` pictures again and again",
    "camera-frozen-clock": "as camera-frozen, but for one pixel that changes",
    "frames-thinned": "one frame of `size` arrives",
    "pictures-late": "pictures are `size` s older than their times say",
    "stamps-shifted": "frames are dated `size` s later than they are",
    "stamps-stuck": "the time of the frames stands",
    "camera-lost": "the camera is gone for good",
    "picture-dark": "there is `size` of the light",
    "picture-bright": "there is `size` times the light, and a haze",
    "picture-blurred": "the picture is blurred by `size` px",
    "picture-smeared": "the picture is smeared over `size` px",
    "picture-mirrored": "the picture is mirrored",
    "picture-turned": "the camera is turned by `size` deg about its axis",
    "picture-shifted": "the camera is turned aside by `size` px",
    "picture-other": "the camera sees something else",
    "marker-twice": "another marker of id `size` comes into view",
    "cell-unplugged": "the amplifier of the tendon's load cell is unplugged",
    "usb-latency": "answers are handed over every `size` ms only",
    "answers-late": "each answer comes `size` ms late",
    "answers-held": "answers are held back once, for `size` ms",
    "host-pause": "the whole host stands still once, for `size` ms",
    "bytes-garbled": "each byte loses a bit with probability `size`",
    "estop-pressed": "somebody presses the emergency stop button",
    "payload-taken": "the hand takes up `size` kg",
}

FaultKind = Literal[
    "port-lost", "board-reset", "frames-dropped", "marker-covered", "markers-swapped", "camera-frozen", "host-silent",
    "controller-exception", "model-nan", "disk-full", "direction-flipped", "direction-stuck", "motor-stalled",
    "drive-off", "supply-off", "drive-rescaled", "motors-exchanged", "torque-lost", "tendon-detached",
    "tendon-slipped", "tendon-creeps", "marker-turned", "marker-peels", "camera-repeats",
    "camera-frozen-clock", "frames-thinned", "pictures-late", "stamps-shifted", "stamps-stuck", "camera-lost",
    "picture-dark", "picture-bright", "picture-blurred", "picture-smeared", "picture-mirrored", "picture-turned",
    "picture-shifted", "picture-other", "marker-twice", "cell-unplugged", "usb-latency", "answers-late", "answers-held",
    "host-pause", "bytes-garbled", "estop-pressed", "payload-taken",
]  # fmt: skip


class InjectedFault(Section):
    """Something that goes wrong."""

    kind: FaultKind = choice("port-lost", "; ".join(f"{kind}: {meaning}" for kind, meaning in FAULTS.items()))
    at: float = quantity(1.0, "s", "when", ge=0)
    since: Literal["trial", "first trial", "power-on"] = choice(
        "trial", "what `at` counts from: the start of each trial's motion, of the first one's, or the board's power-on"
    )
    duration: float | None = quantity(None, "s", "how long it lasts; null: for good", gt=0)
    axis: int = choice(0, "whose motor or tendon", ge=0, lt=4)
    camera: Literal[1, 2] = choice(1, "of two planes, whose pictures: 1 the ulnar-radial plane's, 2 the other's")
    size: float = quantity(1.0, "", "how much, in the unit that the kind says")


class Motors(Section):
    """Behaviour of steppers and spools beyond the commanded steps, with one entry per tendon 1, 2, 4, 5."""

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
    holding_torque: float = quantity(
        0.32, "N m", "beyond it an energised motor slips four full steps", "1.26 N m at 2.8 A, set to 1.0 A", gt=0
    )
    corner_speed: float = quantity(0.0, "1/s", "microsteps per second up to which it has all of that torque", ge=0)
    top_speed: float | None = quantity(
        None, "1/s", "those at which it has none, in a straight line from the corner; null: its torque does not fall",
        "at 1.0 A and 24 V a corner of 35000 and a top of 38000, beyond actuator.step_rate", gt=0,
    )  # fmt: skip
    rotor_inertia: float = quantity(
        3e-5, "kg m^2", "of the rotor; 0: no inertia, an energised motor stands exactly where its drive counts",
        "23HS22-2804S: 300 g cm^2", ge=0,
    )  # fmt: skip
    spool_inertia: float = quantity(
        7e-7, "kg m^2", "of the pulley on its shaft, where the rotor has inertia",
        "assumed: aluminium, 15 mm across and 20 mm long, two flanges of 25 mm by 2 mm", ge=0,
    )  # fmt: skip
    damping: float = quantity(
        2e-3, "N m s/rad", "viscous, of an energised rotor that has inertia",
        "assumed: each swing three quarters of the one before", ge=0,
    )  # fmt: skip
    detent_torque: float = quantity(0.03, "N m", "what a released motor still holds", "assumed: NEMA 23", ge=0)
    release_time: float = quantity(
        5e-3, "s", "time constant with which a released motor lets its tendon go", "assumed", gt=0
    )

    @model_validator(mode="after")
    def _falls_after_its_corner(self) -> Self:
        check_speeds(self.corner_speed, self.top_speed)
        return self


class RenderedCamera(Section):
    """The camera before the bench."""

    frame_rate: float = quantity(60.0, "1/s", "frames per second", "assumed", gt=0, le=1000)
    delay_frames: float = quantity(
        2.0, "", "frames from the middle of an exposure to its arrival", "assumed", ge=0, le=20
    )
    jitter: float = quantity(
        0.0, "s", "longest further delay of a frame's arrival, drawn evenly for each; at most a frame", ge=0
    )
    phase: float = quantity(0.0, "", "share of a frame by which its exposures follow the board's clock", ge=0, lt=1)
    exposure: float = quantity(4e-3, "s", "exposure; a motion in it smears the picture", "assumed", gt=0, le=0.1)
    dropped: float = quantity(0.05, "", "share of frames that never arrive", "assumed", ge=0, lt=1)
    scene: SceneSettings = SceneSettings()

    @model_validator(mode="after")
    def _one_exposure_at_a_time(self) -> Self:
        if self.exposure * self.frame_rate > 1.0:
            raise ValueError(f"an exposure of {self.exposure} s is longer than a frame at {self.frame_rate} per second")
        if self.jitter * self.frame_rate > 1.0:
            raise ValueError(f"a jitter of {self.jitter} s is longer than a frame at {self.frame_rate} per second")
        return self


class SerialLine(Section):
    """The wire between the host and the emulated board."""

    adapter: Literal["16u2", "ftdi", "ch340"] = choice(
        "16u2",
        "USB adapter, which hands over what the board says; 16u2, a genuine Mega's: every 4.096 ms; ftdi: every "
        "latency_timer; ch340: in each of USB's frames of 1 ms",
    )
    latency_timer: float = quantity(16e-3, "s", "of an ftdi adapter", "FTDI's default", ge=1e-3, le=0.255)


class EmulatedCells(Section):
    """Load cells between motors and tendons, each behind an HX711; one entry per tendon 1, 2, 4, 5.

    A count is 256 of the amplifier's 24 bits.
    """

    rate: Literal[10, 80] = choice(80, "conversions per second; a reading is the mean of the last four", "data sheet")
    clock_error: tuple[float, float, float, float] = quantity(
        (0.01, -0.02, 0.015, 0.0), "", "by which share each amplifier converts faster", "assumed"
    )
    counts_per_newton: tuple[float, float, float, float] = quantity(
        (84.0, 87.5, 86.1, 83.2), "1/N", "of each cell", "2 mV/V at 196 N: 85.5, and its tolerance"
    )
    offset: tuple[float, float, float, float] = quantity(
        (60.0, -85.0, 25.0, 110.0), "", "counts without a pull", "assumed: 1 N and less"
    )
    noise: float = quantity(0.5, "", "standard deviation of a reading, in counts", "thrice the data sheet's", ge=0)


class WeakenedPlant(TrueWrist):
    """The wrist as it is; a controller knows it with its stiffness when new."""

    stiffness_scale: float = quantity(0.7, "", "stiffness over the controller's", "paper: springs lose stiffness", gt=0)


class StepperActuator(Actuator, TendonFacts):
    """Elastic tendons on the stepper motors that the board turns."""

    level: Literal["tendon"] = choice("tendon", "the simulation's actuator with motors and elastic tendons")


class Person(Section):
    """Person who is asked to act at the emulated rig, as at a real rig."""

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
    camera_2: RenderedCamera = choice(
        RenderedCamera(phase=0.4), "of two planes, the camera before the flexion-extension plane"
    )
    line: SerialLine = SerialLine()
    person: Person = Person()
    load_cells: EmulatedCells | None = choice(None, "load cells of the tendons; null: none are wired")
    faults: tuple[InjectedFault, ...] = choice((), "what goes wrong")

    @property
    def stiffness_with_field(self) -> float:
        """Stiffness of a tendon [N/m] on a lightly loaded rotor that has inertia, and so hangs on its field."""
        tendon, motors = self.actuator.tendon_stiffness, self.motors
        if motors.rotor_inertia == 0.0:
            return tendon
        teeth = self.actuator.motor_steps / 4.0
        return 1.0 / (1.0 / tendon + self.actuator.pulley_radius**2 / (teeth * motors.holding_torque))
