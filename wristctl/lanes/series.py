"""Power series of elementary functions, in as few terms as their accuracy needs; plain Python, without numba."""

import math
from collections.abc import Sequence
from fractions import Fraction

# The series of `bessel` hold for x^2 up to this: a little more than pi^2.
SERIES_REACH = 10


def _bessel_series(order: int, terms: int) -> tuple[float, ...]:
    """Taylor's series of E_n in x^2, economised to as few terms."""
    coefficients = [Fraction(1, math.prod(range(1, 2 * order + 2, 2)))]
    for k in range(16):
        coefficients.append(-coefficients[-1] / (2 * (k + 1) * (2 * order + 2 * k + 3)))
    return economised(coefficients, Fraction(SERIES_REACH), terms)


def economised(series: Sequence[Fraction], reach: Fraction, terms: int) -> tuple[float, ...]:
    """A power series for 0 to `reach`, economised to as few terms.

    Lanczos: as long as there are more, take off the multiple of Chebyshev's polynomial on that interval that takes off
    the highest term. That spreads its error over the interval, where Taylor's series needs half as many terms again.
    """
    coefficients = [coefficient * reach**k for k, coefficient in enumerate(series)]
    while len(coefficients) > terms:
        chebyshev = _shifted_chebyshev(len(coefficients) - 1)
        share = coefficients[-1] / chebyshev[-1]
        coefficients = [
            coefficient - share * chebyshev_coefficient
            for coefficient, chebyshev_coefficient in zip(coefficients, chebyshev, strict=True)
        ][:-1]
    return tuple(float(coefficient / reach**k) for k, coefficient in enumerate(coefficients))


def _shifted_chebyshev(n: int) -> list[int]:
    """Coefficients of T_n(2 u - 1), lowest first, which is T_2n(sqrt(u))."""
    signed = ((-1) ** (n - k) * 4**k * math.comb(n + k, 2 * k) for k in range(n + 1))
    return [value * n // (n + k) for k, value in enumerate(signed)]


# To 1e-16 of their value at 0, as doubles.
E2, E3 = _bessel_series(2, 10), _bessel_series(3, 11)
