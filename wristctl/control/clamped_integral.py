"""Anti-windup: the integral of the error that PIDs share stays where it is while it would drive a saturated tendon on,
or a motor that is too slow as it is.

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
    """The new integral, or the old one where the new would drive on a saturated tendon, or a motor that is behind."""
    error = now.theta - now.theta_ref
    high = (torque > now.torque_high) | (now.withheld > 0.0)
    low = (torque < now.torque_low) | (now.withheld < 0.0)
    return where((high & (error < 0.0)) | (low & (error > 0.0)), old, new)


@compiled
def delivered(now: Any, torque: Any) -> Any:
    """Whether tendons and motors deliver the torque as it is, so that a law may learn from what comes of it."""
    within = (torque <= now.torque_high) & (torque >= now.torque_low)
    return within & (now.withheld <= 0.0) & (now.withheld >= 0.0)
