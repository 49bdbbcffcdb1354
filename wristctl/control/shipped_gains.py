"""Gains that a study found on a family of worlds, shipped with their conditions and the run that they are from.

`tuned:camera` names those of the family `camera`: of each controller the gains of its median tuning. The file is
written by `python docs/published_gains.py RUN`.
"""

import json
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

from wristctl.control.law import Conditions
from wristctl.errors import UserError, meant

# What the name of shipped gains begins with; the family follows.
PREFIX = "tuned:"
# Gains of the family on whose worlds rows are compared.
OF_WORLDS = "tuned:worlds"
FILE = "tuned_gains.json"


class ShippedGains(NamedTuple):
    """Gains of a controller with what they were found for, and how they did on worlds that no search has seen."""

    gains: dict[str, float]
    about: str
    """What the family asks of a controller, in a few words."""
    conditions: Conditions | None
    """Periods and tendons of the family; None where it has ideal angles or torques."""
    rmse: float
    """Geometric mean of the RMSE over the worlds [rad]."""
    lost: int
    """Worlds in which they fail, swing or chatter."""
    worlds: int
    reliable: bool
    """Whether they are not shown to be lost in more than the tolerated share of the worlds."""
    family_sha256: str
    """Hash of the family's settings as they were."""
    drive: int | None
    """Version of the simulated drive that they were found behind; None where the family has none."""
    run: str
    """Identifier of the run that counted them: the study's, or a comparison of controllers that changed since."""


def is_shipped(gains: object) -> bool:
    """Whether this names shipped gains."""
    return isinstance(gains, str) and gains.startswith(PREFIX)


def families() -> list[str]:
    """Families of which gains are shipped."""
    return list(_shipped())


def shipped_for(controller: str) -> dict[str, dict[str, float]]:
    """Gains of a controller that are shipped, by the names that people type: `tuned:FAMILY`."""
    shipped = {PREFIX + family: content["controllers"] for family, content in _shipped().items()}
    return {name: dict(rows[controller]["gains"]) for name, rows in shipped.items() if controller in rows}


def shipped_gains(controller: str, gains: str) -> ShippedGains:
    """The gains of a controller that `tuned:FAMILY` names. UserError with what there is, where there are none."""
    family = gains.removeprefix(PREFIX)
    if family not in _shipped():
        names = [PREFIX + name for name in _shipped()]
        raise UserError(f"unknown gains '{gains}': no study of '{family}' is shipped", "gains", meant(gains, names))
    of_family = _shipped()[family]
    if controller not in of_family["controllers"]:
        problem = f"no gains of {controller} are shipped for '{family}'"
        raise UserError(problem, "controller", f"one of {', '.join(of_family['controllers'])}")
    row, limits = of_family["controllers"][controller], of_family["conditions"]
    conditions = Conditions(tuple(limits["period"]), tuple(limits["tendon_stiffness"])) if limits else None
    return ShippedGains(
        dict(row["gains"]), of_family["about"], conditions, row["rmse"], row["lost"], of_family["worlds"],
        row["reliable"], of_family["family_sha256"], of_family["drive"],
        of_family.get("compared", of_family)["run"],
    )  # fmt: skip


@cache
def _shipped() -> dict[str, Any]:
    content: dict[str, Any] = json.loads(files("wristctl.control").joinpath(FILE).read_text(encoding="utf-8"))
    return content
