"""Settings of `recommend`: which controllers are tuned for a wrist, on which rig, and for which motions."""

from collections.abc import Collection, Iterable, Mapping
from typing import Annotated, Any, Self

from pydantic import BeforeValidator, Field

from wristctl.config.choices import RIGS
from wristctl.config.families import Drawn, Family
from wristctl.config.loop import TICK, Loop, Reference
from wristctl.config.section import OneOf, Section, choice, kept_settings, quantity, seldom
from wristctl.config.tune import Controllers

# Where a simulated rig differs from what its controller believes. Angle and speed of each motion are drawn too. What
# nobody told of a hand, and what it carries, weigh up to half as much as it does: 0.15 kg of the default one.
_DRAWN: dict[str, Drawn] = {
    "plant.actuator.tendon_stiffness": "x0.7..1.4 log",
    "plant.actuator.friction": "0.03..0.2",
    "plant.actuator.sheath": "0..3",
    "plant.stiffness": "x0.6..1.4",
    "plant.damping": "x0.5..2",
    "plant.hand_mass": "x1..1.5",
    "plant.tendon_radius": "x0.97..1.03",
    "plant.sensor.delay_frames": "1..3",
    "plant.sensor.noise_deg": "0.03..0.1",
    "plant_segments": (4, 4, 8),
    "plant.model": ("pcc", "pcc", "hinges"),
    "disturbances.load": "-0.3..0.3",
}
MEASURED: dict[str, str] = {
    "plant.actuator.tendon_stiffness": "x0.9..1.1",
    "plant.actuator.friction": "x0.7..1.4",
    "plant.actuator.sheath": "x0.7..1.4",
    "plant.stiffness": "x0.9..1.1",
    "plant.damping": "x0.8..1.25",
    "plant.tendon_radius": "x0.99..1.01",
}
"""The same of a rig whose wrist and tendons were identified."""
DELAY = "plant.sensor.delay_frames"
_MOTIONS = (
    Reference(kind="minimum-jerk", duration=1.0),
    Reference(kind="minimum-jerk", duration=0.7),
    Reference(kind="two-sided-sine", frequency=0.2),
    Reference(kind="two-sided-sine", frequency=0.5),
    Reference(kind="ramp", duration=0.7),
    Reference(kind="limited-square", frequency=0.3),
)
# Speed of a square from side to side, over the largest angle [1/s]: it gets there in 0.4 to 0.8 of half a period of
# 0.3 Hz, and rests until it turns.
_SPEEDS = (1.5, 3.0)
_DRAWN_IN_TWO_PLANES = {"reference.toward_deg": "-180..180", "reference.ratio": "0..1"}
_RIG: dict[str, Any] = {
    "control_period": TICK,
    "actuator": {"level": "tendon", "friction": 0.1, "sheath": 1.0},
    "sensor": {"level": "camera"},
}


def _motions_in_two_planes() -> tuple[Reference, ...]:
    """Smooth moves, ramps and squares toward any side, and ellipses from a line to a circle, as fast as in one plane.

    Made where they are wanted: their parameters are read from the code that draws them.
    """
    kinds = ({"kind": "diagonal", "duration": 1.0}, {"kind": "diagonal", "duration": 0.7})
    turns = ({"kind": "ellipse", "turn": 5.0}, {"kind": "ellipse", "turn": 2.0})
    corners = ({"kind": "diagonal-ramp", "duration": 0.7}, {"kind": "diagonal-square", "frequency": 0.3})
    return tuple(Reference.model_validate(each) for each in (*kinds, *turns, *corners))


def _from_the_rig(loop: Any) -> Any:
    """A loop as given; what it leaves out of period, motors, tendons and camera is the default rig's, no ideal one."""
    if not isinstance(loop, Mapping):
        return loop
    parts = {
        name: {**_RIG[name], **loop[name]} for name in ("actuator", "sensor") if isinstance(loop.get(name), Mapping)
    }
    return {**_RIG, **loop, **parts}


class RecommendSettings(Section):
    """A controller with gains for one's own wrist and rig."""

    controllers: Controllers = choice(
        ("ct-dob", "smc-dob", "pid-dob", "pid-ff", "nc", "mrac"), "controllers to tune and to test", min_length=1
    )
    loop: Annotated[Loop, BeforeValidator(_from_the_rig)] = choice(
        Loop.model_validate(_RIG),
        "the rig: motors, tendons, camera and timing; what a study leaves out of them is as in the default here",
    )
    draw: dict[str, Drawn] = choice(
        _DRAWN, "settings of the loop in which simulated rigs differ, and what each is drawn from"
    )
    known: dict[str, Drawn] = choice(
        {},
        "settings that are known of this rig, {plant.hand_mass: x1..1.05}, in place of what is drawn of any",
    )
    references: tuple[Reference, ...] = choice(
        _MOTIONS,
        "motions that each simulated rig follows, to angles drawn within its reach; by default squares at a drawn "
        "speed, and in two planes moves, ramps and squares toward any side and ellipses",
        min_length=1,
    )
    horizon: float = quantity(5.0, "s", "duration of one rollout", "assumed", gt=0)
    largest_deg: float = quantity(45.0, "deg", "largest angle asked for, where the tendons reach it", gt=0, le=180)
    draws: int = choice(16, "simulated rigs to tune on", ge=2, le=10_000)
    validation: int = choice(
        20, "other rigs to choose by, among the best gains and the scaled presets", ge=2, le=10_000
    )
    tests: int = choice(200, "further rigs, which no search has seen, to test on", ge=8, le=10_000)
    candidates: int = choice(12, "candidates per iteration of each search", ge=4, le=10_000)
    iterations: int = choice(6, "iterations of each search", ge=1, le=100_000)
    frequencies: tuple[Annotated[float, Field(gt=0)], ...] = quantity(
        (0.2, 0.4, 0.6, 0.8, 1.0),
        "Hz",
        "sines to both sides, in two planes ellipses, by which it is found how fast a motion may be",
    )
    payloads: tuple[Annotated[float, Field(gt=0)], ...] = quantity(
        (0.1, 0.2, 0.3, 0.5), "kg", "masses in the hand, unknown to the controller, that are tried", "assumed"
    )
    rehearsed: int = choice(
        3, "of the best, how many are rehearsed on the emulated rig at a time, where hw-run has the rig; 0: none",
        ge=0, le=10,
    )  # fmt: skip
    rig: Annotated[str, OneOf(RIGS)] | None = seldom(
        None, "", "a robot of your own, my_rig.py:RIG: rigs are drawn from the ranges of its facts"
    )
    from_identified: str | None = choice(None, "identify run whose parameters replace the study's")
    kept: tuple[str, ...] = kept_settings()

    def measured(self, told: Collection[str] | None = None, usual: Mapping[str, Drawn] = _DRAWN) -> Self:
        """The settings for a wrist that was identified: where nobody says how, rigs differ by what that leaves open.

        `told` are the settings that it tells, `wrist.damping`, `actuator.friction`, ...; None: all. What it does not
        tell is drawn as of any rig, or as is `usual` of this one. A delay is known to half a frame.
        """
        if self.draw != usual:
            return self
        draw = dict(usual)
        for key, source in MEASURED.items():
            leaf = key.removeprefix("plant.")
            if told is None or leaf in told or f"wrist.{leaf}" in told:
                draw[key] = source
        if DELAY in draw and (told is None or "sensor.delay_frames" in told):
            draw[DELAY] = known_delay(self.loop)
        return self.model_copy(update={"draw": draw})

    @property
    def drawn(self) -> dict[str, Drawn]:
        """All that is drawn of a rig: what is known of it takes the place of what is drawn of any."""
        return self.draw | self.known

    def family(self, largest_deg: float, planes: int = 1) -> Family:
        """The simulated rigs, asked for angles of up to `largest_deg` to both sides, in two planes to any side."""
        drawn: dict[str, Drawn] = self.drawn | {"reference.angle_deg": f"{-largest_deg:g}..{largest_deg:g}"}
        references = self.references
        if references == _MOTIONS:
            slow, fast = (share * largest_deg for share in _SPEEDS)
            drawn.setdefault("reference.speed", f"{slow:g}..{fast:g}")
            references = _motions_in_two_planes() if planes == 2 else references
        if planes == 2:
            drawn = in_any_direction(drawn, references)
        return Family(loop=self.loop, draw=drawn, references=references, horizon=self.horizon)


def known_delay(loop: Loop) -> str:
    """What the frames of delay are drawn from once they are known to half a frame."""
    delay = loop.sensor.delay_frames
    return f"{max(0.0, delay - 0.5):.6g}..{delay + 0.5:.6g}"


def in_any_direction(drawn: Mapping[str, Drawn], references: Iterable[Reference]) -> dict[str, Drawn]:
    """What is drawn, and the direction of motions and of the load in two planes where it is not drawn otherwise."""
    of_motions = {f"reference.{name}" for reference in references for name in reference.added()}
    aside = {"disturbances.toward_deg": "-180..180"} if "disturbances.load" in drawn else {}
    return aside | {key: some for key, some in _DRAWN_IN_TWO_PLANES.items() if key in of_motions} | dict(drawn)
