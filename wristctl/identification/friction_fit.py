"""Friction of a wrist's tendons from a measured loop: coefficient, sheath and presliding, with 95 % intervals.

Intervals come from the sandwich covariance of `wristctl.identification.intervals`, in the coordinates of
`wristctl.identification.loop_problem`, in which the model is nearly linear; ends that pass what can be are cut off. One
of the sheath's may be infinite. Friction inside a wrist and that of its tendons look alike in a loop: where one without
the tendons' fits as well, intervals hold both.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from scipy.stats import chi2, norm, qmc

from wristctl.arrays import Array
from wristctl.identification.intervals import NORMAL_95, autocorrelation, bandwidth, inflation, inverse, long_run
from wristctl.identification.loop_problem import (
    BEGIN_INNER_PRESLIDING_DEG,
    BEGIN_PRESLIDING,
    EXPONENT,
    INNER,
    INNER_PRESLIDING,
    LEAST_SHARE,
    NUDGES,
    PRESLIDING,
    RADIUS,
    SHARE,
    SPOOL_MINUS,
    SPOOL_PLUS,
    STIFFNESS,
    SUPPOSITIONS,
    WIDEST,
    LoopProblem,
)

# Evaluations of one search; 10 are usual.
_MOST = 200
# Places that are tried first: how many, from how many of them a search starts, between which exponents and
# preslidings [m], and between which bends [rad] that inner friction holds.
_STARTS, _BEST, _EXPONENTS, _PRESLIDINGS, _INNERS = 32, 4, (0.02, 1.0), (3e-6, 2e-4), (0.01, 0.5)
# Relative decrease of the cost below which a rough search stops.
_ROUGH = 1e-3
# Samples over which small errors are alike.
_LASTING = 30
# Chi-square beyond which a fit without the tendons' three parameters fits less well: 95 %.
_AS_WELL = float(chi2.ppf(0.95, 3))


class FrictionEstimate(NamedTuple):
    """A value with the ends of its 95 % interval; `high` may be infinite."""

    value: float
    low: float
    high: float

    def holds(self, truth: float) -> bool:
        """Whether a value lies in the interval."""
        return self.low <= truth <= self.high


@dataclass(frozen=True)
class FrictionFit:
    """Result of a search over friction's parameters."""

    problem: LoopProblem
    x: Array
    residuals: list[Array]
    """Measured less expected, of the angle [rad] and of both tensions [N] where they were measured."""
    noise: Array
    """Standard deviation of each of them."""
    covariance: Array
    autocorrelation: float
    """Correlation of neighbouring residuals over their noise."""
    rival: FrictionFit | None = None
    """The fit without friction of the tendons, where it fits as well."""

    @property
    def count(self) -> int:
        """Samples that were used."""
        return len(self.residuals[0])

    @property
    def without_friction(self) -> Array:
        """The angle (T,) that the same wrist would take without friction [rad]."""
        x = self.x.copy()
        x[[EXPONENT, INNER]] = 0.0
        return self.problem.expected([x])[0][0]

    @property
    def step_error(self) -> float:
        """RMS change of what is expected when the integration step is halved, over the noise; of all quantities the
        largest."""
        finely = replace(self.problem, finer=2)
        (coarse,), (fine,) = self.problem.expected([self.x]), finely.expected([self.x])
        parts = zip(fine, coarse, self.noise, strict=True)
        return max(float(np.sqrt(np.mean((one - second) ** 2)) / noise) for one, second, noise in parts)

    @property
    def leap(self) -> float:
        """Travel of the tendons between two samples at a turn [m]: where it is about as much as presliding, nobody
        knows where the turn was."""
        loop = self.problem.loop
        if loop.spools is None:
            return 0.0
        steps = np.abs(np.diff(loop.spools[:, 0]))
        turns = loop.turns[(loop.turns > 0) & (loop.turns < len(steps))]
        return float((0.5 * (steps[turns - 1] + steps[turns])).max())

    @property
    def misfit(self) -> float:
        """Variance of what is left over that of the samples' own noise; of all signals the largest."""
        return float(np.max((self.noise / self.problem.noise) ** 2))

    @property
    def inner_friction(self) -> FrictionEstimate | None:
        """Torque of friction inside the wrist [N m]; None where there is none."""
        if self.x[INNER] == 0.0 and INNER in self.problem.fixed:
            return None
        stiffness, bend = self.problem.supposed_wrist(self.x).stiffness, float(self.x[INNER])
        block = self.covariance[np.ix_([INNER, STIFFNESS], [INNER, STIFFNESS])]
        by = np.array([1.0, bend])  # the stiffness is a logarithm
        half = NORMAL_95 * stiffness * math.sqrt(max(0.0, by @ block @ by))
        if self.problem.settings.fix.inner_friction is not None:
            half = 0.0
        ends = [FrictionEstimate(stiffness * bend, max(0.0, stiffness * bend - half), stiffness * bend + half)]
        if self.rival is not None and self.rival.inner_friction is not None:
            ends.append(self.rival.inner_friction)
        return FrictionEstimate(ends[0].value, min(end.low for end in ends), max(end.high for end in ends))

    @property
    def inner_presliding(self) -> FrictionEstimate | None:
        """Bend in which that turns round [rad]."""
        if self.inner_friction is None:
            return None
        return self._scaled(INNER_PRESLIDING, math.radians(BEGIN_INNER_PRESLIDING_DEG))

    @property
    def stiffness(self) -> FrictionEstimate:
        """Bending stiffness of the whole wrist [N m/rad]."""
        return self._scaled(STIFFNESS, self.problem.wrist.stiffness)

    @property
    def tendon_radius(self) -> FrictionEstimate:
        """Radius of the tendons' circle [m]."""
        return self._scaled(RADIUS, self.problem.wrist.tendon_radius)

    @property
    def slack(self) -> list[FrictionEstimate]:
        """Length that the + and the - side reel in before they pull [m], over what their spools count."""
        sides = [] if self.problem.loop.winch else [SPOOL_PLUS, SPOOL_MINUS]
        ends = [self._straight(index, -math.inf, math.inf) for index in sides]
        return [FrictionEstimate(-side.value, -side.high, -side.low) for side in ends]

    def _scaled(self, index: int, unit: float) -> FrictionEstimate:
        """A coordinate that is a logarithm, in the unit of where its search begins."""
        logarithms = self._straight(index, -50.0, 50.0)
        return FrictionEstimate(*(unit * math.exp(end) for end in logarithms))

    @property
    def exponent(self) -> FrictionEstimate:
        """The capstan's exponent at the mean bend."""
        return self._straight(EXPONENT, 0.0, math.inf)

    @property
    def friction(self) -> FrictionEstimate:
        """mu"""
        value = float(self.x[EXPONENT] * self.x[SHARE] / self.problem.bend)
        half = NORMAL_95 * math.sqrt(self._friction_by @ self.covariance[:2, :2] @ self._friction_by)
        most = self.exponent.high / self.problem.bend
        low = 0.0 if self.rival else max(0.0, value - half)
        return FrictionEstimate(value, low, max(value, min(value + half, most)))

    @property
    def _friction_by(self) -> Array:
        """Derivatives of mu by the exponent and by the share."""
        return self.x[[SHARE, EXPONENT]] / self.problem.bend

    @property
    def told_best(self) -> tuple[float, FrictionEstimate]:
        """The bend [rad] of the loop's at which the capstan's exponent is told best, and the exponent there."""
        block, by = self.covariance[:2, :2], self._friction_by
        cross, spread = float((block @ by)[EXPONENT]), float(by @ block @ by)
        furthest = float(np.abs(self.problem.measured[0]).max()) - self.problem.bend
        further = min(max(-cross / spread, -self.problem.bend), furthest)
        value = float(self.x[EXPONENT]) + self.friction.value * further
        half = NORMAL_95 * math.sqrt(max(0.0, block[EXPONENT, EXPONENT] + further * (2.0 * cross + further * spread)))
        low = 0.0 if self.rival else max(0.0, value - half)
        return self.problem.bend + further, FrictionEstimate(value, low, value + half)

    @property
    def sheath(self) -> FrictionEstimate:
        """Angle of the sheath [rad]; infinite interval where the bend's share of the exponent may be none."""
        bend, share = self.problem.bend, self._straight(SHARE, 0.0, 1.0)
        high = math.inf if share.low <= LEAST_SHARE else bend * (1.0 / share.low - 1.0)
        return FrictionEstimate(bend * (1.0 / share.value - 1.0), bend * (1.0 / share.high - 1.0), high)

    @property
    def presliding(self) -> FrictionEstimate:
        """[m]; between nothing and no end where the loop does not tell it."""
        logarithms = self._straight(PRESLIDING, -math.inf, math.inf)
        if logarithms.high - logarithms.value > WIDEST:
            return FrictionEstimate(BEGIN_PRESLIDING * math.exp(logarithms.value), 0.0, math.inf)
        return FrictionEstimate(*(BEGIN_PRESLIDING * math.exp(logarithm) for logarithm in logarithms))

    @property
    def correlation(self) -> float:
        """Correlation of mu with the whole angle that a tendon is wrapped by at the mean bend, both as logarithms."""
        friction, wrapped = np.array([1.0 / max(self.x[EXPONENT], 1e-12), 1.0 / self.x[SHARE]]), np.array([0.0, -1.0])
        block = self.covariance[:2, :2]
        cross = friction @ block @ wrapped
        return float(cross / math.sqrt((friction @ block @ friction) * (wrapped @ block @ wrapped)))

    def _straight(self, index: int, least: float, most: float) -> FrictionEstimate:
        half, value = NORMAL_95 * math.sqrt(self.covariance[index, index]), float(self.x[index])
        low, high = value - half, value + half
        if self.rival is not None:
            other = self.rival._straight(index, -math.inf, math.inf)
            low, high = min(low, other.low), max(high, other.high)
        if index in (SHARE, PRESLIDING) and not self.problem.supposed.tendons:
            low, high = -math.inf, math.inf
        return FrictionEstimate(value, max(least, low), min(most, high))


def fit_in_turn(problem: LoopProblem) -> list[FrictionFit]:
    """Fits of what is supposed of a loop, in turn, until one fits; the last is the one that leaves least over."""
    fits = list[FrictionFit]()
    for supposed in SUPPOSITIONS:
        fits.append(fit_friction(replace(problem, supposed=supposed)))
        if fits[-1].misfit <= problem.settings.lack_of_fit:
            return fits
    return sorted(fits, key=lambda fit: -fit.misfit)


def fit_friction(problem: LoopProblem) -> FrictionFit:
    """Least squares of the model against a measured loop; what is known beforehand counts by its own deviation.

    A rough search starts from each of the best of some places spread over all that may be, since there can be several
    minima (a tendon that slackens); the best of them goes on. Each measured quantity is weighed by the size of its own
    residuals, until these stay.
    """
    noise, searches = np.array([math.radians(0.1), 0.1, 0.1][: len(problem.measured)]), 0
    rough = [_search(problem, start, noise, _ROUGH) for start in _starts(problem, noise)]
    best = min(rough, key=lambda each: each.cost)
    weighed = np.full(len(noise), np.inf)
    while np.abs(np.log(weighed / noise)).max() > 0.05 and searches < 10:
        best, searches = _search(problem, best.x, noise), searches + 1
        weighed, noise = (
            noise,
            np.array([max(float(np.sqrt(np.mean(residual**2))), 1e-9) for residual in best.residuals]),
        )
    fit = _estimated(problem, best, noise)
    if not problem.supposed.inner:
        return fit
    without = replace(problem, supposed=problem.supposed._replace(tendons=False))
    x = best.x.copy()
    x[list(without.fixed)] = list(without.fixed.values())
    rival = _search(without, x, noise)
    return replace(fit, rival=_estimated(without, rival, noise)) if 2.0 * (rival.cost - best.cost) < _AS_WELL else fit


def _estimated(problem: LoopProblem, best: _Found, noise: Array) -> FrictionFit:
    """A fit with its covariance, of quantities with such noise."""
    parts = [residual / sd for residual, sd in zip(best.residuals, noise, strict=True)]
    slopes = [slope / sd for slope, sd in zip(best.slopes, noise, strict=True)]
    free = np.ix_(problem.free, problem.free)
    covariance = np.zeros((problem.count, problem.count))
    covariance[free] = _covariance(parts, [slope[:, problem.free] for slope in slopes], problem.prior[problem.free])
    return FrictionFit(problem, best.x, best.residuals, noise, covariance, autocorrelation(parts))


class _Found(NamedTuple):
    x: Array
    cost: float
    residuals: list[Array]
    slopes: list[Array]


def _starts(problem: LoopProblem, noise: Array) -> Array:
    """Best starting points of a search among the usual one and others, spread as evenly as Sobol's."""
    usual, weighted = problem.begin(), problem.prior > 0.0
    spread = qmc.Sobol(len(usual), scramble=False).random(_STARTS)[1:]  # the first is a corner
    x = np.zeros_like(spread)
    x[:, EXPONENT] = np.exp(np.interp(spread[:, EXPONENT], (0.0, 1.0), np.log(_EXPONENTS)))
    x[:, SHARE] = spread[:, SHARE]
    x[:, PRESLIDING] = np.interp(spread[:, PRESLIDING], (0.0, 1.0), np.log(_PRESLIDINGS)) - math.log(BEGIN_PRESLIDING)
    x[:, INNER] = np.exp(np.interp(spread[:, INNER], (0.0, 1.0), np.log(_INNERS)))
    x[:, weighted] = norm.ppf(spread[:, weighted]) / problem.prior[weighted]
    for index, value in problem.fixed.items():
        x[:, index] = value
    x = np.concatenate([usual[None], x])
    costs = [
        sum(float(np.sum(((e - m) / sd) ** 2)) for e, m, sd in zip(each, problem.measured, noise, strict=True))
        for each in problem.expected(list(x))
    ]
    best: Array = x[np.argsort(np.nan_to_num(costs, nan=np.inf), kind="stable")[:_BEST]]
    return best


def _search(problem: LoopProblem, x: Array, noise: Array, tolerance: float = 1e-9) -> _Found:
    """The least squares that a search from x finds, measured quantities weighed by their noise."""
    free = problem.free
    weights = problem.prior[free]
    weighted, begin = weights > 0.0, x
    last: tuple[Array, list[Array], list[Array]] | None = None

    def whole(moved: Array) -> Array:
        x = begin.copy()
        x[free] = moved
        return x

    def at(moved: Array) -> tuple[Array, list[Array], list[Array]]:
        nonlocal last
        if last is None or not np.array_equal(last[0], moved):
            last = (moved.copy(), *_linearised(problem, whole(moved)))
        return last

    def rows(moved: Array) -> Array:
        parts = [(e - m) / sd for e, m, sd in zip(at(moved)[1], problem.measured, noise, strict=True)]
        return np.concatenate([*parts, (weights * moved)[weighted]])

    def slopes(moved: Array) -> Array:
        columns = [s[:, free] / sd for s, sd in zip(at(moved)[2], noise, strict=True)]
        return np.concatenate([*columns, np.diag(weights)[weighted]])

    low, high = (bound[free] for bound in problem.bounds())
    solution = least_squares(
        rows, x[free].clip(low, high), slopes, bounds=(low, high), x_scale="jac", xtol=1e-7, ftol=tolerance,
        max_nfev=_MOST,
    )  # fmt: skip
    residuals = [m - e for m, e in zip(problem.measured, at(solution.x)[1], strict=True)]
    return _Found(whole(solution.x), float(solution.cost), residuals, at(solution.x)[2])


def _linearised(problem: LoopProblem, x: Array) -> tuple[list[Array], list[Array]]:
    """Expected course (T,) of every quantity, and its derivatives (T, coordinates); nudges point inward."""
    inward = np.where(x > problem.bounds()[1] - 0.1, -1.0, 1.0)
    nudges = inward * np.array(NUDGES[: len(x)])
    expected, *nudged = problem.expected([x, *(x + np.diag(nudges)[problem.free])])
    slopes = [np.zeros((len(signal), len(x))) for signal in expected]
    for index, signals in zip(problem.free, nudged, strict=True):
        for slope, signal, near in zip(slopes, expected, signals, strict=True):
            slope[:, index] = (near - signal) / nudges[index]
    return expected, slopes


def _covariance(residuals: Sequence[Array], slopes: Sequence[Array], weights: Array) -> Array:
    """The sandwich of `wristctl.identification.intervals`: residuals that are alike widen it."""
    count = sum(map(len, residuals))
    lags = bandwidth(autocorrelation(residuals), count / len(residuals))
    bread = inverse(np.diag(weights**2) + sum(slope.T @ slope for slope in slopes))
    meat = np.diag(weights**2) + sum(long_run(s * r[:, None], lags) for s, r in zip(slopes, residuals, strict=True))
    alike, robust = max(1.0, inflation(residuals, _LASTING)) * bread, bread @ meat @ bread
    widen = np.sqrt(np.maximum(1.0, np.diag(robust) / np.diag(alike)))
    sandwich: Array = alike * np.outer(widen, widen)
    return sandwich
