"""Dahl's friction: a bristle that bends as what it holds moves, and holds it fully once it is bent (z = +-1).

Of a tendon the bristle hangs on its path (`wristctl.wrist.tendon_mechanics`), of friction inside the wrist on the bend
of each segment: its torque holds a bent wrist where it is, though no tendon pulls. A segment of a chain has the whole
wrist's torque, for that is the same all along a chain, and its share of the bend in which it turns round. Without
inner friction its type has no fields, and no more is compiled. (P. R. Dahl, A Solid Friction Model, 1968.)

In two planes the bristle of a segment is a vector z, |z| <= 1, that turns toward the direction of motion e along its
path s, dz/ds = slope (e - z): along a line that is the bristle of one plane, and nothing tells directions apart.
"""

from typing import Any, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.lanes.compiled import by_type, compiled, implements, itself, nothing
from wristctl.lanes.functions import expm1_of_negative
from wristctl.lanes.lane import sqrt, where
from wristctl.lanes.rows import rows_of


@compiled
def _toward(z: Any, direction: Any, path: Any, slope: Any) -> Any:
    """A bristle, or one component of it, after what it holds has moved along a path in this direction."""
    return z - expm1_of_negative(-slope * path) * (direction - z)


@compiled
def bristle(z: Any, travel: Any, slope: Any) -> Any:
    """The bristle's state after what it holds has moved by `travel`, positive one way; slope: one over the path."""
    return _toward(z, where(travel < 0.0, -1.0, 1.0), abs(travel), slope)


@compiled
def direction_of(y: Any, z: Any) -> Any:
    """Unit vector along (y, z) and the vector's length; of none no direction."""
    size = sqrt(y * y + z * z)
    scale = where(size > 0.0, 1.0 / where(size > 0.0, size, 1.0), 0.0)
    return y * scale, z * scale, size


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


class InnerFrictionInSpace(NamedTuple):
    """Friction inside a wrist that bends in two planes: as InnerFriction, the rows of its state a pair a segment."""

    torque: Any
    slope: Any
    state: Any


Inner = NoInnerFriction | InnerFriction | InnerFrictionInSpace


def inner_state(q: Array, z: float = 0.0) -> Array:
    """Rows of the state of a wrist at rest at coordinates q (n,), its bristles all bent by z; (2 n,)."""
    return np.concatenate([np.full(len(q), z), q])


@by_type
def inner_in_lanes(inner: Any) -> Any:
    """Inner friction of lanes from that of one block's arrays."""


implements(inner_in_lanes, NoInnerFriction)(itself)


@implements(inner_in_lanes, InnerFriction)
def _in_lanes(inner: Any) -> Any:
    return InnerFriction(rows_of(inner.torque)[0], rows_of(inner.slope)[0], rows_of(inner.state))


@implements(inner_in_lanes, InnerFrictionInSpace)
def _in_space_in_lanes(inner: Any) -> Any:
    return InnerFrictionInSpace(rows_of(inner.torque)[0], rows_of(inner.slope)[0], rows_of(inner.state))


@compiled
def _turned(inner: Any, n: int, k: int, theta: Any) -> Any:
    return bristle(inner.state[k], theta - inner.state[n + k], inner.slope)


@compiled
def _turned_in_space(inner: Any, q: Any, k: int) -> Any:
    """The bristle (y, z) of the segment k at coordinates q."""
    state, y, z = inner.state, 2 * k, 2 * k + 1
    along_y, along_z, path = direction_of(q[y] - state[len(q) + y], q[z] - state[len(q) + z])
    return _toward(state[y], along_y, path, inner.slope), _toward(state[z], along_z, path, inner.slope)


@by_type
def resist(inner: Any, theta: Any, r: Any) -> None:
    """Add to the residual r (n,) the torque with which the wrist resists being at theta (n,)."""


implements(resist, NoInnerFriction)(nothing)


@implements(resist, InnerFriction)
def _resist(inner: Any, theta: Any, r: Any) -> None:
    n = len(theta)
    for k in range(n):
        r[k] = r[k] + inner.torque * _turned(inner, n, k, theta[k])


@implements(resist, InnerFrictionInSpace)
def _resist_in_space(inner: Any, q: Any, r: Any) -> None:
    for k in range(len(q) // 2):
        y, z = _turned_in_space(inner, q, k)
        r[2 * k] = r[2 * k] + inner.torque * y
        r[2 * k + 1] = r[2 * k + 1] + inner.torque * z


@by_type
def resist_slope(inner: Any, theta: Any, omega: Any, by_theta: Any) -> None:
    """Add to dr/d(theta), (n, n), what inner friction adds at the start of a step."""


implements(resist_slope, NoInnerFriction)(nothing)


@implements(resist_slope, InnerFriction)
def _resist_slope(inner: Any, theta: Any, omega: Any, by_theta: Any) -> None:
    for k in range(len(theta)):
        slope = inner.torque * bristle_slope(inner.state[k], omega[k], inner.slope)
        by_theta[k, k] = by_theta[k, k] + slope


@implements(resist_slope, InnerFrictionInSpace)
def _resist_slope_in_space(inner: Any, q: Any, rate: Any, by_q: Any) -> None:
    """dz = slope (dq - z e.dq): at rest alike in all directions, e being none."""
    for k in range(len(q) // 2):
        y, z = 2 * k, 2 * k + 1
        along_y, along_z, _ = direction_of(rate[y], rate[z])
        slope = inner.torque * inner.slope
        by_q[y, y] = by_q[y, y] + slope * (1.0 - inner.state[y] * along_y)
        by_q[y, z] = by_q[y, z] - slope * inner.state[y] * along_z
        by_q[z, y] = by_q[z, y] - slope * inner.state[z] * along_y
        by_q[z, z] = by_q[z, z] + slope * (1.0 - inner.state[z] * along_z)


@by_type
def remember_bend(inner: Any, theta: Any) -> None:
    """Take the bristles over to the end of a step, at coordinates theta."""


implements(remember_bend, NoInnerFriction)(nothing)


@implements(remember_bend, InnerFriction)
def _remember_bend(inner: Any, theta: Any) -> None:
    n = len(theta)
    for k in range(n):
        inner.state[k] = _turned(inner, n, k, theta[k])
        inner.state[n + k] = theta[k]


@implements(remember_bend, InnerFrictionInSpace)
def _remember_bend_in_space(inner: Any, q: Any) -> None:
    for k in range(len(q) // 2):
        y, z = _turned_in_space(inner, q, k)
        inner.state[2 * k] = y
        inner.state[2 * k + 1] = z
    for i in range(len(q)):
        inner.state[len(q) + i] = q[i]
