"""Between ticks the linear loop is the continuous wrist under what is held: a matrix exponential, written out here."""

from __future__ import annotations

import math
from typing import Any

import control
import numpy as np
import pytest
import scipy.linalg

from tests.stability.conftest import LAGGED, TENDON, linear
from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.stability.margins import margins
from wristctl.wrist.compiled_model import linearised, terms
from wristctl.wrist.segments import segments
from wristctl.wrist.statics import equilibria_at
from wristctl.wrist.tendons import TENDONS_PER_SIDE

WRIST = WristParameters()
LOW = TENDONS_PER_SIDE * WRIST.pretension
ACTUATORS = {"ideal": Actuator(), "lagged": LAGGED, "tendon": TENDON.model_copy(update={"friction": 0.0})}
SOFT, HARD = {"Kp": 1.0, "Ki": 2.0, "Kd": 0.05}, {"Kp": 10.0, "Ki": 20.0, "Kd": 0.5}


def _pulls(torque: float, theta: float) -> Array:
    """Pulls of both sides [N] that one segment needs for a torque, the lesser at pretension (E10)."""
    plus, minus = terms(segments(WRIST, 1), [theta], [0.0]).moment_arms[0]
    if torque > (plus + minus) * LOW:
        return np.array([(torque - minus * LOW) / plus, LOW])
    return np.array([LOW, (torque - plus * LOW) / minus])


def _slope(of: Any, at: float) -> Array:
    return np.asarray((of(at + 1e-6) - of(at - 1e-6)) / 2e-6)


def _continuous(n: int, theta: float, stiffness: float) -> tuple[Array, Array, float]:
    """A (2n, 2n) and B (2n, 2) of the wrist at rest, by angles and rates and by both sides' pulls, and its torque."""
    values, still = segments(WRIST, n), np.zeros(n)
    rest = equilibria_at(values[None], n, np.array([theta]), LOW)
    angles, pulls = rest.theta[0], rest.pulls[0]
    own = terms(values, angles, still)
    _, by_angle, by_rate = linearised(values, angles, still, still, pulls)
    by_angle = by_angle + stiffness * own.moment_arms @ own.moment_arms.T
    falling = np.linalg.solve(own.mass, np.hstack([-by_angle, -by_rate]))
    a = np.vstack([np.hstack([np.zeros((n, n)), np.eye(n)]), falling])
    b = np.vstack([np.zeros((n, 2)), np.linalg.solve(own.mass, own.moment_arms)])
    return a, b, float(terms(segments(WRIST, 1), [theta], [0.0]).moment_arms[0] @ pulls)


def _open_loop(n: int, period: float, theta: float, gains: dict[str, float], level: str) -> tuple[Array, Array, Array]:
    """(A, B, C) of the PID loop cut at its torque: what comes back is minus C x."""
    actuator = ACTUATORS[level]
    stiffness = TENDONS_PER_SIDE * actuator.tendon_stiffness * (level == "tendon")
    a, b, torque = _continuous(n, theta, stiffness)
    held = scipy.linalg.expm(period * np.block([[a, b], [np.zeros((2, 2 * n + 2))]]))
    np.testing.assert_allclose(held[: 2 * n], np.hstack(_by_python_control(a, b, period)), rtol=1e-9, atol=1e-12)
    phi, gamma = held[: 2 * n, : 2 * n], held[: 2 * n, 2 * n :]
    angle, rate = np.repeat([1.0, 0.0], n), np.repeat([0.0, 1.0], n)
    by_torque = _slope(lambda value: _pulls(value, theta), torque)
    by_angle = np.outer(_slope(lambda value: _pulls(torque, value), theta), angle)
    share = period / (actuator.lag + period) if level == "lagged" else 1.0
    acts = 0.5 if level == "tendon" else share  # a spool is held in the middle of its way
    x = 2 * n
    whole, into = np.zeros((x + 3, x + 3)), np.zeros(x + 3)
    whole[:x, :x], into[:x] = phi + acts * gamma @ by_angle, acts * gamma @ by_torque  # pulls that act at once
    whole[x : x + 2, :x], into[x : x + 2] = share * by_angle, share * by_torque
    whole[:x, x : x + 2], whole[x : x + 2, x : x + 2] = (1.0 - acts) * gamma, (1.0 - share) * np.eye(2)
    whole[-1, :x], whole[-1, -1] = period * angle, 1.0
    back = np.concatenate([(gains["Kp"] + period * gains["Ki"]) * angle + gains["Kd"] * rate, [0.0, 0.0, gains["Ki"]]])
    return whole, into, back


def _by_python_control(a: Array, b: Array, period: float) -> tuple[Array, Array]:
    held = control.c2d(control.ss(a, b, np.eye(len(a)), 0.0), period, "zoh")
    return np.asarray(held.A), np.asarray(held.B)


CASES = [
    (n, period, degrees, gains, level)
    for n, level in ((1, "ideal"), (4, "ideal"), (4, "lagged"), (4, "tendon"))
    for period, degrees, gains in ((1e-3, 0.0, HARD), (1e-3, 30.0, SOFT), (5e-3, -20.0, HARD), (1e-2, 30.0, SOFT))
]


@pytest.mark.parametrize(("n", "period", "degrees", "gains", "level"), CASES)
def test_margins_are_those_of_the_exact_hold(
    n: int, period: float, degrees: float, gains: dict[str, float], level: str
) -> None:
    loop = Loop(plant_segments=n, control_period=period, actuator=ACTUATORS[level])
    found = margins(linear("pid", gains, loop, degrees).closed)
    whole, into, back = _open_loop(n, period, math.radians(degrees), gains, level)
    inner, outer = (
        np.abs(np.linalg.eigvals(whole - found.most.value * share * np.outer(into, back))).max()
        for share in (1.0 - 2e-6, 1.0 + 2e-6)
    )
    assert inner < 1.0 < outer
    own = control.ss(whole, into[:, None], back[None], 0.0, period)
    omega = np.linspace(1e-3, math.pi, 4000) / period
    amplified = np.abs(1.0 / (1.0 + own(np.exp(1j * np.append(omega, found.sensitivity.omega) * period))))
    assert amplified[-1] == pytest.approx(found.sensitivity.value, rel=1e-6)
    assert amplified.max() <= found.sensitivity.value * (1.0 + 1e-6)
    for crossed in found.gain_crossings:
        assert abs(own(np.exp(1j * crossed.omega * period))) == pytest.approx(1.0, rel=1e-6)


def test_a_pid_at_1_ms_bears_as_much_gain_as_two_other_programs_say() -> None:
    """One integration step a tick put the limit at 2.87 and Ms at 1.53."""
    found = margins(linear("pid", HARD, Loop()).closed)
    assert (found.most.value, found.sensitivity.value) == pytest.approx((3.2340, 1.4476), abs=1e-4)


@pytest.mark.parametrize("level", ACTUATORS)
@pytest.mark.slow
def test_the_linear_loop_is_the_same_whatever_steps_it_is_simulated_with(level: str) -> None:
    loop = Loop(control_period=5e-3, actuator=ACTUATORS[level])
    found = [margins(linear("pid", SOFT, loop.model_copy(update={"substeps": each}), 15.0).closed) for each in (1, 50)]
    assert found[0].most.value == pytest.approx(found[1].most.value, rel=1e-6)
    assert found[0].delay == pytest.approx(found[1].delay, rel=1e-6)
