"""Elementary functions of lanes, branch-free, with their error in units in the last place (ulp)."""

import math
import operator
from collections.abc import Callable
from fractions import Fraction
from typing import Any

from numba.core import types
from numba.extending import overload

from wristctl.lanes.compiled import compiled
from wristctl.lanes.lane import exp2i, exponent, floor, polynomial, sqrt, where, zero_like
from wristctl.lanes.series import E2, E3, economised
from wristctl.lanes.types import LaneType, RowsType

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


def norm(rows: Any) -> Any:
    """Root of the sum of squares of rows; of one row its size."""
    raise NotImplementedError("compiled code only")


@overload(norm, strict=False)
def _norm(rows: Any) -> Any:
    if not isinstance(rows, RowsType):
        return None
    if rows.size == 1:
        return lambda rows: abs(rows[0])

    def of_all(rows: Any) -> Any:
        squared = zero_like(rows[0])
        for k in range(len(rows)):
            squared = squared + rows[k] * rows[k]
        return sqrt(squared)

    return of_all


@compiled
def clip(x: Any, low: Any, high: Any) -> Any:
    """x held between low and high."""
    return minimum(maximum(x, low), high)


@compiled
def _reduced(y: Any) -> Any:
    """exp(r) - 1 and the whole k with y = r + k ln 2, |r| <= ln(2)/2."""
    k = floor(y * _LOG2_E + 0.5)
    r = (y - k * _LN2_HIGH) - k * _LN2_LOW
    return r + r * r * _exp_rest(r), k


@compiled
def expm1_of_negative(y: Any) -> Any:
    """exp(y) - 1 for y <= 0 to 1.5 ulp, by Taylor's series within ln(2)/2 of a power of 2; below -44 as at -44."""
    less, k = _reduced(maximum(-44.0, y))
    scale = exp2i(k)
    return scale * less + (scale - 1.0)


@compiled
def exp(y: Any) -> Any:
    """exp(y) to 1 ulp; infinite above 709.8, 0 below -745.2."""
    less, k = _reduced(minimum(710.0, maximum(-746.0, y)))
    half = floor(0.5 * k)
    return (1.0 + less) * exp2i(half) * exp2i(k - half)


@compiled
def tanh(x: Any) -> Any:
    """Hyperbolic tangent to 3 ulp: -t/(t + 2) with t = exp(-2|x|) - 1."""
    t = expm1_of_negative(-2.0 * minimum(abs(x), 22.0))
    size = -t / (t + 2.0)
    return where(x < 0.0, -size, size)


# pi/2 as three doubles, and the angle up to which their multiples take it off to less than an ulp.
_HALF_PI = (1.5707963267948966, 6.123233995736766e-17, -1.4973849048591833e-33)
_TURNED = 1e9
# (sin(r)/r - 1)/r^2 and (cos(r) - 1 + r^2/2)/r^4, in r^2
_sine_rest = polynomial(tuple((-1.0) ** k / math.factorial(2 * k + 1) for k in range(1, 9)))
_cosine_rest = polynomial(tuple((-1.0) ** k / math.factorial(2 * k) for k in range(2, 9)))


@compiled
def _sine_and_cosine(x: Any) -> Any:
    """Taylor's series within pi/4 of a quarter turn, and not a number beyond 1e9 rad.

    The first step of the reduction (Cody and Waite) is exact: both are multiples of the same power of 2, less than 1.
    """
    k = floor(x * (1.0 / _HALF_PI[0]) + 0.5)
    r = ((x - k * _HALF_PI[0]) - k * _HALF_PI[1]) - k * _HALF_PI[2]
    s = r * r
    sine = r + r * (s * _sine_rest(s))
    cosine = (1.0 - 0.5 * s) + s * s * _cosine_rest(s)
    quarter = where(abs(x) <= _TURNED, k - 4.0 * floor(0.25 * k), math.nan)
    is_odd = ((quarter > 0.5) & (quarter < 1.5)) | (quarter > 2.5)
    first, second = where(is_odd, cosine, sine), where(is_odd, sine, cosine)
    known = where(quarter >= 0.0, 1.0, math.nan)
    sign = where(quarter > 1.5, -known, known)
    other_sign = where((quarter > 0.5) & (quarter < 2.5), -known, known)
    return sign * first, other_sign * second


@compiled
def sin(x: Any) -> Any:
    """Sine to 2 ulp; not a number beyond 1e9 rad."""
    return _sine_and_cosine(x)[0]


@compiled
def cos(x: Any) -> Any:
    """Cosine to 2 ulp; not a number beyond 1e9 rad."""
    return _sine_and_cosine(x)[1]


@compiled
def tan(x: Any) -> Any:
    """Tangent to 3 ulp; not a number beyond 1e9 rad."""
    sine, cosine = _sine_and_cosine(x)
    return sine / cosine


_LEAST_NORMAL, _LIFTED = 2.0**-1022, 54.0
# (atanh(s)/s - 1) 2/s^2, in s^2
_log_rest = polynomial(tuple(2.0 / (2 * k + 1) for k in range(1, 11)))


@compiled
def log(x: Any) -> Any:
    """Natural logarithm to 1 ulp; minus infinity at 0, not a number below.

    Of x = 2^k (1 + f) with sqrt(1/2) <= 1 + f <= sqrt(2) by s = f/(2 + f): log(1 + f) = 2 atanh(s), summed as
    f - (f^2/2 - s (f^2/2 + ...)) so that f itself is not rounded.
    """
    is_subnormal = x < _LEAST_NORMAL
    lifted = where(is_subnormal, x * 2.0**_LIFTED, x)
    k = exponent(lifted)
    mantissa = lifted * exp2i(-k)
    is_large = mantissa > math.sqrt(2.0)
    f = where(is_large, 0.5 * mantissa, mantissa) - 1.0
    k = where(is_large, k + 1.0, k) - where(is_subnormal, _LIFTED, 0.0)
    s = f / (2.0 + f)
    half = 0.5 * f * f
    value = k * _LN2_HIGH - ((half - (s * (half + s * s * _log_rest(s * s)) + k * _LN2_LOW)) - f)
    value = where(x > 0.0, where(x < math.inf, value, x), math.nan)
    return where(abs(x) <= 0.0, -math.inf, value)


@compiled
def power(x: Any, y: Any) -> Any:
    """x^y = exp(y log x) of x >= 0, to 2 + 2 |y log x| ulp; not a number below 0. In a law: `x**y`, or `pow(x, y)`."""
    base, to = x + zero_like(y), y + zero_like(x)
    of_zero = where(to > 0.0, 0.0, where(to < 0.0, math.inf, 1.0))
    return where(abs(base) <= 0.0, of_zero, exp(to * log(base)))


_MOST_FACTORS = 64


@overload(operator.pow, strict=False, prefer_literal=True)
@overload(pow, strict=False, prefer_literal=True)
def _of_lanes(x: Any, y: Any) -> Callable[[Any, Any], Any] | None:
    """Whole powers that are written out are products, of either sign of x; all others are `power`."""
    if not any(isinstance(argument, LaneType) for argument in (x, y)):
        return None
    if not isinstance(y, types.IntegerLiteral) or not 0 <= y.literal_value <= _MOST_FACTORS:
        return lambda x, y: power(x, y)
    count = y.literal_value

    def product(x: Any, y: Any) -> Any:  # a loop that unrolls
        result = 1.0 + zero_like(x)
        for _ in range(count):
            result = result * x
        return result

    return product


# atan(t)/t - 1 over t^2, in t^2, for |t| <= tan(pi/8)
_EIGHTH = math.sqrt(2.0) - 1.0
_arc_rest = polynomial(economised([Fraction((-1) ** k, 2 * k + 1) for k in range(1, 30)], Fraction(1716, 10000), 13))


@compiled
def atan2(y: Any, x: Any) -> Any:
    """Angle of the point (x, y) from the x axis, -pi to pi, to 2 ulp; 0 at the origin, and 0 has no sign.

    For sizes below 1e307: not a number of two infinities. The angle within pi/8 is added to the multiple of pi/4
    nearest to it at once, so that it is rounded once.
    """
    across, along = abs(y), abs(x)
    is_steep = across > along
    small, large = where(is_steep, along, across), where(is_steep, across, along)
    is_far = small > _EIGHTH * large
    below = where(is_far, small + large, large)
    t = where(is_far, small - large, small) / where(large <= 0.0, 1.0, below)
    angle = t + t * (t * t * _arc_rest(t * t))
    eighths = where(is_far, 1.0, 0.0)
    angle, eighths = where(is_steep, -angle, angle), where(is_steep, 2.0 - eighths, eighths)
    angle, eighths = where(x < 0.0, -angle, angle), where(x < 0.0, 4.0 - eighths, eighths)
    sum_of_both = eighths * (0.5 * _HALF_PI[0]) + (eighths * (0.5 * _HALF_PI[1]) + angle)
    return where(y < 0.0, -sum_of_both, sum_of_both)


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
