"""Series of E_n(x) = j_n(x)/x^n in x^2, spherical Bessel functions over powers: coefficients, lowest power first."""

import math
from fractions import Fraction

_REACH = 10
"""The series hold for x^2 up to this: a little more than pi^2."""


def _series(order: int, terms: int) -> tuple[float, ...]:
    """Taylor's series economised to as few terms.

    Lanczos: as long as there are more, take off the multiple of Chebyshev's polynomial on 0 to _REACH that takes off
    the highest term. That spreads its error over the interval, where 15 terms of Taylor's would be needed.
    """
    rest = [Fraction(1, math.prod(range(1, 2 * order + 2, 2)))]
    for k in range(16):
        rest.append(-_REACH * rest[-1] / (2 * (k + 1) * (2 * order + 2 * k + 3)))
    while len(rest) > terms:
        chebyshev = _shifted_chebyshev(len(rest) - 1)
        share = rest[-1] / chebyshev[-1]
        rest = [own - share * other for own, other in zip(rest, chebyshev, strict=True)][:-1]
    return tuple(float(coefficient / _REACH**k) for k, coefficient in enumerate(rest))


def _shifted_chebyshev(n: int) -> list[int]:
    """Coefficients of T_n(2 u - 1), lowest first, which is T_2n(sqrt(u))."""
    signed = ((-1) ** (n - k) * 4**k * math.comb(n + k, 2 * k) for k in range(n + 1))
    return [value * n // (n + k) for k, value in enumerate(signed)]


E2, E3 = _series(2, 10), _series(3, 11)
"""To 1e-16 of their value at 0, as doubles."""
