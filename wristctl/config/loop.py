"""One closed loop: plant, timing, limits, and the reference it follows."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Annotated, Any, Literal, Self

from pydantic import BeforeValidator, model_validator

from wristctl.config.choices import REFERENCES
from wristctl.config.given_files import columns_of_file, given_file, of_file
from wristctl.config.plant import Actuator, Disturbances, Plant, Sensor
from wristctl.config.section import OneOf, OpenSection, Parameter, Section, choice, quantity, seldom

# Former names of plant models in older studies. A loop had the same name.
_WRITTEN = {"exact": "closed-form"}
InverseName = Annotated[
    Literal["none", "closed-form", "network"],
    BeforeValidator(lambda name: _WRITTEN.get(name, name) if isinstance(name, str) else name),
]
DirectionName = Literal["ulnar", "radial", "flexion", "extension"]


# Integration step [s] below which elastic tendons and their friction cost no accuracy (docs/accuracy.md).
LONGEST_STEP = 1e-3
# Integration steps that a control period may have by hand.
MOST_SUBSTEPS = 1000
# Stiffness [N/m] beyond which tendons take half that step.
STIFF = 50e3


# Kind of reference whose wanted bends come while the loop runs.
LIVE = "live"


# Default tips of a tip-path, as multiples of the wrist's length.
_TIP_RATIOS = ((0.975, 0.175), (0.95, 0.2625), (0.9875, -0.125), (0.95, 0.2625))


def longest_step(actuator: Actuator) -> float:
    """The integration step [s] that is short enough for elastic tendons of an actuator's stiffness."""
    return LONGEST_STEP if actuator.tendon_stiffness <= STIFF else 0.5 * LONGEST_STEP


def sample_period(control_period: float) -> float:
    """Time between samples of references and records: 1 ms, or the control period where that is longer [s]."""
    return max(control_period, round(1e-3 / control_period) * control_period)


class Loop(Section):
    """The plant and the timing. Controllers always see one segment (E13: a scalar input)."""

    plant_segments: int = choice(4, "constant-curvature segments of the simulated wrist", "assumed", ge=1, le=8)
    plant: Plant = Plant()
    disturbances: Disturbances = Disturbances()
    actuator: Actuator = Actuator()
    sensor: Sensor = Sensor()
    control_period: float = quantity(
        1e-3, "s", "time between two evaluations of the controller", "assumed", gt=0, le=0.1
    )
    substeps: int | None = choice(
        None,
        "integration steps in a period; null: as many as its numbers take, of 1 ms at most for elastic tendons (0.5 ms "
        "above 50 kN/m)",
        ge=1,
        le=MOST_SUBSTEPS,
    )
    limits: bool = choice(True, "tensions stay within pretension and tension_limit; false: no upper limit")
    planes: Literal[1, 2] | None = seldom(
        None,
        "",
        "planes that it bends in; null: two for a reference in two planes, for tendons that are not two alike on "
        "either side, and where gravity, springs, a force or a tendon takes it out of its plane; else one",
    )
    coupling: Literal["compensated", "ignored"] = seldom(
        "compensated", "", "in two planes: whether their effect on each other is added to the controller's torques"
    )

    stiffness: float | None = seldom(
        None,
        "N m/rad",
        "of the straight wrist on held spools, the least over a bend of stiffness_over_deg, to which tendons pull "
        "against each other; null: they do not",
        gt=0,
    )
    stiffness_over_deg: float = seldom(1.0, "deg", "bend over which `stiffness` counts", gt=0, le=10)
    spool_lead: bool = seldom(True, "", "whether spools move at the speed of the reference, and close their gap on top")

    @property
    def is_exact(self) -> bool:
        """Whether actuators are ideal and angles exact: no motors, tendons or camera."""
        return self.actuator.level == "ideal" and self.sensor.level == "ideal"

    @property
    def steps(self) -> int:
        """Integration steps within one control period."""
        return self.substeps or (self.fewest_steps if self.actuator.winds else 1)

    @property
    def fewest_steps(self) -> int:
        """Fewest integration steps of a control period that resolve its elastic tendons."""
        return max(1, math.ceil(self.control_period / longest_step(self.actuator) * (1.0 - 1e-9)))

    @model_validator(mode="after")
    def _a_frame_lasts_a_tick(self) -> Self:
        if self.sensor.level == "camera" and self.sensor.frame_rate * self.control_period > 1.0:
            raise ValueError("sensor.frame_rate is above one frame per control_period")
        return self


class Reference(OpenSection):
    """The wanted motion, from rest and straight.

    step and minimum-jerk move to an angle or a tip position, sine swings between straight and the angle, multi-step
    jumps through angles, tip-path moves through tip positions, each move a minimum jerk of `duration`. Others have a
    course of their own: recordings, excitations, motions of daily living, paths in two planes.
    """

    kind: Annotated[str, OneOf(REFERENCES)] = choice("minimum-jerk", "shape of the wanted motion (or file.py:NAME)")
    angle_deg: float | None = quantity(None, "deg", "wanted angle at the end; 30 deg where no target is given", "paper")
    tip: tuple[float, float] | None = quantity(None, "m", "wanted tip position at the end, instead of the angle")
    angles_deg: tuple[float, ...] = quantity((20.0, -10.0, 30.0), "deg", "angles of a multi-step", min_length=1)
    tips: tuple[tuple[float, float], ...] | None = quantity(
        None, "m", "tips of a tip-path, instead of tip_ratios", min_length=1
    )
    tip_ratios: tuple[tuple[float, float], ...] | None = quantity(
        None,
        "",
        "the same as multiples of the wrist's length; where no target is given (0.975, 0.175), (0.95, 0.2625), "
        "(0.9875, -0.125), (0.95, 0.2625)",
        min_length=1,
    )
    duration: float = quantity(1.0, "s", "duration of each minimum-jerk move or step", "assumed", gt=0)
    frequency: float = quantity(0.5, "1/s", "frequency of a sine, a chirp's at first", "assumed", gt=0)
    file: str | None = given_file("recording: an open log (documentation: The open log); live: the record of one")
    column: str | None = of_file("recording: name of the angle's column, or tip; by default angle, bend, theta, tip")
    columns: str | None = columns_of_file()
    listen: str | None = seldom(
        None,
        "",
        "live: HOST:PORT of the UDP socket, or lsl:NAME of an LSL stream; null: 127.0.0.1:5005. Another host than "
        "127.0.0.1, and a stream, let other computers move the wrist",
        pattern=r"^(lsl:.*\S|(\[[0-9a-fA-F:.]+\]|[^:\s]+):\d{1,5})$",
    )
    inverse: InverseName = choice(
        "none",
        "how wanted tips become reference angles: a network, one arc's closed-form inverse, or the angle itself",
    )

    @property
    def is_live(self) -> bool:
        """Whether it comes while the loop runs: it is live, and no record of one."""
        return self.kind == LIVE and self.file is None

    @property
    def end_deg(self) -> float:
        """The wanted angle at the end [deg], where it is no tip."""
        return 30.0 if self.angle_deg is None else self.angle_deg

    @property
    def _by_ratios(self) -> bool:
        return self.kind == "tip-path" and self.tips is None

    @property
    def end_ratios(self) -> tuple[tuple[float, float], ...]:
        """The tips of a tip-path as multiples of the wrist's length, where they are not in metres."""
        return _TIP_RATIOS if self.tip_ratios is None else self.tip_ratios

    def in_metres(self, length: float) -> Reference:
        """The reference with the tips of a tip-path in metres, on a wrist of this length [m]."""
        if not self._by_ratios:
            return self
        millimetres = 1e3 * length  # 0.175 of 80 mm are 14 mm to the last bit; 0.175 of 0.08 m are not 0.014 m
        tips = tuple((x * millimetres / 1e3, y * millimetres / 1e3) for x, y in self.end_ratios)
        return self.model_copy(update={"tips": tips, "tip_ratios": None})

    def added(self) -> Mapping[str, Parameter]:
        """Parameters that a reference from outside the package adds."""
        parameters: Mapping[str, Parameter] = REFERENCES[self.kind].parameters
        return parameters

    @classmethod
    def addable(cls) -> Mapping[str, Parameter]:
        """Parameters of every reference."""
        return {name: parameter for kind in REFERENCES for name, parameter in REFERENCES[kind].parameters.items()}

    def mirrored(self) -> Reference:
        """Reference with the same motion to the other side."""
        turned = {name: -self.value(name) for name, parameter in self.added().items() if parameter.mirrors}
        return self.model_copy(
            update={
                **turned,
                "angle_deg": -self.end_deg if self.tip is None else None,
                "tip": None if self.tip is None else (self.tip[0], -self.tip[1]),
                "angles_deg": tuple(-angle for angle in self.angles_deg),
                "tips": None if self.tips is None else tuple((x, -y) for x, y in self.tips),
                "tip_ratios": tuple((x, -y) for x, y in self.end_ratios) if self._by_ratios else None,
            }
        )

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if self.angle_deg is not None and self.tip is not None:
            raise ValueError("give angle_deg or tip, not both")
        if self.tips is not None and self.tip_ratios is not None:
            raise ValueError("give tips or tip_ratios, not both")
        if (self.tip is not None or self.kind == "tip-path") and self.inverse == "none":
            raise ValueError("a tip target needs inverse: network or closed-form")
        if (self.kind == "recording") != (self.file is not None) and self.kind != LIVE:
            raise ValueError("kind: recording goes with its file, and no other kind but live does")
        if self.listen is not None and (self.kind != LIVE or self.file is not None):
            raise ValueError("listen is of kind: live without a file, and this reference listens to nobody")
        return self


def comes_live(given: Any) -> bool:
    """Whether a reference, as a section or as a study has it, comes while the loop runs."""
    if isinstance(given, Mapping):
        return (given.get("kind"), given.get("file")) == (LIVE, None)
    return isinstance(given, Reference) and given.is_live


class Scenario(Section):
    """A loop and a reference: what a controller is tuned or tested on."""

    loop: str = choice("four-segments", "name of a loop in `loops`")
    reference: Reference = Reference()


# Built-in loops (PAPER C5): model = plant in nearly continuous time, the same sampled, and the four-segment plant.
LOOPS: dict[str, Loop] = {
    "exact": Loop(plant_segments=1, control_period=1e-6, limits=False),
    "sampled": Loop(plant_segments=1),
    "four-segments": Loop(),
}
# Time between two evaluations of a rig's controller [s]: a genuine Mega R3 answers within 9 ms.
TICK = 10e-3
# A rig as it is believed: steppers, elastic tendons in sheaths and a camera of 60 Hz.
CAMERA = Loop.model_validate(
    {"control_period": TICK, "actuator": {"level": "tendon", "sheath": 1.0}, "sensor": {"level": "camera"}}
)


def _from_built_in(loops: Any) -> Any:
    """Loops as given; what a loop with a built-in one's name leaves out is that one's."""
    if not isinstance(loops, Mapping):
        return loops
    built_in = {name: loop.model_dump(exclude_unset=True) for name, loop in LOOPS.items()}
    return {
        name: {**built_in.get(name, {}), **loop} if isinstance(loop, Mapping) else loop for name, loop in loops.items()
    }


# Loops by name. Those given are all there are: a study that names its loops is judged on these and no others.
Loops = Annotated[dict[str, Loop], BeforeValidator(_from_built_in)]
