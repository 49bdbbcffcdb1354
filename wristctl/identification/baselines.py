"""Predictions that know nothing of a robot's mechanics, for a model to be held against: a mean, and a Gaussian process.

The process is a map from the spools (and the mass, where it differs) to the motion, with a squared exponential kernel
and noise; its length and noise maximise the marginal likelihood (Rasmussen and Williams, Gaussian Processes for Machine
Learning, 2006, chapters 2 and 5). It has no memory: of friction and creep it knows what they are in the mean.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from scipy.linalg import LinAlgError, cho_factor, cho_solve
from scipy.optimize import minimize

from wristctl.arrays import Array
from wristctl.identification.arc_robot import ArcRecording
from wristctl.identification.prediction_scores import squares_of_blocks

# Most samples that the process learns from, evenly over all; where the search for its logarithms of length and noise
# (over the spread of inputs and outputs) begins, and its most evaluations.
_MOST, _BEGIN, _EVALUATIONS = 600, (0.0, math.log(0.1)), 40


@dataclass(frozen=True)
class Baseline:
    """A prediction of recordings without a model."""

    name: str
    recordings: tuple[ArcRecording, ...]
    errors: tuple[Array, ...]
    """Predicted less measured (T, d) of each recording [rad or m]; 0 where nothing was measured."""
    centred: bool
    """Whether the mean of the error does not count."""

    @cached_property
    def squares(self) -> tuple[Array, Array]:
        """Sum of squared errors and number of samples of each block of what was predicted."""
        return squares_of_blocks(self.errors, self.recordings, self.centred)


def baselines(cases: Sequence[Sequence[ArcRecording]], centred: bool) -> dict[str, list[Baseline]]:
    """Both baselines of each case, by their names.

    Parameters
    ----------
    cases : recordings that are fitted together, several times: their fitted samples are what a baseline knows
    centred : whether the mean error of what is predicted does not count
    """
    kinds = {"mean of the other runs": mean_of_runs, "Gaussian process": gaussian_process}
    found = dict[str, list[Baseline]]()
    for name, predict in kinds.items():
        found[name] = []
        for recordings in cases:
            wrong = [
                np.nan_to_num(predicted - recording.measured)
                for predicted, recording in zip(predict(recordings), recordings, strict=True)
            ]
            found[name].append(Baseline(name, tuple(recordings), tuple(wrong), centred))
    return found


def mean_of_runs(recordings: Sequence[ArcRecording]) -> list[Array]:
    """Mean of what was fitted (T, d): at each instant where several whole runs last as long, else over all samples."""
    whole = [one for one in recordings if one.fitted.all()]
    known = np.concatenate([one.measured[one.fitted] for one in recordings])
    predicted = list[Array]()
    for recording in recordings:
        others = [one for one in whole if one is not recording and _lasts(one, recording)]
        if len(others) > 1:
            columns = range(recording.measured.shape[1])
            at = [[np.interp(recording.time, one.time, one.measured[:, k]) for k in columns] for one in others]
            predicted.append(np.mean(at, axis=0).T)
        else:
            predicted.append(np.tile(np.mean(known, axis=0), (len(recording.time), 1)))
    return predicted


def _lasts(one: ArcRecording, other: ArcRecording) -> bool:
    """Whether a recording covers the time of another, but for a step."""
    step = float(np.median(np.diff(other.time))) if len(other.time) > 1 else 0.0
    return bool(one.time[0] <= other.time[0] + step and one.time[-1] >= other.time[-1] - step)


def gaussian_process(recordings: Sequence[ArcRecording]) -> list[Array]:
    """Mean of a Gaussian process (T, d) of spools and mass, given what is fitted and what gives a zero."""
    inputs = [np.column_stack([one.spools, np.full(len(one.time), one.mass)]) for one in recordings]
    given = np.concatenate([x[one.fitted | one.zeroing] for x, one in zip(inputs, recordings, strict=True)])
    seen = np.concatenate([one.measured[one.fitted | one.zeroing] for one in recordings])
    columns = np.isfinite(seen).any(axis=0)
    rows = np.flatnonzero(np.isfinite(seen[:, columns]).all(axis=1))
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(len(rows), _MOST)).astype(np.int64))]
    centre, spread = given[rows].mean(axis=0), given[rows].std(axis=0)
    spread[spread < 1e-12] = math.inf  # a mass that is always the same
    known, mean = (given[rows] - centre) / spread, seen[rows][:, columns].mean(axis=0)
    outputs = seen[rows][:, columns] - mean
    options: Any = {"maxfev": _EVALUATIONS}
    found = minimize(_unlikely, np.array(_BEGIN), (known, outputs), "Nelder-Mead", options=options)
    factor = cho_factor(_kernel(known, known, found.x[0]) + _noise(found.x[1]) * np.eye(len(known)), lower=True)
    weights = cho_solve(factor, outputs)
    predicted = list[Array]()
    for x, one in zip(inputs, recordings, strict=True):
        whole = np.full(one.measured.shape, math.nan)
        whole[:, columns] = mean + _kernel((x - centre) / spread, known, found.x[0]) @ weights
        predicted.append(whole)
    return predicted


def _kernel(one: Array, other: Array, log_length: float) -> Array:
    """Squared exponential of the distances of inputs (N, D) and (M, D), over their number: (N, M)."""
    squares = np.sum(one**2, axis=1)[:, None] + np.sum(other**2, axis=1) - 2.0 * one @ other.T
    kernel: Array = np.exp(-0.5 * np.maximum(squares, 0.0) / (one.shape[1] * math.exp(2.0 * log_length)))
    return kernel


def _noise(log_noise: float) -> float:
    """Variance of the noise over that of the process."""
    return math.exp(2.0 * log_noise) + 1e-8


def _unlikely(logs: Array, known: Array, outputs: Array) -> float:
    """Negative logarithm of the likelihood of outputs (N, d), their variance being the likeliest."""
    covariance = _kernel(known, known, float(logs[0])) + _noise(float(logs[1])) * np.eye(len(known))
    try:
        factor = cho_factor(covariance, lower=True)
    except LinAlgError:
        return 1e12
    fit = float(np.sum(outputs * cho_solve(factor, outputs))) / outputs.size
    spread = float(np.sum(np.log(np.diag(factor[0]))))
    return float(0.5 * outputs.size * math.log(max(fit, 1e-300)) + outputs.shape[1] * spread)
