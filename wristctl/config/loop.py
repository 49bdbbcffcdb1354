"""One closed loop: plant, timing, limits, and the reference it follows."""

from __future__ import annotations

from typing import Literal, Self

from pydantic import model_validator

from wristctl.config.section import Section, choice, quantity

Inverse = Literal["none", "exact", "network"]


class Plant(Section):
    """How the simulated wrist differs from the one that its controller knows."""

    stiffness_scale: float = quantity(1.0, "", "stiffness over the controller's", "paper: springs lose stiffness", gt=0)
    damping_scale: float = quantity(1.0, "", "damping over the controller's", gt=0)
    payload: float = quantity(0.0, "kg", "mass added to the hand, which the controller does not know", ge=0)


class Loop(Section):
    """The plant and the timing. Controllers always see one segment (E13: a scalar input)."""

    plant_segments: int = choice(4, "constant-curvature segments of the simulated wrist", "assumed", ge=1, le=8)
    plant: Plant = Plant()
    control_period: float = quantity(1e-3, "s", "time between two evaluations of the law", "assumed", gt=0, le=0.1)
    substeps: int = choice(1, "integration steps within one control period", ge=1, le=1000)
    limits: bool = choice(True, "tensions stay within pretension and tension_limit; false: no upper limit")


class Reference(Section):
    """The wanted motion, from rest and straight: a step or a minimum-jerk move to an angle or a tip position."""

    kind: Literal["step", "minimum-jerk"] = choice("minimum-jerk", "shape of the move")
    angle_deg: float | None = quantity(None, "deg", "wanted angle at the end; 30 deg where no target is given", "paper")
    tip: tuple[float, float] | None = quantity(None, "m", "wanted tip position at the end, instead of the angle")
    duration: float = quantity(1.0, "s", "duration of a minimum-jerk move", "assumed", gt=0)
    inverse: Inverse = choice(
        "none", "how wanted tip positions become reference angles: network, exact inverse, or the angle given directly"
    )

    @model_validator(mode="after")
    def _one_target(self) -> Self:
        if self.angle_deg is not None and self.tip is not None:
            raise ValueError("give angle_deg or tip, not both")
        if self.tip is not None and self.inverse == "none":
            raise ValueError("a tip target needs inverse: network or exact")
        return self


class Scenario(Section):
    """A loop and a reference: what a controller is tuned or judged on."""

    loop: str = choice("default", "name of a loop in `loops`")
    reference: Reference = Reference()


LOOPS: dict[str, Loop] = {
    "exact": Loop(plant_segments=1, control_period=1e-6, limits=False),
    "sampled": Loop(plant_segments=1),
    "default": Loop(),
}
"""Named loops (PAPER C5): model = plant in nearly continuous time, the same sampled, and the four-segment plant."""
