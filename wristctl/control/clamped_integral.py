"""The integral of the error that PIDs share, which stays where it is while it would drive a saturated tendon on.

Conditional integration, or clamping: Astrom and Hagglund, PID Controllers (1995), section 3.5.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import where


@compiled
def integrated(now: Any, integral: Any) -> Any:
    """The integral of the error with this period's [rad s]."""
    return integral + now.period * (now.theta - now.theta_ref)


@compiled
def held(now: Any, torque: Any, old: Any, new: Any) -> Any:
    """The new integral, or the old one where the new would drive a saturated tendon on."""
    error = now.theta - now.theta_ref
    stays = ((torque > now.torque_high) & (error < 0.0)) | ((torque < now.torque_low) & (error > 0.0))
    return where(stays, old, new)
