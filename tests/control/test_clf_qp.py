"""The programme of `clf-qp` against scipy's bounded least squares, and what its Lyapunov function promises."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
import pytest
from scipy.optimize import lsq_linear

from tests.control.test_laws import inertia_and_load, torque
from wristctl.control.clf_qp import CLF_QP, least_acceleration
from wristctl.lanes.compiled import kernel
from wristctl.lanes.rows import part, rows_of


@kernel
def _solve(values: Any, arms: Any, room: Any, out: Any, planes: Any, places: Any, both: Any) -> None:
    given, found = rows_of(values), part(rows_of(out), 0, planes)
    slope, base = part(given, 2, planes), part(given, 2 + len(planes), planes)
    levers, limits = part(rows_of(arms), 0, both), part(rows_of(room), 0, places)
    least_acceleration(given[0], slope, given[1], base, levers, limits, found)


class Programme(NamedTuple):
    """|m|^2 + price max(0, decay + slope.m)^2, least over m = base + arms s with s from 0 to room."""

    decay: float
    price: float
    slope: np.ndarray
    base: np.ndarray
    arms: np.ndarray
    room: np.ndarray

    def cost(self, m: np.ndarray) -> float:
        return float(m @ m + self.price * max(0.0, self.decay + self.slope @ m) ** 2)

    def solved(self) -> np.ndarray:
        planes, places = self.arms.shape
        out, given = np.zeros(planes), np.array([self.decay, self.price, *self.slope, *self.base])
        tuples = [(0,) * count for count in (planes, places, planes * places)]
        _solve(given, self.arms.ravel(), self.room, out, *tuples)
        return out

    def by_scipy(self) -> np.ndarray:
        """With a surplus of at least 0 beside the decay, its square is that of the positive part."""
        root, places = np.sqrt(self.price), len(self.room)
        rows = np.vstack([np.c_[self.arms, np.zeros(len(self.base))], root * np.append(self.slope @ self.arms, 1.0)])
        wanted = -np.append(self.base, root * (self.decay + self.slope @ self.base))
        bounds = np.zeros(places + 1), np.append(self.room, np.inf)
        found = lsq_linear(rows, wanted, bounds, method="bvls", tol=1e-14, max_iter=500)
        answer: np.ndarray = self.base + self.arms @ np.clip(found.x[:places], 0.0, self.room)
        return answer


def drawn(rng: np.random.Generator, planes: int, places: int) -> Programme:
    """Tendons evenly around, or anywhere, that can pull toward every side or not."""
    angles = 2.0 * np.pi * np.arange(places) / places if rng.random() < 0.5 else rng.uniform(0.0, 6.3, places)
    arms = np.array([np.cos(angles), np.sin(angles)])[:planes] * rng.uniform(0.5, 2.0)
    room = rng.uniform(0.1, 3.0, places)
    slope, base = rng.normal(0.0, 1.0, planes), rng.normal(0.0, 1.0, planes)
    return Programme(rng.normal(0.0, 2.0), 10.0 ** rng.uniform(-1.0, 3.0), slope, base, arms, room)


@pytest.mark.parametrize("planes", [1, 2])
@pytest.mark.parametrize("places", [2, 3, 4, 6])
def test_the_programme_is_solved_as_scipy_solves_it(planes: int, places: int) -> None:
    rng, limited = np.random.default_rng(places), 0
    for _ in range(250):
        given = drawn(rng, planes, places)
        found, expected = given.solved(), given.by_scipy()
        least = given.cost(expected)
        assert given.cost(found) == pytest.approx(least, rel=1e-7, abs=1e-10)
        np.testing.assert_allclose(found, expected, atol=1e-4 * (1.0 + np.sqrt(least)))
        free = -given.price * max(given.decay, 0.0) * given.slope / (1.0 + given.price * given.slope @ given.slope)
        limited += given.cost(found) > given.cost(free) * (1.0 + 1e-6) + 1e-9
    assert 20 < limited < 250


def lyapunov(error: float, rate: float, w: float, zeta: float) -> float:
    return 2.0 * zeta * w**3 * error**2 + 2.0 * w**2 * error * rate + 2.0 * zeta * w * rate**2


@pytest.mark.parametrize("error", [-0.4, 0.02, 0.4])
@pytest.mark.parametrize("rate", [-3.0, 0.5, 3.0])
@pytest.mark.parametrize("decay", [1.0, 60.0])
def test_the_lyapunov_function_falls_as_fast_as_asked(error: float, rate: float, decay: float) -> None:
    """With an exact model and no limits V' is the smaller of -lambda V and what it is under the regulator."""
    w, zeta = 20.0, 1.0
    gains = CLF_QP.values({"w": w, "zeta": zeta, "lambda": decay, "slack": 1e-7, "wo": 1e-1})
    torque_wanted = torque("clf-qp", gains, theta=0.1 + error, rate=rate, theta_ref=0.1, acceleration_ref=2.0)
    inertia, load = inertia_and_load(0.1 + error, rate)
    acceleration = (torque_wanted - load) / inertia - 2.0
    by_itself = 4.0 * zeta * w**3 * error * rate + 2.0 * w**2 * rate**2
    falls = by_itself + (2.0 * w**2 * error + 4.0 * zeta * w * rate) * acceleration
    regulator = -(w**2) * error - 2.0 * zeta * w * rate
    regulated = by_itself + (2.0 * w**2 * error + 4.0 * zeta * w * rate) * regulator
    wanted = min(-decay * lyapunov(error, rate, w, zeta), regulated)
    assert falls == pytest.approx(wanted, rel=1e-5)
    assert (acceleration == pytest.approx(regulator)) == (wanted == regulated)


def test_beyond_what_tendons_give_it_asks_for_all_that_they_give() -> None:
    gains = CLF_QP.values(CLF_QP.presets["default"])
    for error, end in ((0.5, -0.3), (-0.5, 0.2)):
        wanted = torque("clf-qp", gains, theta=error, torque_low=-0.3, torque_high=0.2)
        assert wanted == pytest.approx(end, rel=1e-12)
