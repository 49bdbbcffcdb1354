"""Nonlinear least squares of the forward model's angle against the marker's, at the times of the frames."""

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.identification.measured_trials import MeasuredTrial, frame_noise
from wristctl.identification.problem import SPOOL, Coordinate, Problem, spool_zero
from wristctl.processes import cores

# Steps of the finite differences, in parameters and in spools [m]. Where a tendon becomes taut one integration step
# earlier, the bend jumps by some 1e-6 rad: few steps this small meet such a jump, and hardly one on both sides.
_NUDGE, _NUDGE_M = 1e-6, 1e-8
# Evaluations of one search; 10 to 20 are usual.
_MOST = 200
# Evaluations after which several beginnings are compared, and part of the best's chi-square by which others that go on
# may have more.
_FEW, _CLOSE = 12, 0.05
# Chi-square by the parabola through a minimum below which another end is the same minimum.
_APART = 4.0
# Linearisations of so many last points are kept.
_KEPT = 4


# Least noise of a marker's angle [rad].
_LEAST_NOISE = 1e-6


@dataclass(frozen=True)
class Linearisation:
    """The angles that the model expects in the frames, and their derivatives by the coordinates."""

    expected: list[Array]
    """Expected angles of every trial (F,) [rad], the camera's zero included."""
    slopes: list[Array]
    """Derivatives of every trial's angles (F, coordinates)."""


def linearise(problem: Problem, x: Array) -> Linearisation:
    """Expected angles and their derivatives at coordinates x; the finite differences are lanes beside the angles.

    Of the differences to either side the smaller one counts: a bend that jumps makes a difference too large. Stiffness,
    damping and tendons that grow together hardly change a bend that spools prescribe, so that a jump in one of their
    columns would look like knowledge of all three.
    """
    coordinates = problem.coordinates
    low, _ = problem.bounds()

    def one(trial: MeasuredTrial) -> tuple[Array, Array]:
        moved = [Coordinate(name) for name in problem.free if name != "delay"]
        moved += [spool_zero(trial, tendon) for tendon in trial.tendons]
        columns = np.array([coordinates[coordinate] for coordinate in moved])
        nudges = np.array([_NUDGE_M if coordinate.kind == SPOOL else _NUDGE for coordinate in moved])
        # of a parameter at its lower end there is one side alone
        backward = np.where(x[columns] - nudges < low[columns], nudges, -nudges)
        nudged = np.tile(x, (2 * len(moved), 1))
        nudged[np.arange(len(nudged)), np.tile(columns, 2)] += np.concatenate([nudges, backward])
        bends, delay = problem.courses(trial, (x, *nudged)), problem.delay(trial, x)
        course = problem.viewed(trial, bends, x)
        expected, *near = (trial.shown(angle, delay) for angle in course)
        slopes = np.zeros((len(expected), len(x)))
        sides = (np.array(near) - expected) / np.concatenate([nudges, backward])[:, None]
        forth, back = sides[: len(moved)], sides[len(moved) :]
        slopes[:, columns] = np.where(abs(forth) < abs(back), forth, back).T
        delays = [*[Coordinate("delay")] * ("delay" in problem.free), *problem.clocks(trial)]
        if delays:
            h = problem.settings.step
            early, late = (trial.shown(course[0], delay - shift) for shift in (-h, h))
            slopes[:, [coordinates[each] for each in delays]] = ((early - late) / (2.0 * h))[:, None]
        for view in problem.views(trial):
            alone = np.arange(len(x)) == coordinates[view]
            slopes[:, coordinates[view]] = trial.shown(problem.viewed(trial, bends[0], alone) - bends[0], delay)
        for zero, share in problem.zeros(trial).items():
            slopes[:, coordinates[zero]] = share
            expected = expected + share * x[coordinates[zero]]
        return expected, slopes

    with ThreadPoolExecutor(cores()) as pool:
        columns = list(pool.map(one, problem.trials))
    return Linearisation([each for each, _ in columns], [each for _, each in columns])


class Rival(NamedTuple):
    """Coordinates where another search ended, and by how much more chi-square [1] than the best one."""

    x: Array
    excess: float


@dataclass(frozen=True)
class Fit:
    """Result of a search over a wrist's parameters."""

    problem: Problem
    x: Array
    noise: float
    """Standard deviation of the residuals [rad]."""
    residuals: list[Array]
    """Marker's less expected angle, of each trial (F,) [rad]."""
    slopes: list[Array]
    evaluations: int
    rivals: tuple[Rival, ...] = ()
    """Other minima, where searches ended that began elsewhere."""

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, found or fixed."""
        return self.problem.values(self.x)


def fit(problem: Problem) -> Fit:
    """The coordinates of least squares, with what is known beforehand counting by its own standard deviation.

    Where the residuals are not of the size that they were weighed with, the search goes on from there with their own.
    Of several beginnings the best after a few evaluations goes on, and those that are nearly as good.
    BLAS has one thread: on matrices this small its others only wait for each other, on cores that simulate.
    """
    search = _Search(problem)
    noise = max(frame_noise([trial.angle for trial in problem.trials]), _LEAST_NOISE)
    begins = [np.clip(x, *problem.bounds()) for x in problem.begins()]
    with threadpool_limits(limits=1, user_api="blas"):
        if len(begins) > 1:
            begins = sorted((search.descend(x, noise, _FEW) for x in begins), key=lambda x: search.cost(x, noise))
        first, *others = begins
        minima = [search.settle(first, noise)]
        (x, noise), *_ = minima
        for rival in search.rivals(others, x, noise):
            if rival.excess < _CLOSE * search.cost(x, noise):
                minima.append(search.settle(rival.x, noise))
        x, noise = min(minima, key=lambda minimum: search.cost(minimum[0], noise))
        rivals = search.rivals([end for end, _ in minima], x, noise)
        return Fit(problem, x, noise, search.residuals(x), search.at(x).slopes, search.evaluations, tuple(rivals))


class _Search:
    """Least squares of a problem, its linearisations counted and kept while a search stays where it was."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.weights, self.evaluations = problem, problem.prior(), 0
        self._kept: dict[bytes, Linearisation] = {}

    def at(self, x: Array) -> Linearisation:
        """Linearisation at coordinates x."""
        if (key := x.tobytes()) not in self._kept:
            if len(self._kept) >= _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = linearise(self.problem, x)
            self.evaluations += 1
        return self._kept[key]

    def residuals(self, x: Array) -> list[Array]:
        """Measured less expected readings of each trial."""
        return [t.angle - e for e, t in zip(self.at(x).expected, self.problem.trials, strict=True)]

    def cost(self, x: Array, noise: float) -> float:
        """Chi-square of readings with this noise, and of what is known beforehand."""
        squares = sum(float(residual @ residual) for residual in self.residuals(x))
        return squares / noise**2 + float(np.sum((self.weights * x) ** 2))

    def rivals(self, ends: Sequence[Array], x: Array, noise: float) -> list[Rival]:
        """Those ends that are not on the slopes of the minimum x: a parabola through it would have them much higher."""
        squares, rivals = self.weights**2, list[Rival]()
        for end in ends:
            away, excess = end - x, self.cost(end, noise) - self.cost(x, noise)
            parabola = sum(float(np.sum((slope @ away) ** 2)) for slope in self.at(x).slopes) / noise**2
            if parabola + float(squares @ away**2) > max(_APART, 2.0 * excess):
                rivals.append(Rival(end, excess))
        return rivals

    def descend(self, x: Array, noise: float, most: int) -> Array:
        """Coordinates after at most so many evaluations from x."""
        weighted = self.weights > 0.0

        def rows(x: Array) -> Array:
            parts = [-residual / noise for residual in self.residuals(x)]
            return np.concatenate([*parts, (self.weights * x)[weighted]])

        def slopes(x: Array) -> Array:
            return np.concatenate([*(slope / noise for slope in self.at(x).slopes), np.diag(self.weights)[weighted]])

        bounds = self.problem.bounds()
        solution = least_squares(rows, x, slopes, bounds=bounds, x_scale="jac", xtol=1e-5, ftol=1e-8, max_nfev=most)
        end: Array = solution.x
        return end

    def settle(self, x: Array, noise: float) -> tuple[Array, float]:
        """The minimum from x, and the standard deviation of its residuals, with which they are weighed there."""
        weighed, last = np.inf, self.evaluations + _MOST
        while abs(np.log(weighed / noise)) > 0.05 and self.evaluations < last:
            weighed = noise
            x = self.descend(x, weighed, _MOST)
            residuals = self.residuals(x)
            squares, count = sum(float(residual @ residual) for residual in residuals), sum(map(len, residuals))
            noise = float(np.sqrt(squares / max(1, count - len(self.problem.free))))
        return x, noise
