"""The wrist's parameters; every default carries its source: the paper gives few of them (C10)."""

import math
from typing import Any, Literal, Self

from pydantic import model_validator

from wristctl.config.section import Section, choice, quantity, seldom


class TendonPlace(Section):
    """A place in the wrist's cross-section where a tendon runs, or several alike that are pulled together."""

    angle_deg: float = quantity(..., "deg", "direction from the wrist's axis, from ulnar (0) toward flexion (90)")
    radius: float | None = quantity(None, "m", "distance from the wrist's axis; null: wrist.tendon_radius", ge=0)
    ends_at: int | None = choice(None, "disc that the tendon ends at, the clamped one being 1; null: the last", ge=2)
    multiplicity: int = choice(1, "number of tendons alike at this place", ge=1)

    @model_validator(mode="before")
    @classmethod
    def _by_its_angle(cls, given: Any) -> Any:
        """A place given by its direction alone, 120, as a place."""
        try:
            number = isinstance(given, str | int | float) and not isinstance(given, bool)
            return {"angle_deg": float(given)} if number else given
        except ValueError:
            return given


class WristParameters(Section):
    """A tendon-driven wrist of rigid discs and springs; SI units."""

    discs: int = choice(5, "rigid discs, the first clamped, the last carrying the hand", "paper", ge=2, le=33)
    length: float = quantity(0.080, "m", "arc length from the first to the last disc", "assumed", gt=0)
    mass: float = quantity(0.050, "kg", "moving mass of the wrist itself", "assumed", gt=0)
    hand_mass: float = quantity(0.30, "kg", "mass of the hand", "assumed", ge=0)
    hand_offset: float = quantity(0.060, "m", "hand's centre of mass beyond the last disc", "assumed", ge=0)
    stiffness: float = quantity(0.615, "N m/rad", "bending stiffness of the whole wrist", "paper, C1", gt=0)
    flexion_ratio: float = quantity(1.0, "", "stiffness toward flexion over that toward ulnar", "assumed: alike", gt=0)
    stiffness_axis_deg: float = seldom(
        0.0, "deg", "direction of the bends that meet `stiffness`, from ulnar (0) toward flexion (90)"
    )
    taper: float = quantity(
        1.0, "", "stiffness at the base over that at the tip, the whole's staying (plant hinges)", "assumed: even", gt=0
    )
    damping: float = quantity(0.105, "N m s/rad", "bending damping of the whole wrist", "paper, C1", ge=0)
    tendon_radius: float = quantity(0.020, "m", "radius of the circle of tendons", "assumed", gt=0)
    tendons: Literal["three", "four", "five", "six"] | tuple[TendonPlace, ...] = choice(
        "four",
        "places: three at 120 deg, four at 45 deg from both planes, five with one more in the centre, six at 60 deg, "
        "or a list of places; a wrist in one plane has four or five",
        "paper",
    )
    pretension: float = quantity(2.0, "N", "least tension of each tendon", "assumed", ge=0)
    tension_limit: float = quantity(60.0, "N", "largest tension of each tendon", "assumed", gt=0)
    range_deg: float = quantity(50.0, "deg", "bending range to either side", "paper", gt=0, le=180)
    gravity: tuple[float, float] = quantity(
        (-9.81, 0.0), "m/s^2", "gravity along the base tangent and toward ulnar", "assumed: upright, as in the test"
    )
    gravity_flexion: float = quantity(0.0, "m/s^2", "gravity toward flexion", "assumed: upright")

    @model_validator(mode="after")
    def _tensions_in_order(self) -> Self:
        if self.tension_limit <= self.pretension:
            raise ValueError(f"tension_limit ({self.tension_limit} N) must exceed pretension ({self.pretension} N)")
        return self

    @property
    def tension_range(self) -> float:
        """From pretension to the largest tension of a tendon [N]."""
        return self.tension_limit - self.pretension

    @property
    def tendon_offset(self) -> float:
        """Distance c of a pair's tendons from the neutral line, r / sqrt(2) [m]."""
        return self.tendon_radius / math.sqrt(2.0)
