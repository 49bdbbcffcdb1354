"""Elementary functions of lanes, branch-free, with their error in units in the last place (ulp)."""

import math
from fractions import Fraction
from typing import Any

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import exp2i, floor, polynomial, where

# The series hold for x^2 up to this: a little more than pi^2.
_REACH = 10


def _series(order: int, terms: int) -> tuple[float, ...]:
    """Taylor's series economised to as few terms.

    Lanczos: as long as there are more, take off the multiple of Chebyshev's polynomial on 0 to _REACH that takes off
    the highest term. That spreads its error over the interval, where 15 terms of Taylor's would be needed.
    """
    coefficients = [Fraction(1, math.prod(range(1, 2 * order + 2, 2)))]
    for k in range(16):
        coefficients.append(-_REACH * coefficients[-1] / (2 * (k + 1) * (2 * order + 2 * k + 3)))
    while len(coefficients) > terms:
        chebyshev = _shifted_chebyshev(len(coefficients) - 1)
        share = coefficients[-1] / chebyshev[-1]
        coefficients = [
            coefficient - share * chebyshev_coefficient
            for coefficient, chebyshev_coefficient in zip(coefficients, chebyshev, strict=True)
        ][:-1]
    return tuple(float(coefficient / _REACH**k) for k, coefficient in enumerate(coefficients))


def _shifted_chebyshev(n: int) -> list[int]:
    """Coefficients of T_n(2 u - 1), lowest first, which is T_2n(sqrt(u))."""
    signed = ((-1) ** (n - k) * 4**k * math.comb(n + k, 2 * k) for k in range(n + 1))
    return [value * n // (n + k) for k, value in enumerate(signed)]


# To 1e-16 of their value at 0, as doubles.
E2, E3 = _series(2, 10), _series(3, 11)


_LOG2_E = 1.0 / math.log(2.0)
_LN2_HIGH = 6.93147180369123816490e-01
_LN2_LOW = 1.90821492927058770002e-10
# (exp(r) - 1 - r)/r^2
_exp_rest = polynomial(tuple(1.0 / math.factorial(k) for k in range(2, 14)))


@compiled
def minimum(a: Any, b: Any) -> Any:
    """The smaller of two lanes."""
    return where(a < b, a, b)


@compiled
def maximum(a: Any, b: Any) -> Any:
    """The larger of two lanes."""
    return where(a > b, a, b)


@compiled
def clip(x: Any, low: Any, high: Any) -> Any:
    """x held between low and high."""
    return minimum(maximum(x, low), high)


@compiled
def _reduced(y: Any) -> Any:
    """exp(r) - 1 and 2^k with y = r + k ln 2, |r| <= ln(2)/2."""
    k = floor(y * _LOG2_E + 0.5)
    r = (y - k * _LN2_HIGH) - k * _LN2_LOW
    return r + r * r * _exp_rest(r), exp2i(k)


@compiled
def expm1_of_negative(y: Any) -> Any:
    """exp(y) - 1 for y <= 0 to 1.5 ulp, by Taylor's series within ln(2)/2 of a power of 2; below -44 as at -44."""
    less, scale = _reduced(maximum(-44.0, y))
    return scale * less + (scale - 1.0)


@compiled
def exp(y: Any) -> Any:
    """exp(y) to 1 ulp; beyond +-44 as there."""
    less, scale = _reduced(minimum(44.0, maximum(-44.0, y)))
    return scale * (1.0 + less)


@compiled
def tanh(x: Any) -> Any:
    """Hyperbolic tangent to 3 ulp: -t/(t + 2) with t = exp(-2|x|) - 1."""
    t = expm1_of_negative(-2.0 * minimum(abs(x), 22.0))
    size = -t / (t + 2.0)
    return where(x < 0.0, -size, size)


_e2 = polynomial(E2)
_e3 = polynomial(E3)


@compiled
def bessel(x: Any) -> Any:
    """E_n(x) = j_n(x)/x^n for n = 0..3, spherical Bessel functions over powers, |x| <= pi.

    E0 = sin(x)/x, and d(E_n)/dx = -x E_{n+1}. Everything a constant-curvature arc needs follows without a division:
    cos x = E0 - x^2 E1, and the series for E2 and E3 with the downward recurrence E_{n-1} = (2n+1) E_n - x^2 E_{n+1}
    (stable, DLMF 10.51) hold at 0 as anywhere else. Absolute error below 4e-16 (E0), that is 2 ulp of 1.
    """
    s = x * x
    e2, e3 = _e2(s), _e3(s)
    e1 = 5.0 * e2 - s * e3
    e0 = 3.0 * e1 - s * e2
    return e0, e1, e2, e3
