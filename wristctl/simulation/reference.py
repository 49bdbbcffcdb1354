"""References: wanted angles or tip positions, evaluated into theta_ref and its derivatives before the loop runs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.config.errors import UserError
from wristctl.config.loop import Reference
from wristctl.config.wrist import WristParameters
from wristctl.wrist.kinematics import Inverse, arc_path, exact_arc, exact_inverse

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Motion:
    """A reference on the sample grid, T samples from t = 0; SI units."""

    time: Array
    theta_ref: Array
    rate_ref: Array
    acceleration_ref: Array
    theta_desired: Array
    """The true wanted angle, which a network only approximates."""
    tip_desired: Array
    """The wanted tip position, (T, 2)."""
    rest: float
    """Time at which the reference rests."""
    horizon: float
    outside: float = 0.0
    """Share of samples whose tip position lies outside the domain that the network was trained on."""

    @property
    def final(self) -> float:
        """Last reference angle [rad]."""
        return float(self.theta_ref[-1])


def minimum_jerk(time: Array, duration: float) -> tuple[Array, Array, Array]:
    """The minimum-jerk course from 0 to 1 and two time derivatives (Flash and Hogan, J. Neurosci. 5 (1985) 1688)."""
    s = np.clip(time / duration, 0.0, 1.0)
    course = s**3 * (10.0 - 15.0 * s + 6.0 * s**2)
    rate = 30.0 * s**2 * (1.0 - s) ** 2 / duration
    acceleration = 60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / duration**2
    return course, rate, acceleration


def motion(
    reference: Reference, wrist: WristParameters, horizon: float, period: float, network: Inverse | None = None
) -> Motion:
    """Evaluate a reference on the grid of `period` [s] over the horizon [s].

    A tip target, or an angle with inverse `network` or `exact`, becomes a tip path (an arc whose angle and length move
    from rest) that the inverse turns into angles; errors against theta_desired then show the inverse's own error.
    """
    time: Array = np.arange(round(horizon / period), dtype=np.float64) * period
    still = np.zeros_like(time)
    if reference.kind == "step":
        course, rate, acceleration, rest = np.ones_like(time), still, still, 0.0
    else:
        course, rate, acceleration = minimum_jerk(time, reference.duration)
        rest = reference.duration
    angle, length = _target(reference, wrist)
    theta = np.stack([angle * course, angle * rate, angle * acceleration])
    longer = length - wrist.length
    arc = np.stack([wrist.length + longer * course, longer * rate, longer * acceleration])
    tip = arc_path(theta, arc)
    if reference.inverse == "none":
        return Motion(time, theta[0], theta[1], theta[2], theta[0], tip.position, rest, horizon)
    found = _inverse(reference, network)(tip)
    outside = float(np.mean(found.outside))
    return Motion(time, found.theta, found.rate, found.acceleration, theta[0], tip.position, rest, horizon, outside)


def _target(reference: Reference, wrist: WristParameters) -> tuple[float, float]:
    """Final angle [rad] and arc length [m]."""
    if reference.tip is None:
        degrees = 30.0 if reference.angle_deg is None else reference.angle_deg
        if abs(degrees) > wrist.range_deg:
            raise UserError(
                f"reference of {degrees} deg is beyond the wrist's range of +-{wrist.range_deg} deg",
                where="reference.angle_deg",
                fix="ask for less, or widen wrist.range_deg",
            )
        return float(np.deg2rad(degrees)), wrist.length
    x, y = reference.tip
    theta, arc = exact_arc(np.array([x, y]))
    angle, length = float(theta), float(arc)
    if abs(angle) > np.deg2rad(wrist.range_deg) or not 0.0 < length < np.inf:
        raise UserError(
            f"tip ({x}, {y}) m asks for {np.rad2deg(angle):.1f} deg, beyond the range of +-{wrist.range_deg} deg",
            where="reference.tip",
            fix="choose a tip position within reach",
        )
    return angle, length


def _inverse(reference: Reference, network: Inverse | None) -> Inverse:
    if reference.inverse == "exact":
        return exact_inverse
    if network is None:
        raise UserError("the reference goes through a network, and none is given", "reference.inverse", "--network RUN")
    return network
