"""From a wanted torque to tensions of an antagonistic pair ("force" and "f2" of E10).

One side pulls, the other keeps its pretension. Both sides' pulls compress the arc, so both arms count.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import clip
from wristctl.lanes.lane import where
from wristctl.wrist.tendons import moment_arms


@compiled
def reach(theta: Any, wrist: Any, low: Any, high: Any) -> Any:
    """Least and largest torque [N m] at theta with both sides' pulls between low and high [N]."""
    plus, minus = moment_arms(theta, wrist)
    return plus * low + minus * high, plus * high + minus * low


@compiled
def allocate(theta: Any, wrist: Any, torque: Any, low: Any, high: Any) -> Any:
    """Pulls of the + and the - side [N] that give the torque nearest to the wanted one, with one side at `low`."""
    plus, minus = moment_arms(theta, wrist)
    forward = torque > (plus + minus) * low
    needed = clip((torque - where(forward, minus, plus) * low) / where(forward, plus, minus), low, high)
    return where(forward, needed, low), where(forward, low, needed)


@compiled
def torque_of(theta: Any, wrist: Any, plus: Any, minus: Any) -> Any:
    """Torque [N m] of both sides' pulls [N] on the one-segment wrist ("force": A_b F_t)."""
    arm_plus, arm_minus = moment_arms(theta, wrist)
    return arm_plus * plus + arm_minus * minus
