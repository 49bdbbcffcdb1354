"""Tendons: straight between neighbouring discs at +-c from the neutral line.

A segment holds g spans, each bending by theta/g over l/g; with y = theta/(2 g) a side's tendon is
2 g (l/theta -+ c) sin(y) long and its moment arm is minus the derivative of that length by theta.
"""

from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.functions import bessel, clip
from wristctl.lanes.lane import where

# Every one of the four directions is pulled by two tendons with equal tension (paper: 1+2, 4+5, 1+4, 2+5).
TENDONS_PER_SIDE = 2


@compiled
def moment_arms(segment: Any, theta: Any) -> Any:
    """Moment arms of the + and the - side of one segment [m]: +-c cos(y) + (l/2g) y E1(y)."""
    y = (0.5 / segment.spans) * theta
    e0, e1, _, _ = bessel(y)
    bending = segment.tendon_offset * (e0 - y * y * e1)
    compression = (0.5 / segment.spans) * segment.length * y * e1
    return bending + compression, compression - bending


@compiled
def lengths(segment: Any, theta: Any) -> Any:
    """Lengths of the + and the - side of one segment [m]: l E0(y) -+ 2 g c sin(y)."""
    y = (0.5 / segment.spans) * theta
    e0 = bessel(y)[0]
    bending = 2.0 * segment.spans * segment.tendon_offset * y * e0
    return segment.length * e0 - bending, segment.length * e0 + bending


@compiled
def tendon_torques(segment: Any, theta: Any, plus: Any, minus: Any, torque: Any, slope: Any) -> None:
    """Torque of both sides' pulls [N] on each segment and its derivative by that segment's theta, into two rows."""
    half_span = (0.5 / segment.spans) * segment.length
    bend, squeeze = segment.tendon_offset * (plus - minus), half_span * (plus + minus)
    for k in range(len(theta)):
        y = (0.5 / segment.spans) * theta[k]
        e0, e1, e2, _ = bessel(y)
        s = y * y
        torque[k] = bend * (e0 - s * e1) + squeeze * y * e1
        slope[k] = (0.5 / segment.spans) * (squeeze * (e1 - s * e2) - bend * y * e0)


@compiled
def reach(theta: Any, wrist: Any, low: Any, high: Any) -> Any:
    """Least and largest torque [N m] at theta with both sides' pulls between low and high [N]."""
    plus, minus = moment_arms(wrist, theta)
    return plus * low + minus * high, plus * high + minus * low


@compiled
def allocate(theta: Any, wrist: Any, torque: Any, low: Any, high: Any) -> Any:
    """Pulls of the + and the - side [N] that give the torque nearest to the wanted one, with one side at `low`."""
    plus, minus = moment_arms(wrist, theta)
    forward = torque > (plus + minus) * low
    needed = clip((torque - where(forward, minus, plus) * low) / where(forward, plus, minus), low, high)
    return where(forward, needed, low), where(forward, low, needed)
