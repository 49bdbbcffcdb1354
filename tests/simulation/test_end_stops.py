"""End stops against SciPy's integration of the same equations, written out."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from tests.simulation.spools import spooled
from wristctl.arrays import Array
from wristctl.config.plant import Actuator, TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.wrist.compiled_model import terms
from wristctl.wrist.segments import segments
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST = WristParameters(damping=0.04)
SOFT = Actuator(level="tendon", tendon_stiffness=2e3, friction=0.0)
END, STOP_STIFFNESS, DISSIPATION = np.radians(12.0), 20.0, 4.0
STOP = TrueWrist(end_stop_deg=12.0, end_stop_stiffness=STOP_STIFFNESS, end_stop_dissipation=DISSIPATION)
LEG, STEP = 0.15, 5e-5


def damped(theta: Array, omega: Array) -> Array:
    return 1.0 + DISSIPATION * np.sign(theta) * omega


def contact(theta: Array, omega: Array) -> Array:
    """Hunt and Crossley's torque k d (1 + c d') of each segment's stop (n, ...), which only pushes back."""
    n = len(theta)
    depth = np.sign(theta) * np.maximum(np.abs(theta) - END / n, 0.0)
    return n * STOP_STIFFNESS * depth * np.maximum(damped(theta, omega), 0.0)


def leg(reeled: Array, begin: Array, force: float) -> Array:
    """Segment angles and rates (2 n, T + 1): M theta'' + C + G - J F + contact + K theta + D theta' = arms x pulls."""
    n = len(begin) // 2
    values = segments(WRIST, n, (0.0, force))

    def moving(_: float, state: Array) -> Array:
        theta, omega = state[:n], state[n:]
        here = terms(values, theta, omega)
        stretch = reeled - (WRIST.length - here.tendon_lengths.sum(axis=0))
        pulls = TENDONS_PER_SIDE * SOFT.tendon_stiffness * np.maximum(stretch, 0.0)
        passive = n * (WRIST.stiffness * theta + WRIST.damping * omega) + contact(theta, omega)
        return np.concatenate([omega, np.linalg.solve(here.mass, here.moment_arms @ pulls - here.bias - passive)])

    times = STEP * np.arange(round(LEG / STEP) + 1)
    found = solve_ivp(moving, (0.0, times[-1]), begin, "LSODA", times, rtol=1e-9, atol=1e-11)
    assert found.success
    states: Array = found.y
    return states


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("n", [1, 4])
@pytest.mark.slow
def test_a_wrist_that_is_thrown_and_pulled_from_one_stop_into_the_other_moves_as_scipy_has_it(
    n: int, sign: float
) -> None:
    """It is let go of so fast that the stop would hold it back, were contact to pull."""
    first, force = np.array([0.012, -0.01])[:: int(sign)], sign * 1.0
    rate = np.full(n, sign * 8.0 / n)
    one = leg(first, np.concatenate([np.zeros(n), rate]), force)
    two = leg(first[::-1], one[:, -1], force)
    reeled = np.repeat([first, first[::-1]], round(LEG / STEP), axis=0)
    done = spooled(reeled, SOFT, plant=STOP, wrist=WRIST, h=STEP, n=n, rate=rate, force=force)
    course = np.concatenate([one[:, :-1], two[:, :-1]], axis=1)
    theta, omega = course[:n], course[n:]
    np.testing.assert_allclose(done.theta, theta.sum(axis=0), rtol=0.0, atol=1e-5)
    deep = np.abs(theta) - END / n
    for side in (1.0, -1.0):
        assert (deep * (side * theta > 0.0)).max(axis=1).min() > np.radians(1.0) / n, "each segment is pressed into it"
    assert damped(theta, omega)[deep > 0.0].min() < 0.0
