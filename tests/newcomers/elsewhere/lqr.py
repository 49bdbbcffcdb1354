"""A linear state feedback with the static torque of the reference fed forward."""

from __future__ import annotations

from typing import Any

from wristctl.control.law import Controller, Gain
from wristctl.control.model import one_segment


def law(now: Any, wrist: Any, gains: Any, memory: Any) -> Any:
    """Load at the reference less K1 (theta - theta_ref) + K2 (rate - rate_ref)."""
    _, load = one_segment(wrist, now.theta_ref, 0.0 * now.theta_ref)
    return load - gains.K1 * (now.theta - now.theta_ref) - gains.lambda_ * (now.rate - now.rate_ref)


LQR = Controller(
    name="lqr",
    law=law,
    source="a stranger",
    gains={
        "K1": Gain("N m/rad", "feedback of the angle", 1e-2, 1e2),
        "lambda": Gain("N m s/rad", "feedback of the rate", 1e-3, 1e1),
    },
    presets={"default": {"lambda": 0.2, "K1": 4.0}},
)
