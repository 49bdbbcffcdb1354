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
    x, angle, rate = 2 * n, np.repeat([1.0, 0.0], n), np.repeat([0.0, 1.0], n)
    by_torque = _slope(lambda value: _pulls(value, theta), torque)
    by_angle = np.outer(_slope(lambda value: _pulls(torque, value), theta), angle)
    if level == "tendon":
        motion, driven = _by_spools(a, b, period, by_angle, by_torque)
    else:
        motion, driven = _by_pulls(a, b, period, by_angle, by_torque, actuator.lag if level == "lagged" else 0.0)
    size = len(motion)
    whole, into = np.zeros((size + 1, size + 1)), np.append(driven, 0.0)
    whole[:size, :size] = motion
    whole[-1, :x], whole[-1, -1] = period * angle, 1.0
    back = np.zeros(size + 1)
    back[:x], back[-1] = (gains["Kp"] + period * gains["Ki"]) * angle + gains["Kd"] * rate, gains["Ki"]
    return whole, into, back


def _by_pulls(a: Array, b: Array, period: float, by_angle: Array, by_torque: Array, lag: float) -> tuple[Array, Array]:
    """A tick of wrist and pulls, which follow their commands with a lag [s], and what a torque does in it."""
    x = len(a)
    held = scipy.linalg.expm(period * np.block([[a, b], [np.zeros((2, x + 2))]]))
    np.testing.assert_allclose(held[:x], np.hstack(_by_python_control(a, b, period)), rtol=1e-9, atol=1e-12)
    phi, gamma, share = held[:x, :x], held[:x, x:], period / (lag + period)
    whole, into = np.zeros((x + 2, x + 2)), np.zeros(x + 2)
    whole[:x, :x], into[:x] = phi + share * gamma @ by_angle, share * gamma @ by_torque  # pulls that act at once
    whole[x:, :x], into[x:] = share * by_angle, share * by_torque
    whole[:x, x:], whole[x:, x:] = (1.0 - share) * gamma, (1.0 - share) * np.eye(2)
    return whole, into


def _by_spools(a: Array, b: Array, period: float, by_angle: Array, by_torque: Array) -> tuple[Array, Array]:
    """A tick of wrist, spools (as the pulls that they stretch tendons by) and the rates sent before, newest first.

    A rate takes effect after the board's delay. It is to bring the spool to its target a period after that.
    """
    x, late = len(a), TENDON.command_delay + 0.5 * TENDON.update
    ticks = int(late // period)
    since = late - ticks * period
    flow, one = np.zeros((x + 4, x + 4)), np.eye(2)
    flow[:x, :x], flow[:x, x : x + 2], flow[x : x + 2, x + 2 :] = a, b, one
    sent = [slice(x + 2 + 2 * k, x + 4 + 2 * k) for k in range(ticks + 1)]
    size = x + 4 + 2 * ticks
    newest = np.zeros((2, size))
    newest[:, :x], newest[:, x : x + 2], newest[:, sent[-1]] = by_angle, -one, -since * one
    for rate in sent[:-1]:
        newest[:, rate] = -period * one
    newest /= period
    before = np.zeros((x + 4, size))
    before[: x + 2, : x + 2], before[x + 2 :, sent[-1]] = np.eye(x + 2), one
    between, driven = scipy.linalg.expm(since * flow) @ before, np.zeros(x + 4)
    between[x + 2 :] = np.eye(size)[sent[-2]] if ticks else newest
    if not ticks:
        driven[x + 2 :] = by_torque / period
    rest = scipy.linalg.expm((period - since) * flow)
    whole, into = np.zeros((size, size)), np.zeros(size)
    whole[: x + 2], into[: x + 2] = (rest @ between)[: x + 2], (rest @ driven)[: x + 2]
    whole[sent[0]], into[sent[0]] = newest, by_torque / period
    for older, rate in zip(sent[1:], sent[:-1], strict=True):
        whole[older, rate] = one
    return whole, into


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
    within = 1e-3 if level == "tendon" else 2e-6  # its spools turn on step by step
    inner, outer = (
        np.abs(np.linalg.eigvals(whole - found.most.value * share * np.outer(into, back))).max()
        for share in (1.0 - within, 1.0 + within)
    )
    assert inner < 1.0 < outer
    own = control.ss(whole, into[:, None], back[None], 0.0, period)
    omega = np.linspace(1e-3, math.pi, 4000) / period
    amplified = np.abs(1.0 / (1.0 + own(np.exp(1j * np.append(omega, found.sensitivity.omega) * period))))
    assert amplified[-1] == pytest.approx(found.sensitivity.value, rel=within)
    assert amplified.max() <= found.sensitivity.value * (1.0 + within)
    for crossed in found.gain_crossings:
        assert abs(own(np.exp(1j * crossed.omega * period))) == pytest.approx(1.0, rel=within)


def test_a_pid_at_1_ms_bears_as_much_gain_as_two_other_programs_say() -> None:
    """One integration step a tick put the limit at 2.87 and Ms at 1.53."""
    found = margins(linear("pid", HARD, Loop()).closed)
    assert (found.most.value, found.sensitivity.value) == pytest.approx((3.2340, 1.4476), abs=1e-4)


@pytest.mark.parametrize("level", ACTUATORS)
@pytest.mark.slow
def test_the_linear_loop_is_the_same_whatever_steps_it_is_simulated_with(level: str) -> None:
    loop = Loop(control_period=5e-3, actuator=ACTUATORS[level])
    found = [margins(linear("pid", SOFT, loop.model_copy(update={"substeps": each}), 15.0).closed) for each in (1, 50)]
    within = 3e-4 if level == "tendon" else 1e-6  # a spool that turns on in the period does so step by step
    assert found[0].most.value == pytest.approx(found[1].most.value, rel=within)
    assert found[0].delay == pytest.approx(found[1].delay, rel=within)
