"""Trials on hardware, real or emulated: what the controller drives and sees, and when it must stop."""

from collections.abc import Iterator, Mapping
from typing import Annotated, Any, Literal, Self, get_args

from pydantic import ValidationInfo, field_validator, model_validator

from wristctl.config.bench import BenchSettings
from wristctl.config.camera import Device, Gates, Markers
from wristctl.config.choices import PLANTS_IN_SPACE, RIGS
from wristctl.config.controller_row import BY_LOOP, GAINS, GainsChoice, Row
from wristctl.config.loop import TICK, DirectionName, Loop, Reference, comes_live
from wristctl.config.plant import Actuator, Plant, Push, Sensor, TrueActuator, TrueSensor, TrueWrist
from wristctl.config.section import OneOf, Section, choice, kept_settings, quantity, seldom
from wristctl.config.wrist import WristParameters
from wristctl.errors import Unfitting

# Directions of bending; those between the planes are of a rig in two.
Between = Literal["ulnar-flexion", "radial-flexion", "radial-extension", "ulnar-extension"]
RigDirection = DirectionName | Between

# Least and greatest ramp that the board takes [steps/s^2].
RAMPS = 1000.0, 200_000.0

# Lifetime of a step rate on the board: least time [s], and number of ticks.
_LEAST_LIFE, _LIFE_PERIODS = 0.05, 2.5

# What of an actuator host and board do by themselves, whatever hangs on them.
_OF_THE_BOARD = ("step_rate", "step_acceleration", "ramp", "command_delay", "update")


class Homing(Section):
    """Homing: every motor reels in by small moves until its tendon bends the wrist, then lets go again."""

    slack: float = quantity(2e-3, "m", "longest slack of a tendon that is looked for", "assumed", gt=0, le=0.02)
    move: float = quantity(60e-6, "m", "tendon reeled in by one move", "assumed", gt=0)
    pull: float = quantity(0.6e-3, "m", "tendon reeled in beyond the first bend, to measure by", "assumed", gt=0)
    bend_deg: float = quantity(0.5, "deg", "bend that counts as one, above the marker's noise", "assumed", gt=0)
    rest: float = quantity(0.15, "s", "pause after a move before the marker is read", "assumed", ge=0)
    frames: int = choice(5, "frames whose mean is one reading", ge=1)
    let_go: float = quantity(3.0, "s", "longest wait for the wrist to straighten again", "assumed", gt=0)
    steps_tolerance: float = quantity(
        0.15, "", "steps per radian may differ from the model's by this share", "measured", gt=0
    )
    taut: float = quantity(0.15e-3, "m", "by how much a tendon may be taut when homing begins", "assumed", ge=0)
    rest_deg: float = quantity(
        7.0, "deg", "how far from where its weight lets it a slack wrist may rest", "emulated", gt=0, lt=30
    )
    oblique_deg: float = quantity(
        12.0, "deg", "how far off square the markers may show an uncalibrated camera", "emulated: +-10", gt=0, lt=45
    )
    direction_deg: float = quantity(
        20.0, "deg", "in two planes: how far from its place a tendon may bend the wrist", "assumed", gt=0, lt=45
    )
    sticks: float = quantity(0.3e-3, "m", "path between reeling in and letting go: friction", "assumed", gt=0)
    stretch: Literal["believed", "measured"] = choice(
        "believed", "of the tendons, by which trials wind: as believed, or by the steps per radian that homing takes"
    )


class Safety(Section):
    """Limits whose violation stops the motors, and how they stop."""

    angle_deg: float = quantity(55.0, "deg", "largest bending angle, as estimated", "range and a tenth", gt=0)
    rate: float = quantity(10.0, "rad/s", "largest bending rate, as estimated", "assumed", gt=0)
    motor_pull: float = quantity(
        42.0, "N", "largest pull of a motor at its drive's current, beyond which it slips", "1.0 A", gt=0
    )
    tension: float = quantity(
        60.0, "N", "largest tension by spool position and estimated angle; wrist.tension_limit if less",
        "assumed", gt=0,
    )  # fmt: skip
    travel: float = quantity(0.020, "m", "furthest a spool may reel in or pay out from zero", "assumed", gt=0)
    follow_deg: float = quantity(
        3.5, "deg", "furthest that the marker may be from where the spools should have the wrist", "measured", gt=0
    )
    jump_deg: float = quantity(
        2.0, "deg", "furthest that it may come off that within 40 ms, or from a frame to the next", "measured", gt=0
    )
    excess_pull: float = quantity(
        10.0, "N", "furthest that a tendon's load cell may show more than its spool explains", "measured", gt=0
    )
    missing_pull: float = quantity(
        2.0, "N", "pull that a spool makes of the softest tendon, and of which its load cell must show a quarter",
        "assumed", gt=0,
    )  # fmt: skip
    cell_age: float = quantity(
        0.2, "s", "longest time without a reading of a load cell; the board says up to 0.25", "assumed", gt=0, le=0.25
    )
    softest: float = quantity(
        5e3, "N/m", "stiffness that tendons have at least: how far spools may lead", "assumed", gt=0
    )
    stiffest: float = quantity(
        50e3,
        "N/m",
        "stiffness that tendons have at most: how much a spool explains of a measured pull",
        "assumed",
        gt=0,
    )
    load: float = quantity(1.6, "N m", "largest load torque that the observer may find", "measured", gt=0)
    across_deg: float = quantity(
        1.0, "deg", "largest bend across the plane, by the size of the tip's marker", "measured", gt=0
    )
    odd_for: float = quantity(
        0.06, "s", "how long follow_deg, load or across_deg may be exceeded; half as long if twice", "assumed", ge=0
    )
    stale: float = quantity(0.15, "s", "longest time since the capture of a usable marker angle", "assumed", gt=0)
    late: float = quantity(0.05, "s", "longest delay of one tick; with its period below the watchdog", "assumed", gt=0)
    skipped: float = quantity(
        0.2, "", "largest share of half a second's ticks that are skipped", "assumed", gt=0, lt=0.5
    )
    round_trip: float = quantity(
        2.0, "", "largest median of half a second's command round trips, over control_period", "assumed", gt=0, le=3
    )
    watchdog: float = quantity(0.1, "s", "silence after which the board stops by itself", "assumed", ge=0.01, le=2.0)
    hold: bool = choice(False, "after a fault the drives hold the tendons, instead of letting them go")

    @model_validator(mode="after")
    def _the_host_notices_first(self) -> Self:
        if self.late >= self.watchdog:
            problem = f"late ({self.late:g} s) must be below watchdog ({self.watchdog:g} s)"
            raise Unfitting(problem, f"safety.late below {self.watchdog:g}, or a longer safety.watchdog")
        return self


class LoadCells(Section):
    """Load cells of the tendons behind HX711 amplifiers, as `wristctl hw weigh` finds them.

    One entry per tendon 1, 2, 4, 5. A count is 256 of an amplifier's 24 bits.
    """

    rate: Literal[10, 80] = choice(80, "conversions per second, by the amplifiers' RATE pin", "data sheet")
    counts_per_newton: tuple[float, float, float, float] = quantity(
        (85.5, 85.5, 85.5, 85.5), "1/N", "of each cell; negative: mounted the other way round", "2 mV/V at 196 N"
    )
    offset: tuple[float, float, float, float] = quantity(
        (0.0, 0.0, 0.0, 0.0), "", "counts of each cell without a pull", "wristctl hw weigh"
    )

    @model_validator(mode="after")
    def _each_shows_something(self) -> Self:
        if 0.0 in self.counts_per_newton:
            raise ValueError("counts_per_newton of 0: such a cell shows nothing")
        return self


class RigSettings(Section):
    """Motors, camera and how they are known. Without a port the whole rig is emulated."""

    port: str | None = choice(None, "serial port of the motor board; without one the whole rig is emulated")
    baud: int = choice(250_000, "of the serial line", gt=0)
    planes: Literal[1, 2] = choice(
        1, "bending planes: 1, the wrist is turned for the other one; 2, one camera for each, at a right angle"
    )
    camera: str = choice("0", "camera beside a real board: its number, or device path")
    camera_2: str = choice("2", "second camera, of two planes: it looks at the flexion-extension plane")
    real_time: bool = choice(False, "emulated rig: against the wall clock, in a process of its own")
    priority: bool = choice(False, "real-time scheduling and locked memory for the loop, as far as the system allows")
    actuator: Actuator = choice(Actuator(level="tendon"), "motors and tendons as the controller knows them")
    sensor: Sensor = choice(Sensor(level="camera"), "camera as the observer knows it")
    homing: Homing = Homing()
    safety: Safety = Safety()
    load_cells: LoadCells | None = choice(None, "load cells of the tendons; null: pulls are not measured")
    markers: Markers = Markers()
    markers_2: Markers = choice(Markers(base=2, tip=3), "markers of the second camera, of two planes")
    gates: Gates = Gates()
    device: Device = Device()
    bench: BenchSettings = choice(BenchSettings(), "the emulated rig, where there is no port")
    optics: str | None = choice(None, "calibrate-camera run; without one the camera looks square at the plane")
    optics_2: str | None = choice(None, "calibrate-camera run of the second camera, of two planes")

    def within(self, wrist: WristParameters) -> Self:
        """Settings whose largest tension is no more than the wrist bears."""
        tension = min(self.safety.tension, wrist.tension_limit)
        return self.model_copy(update={"safety": self.safety.model_copy(update={"tension": tension})})

    @field_validator("camera", "camera_2", mode="before")
    @classmethod
    def _number_of_a_camera(cls, given: Any) -> Any:
        """The number of a camera as text, where a study has it as a number."""
        return str(given) if type(given) is int else given

    @field_validator("actuator", "sensor", mode="before")
    @classmethod
    def _level_of_a_rig(cls, given: Any, field: ValidationInfo) -> Any:
        """A rig's level, where a study gives other keys of the section alone."""
        level = "tendon" if field.field_name == "actuator" else "camera"
        return {"level": level, **given} if isinstance(given, Mapping) else given

    @model_validator(mode="after")
    def _fits_together(self) -> Self:
        for problem, fix in self._misfits():
            raise Unfitting(problem, fix)
        return self

    def _misfits(self) -> Iterator[tuple[str, str]]:
        """What does not fit together, and what would."""
        plant, emulated = self.bench.plant.model, self.port is None and getattr(self, "rig", None) is None
        if self.planes == 2 and emulated and plant not in PLANTS_IN_SPACE:
            yield f"plant {plant} bends in one plane", f"bench.plant.model: {', '.join(PLANTS_IN_SPACE)}"
        numbers = [self.markers.base, self.markers.tip, self.markers_2.base, self.markers_2.tip]
        if self.planes == 2 and len(set(numbers)) < len(numbers):
            yield f"four markers need different ids, they are {numbers}", "other ids in markers_2"
        motors, (least, most) = self.actuator, RAMPS
        if not least <= motors.ramp <= most:
            yield f"no board ramps at {motors.ramp:g} steps/s^2", f"actuator.ramp of {least:g} to {most:g}"
        if motors.ramp < motors.step_acceleration:
            problem = (
                f"the board's ramp ({motors.ramp:g} steps/s^2) is slower than the host changes step rates "
                f"(actuator.step_acceleration, {motors.step_acceleration:g} steps/s^2)"
            )
            yield problem, f"actuator.ramp of at least {motors.step_acceleration:g}, or four times as much"
        if not self.actuator.winds or self.sensor.level != "camera":
            yield "a rig has actuator.level: tendon and sensor.level: camera", ""


class CalibrateWristSettings(RigSettings):
    """Zero, senses of turning and steps per radian of a rig."""

    plane: Literal["ulnar", "flexion"] = choice("ulnar", "bending plane that the camera looks at")
    axis: int | None = choice(None, "try this axis alone, 0 to 3, and calibrate nothing", ge=0, le=3)
    max_deg: float = quantity(2.0, "deg", "largest bend while one axis is tried", "assumed", gt=0.5, le=10)


class RigRow(Row):
    """One controller with one set of gains, on a rig."""

    gains: GainsChoice = choice(BY_LOOP, GAINS)


class HwRunSettings(RigSettings):
    """The paper's experiment: directions x repetitions, with and without a push, for each controller."""

    rig: Annotated[str, OneOf(RIGS)] | None = seldom(
        None, "", "a robot of your own, my_rig.py:RIG, in place of board and camera"
    )
    rows: tuple[RigRow, ...] = choice(
        (RigRow(controller="smc-tracking"),),
        "controllers with their gains",
        min_length=1,
        alias="controllers",
    )
    directions: tuple[RigDirection, ...] = choice(
        ("ulnar", "radial", "flexion", "extension"),
        "directions of bending, in two planes also between them; a path in two planes has its own",
        "paper",
        min_length=1,
    )
    repetitions: int = choice(1, "of each direction", ge=1, le=1000)
    push: Push = choice(Push(force=2.0), "a person's push against the bend; force 0: none", "assumed")
    push_toward_deg: float | None = seldom(
        None,
        "deg",
        "in two planes: where it pushes to, from ulnar (0) toward flexion (90); null: against the bend at its start",
    )
    without_push: bool = choice(True, "trials without the push too")
    reference: Reference = choice(Reference(), "motion of each trial; its angle counts toward the direction")
    horizon: float = quantity(5.0, "s", "duration of a trial", "assumed", gt=0)
    payload: float = quantity(
        0.0, "kg", "load that the hand takes up in a trial, declared: motors may pull as much more", ge=0
    )
    tension_factor: float = quantity(
        2.0, "", "trials stop beyond so many times the largest tension of all in simulation, with that payload",
        "assumed", gt=1,
    )  # fmt: skip
    back: float = quantity(1.0, "s", "duration of the return to zero", "assumed", gt=0)
    rest: float = quantity(0.5, "s", "rest at zero before each trial", "assumed", ge=0.1)
    control_period: float = quantity(
        TICK, "s", "time between two evaluations of the controller", "a Mega answers within 9 ms", ge=2e-3, le=0.05
    )
    calibration: str | None = choice(None, "calibrate-wrist run; without one the rig is homed from scratch")
    positions: Literal["find", "stored"] = choice("find", "zero positions: found anew, or as the calibration left them")
    from_identified: str | None = choice(None, "identify run whose parameters replace what the controller knows")
    kept: tuple[str, ...] = kept_settings()
    tuned: str | None = choice(None, "tune run behind gains: tuned")
    network: str | None = choice(None, "train run behind a reference with inverse: network")
    video: bool = choice(False, "keep the frames that were looked at as videos: raw, and with clock and marker angle")

    @model_validator(mode="before")
    @classmethod
    def _toward_one_side(cls, given: Any) -> Any:
        """Settings with one direction and no push, where a live reference is given and these are not."""
        live = isinstance(given, Mapping) and comes_live(given.get("reference"))
        return {"directions": ("ulnar",), "push": {"force": 0.0}, **given} if live else given

    def _misfits(self) -> Iterator[tuple[str, str]]:
        yield from super()._misfits()
        trials = len(self.rows) * len(set(self.directions)) * self.repetitions
        trials *= self.without_push + (self.push.force != 0.0)
        if self.reference.is_live and trials != 1:
            fix = "one controller, direction and repetition; others follow its record (reference.file)"
            yield f"a live reference is followed in one trial, and these settings have {trials}", fix
        if self.reference.is_live and self.port is None and self.rig is None and not self.real_time:
            yield "a live reference comes by the wall clock, and this bench has virtual time", "--real-time"
        if self.planes == 1 and not self.planes_are_open:
            if between := [name for name in self.directions if name in get_args(Between)]:
                yield f"{between[0]} lies between two planes, and the rig bends in one", "planes: 2"
            if self.push_toward_deg is not None:
                yield "push_toward_deg is of a rig in two planes, and this one bends in one", "planes: 2"
        for name in ("port", "calibration", "load_cells", "optics", "optics_2", "video", "real_time"):
            if self.rig is not None and getattr(self, name):
                yield f"{name} is of the board with its cameras, and rig names another rig", f"no {name}, or no rig"
        if self.push.force == 0.0 and not self.without_push:
            yield "without_push: false and push.force: 0 leave no trial", ""
        period, limits = self.control_period, self.safety
        if self.sensor.frame_rate * period > 1.0:
            yield "sensor.frame_rate is above one frame per control_period", ""
        if self.positions == "stored" and self.calibration is None:
            yield "positions: stored needs a calibration run", ""
        if self.rate_life >= limits.watchdog:
            problem = (
                f"a step rate lives for {self.rate_life:g} s ({_LIFE_PERIODS:g} times control_period {period:g} s, "
                f"{_LEAST_LIFE:g} s at least), which must be below safety.watchdog ({limits.watchdog:g} s)"
            )
            shorter = f"control_period below {limits.watchdog / _LIFE_PERIODS:g}, or "
            fix = f"safety.watchdog above {self.rate_life:g}"
            yield problem, (shorter if limits.watchdog > _LEAST_LIFE else "") + fix
        if period + limits.late >= limits.watchdog:
            problem = (
                f"a tick that is late by safety.late ({limits.late:g} s) comes {period + limits.late:g} s after the "
                f"one before: not below safety.watchdog ({limits.watchdog:g} s)"
            )
            yield problem, f"safety.late below {limits.watchdog - period:g}, or a longer safety.watchdog"

    @property
    def planes_are_open(self) -> bool:
        """Whether the rig has as many planes as its reference, which is not known before that is loaded."""
        return "reference" in self.model_fields_set and "planes" not in self.model_fields_set

    def bending_in(self, planes: int) -> Self:
        """Settings of a rig with so many planes. Raises ValidationError where others do not fit them."""
        return self.model_validate({name: getattr(self, name) for name in self.model_fields_set} | {"planes": planes})

    @property
    def rate_life(self) -> float:
        """Seconds for which the board follows a step rate without another: two ticks may be lost."""
        return max(_LEAST_LIFE, _LIFE_PERIODS * self.control_period)

    def _emulated_world(self) -> Plant:
        """The bench as the plant of a loop: what of its motors and camera is not as believed stands there."""
        wrist = {name: getattr(self.bench.plant, name) for name in TrueWrist.model_fields}
        camera = self.sensor.model_copy(update={n: getattr(self.bench.camera, n) for n in ("delay_frames", "dropped")})
        as_flashed = {name: getattr(self.actuator, name) for name in _OF_THE_BOARD}  # on both rigs the same firmware
        as_flashed["tendon_stiffness"] = self.bench.stiffness_with_field
        motors = TrueActuator.between(self.actuator, self.bench.actuator.model_copy(update=as_flashed))
        holds = self.bench.motors
        holding = {
            "torque": holds.holding_torque, "corner_speed": holds.corner_speed, "top_speed": holds.top_speed
        }  # fmt: skip
        return Plant(
            **wrist,
            actuator=motors.model_copy(update=holding),
            sensor=TrueSensor.between(self.sensor, camera),
        )

    @property
    def loop(self) -> Loop:
        """Loop of the trials in simulation: the emulated plant, or the known plant of a real or an identified wrist."""
        if self.port is None and self.from_identified is None and self.rig is None:
            return self.known_loop.model_copy(update={"plant": self._emulated_world()})
        return self.known_loop

    @property
    def known_loop(self) -> Loop:
        """Loop of the trials with the plant that is believed, and the payload that is declared."""
        return Loop(
            plant_segments=self.bench.segments,
            planes=self.planes if self.planes == 2 else None,
            plant=Plant(payload=self.payload),
            actuator=self.actuator,
            sensor=self.sensor,
            control_period=self.control_period,
        )
