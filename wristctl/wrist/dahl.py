"""Dahl's friction: a bristle that bends as what it holds moves, and holds it fully once it is bent (z = +-1).

Of a tendon the bristle hangs on its path (`wristctl.wrist.tendon_mechanics`), of friction inside the wrist on the bend
of each segment: its torque holds a bent wrist where it is, though no tendon pulls. A segment of a chain has the whole
wrist's torque, for that is the same all along a chain, and its share of the bend in which it turns round. Without
inner friction its type has no fields, and no more is compiled. (P. R. Dahl, A Solid Friction Model, 1968.)
"""

from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import by_type, compiled, implements
from wristctl.lanes.functions import expm1_of_negative
from wristctl.lanes.lane import where
from wristctl.lanes.rows import rows_of


@compiled
def bristle(z: Any, travel: Any, slope: Any) -> Any:
    """The bristle's state after what it holds has moved by `travel`, positive one way; slope: one over the path."""
    sign = where(travel < 0.0, -1.0, 1.0)
    return z - expm1_of_negative(-slope * abs(travel)) * (sign - z)


@compiled
def bristle_slope(z: Any, speed: Any, slope: Any) -> Any:
    """dz/dx where what it holds moves at this speed; between both directions' where it is at rest."""
    sign = where(speed > 0.0, 1.0, where(speed < 0.0, -1.0, 0.0))
    return (1.0 - z * sign) * slope


class NoInnerFriction(NamedTuple):
    """A wrist that bends without friction of its own."""


class InnerFriction(NamedTuple):
    """Friction inside the wrist; lanes, SI units."""

    torque: Any
    """Torque of a fully bent bristle [N m]."""
    slope: Any
    """One over the bend of a segment in which friction turns round [1/rad]."""
    state: Any
    """Rows: the bristle of each segment, then the bend of each before the step [rad]."""


Inner = NoInnerFriction | InnerFriction


def inner_state(q: Array, z: float = 0.0) -> Array:
    """Rows of the state of a wrist at rest at coordinates q (n,), its bristles all bent by z; (2 n,)."""
    return np.concatenate([np.full(len(q), z), q])


def one_block(inner: Inner, number: int) -> Inner:
    """Inner friction of one block's lanes."""
    return type(inner)(*(rows[number] for rows in inner))


@by_type
def inner_in_lanes(inner: Any) -> Any:
    """Inner friction of lanes from that of one block's arrays."""
    raise NotImplementedError("compiled code only")


@implements(inner_in_lanes, NoInnerFriction)
def _none_in_lanes(inner: Any) -> Any:
    return inner


@implements(inner_in_lanes, InnerFriction)
def _in_lanes(inner: Any) -> Any:
    return InnerFriction(rows_of(inner.torque)[0], rows_of(inner.slope)[0], rows_of(inner.state))


@compiled
def _turned(inner: Any, n: int, k: int, theta: Any) -> Any:
    return bristle(inner.state[k], theta - inner.state[n + k], inner.slope)


@by_type
def resist(inner: Any, theta: Any, r: Any) -> None:
    """Add to the residual r (n,) the torque with which the wrist resists being at theta (n,)."""
    raise NotImplementedError("compiled code only")


@implements(resist, NoInnerFriction)
def _resist_nothing(inner: Any, theta: Any, r: Any) -> None:
    pass


@implements(resist, InnerFriction)
def _resist(inner: Any, theta: Any, r: Any) -> None:
    n = len(theta)
    for k in range(n):
        r[k] = r[k] + inner.torque * _turned(inner, n, k, theta[k])


@by_type
def resist_slope(inner: Any, theta: Any, omega: Any, by_theta: Any) -> None:
    """Add to dr/d(theta), (n, n), what inner friction adds at the start of a step."""
    raise NotImplementedError("compiled code only")


@implements(resist_slope, NoInnerFriction)
def _no_slope(inner: Any, theta: Any, omega: Any, by_theta: Any) -> None:
    pass


@implements(resist_slope, InnerFriction)
def _resist_slope(inner: Any, theta: Any, omega: Any, by_theta: Any) -> None:
    for k in range(len(theta)):
        slope = inner.torque * bristle_slope(inner.state[k], omega[k], inner.slope)
        by_theta[k, k] = by_theta[k, k] + slope


@by_type
def remember_bend(inner: Any, theta: Any) -> None:
    """Take the bristles over to the end of a step, at coordinates theta."""
    raise NotImplementedError("compiled code only")


@implements(remember_bend, NoInnerFriction)
def _remember_nothing(inner: Any, theta: Any) -> None:
    pass


@implements(remember_bend, InnerFriction)
def _remember_bend(inner: Any, theta: Any) -> None:
    n = len(theta)
    for k in range(n):
        inner.state[k] = _turned(inner, n, k, theta[k])
        inner.state[n + k] = theta[k]
