"""Uncertainty of the parameters: covariance, intervals, correlations, condition.

Neighbouring residuals may be alike (an error of the model, the camera's filter). The covariance is therefore the
sandwich of Newey and West (Econometrica 55 (1987) 703) within each trial, with Andrews' bandwidth for a first-order
autoregression (Econometrica 59 (1991) 817). No interval is narrower than so many independent frames would allow as the
residuals are worth: small errors that last (the average of the base's marker, a rest on the same pixels) hide behind
the noise of single frames, and show in the sum of the autocorrelations over half a second. Nor is one narrower
than readings with the least noise of a rig would leave it: what is left over of simulated readings is no noise.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.identification.fit import Fit
from wristctl.identification.measured_trials import LEAST_NOISE, MeasuredTrial
from wristctl.identification.problem import Coordinate, Problem
from wristctl.identification.unknowns import NOT_NEGATIVE

NORMAL_95 = 1.959964
# Autocorrelation of neighbouring residuals beyond which the model is said to miss something.
ALIKE = 0.2
# Share of the deviation beforehand that is left where trials tell hardly anything.
_ASSUMED = 0.8
# Frames, and time [s], over which small errors are alike.
_FRAMES, _LASTING = 30, 0.5


@dataclass(frozen=True)
class Knowledge:
    """Uncertainty of a fit's coordinates."""

    deviation: Array
    """Standard deviations."""
    information: Array
    """Inverse covariance if residuals were independent, with what was known beforehand."""
    condition: float
    """Condition number of the Jacobian, its columns scaled to unit length."""
    autocorrelation: float
    """Correlation of neighbouring residuals."""
    effective: float
    """Independent frames that would tell as much as the residuals do."""
    before: Array
    """One over the standard deviations with which coordinates were known beforehand; 0 where nothing was."""

    def assumed(self, index: int) -> bool:
        """Whether hardly more is known of a coordinate than beforehand."""
        return bool(self.deviation[index] * self.before[index] > _ASSUMED)

    @property
    def half_widths(self) -> Array:
        """Half the 95 % interval of each coordinate."""
        return NORMAL_95 * self.deviation

    @property
    def misses_something(self) -> bool:
        """Whether neighbouring residuals are so much alike that not the camera's noise but the model is behind it."""
        return self.autocorrelation > ALIKE

    @property
    def correlation(self) -> Array:
        """Correlations of the coordinates."""
        covariance = inverse(self.information)
        sd = np.sqrt(np.diag(covariance))
        correlation: Array = covariance / np.outer(sd, sd)
        return correlation


def knowledge(fit: Fit) -> Knowledge:
    """Deviations, condition and autocorrelation at the end of a fit."""
    weights = fit.problem.prior()
    slopes = [slope / fit.noise for slope in fit.slopes]
    residuals = [residual / fit.noise for residual in fit.residuals]
    count = sum(map(len, residuals))
    bread, variance = sandwich(slopes, residuals, weights, len(fit.problem.free))
    stacked = np.concatenate([*slopes, np.diag(weights)[weights > 0.0]])
    alike = max(1.0, *(inflation(residuals, lags) for lags in {_FRAMES, _lasting(fit.problem.trials)}))
    wider = max(1.0, LEAST_NOISE / fit.noise)
    deviation = _with_clocks(fit.problem, wider * np.sqrt(np.maximum(alike * np.diag(bread), np.diag(variance))))
    information = information_of(slopes, weights)
    return Knowledge(deviation, information, condition(stacked), autocorrelation(residuals), count / alike, weights)


def _lasting(trials: Sequence[MeasuredTrial]) -> int:
    """Frames over which small errors are alike, at most a quarter of the shortest trial."""
    pause = float(np.median(np.concatenate([np.diff(trial.captured) for trial in trials])))
    return max(1, min(round(_LASTING / pause), *(len(trial.captured) // 4 for trial in trials)))


def sandwich(slopes: Sequence[Array], residuals: Sequence[Array], weights: Array, free: int) -> tuple[Array, Array]:
    """Covariances of coordinates if residuals were independent, and by how they really are alike.

    Slopes and residuals of each trial in standard deviations, one over those of what is known beforehand, and how many
    coordinates nothing is known of.
    """
    count = sum(map(len, residuals))
    lags = bandwidth(autocorrelation(residuals), count / len(residuals))
    meat = np.diag(weights**2)
    for slope, residual in zip(slopes, residuals, strict=True):
        meat = meat + long_run(slope * residual[:, None], lags) * count / max(1, count - free)
    bread = inverse(information_of(slopes, weights))
    return bread, bread @ meat @ bread


def promised(problem: Problem, slopes: Sequence[Array]) -> Array:
    """Half the 95 % interval of each coordinate that frames with these slopes, in standard deviations, would leave."""
    bread = inverse(information_of(slopes, problem.prior()))
    return NORMAL_95 * _with_clocks(problem, np.sqrt(np.diag(bread)))


def _with_clocks(problem: Problem, deviation: Array) -> Array:
    """An error of the clocks is a delay, and nothing in the trials tells the two apart."""
    wider = deviation.copy()
    if "delay" in problem.free:
        column = problem.coordinates[Coordinate("delay")]
        wider[column] = np.hypot(wider[column], problem.settings.clock_error)
    return wider


def information_of(slopes: Sequence[Array], weights: Array) -> Array:
    """Fisher's information of residuals of unit variance with these slopes, with what is known beforehand."""
    total: Array = np.diag(weights**2) + sum(slope.T @ slope for slope in slopes)
    return total


def inverse(information: Array) -> Array:
    """The covariance; nearly infinite, not an error, where a coordinate has no influence."""
    scale = np.sqrt(np.diag(information)) + 1e-9
    scaled = information / np.outer(scale, scale) + 1e-12 * np.eye(len(scale))
    inverted: Array = np.linalg.inv(scaled) / np.outer(scale, scale)
    return inverted


def condition(slopes: Array) -> float:
    """Largest over least singular value with columns scaled to unit length; infinite where one is zero."""
    length = np.linalg.norm(slopes, axis=0)
    if not length.all():
        return float("inf")
    with threadpool_limits(limits=1, user_api="blas"):
        values = np.linalg.svd(slopes / length, compute_uv=False)
    return float(values[0] / max(values[-1], 1e-300))


def autocorrelation(residuals: Sequence[Array]) -> float:
    """Correlation of each residual with the next one of its trial."""
    product = sum(float(residual[:-1] @ residual[1:]) for residual in residuals)
    return float(np.clip(product / sum(float(residual @ residual) for residual in residuals), -0.97, 0.97))


def inflation(residuals: Sequence[Array], lags: int) -> float:
    """Ratio of a mean's variance to its variance under independent residuals (Bartlett)."""
    total = sum(float(residual @ residual) for residual in residuals)
    means = sum(float(long_run(residual[:, None], lags)[0, 0]) for residual in residuals)
    return means / total


def bandwidth(rho: float, length: float) -> int:
    """Lags to weigh in trials of this many frames, by Andrews' rule for Bartlett's kernel."""
    alpha = 4.0 * rho**2 / ((1.0 - rho) ** 2 * (1.0 + rho) ** 2)
    return int(min(np.ceil(1.1447 * (alpha * length) ** (1.0 / 3.0)), length / 4.0))


def long_run(scores: Array, lags: int) -> Array:
    """Covariance of the sum of a sequence (F, p) whose neighbours up to `lags` apart may be alike (Bartlett)."""
    total = scores.T @ scores
    for lag in range(1, min(lags, len(scores) - 1) + 1):
        products = scores[lag:].T @ scores[:-lag]
        total = total + (1.0 - lag / (lags + 1.0)) * (products + products.T)
    estimate: Array = total
    return estimate


def interval(fit: Fit, known: Knowledge, name: str) -> tuple[float, float]:
    """The 95 % interval of a free parameter in its own unit; friction's end at 0."""
    index = fit.problem.free.index(name)
    half, start, unknown = known.half_widths[index], fit.problem.start[name], fit.problem.unknowns[name]
    low, high = (unknown.value(fit.x[index] + side * min(half, 50.0), start) for side in (-1.0, 1.0))
    return (max(low, 0.0) if name in NOT_NEGATIVE else low), high
