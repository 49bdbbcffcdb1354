"""Targets of a reference: where its moves end."""

import math
from functools import lru_cache
from typing import Literal

import numpy as np

from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.wrist.kinematics import arc_tip, exact_arc

Targets = Literal["end", "angles_deg", "tips", "none"]
"""Where they stand: one angle or tip at the end, or the leaf with several, one every `duration`."""

TIP_TOLERANCE = 0.01
"""How far from the tips that one arc of the wrist reaches a target may be, as a share of the wrist's length."""


def targets_of(reference: Reference, at: Targets, wrist: WristParameters) -> list[tuple[float, float]]:
    """Angle [rad] and arc length [m] of each target in turn; UserError for one out of reach."""
    if at == "tips":
        where = "reference.tip_ratios" if reference.tips is None else "reference.tips"
        return [_tip_target(tip, where, wrist) for tip in reference.in_metres(wrist.length).tips or ()]
    if at == "angles_deg":
        return [_angle_target(angle, "reference.angles_deg", wrist) for angle in reference.angles_deg]
    if reference.tip is not None:
        return [_tip_target(reference.tip, "reference.tip", wrist)]
    return [_angle_target(reference.end_deg, "reference.angle_deg", wrist)]


def _angle_target(degrees: float, where: str, wrist: WristParameters) -> tuple[float, float]:
    if abs(degrees) > wrist.range_deg:
        raise UserError(
            f"reference of {degrees} deg is beyond the wrist's range of +-{wrist.range_deg} deg",
            where=where,
            fix="ask for less, or widen wrist.range_deg",
        )
    return float(np.deg2rad(degrees)), wrist.length


def _tip_target(tip: tuple[float, float], where: str, wrist: WristParameters) -> tuple[float, float]:
    angle, length = _arc_to(tip)
    bent = abs(angle) > np.deg2rad(wrist.range_deg) or not 0.0 < length < np.inf
    nearest = _nearest(tip, wrist.length, wrist.range_deg)
    off = math.dist(tip, nearest)
    if bent or off > TIP_TOLERANCE * wrist.length:
        why = (
            f"asks for {np.rad2deg(angle):.1f} deg, beyond the range of +-{wrist.range_deg} deg"
            if bent
            else f"is {1e3 * off:.3g} mm from where an arc of {1e3 * wrist.length:g} mm can end"
        )
        fix = f"the nearest tip within reach, [{nearest[0]:.5f}, {nearest[1]:.5f}] m"
        if where != "reference.tip":
            fix += "; tip_ratios are multiples of the wrist's length"
        raise UserError(f"tip {tip} m {why}", where, fix)
    return angle, length


@lru_cache(maxsize=64)
def _nearest(tip: tuple[float, float], length: float, range_deg: float) -> tuple[float, float]:
    """The nearest tip [m] that an arc of this length [m] reaches within its range, to a hundredth of a degree."""
    limit = np.deg2rad(range_deg)
    tips = arc_tip(np.linspace(-limit, limit, 2 * math.ceil(100.0 * range_deg) + 1), length)
    x, y = tips[np.argmin(np.hypot(*(tips - tip).T))].tolist()
    return x, y


@lru_cache(maxsize=64)
def _arc_to(tip: tuple[float, float]) -> tuple[float, float]:
    theta, length = exact_arc(np.array(tip))
    return float(theta), float(length)
