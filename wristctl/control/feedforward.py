"""Stiffness and gravity feedforward: the baseline that every feedback controller has to beat."""

from typing import Any

from wristctl.control.law import Conditions, Controller
from wristctl.control.model import one_segment
from wristctl.lanes.lane import zero_like


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """The torque that holds the one-segment wrist at rest at the reference: K theta_ref + G(theta_ref)."""
    _, load = one_segment(wrist, now.theta_ref, zero_like(now.theta_ref))
    return load


FEEDFORWARD = Controller(
    name="feedforward",
    law=law,
    source="baseline",
    gains={},
    presets={"default": {}},
    conditions={"default": Conditions((1e-3, 1e-2), (2e3, 1e5))},
)
