"""Hysteresis of a wrist on its tendons: the loops that `analyse` drives it through."""

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from wristctl.config.plant import Actuator
from wristctl.config.section import Section, choice, quantity
from wristctl.errors import Unfitting

Speed = Annotated[float, Field(gt=0, le=20)]
NotNegative = Annotated[float, Field(ge=0)]
Path = Annotated[float, Field(gt=0)]


class HysteresisSettings(Section):
    """Loops of every range, speed, friction, sheath and presliding, and the dead band at angles."""

    drive: Literal["spools", "tensions"] = choice(
        "spools", "what moves the wrist, as it would without friction: positions of its spools, or pulls at them"
    )
    toward_deg: float = quantity(
        0.0, "deg", "direction of the bends from ulnar toward flexion; other than 0: in two planes", ge=-360, le=360
    )
    shape: Literal["sine", "triangle"] = choice("sine", "of the way to and fro, from a range's low end")
    ranges_deg: tuple[tuple[float, float], ...] = quantity(
        ((0.0, 30.0), (10.0, 20.0), (14.0, 16.0)), "deg", "angles between which it goes: outer loop, then inner ones",
        min_length=1,
    )  # fmt: skip
    circles_deg: tuple[Annotated[float, Field(gt=0, le=180)], ...] = quantity(
        (), "deg", "bends by which the hand circles about the straight wrist, in two planes; none: no circles"
    )
    frequencies: tuple[Speed, ...] = quantity((0.002, 0.02, 0.2, 1.0), "1/s", "cycles per second", min_length=1)
    frictions: tuple[NotNegative, ...] = quantity((0.1,), "", "coefficients of the tendons' friction", min_length=1)
    sheaths: tuple[NotNegative, ...] = quantity(
        (0.0, 1.0, 3.0), "rad", "angles by which each tendon is wrapped before it reaches the wrist", min_length=1
    )
    preslidings: tuple[Path, ...] = quantity((2e-5,), "m", "paths in which friction turns round", min_length=1)
    tendon_stiffness: float = quantity(20e3, "N/m", "stiffness of one tendon", "assumed; sweep 2-50 kN/m", gt=0)
    stiffness: float | None = quantity(
        None,
        "N m/rad",
        "of the wrist on held spools, to which tendons pull against each other; null: as it is",
        gt=0,
    )
    stiffness_over_deg: float = quantity(1.0, "deg", "bend over which `stiffness` counts", "as a loop's", gt=0, le=10)
    angles_deg: tuple[float, ...] = quantity(
        (5.0, 15.0, 25.0),
        "deg",
        "where held spools are approached from both ends of the outer range, for the dead band; where they are left "
        "out: at a sixth, half and five sixths of that range",
    )
    ramp: float = quantity(7.0, "s", "how long that takes", "assumed; below 5 s a wrist arrives with a swing", gt=0)
    segments: int = choice(4, "constant-curvature segments of the wrist", "as simulated", ge=1, le=8)
    step: float = quantity(1e-3, "s", "longest integration step", "as simulated", gt=0, le=5e-3)
    samples: int = choice(200, "samples kept of each cycle, a multiple of 4", ge=40, le=10_000, multiple_of=4)

    @model_validator(mode="after")
    def _ranges_go_up(self) -> Self:
        for low, high in self.ranges_deg:
            if not high > low:
                raise ValueError(f"a range goes from a lower to a higher angle, not from {low:g} to {high:g} deg")
        low, high = self.ranges_deg[0]
        if "angles_deg" not in self.model_fields_set:
            inside = tuple(low + (high - low) * sixths / 6.0 for sixths in (1, 3, 5))
            self.__dict__["angles_deg"] = inside
        for angle in self.angles_deg:
            if not low < angle < high:
                problem = f"angles_deg: {angle:g} deg lies outside the outer range, {low:g} to {high:g} deg"
                raise Unfitting(problem, "angles_deg between these; where it is left out it follows ranges_deg")
        return self

    def actuator(self, friction: float, sheath: float, presliding: float) -> Actuator:
        """Tendons with such friction."""
        return Actuator(
            level="tendon",
            tendon_stiffness=self.tendon_stiffness,
            friction=friction,
            sheath=sheath,
            presliding=presliding,
        )
