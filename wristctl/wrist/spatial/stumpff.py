"""Stumpff's functions c_k(s) = sum (-s)^j/(2j + k)!, which make a bend by a vector smooth where it is straight.

With s = |u|^2: c_0 = cos|u|, c_1 = sin|u|/|u|, c_2 = (1 - cos|u|)/|u|^2. They are entire, c_k = 1/k! - s c_{k+2}, and
the derivative of c_k by a component u_a is u_a (k c_{k+2} - c_{k+1}).
"""

from fractions import Fraction
from math import factorial
from typing import Any, NamedTuple

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import polynomial
from wristctl.lanes.series import SERIES_REACH, economised

_TERMS = 8


def _series(k: int) -> Any:
    coefficients = [Fraction((-1) ** j, factorial(2 * j + k)) for j in range(20)]
    return polynomial(economised(coefficients, Fraction(SERIES_REACH), _TERMS))


_c7, _c8 = _series(7), _series(8)


class Stumpff(NamedTuple):
    """c_0 to c_8 at one s, or rows of them."""

    c0: Any
    c1: Any
    c2: Any
    c3: Any
    c4: Any
    c5: Any
    c6: Any
    c7: Any
    c8: Any


class Slopes(NamedTuple):
    """Derivatives of c_1 to c_6 by a component of u, over that component: d(c_k)/d(u_a) = u_a d_k."""

    d1: Any
    d2: Any
    d3: Any
    d4: Any
    d5: Any
    d6: Any


@compiled
def stumpff(s: Any) -> Any:
    """c_0 to c_8 for s of 0 to 10, a little more than pi^2: the highest by series, the others by recurrence."""
    c7, c8 = _c7(s), _c8(s)
    c6 = 1.0 / 720.0 - s * c8
    c5 = 1.0 / 120.0 - s * c7
    c4 = 1.0 / 24.0 - s * c6
    c3 = 1.0 / 6.0 - s * c5
    c2 = 0.5 - s * c4
    c1 = 1.0 - s * c3
    return Stumpff(1.0 - s * c2, c1, c2, c3, c4, c5, c6, c7, c8)


@compiled
def slopes(c: Any) -> Any:
    """Slopes of Stumpff's functions; their own slopes follow by the same rule, as `k d_{k+2} - d_{k+1}`."""
    return Slopes(
        c.c3 - c.c2,
        2.0 * c.c4 - c.c3,
        3.0 * c.c5 - c.c4,
        4.0 * c.c6 - c.c5,
        5.0 * c.c7 - c.c6,
        6.0 * c.c8 - c.c7,
    )
