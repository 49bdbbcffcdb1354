"""Targets of a reference: where its moves end."""

from __future__ import annotations

from functools import lru_cache
from typing import Literal

import numpy as np

from wristctl.config.errors import UserError
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.wrist.kinematics import exact_arc

Targets = Literal["end", "angles_deg", "tips", "none"]
"""Where they stand: one angle or tip at the end, or the leaf with several, one every `duration`."""


def targets_of(reference: Reference, at: Targets, wrist: WristParameters) -> list[tuple[float, float]]:
    """Angle [rad] and arc length [m] of each target in turn; UserError for one out of reach."""
    if at == "tips":
        return [_tip_target(tip, "reference.tips", wrist) for tip in reference.tips]
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
    if abs(angle) > np.deg2rad(wrist.range_deg) or not 0.0 < length < np.inf:
        raise UserError(
            f"tip {tip} m asks for {np.rad2deg(angle):.1f} deg, beyond the range of +-{wrist.range_deg} deg",
            where=where,
            fix="choose a tip position within reach",
        )
    return angle, length


@lru_cache(maxsize=64)
def _arc_to(tip: tuple[float, float]) -> tuple[float, float]:
    theta, length = exact_arc(np.array(tip))
    return float(theta), float(length)
