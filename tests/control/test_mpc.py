"""The plan of `mpc` against OSQP's solution of the same programme."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import osqp
import pytest
from scipy import sparse

from tests.control.test_laws import inertia_and_load, torque
from wristctl.config.wrist import WristParameters
from wristctl.control.disturbance_observer import VALUES
from wristctl.control.law import NOW, now_of, signals_of
from wristctl.control.model import one_segment_terms
from wristctl.control.mpc import HORIZON, MPC, TURNS, plan
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import rows_of
from wristctl.wrist.segments import load_segments, segments
from wristctl.wrist.tendons import reach

WRIST = WristParameters()
LIMITS = np.array([2.0 * WRIST.pretension, 2.0 * WRIST.tension_limit])


@kernel
def _plan(now: Any, values: Any, kept: Any, turns: int, out: Any) -> None:
    value, found = rows_of(values), rows_of(out)
    start, weights, box = (value[0], value[1]), (value[2], value[3]), (value[4], value[5])
    found[0] = plan(now_of(now), start, weights, box, rows_of(kept), turns)


@kernel
def _reached(wrist: Any, limits: Any, values: Any, out: Any) -> None:
    known, limit, found, theta = load_segments(rows_of(wrist)), rows_of(limits), rows_of(out), rows_of(values)[0]
    found[0], found[1] = reach(theta, known, limit[0], limit[1])
    found[2], _, found[3] = one_segment_terms(known, theta)


class Problem(NamedTuple):
    """What the law sees (signals,), and state, weights and box (6,); the inertia turns accelerations into torques."""

    now: np.ndarray
    values: np.ndarray
    inertia: float


def problem(rng: np.random.Generator) -> Problem:
    """A state off a sine, anywhere in the wrist's range, and what tendons reach there."""
    now, period = np.zeros(signals_of(HORIZON)), float(rng.choice([1e-3, 2e-3, 5e-3, 1e-2]))
    now[NOW.index("period")] = period
    w, time = 2.0 * np.pi * rng.uniform(0.2, 2.0), np.arange(HORIZON + 1) * period
    phase, size = w * time + rng.uniform(0.0, 6.3), rng.uniform(-0.7, 0.7)
    course = size * np.stack([np.sin(phase), w * np.cos(phase), -w * w * np.sin(phase)], axis=1)
    now[2:5], now[len(NOW) :] = course[0], course[1:].ravel()
    angle, rate = np.clip(course[0, 0] + rng.normal(0.0, 0.3), -0.87, 0.87), course[0, 1] + rng.normal(0.0, 3.0)
    found = np.zeros(4)
    _reached(segments(WRIST, 1), LIMITS, np.array([angle]), found)
    low, high, inertia, gravity = found
    load = gravity + WRIST.damping * rate + WRIST.stiffness * angle
    box = (low - load) / inertia, (high - load) / inertia
    weights = float(rng.choice([20.0, 50.0, 100.0])), float(rng.choice([0.8, 1.0, 1.5]))
    return Problem(now, np.array([angle, rate, *weights, *box]), inertia)


def planned(given: Problem, turns: int) -> float:
    out = np.zeros(1)
    _plan(given.now, given.values, np.zeros(2 * HORIZON), turns, out)
    return float(out[0])


def optimal(given: Problem) -> np.ndarray:
    """All accelerations of the condensed programme, by OSQP."""
    angle, rate, w, zeta, low, high = given.values
    h = given.now[NOW.index("period")]
    course = given.now[len(NOW) :].reshape(HORIZON, 3)
    step, push = np.array([[1.0, h], [0.0, 1.0]]), np.array([0.5 * h * h, h])
    free = np.concatenate([np.linalg.matrix_power(step, k + 1) @ [angle, rate] for k in range(HORIZON)])
    forced = np.zeros((2 * HORIZON, HORIZON))
    for k in range(HORIZON):
        for j in range(k + 1):
            forced[2 * k : 2 * k + 2, j] = np.linalg.matrix_power(step, k - j) @ push
    cost = np.kron(np.eye(HORIZON), h * np.diag([w**4, (4.0 * zeta**2 - 2.0) * w**2]))
    cost[-2:, -2:] = [[2.0 * zeta * w**3, w**2], [w**2, 2.0 * zeta * w]]
    wished = np.append(given.now[4], course[:-1, 2])
    hessian = forced.T @ cost @ forced / h + np.eye(HORIZON)
    linear = forced.T @ cost @ (free - course[:, :2].ravel()) / h - wished
    solver = osqp.OSQP()
    solver.setup(
        sparse.csc_matrix(np.triu(hessian)), linear, sparse.eye(HORIZON, format="csc"), np.full(HORIZON, low),
        np.full(HORIZON, high), verbose=False, eps_abs=1e-10, eps_rel=1e-10, max_iter=100_000,
    )  # fmt: skip
    found: np.ndarray = solver.solve(raise_error=True).x
    return found


@pytest.mark.slow
def test_a_plan_is_the_optimum_and_nearly_so_after_its_fixed_turns() -> None:
    rng, constrained = np.random.default_rng(0), 0
    for _ in range(1000):
        given = problem(rng)
        best, (low, high) = optimal(given), given.values[4:]
        reached = given.inertia * (high - low)
        assert given.inertia * abs(planned(given, 3000) - best[0]) < 1e-6
        assert given.inertia * abs(planned(given, TURNS) - best[0]) < 0.01 * reached
        constrained += bool(np.any((best < low + 1e-6 * reached) | (best > high - 1e-6 * reached)))
    assert constrained >= 300


@pytest.mark.parametrize("zeta", [0.8, 1.5])
def test_an_unconstrained_plan_is_the_linear_law(zeta: float) -> None:
    """A horizon's end that costs what an endless one would makes its length nothing, as far as periods are short."""
    now = np.zeros(signals_of(HORIZON))
    now[NOW.index("period")] = 1e-5
    given = Problem(now, np.array([0.1, -0.3, 50.0, zeta, -1e9, 1e9]), 1.0)
    assert planned(given, 2000) == pytest.approx(-2.0 * zeta * 50.0 * -0.3 - 50.0**2 * 0.1, rel=2e-3)


@pytest.mark.parametrize("load", [-0.3, 0.0, 0.3])
@pytest.mark.parametrize("theta", [-0.5, 0.5])
def test_a_law_that_wants_all_gets_what_tendons_reach_whatever_load_it_makes_out(theta: float, load: float) -> None:
    """M v + load of the model - d, at either end of the box of v, is the end of what tendons reach."""
    rate, ends = -0.4, {"torque_low": -0.9, "torque_high": 0.7}
    inertia, modelled = inertia_and_load(theta, rate)
    memory = np.zeros(MPC.memory)
    memory[:VALUES] = load, inertia * rate, 1.0  # the momentum is what that load makes it
    wanted = torque("mpc", (100.0, 1.0, 50.0), memory, theta=theta, rate=rate, period=5e-3, **ends)
    assert memory[0] == pytest.approx(load, abs=1e-12)
    assert wanted == pytest.approx(ends["torque_low" if theta > 0.0 else "torque_high"], rel=1e-9)
    v = (wanted - modelled + load) / inertia
    least, most = ((ends[each] - modelled + load) / inertia for each in ("torque_low", "torque_high"))
    assert least * (1.0 + 1e-9) <= v <= most * (1.0 + 1e-9) and abs(v) < 100.0**2 * abs(theta)
