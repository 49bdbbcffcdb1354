"""A controller with its gains: a row of a comparison."""

from typing import Annotated

from wristctl.config.choices import CONTROLLERS
from wristctl.config.section import OneOf, Section, choice

GainsChoice = str | dict[str, float]
ControllerName = Annotated[str, OneOf(CONTROLLERS)]

REPETITIONS = "repetitions, each with noise and drawn plants of its own, the same for all rows"


class Row(Section):
    """One controller with one set of gains."""

    controller: ControllerName = choice("smc", "name in the table of controllers, or file.py:NAME")
    gains: GainsChoice = choice("default", "a preset's name, `tuned` (from a tune run), or every gain by name")

    @property
    def gains_name(self) -> str:
        """The preset, `tuned`, or the values themselves."""
        return self.gains if isinstance(self.gains, str) else " ".join(f"{k}={v:g}" for k, v in self.gains.items())

    @property
    def label(self) -> str:
        """controller/gains"""
        return f"{self.controller}/{self.gains_name}"
