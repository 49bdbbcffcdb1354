from __future__ import annotations

import mpmath
import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from wristctl.wrist.kinematics import arc_path, arc_tip, exact_arc


@pytest.mark.parametrize("theta", [0.0, 1e-300, 1e-9, -3e-5, 0.5, -0.87, 3.0])
def test_arc_tip_matches_e1_in_forty_digits(theta: float) -> None:
    with mpmath.workdps(40):
        t, length = mpmath.mpf(theta), mpmath.mpf(0.08)
        if theta == 0.0:
            wanted = (0.08, 0.0)
        else:
            wanted = (float(length * mpmath.sin(t) / t), float(length * 2 * mpmath.sin(t / 2) ** 2 / t))
    np.testing.assert_allclose(arc_tip(np.array(theta), np.array(0.08)), wanted, rtol=1e-15, atol=0.0)


@given(q=st.tuples(*[st.floats(-2.0, 2.0)] * 3), r=st.tuples(st.floats(0.04, 0.12), *[st.floats(-0.5, 0.5)] * 2))
@example(q=(0.0, 0.0, 0.0), r=(0.08, 0.1, -0.2))
@example(q=(0.0, 1.0, -0.3), r=(0.08, 0.0, 0.0))
def test_velocity_and_acceleration_of_an_arcs_tip_are_its_derivatives(
    q: tuple[float, ...], r: tuple[float, ...]
) -> None:
    """Numerical ones, in thirty digits, of r (exp(i q) - 1)/(i q)."""

    def place(t: mpmath.mpf) -> mpmath.mpc:
        angle, length = (v[0] + t * (v[1] + t * v[2] / 2) for v in (q, r))
        return length * (mpmath.expm1(1j * angle) / (1j * angle) if angle else 1)

    path = arc_path(*(np.array(each)[:, None] for each in (q, r)))
    with mpmath.workdps(30):
        for order, found in enumerate((path.position, path.velocity, path.acceleration)):
            wanted = complex(mpmath.diff(place, 0, order))
            np.testing.assert_allclose(found[0], [wanted.real, wanted.imag], rtol=1e-12, atol=1e-14)


def test_exact_arc_undoes_arc_tip() -> None:
    theta, length = np.array([-3.0, -0.5, 0.0, 1e-9, 2.0]), np.array([0.07, 0.08, 0.09, 0.08, 0.1])
    back = exact_arc(arc_tip(theta, length))
    np.testing.assert_allclose(back[0], theta, rtol=0, atol=1e-15)
    np.testing.assert_allclose(back[1], length, rtol=1e-14)
