"""The table of controllers: a newcomer is one file and one line here."""

from __future__ import annotations

from collections.abc import Mapping

from wristctl.config.errors import UserError, meant
from wristctl.control.computed_torque import COMPUTED_TORQUE
from wristctl.control.feedforward import FEEDFORWARD
from wristctl.control.gvsc import GVSC
from wristctl.control.law import Controller
from wristctl.control.mrac import MRAC
from wristctl.control.nc import NC
from wristctl.control.pid import PID
from wristctl.control.smc import SMC
from wristctl.control.smc_tracking import SMC_TRACKING
from wristctl.control.super_twisting import SUPER_TWISTING

CONTROLLERS: dict[str, Controller] = {
    c.name: c for c in (SMC, PID, MRAC, GVSC, NC, SMC_TRACKING, SUPER_TWISTING, COMPUTED_TORQUE, FEEDFORWARD)
}


def controller(name: str) -> Controller:
    """The controller of this name; UserError with the nearest name if there is none."""
    if name not in CONTROLLERS:
        raise UserError(f"unknown controller '{name}'", "controller", meant(name, CONTROLLERS))
    return CONTROLLERS[name]


def gains_of(
    chosen: Controller, gains: str | Mapping[str, float], tuned: Mapping[str, Mapping[str, float]] | None = None
) -> tuple[float, ...]:
    """Gains by preset name, `tuned`, or by value, in the controller's order; UserError for what is unknown or missing.

    `tuned` holds a tune run's gains by controller and name.
    """
    if gains == "tuned":
        if tuned is None or chosen.name not in tuned:
            fix = f"--tuned RUN, a tune run that tuned {chosen.name}"
            raise UserError(f"no tuned gains of {chosen.name}", "gains", fix)
        gains = tuned[chosen.name]
    if isinstance(gains, str):
        if gains not in chosen.presets:
            raise UserError(
                f"unknown gains '{gains}' of {chosen.name}", "gains", meant(gains, [*chosen.presets, "tuned"])
            )
        return chosen.presets[gains]
    for name in gains:
        if name not in chosen.gains:
            raise UserError(f"unknown gain '{name}' of {chosen.name}", f"gains.{name}", meant(name, chosen.gains))
    missing = [name for name in chosen.gains if name not in gains]
    if missing:
        raise UserError(f"missing gain {', '.join(missing)} of {chosen.name}", "gains", "give every gain by name")
    return tuple(float(gains[name]) for name in chosen.gains)
