"""A controller with its gains: a row of a comparison."""

import re
from typing import Annotated, Any

from pydantic import BeforeValidator

from wristctl.config.choices import CONTROLLERS
from wristctl.config.section import OneOf, Section, choice
from wristctl.errors import Unfitting

# How gains are given by name, for a description and an error.
BY_NAME = "every gain by name (Kp=10,Ki=2,Kd=0.1)"
# Gains of a controller that is typed by its name alone: a preset for each loop.
BY_LOOP = "by-loop"
GAINS = (
    "a preset's name, `by-loop` (`default` or `hardware`, by motors and camera), `tuned` (from a tune run), "
    f"`tuned:camera` (of a family, shipped), or {BY_NAME}"
)


def _by_name(gains: Any) -> Any:
    """Gains by name out of a text such as Kp=10,Ki=2,Kd=0.1; anything else as it is."""
    if not isinstance(gains, str) or "=" not in gains:
        return gains
    values: dict[str, float] = {}
    for part in re.split(r"[,\s]+", gains.strip()):
        name, _, value = part.partition("=")
        try:
            number = float(value)
        except ValueError:
            raise Unfitting(f"gains by name are NAME=NUMBER, and '{part}' is not", "Kp=10,Ki=2,Kd=0.1") from None
        if not name or name in values:
            raise Unfitting(f"'{part}' names {'a gain twice' if name else 'no gain'}", "each gain once, by its name")
        values[name] = number
    return values


CONTROLLER = "name in the table of controllers, NAME/GAINS, or file.py:NAME"
GainsChoice = Annotated[str | dict[str, float], BeforeValidator(_by_name)]
ControllerName = Annotated[str, OneOf(CONTROLLERS)]

REPETITIONS = "repetitions, each with noise and drawn plants of its own, the same for all rows"


def label_of(controller: str, gains: str) -> str:
    """Label of a row of tables: controller/gains; of gains by loop the controller alone."""
    return controller if gains == BY_LOOP else f"{controller}/{gains}"


class Row(Section):
    """One controller with one set of gains."""

    controller: ControllerName = choice("smc", CONTROLLER)
    gains: GainsChoice = choice("default", GAINS)

    @property
    def gains_name(self) -> str:
        """The preset, `tuned`, or the values themselves."""
        return self.gains if isinstance(self.gains, str) else " ".join(f"{k}={v:g}" for k, v in self.gains.items())

    @property
    def label(self) -> str:
        """controller/gains; of gains by loop the controller alone"""
        return label_of(self.controller, self.gains_name)
