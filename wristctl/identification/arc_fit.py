"""Arcs on elastic tendons fitted to a part of a real robot's recordings, and asked for the rest."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.stats import t as student

from wristctl.arrays import Array
from wristctl.identification.arc_robot import SLACK_ERROR, ArcRecording, ArcRobot, Term
from wristctl.identification.intervals import NORMAL_95
from wristctl.identification.prediction_scores import squares_of_blocks

_ZERO_SCALE = {"bend": 0.02, "tip": 2e-3}
# Range in which zero and slack are looked for [rad or m, m], and change of a difference over the usual change.
_ZERO_RANGE, _SLACK_RANGE, _STEP = 1.0, 1.5e-2, 1e-4
# Error of a single sample that the priors are held against: 1 deg, or 2 mm; beside it of a tension [N] or
# a rate [rad/s].
_ERROR, _ERROR_BESIDE = {"bend": math.radians(1.0), "tip": 2e-3}, 0.5
# Where samples are weighed: searches, and the least of these errors over that.
_SEARCHES, _LEAST_ERROR = 3, 1e-3
# Time [s] after which errors of a log that is read between its rows are of other rows.
_FRAME = 0.04
# Share of a block's error in a direction that the fit leaves at least.
_LEAST_LEFT = 1e-6


class Told(NamedTuple):
    """An unknown's value with its 95 % interval; one that the data do not tell has an interval without ends."""

    value: float
    low: float
    high: float
    unit: str
    meaning: str

    @property
    def known(self) -> bool:
        """Whether the data tell it."""
        return math.isfinite(self.low + self.high)


@dataclass(frozen=True)
class ArcFit:
    """A robot's model with some terms, fitted to recordings."""

    robot: ArcRobot
    terms: tuple[Term, ...]
    recordings: tuple[ArcRecording, ...]
    x: Array
    """Unknowns, then zero and slack of each session that is fitted."""
    own: Mapping[str, Array]
    """Zero and slack of each session."""
    centred: bool
    """Whether the mean of the error over what is predicted does not count, as its authors have it."""
    weights: tuple[float, float] = (1.0, 1.0)
    """Error of a sample of the motion and of one beside it, over the usual."""
    predicts: bool = True
    """Whether its model predicts what was left out: of one that does not no unknown is told."""
    left_open: Mapping[str, float] = field(default_factory=dict)
    """Standard deviations that terms which the data leave open add to unknowns."""

    @property
    def numbers(self) -> int:
        """Free numbers of what is fitted."""
        return len(self.x)

    @cached_property
    def values(self) -> dict[str, float]:
        """The unknowns by name."""
        return dict(zip(self.robot.unknowns(self.terms), self.x.tolist(), strict=False))

    @cached_property
    def errors(self) -> list[Array]:
        """Expected less measured (T, d) of each recording [rad or m]."""
        values = {name: np.array([value]) for name, value in self.values.items()}
        return [
            np.nan_to_num(
                self.robot.expected(values, *_parted(self.own[recording.session][None], self.robot), recording)[0][0]
                - recording.measured
            )
            for recording in self.recordings
        ]

    @property
    def cost(self) -> float:
        """Sum of the squares that the fit makes small."""
        problem = _Problem(self.robot, self.terms, self.recordings)
        return float(np.sum(problem.residuals(self.x[None]) ** 2))

    def rms(self, part: str = "fitted") -> float:
        """RMS length of the errors over a part: fitted, zeroing or asked [rad or m]; nan where there is none."""
        wrong = np.concatenate([e[getattr(r, part)] for e, r in zip(self.errors, self.recordings, strict=True)])
        return float(np.sqrt(np.mean(np.sum(wrong**2, axis=1)))) if len(wrong) else math.nan

    def missed(self) -> float:
        """Share of the motion of the predicted part that its errors are (RMS), without what differs from row to row.

        The latter is noise, by how far each error lies beside the mean of those a camera's frame away.
        """
        wrong, noise, moved = list[Array](), list[Array](), list[Array]()
        for errors, recording in zip(self.errors, self.recordings, strict=True):
            wrong.append(errors[recording.asked])
            away = max(1, int(_FRAME / float(np.nanmedian(recording.pause))))
            beside = errors[away:-away] - 0.5 * (errors[: -2 * away] + errors[2 * away :])
            noise.append(beside[recording.asked[away:-away]] / math.sqrt(1.5))
            moved.append(recording.measured[recording.asked])
        squares, noises = (float(np.mean(np.sum(np.concatenate(x) ** 2, axis=1))) for x in (wrong, noise))
        whole = float(np.nansum(np.nanvar(np.concatenate(moved), axis=0)))
        return math.sqrt(max(0.0, squares - noises) / whole) if whole else math.inf

    @cached_property
    def squares(self) -> tuple[Array, Array]:
        """Sum of squared errors and number of samples of each block of what was predicted."""
        return squares_of_blocks(self.errors, self.recordings, self.centred)

    def asked_of(self, recording: ArcRecording) -> ArcFit:
        """The same unknowns on another recording, whose zeroing samples give its zero; it is taken to have no slack."""
        problem = _Problem(self.robot, tuple(term for term in self.terms if term != "slack"), (recording,))
        return replace(
            self,
            recordings=(recording,),
            own={recording.session: problem.zeroed(self.x[: len(self.values)], recording)},
        )

    @cached_property
    def told(self) -> dict[str, Told]:
        """The unknowns with intervals, by blocks of what was fitted: errors of neighbouring samples are alike.

        The covariance and Student's degrees of freedom are those of Bell and McCaffrey (Survey Methodology 28 (2002)
        169): of few blocks the fit itself makes the errors smaller.
        """
        problem = _Problem(self.robot, self.terms, self.recordings, self.weights)
        jacobian, residual = problem.jacobian(self.x) * problem.scale, problem.residuals(self.x[None])[0]
        blocks = problem.blocks()
        measured, beforehand = jacobian[: len(blocks)], jacobian[len(blocks) :]
        residual = residual[: len(blocks)]
        precise, directions = np.linalg.eigh(jacobian.T @ jacobian)
        root = directions / np.sqrt(np.maximum(precise, 1e-12 * precise[-1]))
        scores, freedom = by_blocks(measured @ root, residual, blocks, root)
        quantile = student.ppf(0.975, freedom)
        blockwise = quantile * np.linalg.norm(root @ scores.T, axis=1)
        assumed = NORMAL_95 * np.linalg.norm(root @ root.T @ beforehand.T, axis=1)
        alone = quantile * np.linalg.norm(root, axis=1) * math.sqrt(float(np.mean(residual**2)))
        halves = problem.scale * np.maximum(np.hypot(blockwise, assumed), alone)  # where residuals show no such change
        told = {}
        for k, (name, unknown) in enumerate(self.robot.unknowns(self.terms).items()):
            value = float(self.x[k])
            half = math.hypot(float(halves[k]), NORMAL_95 * self.left_open.get(name, 0.0))
            low, high = value - half, value + half
            at_end = min(value - unknown.low, unknown.high - value) < 1e-2 * unknown.scale
            wide = not self.robot.is_told(name, value, half)
            ends = (max(low, unknown.low), high)
            if wide or (at_end and unknown.low != 0.0) or not self.predicts:
                ends = (-math.inf, math.inf)
            told[name] = Told(value, ends[0], ends[1], unknown.unit, unknown.meaning)
        return told


def by_blocks(slopes: Array, residual: Array, blocks: NDArray[np.int64], root: Array) -> tuple[Array, Array]:
    """Scores of each block (blocks, P) as if it were not fitted, and Student's degrees of freedom of each unknown (P,).

    Slopes (R, P) are by coordinates of unit variance, of which `root` (P, P) makes the unknowns. With X and r the
    slopes and residuals of a block its scores are X' (1 - X X')^(-1/2) r, from the eigenvectors of X' X; the degrees of
    freedom are Satterthwaite's of independent errors.
    """
    count, numbers = int(blocks.max()) + 1, slopes.shape[1]
    scores, alone, shared = np.zeros((count, numbers)), np.zeros((count, numbers)), np.zeros((numbers, count, numbers))
    for block in range(count):
        some = slopes[blocks == block]
        leverage, axes = np.linalg.eigh(some.T @ some)
        left = np.clip(1.0 - leverage, _LEAST_LEFT, 1.0)
        scores[block] = (axes / np.sqrt(left)) @ (axes.T @ (some.T @ residual[blocks == block]))
        by_axes = root @ axes
        alone[block] = by_axes**2 @ (leverage / left)
        shared[:, block] = (by_axes * leverage / np.sqrt(left)) @ axes.T
    covariance = np.einsum("ck,cd->kcd", alone, np.eye(count)) - shared @ shared.transpose(0, 2, 1)
    squares = np.sum(covariance**2, axis=(1, 2)) + 1e-300
    freedom: Array = np.trace(covariance, axis1=1, axis2=2) ** 2 / squares
    return scores, np.maximum(freedom, 1.0)


def fit_arcs(
    robot: ArcRobot, terms: Sequence[Term], recordings: Sequence[ArcRecording], centred: bool = False,
    begin: Mapping[str, float] | None = None,
) -> ArcFit:  # fmt: skip
    """Fit a robot's model by least squares, then zero and slack of sessions that only give these.

    Parameters
    ----------
    terms : what the model has beside elastic arcs and tendons
    recordings : what is fitted and what is predicted
    centred : whether the mean error of what is predicted does not count
    begin : where the search begins, by unknown
    """
    problem = _Problem(robot, tuple(terms), tuple(recordings))
    x = problem.solved(begin or {})
    for _ in range(_SEARCHES - 1 if robot.weighed else 0):
        problem = replace(problem, weights=problem.weighed(x))
        x = problem.searched(x)
    own = problem.own_of(x[None])
    whole = {session: part[0] for session, part in own.items()}
    unknowns = x[: len(problem.unknowns)]
    for recording in recordings:
        if recording.session not in whole:
            whole[recording.session] = problem.zeroed(unknowns, recording)
    return ArcFit(robot, tuple(terms), tuple(recordings), x, whole, centred, problem.weights)


def _parted(own: Array, robot: ArcRobot) -> tuple[Array, Array]:
    """Zero (V, 2 or 3) and slack (V, M)."""
    return own[:, : robot.zeros], own[:, robot.zeros :]


@dataclass(frozen=True)
class _Problem:
    robot: ArcRobot
    terms: tuple[Term, ...]
    recordings: tuple[ArcRecording, ...]
    weights: tuple[float, float] = (1.0, 1.0)

    @cached_property
    def unknowns(self) -> list[str]:
        return list(self.robot.unknowns(self.terms))

    @cached_property
    def fitted(self) -> list[ArcRecording]:
        return [recording for recording in self.recordings if recording.fitted.any()]

    @cached_property
    def sessions(self) -> list[str]:
        return list(dict.fromkeys(recording.session for recording in self.fitted))

    @cached_property
    def own_scale(self) -> Array:
        slack = [5e-4] * (len(self.robot.ends) if "slack" in self.terms else 0)
        return np.array([_ZERO_SCALE[self.robot.measured]] * self.robot.zeros + slack)

    @cached_property
    def scale(self) -> Array:
        chosen = self.robot.unknowns(self.terms).values()
        scale: Array = np.r_[[unknown.scale for unknown in chosen], np.tile(self.own_scale, len(self.sessions))]
        return scale

    def bounds(self) -> tuple[Array, Array]:
        chosen = self.robot.unknowns(self.terms).values()
        zero, tendons = self.robot.zeros, len(self.own_scale) - self.robot.zeros
        high = np.tile([_ZERO_RANGE] * zero + [_SLACK_RANGE] * tendons, len(self.sessions))
        low = [unknown.low for unknown in chosen]
        return np.r_[low, -high], np.r_[[unknown.high for unknown in chosen], high]

    def own_of(self, x: Array) -> dict[str, Array]:
        """Zero and slack (V, ...) of each fitted session; slack is 0 where the model has none."""
        parts = x[:, len(self.unknowns) :].reshape(len(x), len(self.sessions), len(self.own_scale))
        return {session: self._whole(parts[:, k]) for k, session in enumerate(self.sessions)}

    def _whole(self, own: Array) -> Array:
        missing = self.robot.zeros + len(self.robot.ends) - own.shape[1]
        whole: Array = np.concatenate([own, np.zeros((len(own), missing))], axis=1)
        return whole

    def residuals(self, x: Array) -> Array:
        """Errors of what is fitted, and of the slack from none, over the error of a sample: (V, ...)."""
        values = dict(zip(self.unknowns, x.T, strict=False))
        own = self.own_of(x)
        rows = [self._of(values, own[recording.session], recording, "fitted") for recording in self.fitted]
        slacks = [own[session][:, self.robot.zeros :] / SLACK_ERROR for session in self.sessions]
        beforehand = [
            ((values[name] - self.robot.begin[name]) / error)[:, None] for name, error in self.robot.known_to.items()
        ]
        residuals: Array = np.concatenate(rows + slacks + beforehand, axis=1)
        return residuals

    def _of(self, values: Mapping[str, Array], own: Array, recording: ArcRecording, part: str) -> Array:
        expected, beside = self.robot.expected(values, *_parted(own, self.robot), recording)
        chosen = getattr(recording, part)
        error, error_beside = _ERROR[self.robot.measured] * self.weights[0], _ERROR_BESIDE * self.weights[1]
        wrong = np.nan_to_num((expected - recording.measured)[:, chosen].reshape(len(own), -1)) / error
        if recording.beside is None:
            return np.asarray(wrong)
        measured = recording.beside[chosen]
        off = np.where(np.isfinite(measured), beside[:, chosen] - measured, 0.0).reshape(len(own), -1)
        return np.concatenate([wrong, off / error_beside], axis=1)

    def weighed(self, x: Array) -> tuple[float, float]:
        """Weights by the sizes of the residuals at x, of samples that were measured."""
        values, own = dict(zip(self.unknowns, x[None].T, strict=False)), self.own_of(x[None])
        sums = np.zeros((2, 2))
        for one in self.fitted:
            rows, chosen = self._of(values, own[one.session], one, "fitted")[0], one.fitted
            parts = rows[: one.measured[chosen].size], rows[one.measured[chosen].size :]
            there = one.measured, one.beside if one.beside is not None else one.measured[:0]
            for k, (part, signals) in enumerate(zip(parts, there, strict=True)):
                sums[k] += np.sum(part**2), np.isfinite(signals[chosen]).sum() if len(part) else 0
        motion, beside = (
            weight * max(_LEAST_ERROR, math.sqrt(square / count)) if count else weight
            for weight, (square, count) in zip(self.weights, sums, strict=True)
        )
        return motion, beside

    def blocks(self) -> NDArray[np.int64]:
        """Block of each residual of a sample."""
        numbers, first = [], 0
        for recording in self.fitted:
            block = np.unique(recording.block[recording.fitted], return_inverse=True)[1] + first
            first = int(block.max()) + 1
            numbers.append(np.repeat(block, recording.measured.shape[1]))
            if recording.beside is not None:
                numbers.append(np.repeat(block, recording.beside.shape[1]))
        return np.concatenate(numbers)

    def jacobian(self, x: Array) -> Array:
        """Derivatives of the residuals by differences."""
        return _slopes(self.residuals, x, self.scale)

    def solved(self, begin: Mapping[str, float]) -> Array:
        chosen = self.robot.unknowns(self.terms)
        unknowns = [begin.get(name, unknown.begin) for name, unknown in chosen.items()]
        zeros = np.tile(0.0 * self.own_scale, len(self.sessions))
        for k, session in enumerate(self.sessions):
            first = next(recording for recording in self.fitted if recording.session == session)
            if self.robot.measured == "tip":
                straight = np.nan_to_num(first.measured[first.fitted][0]) - [sum(self.robot.lengths), 0.0, 0.0]
                zeros[k * len(self.own_scale) :][:3] = straight
        return self.searched(np.r_[unknowns, zeros])

    def searched(self, x: Array) -> Array:
        """Values with the least squares of the residuals, sought from x on."""
        low, high = self.bounds()
        return _least(self.residuals, np.clip(x, low + 1e-9, high - 1e-9), self.scale, (low, high))

    def zeroed(self, unknowns: Array, recording: ArcRecording) -> Array:
        """Zero and slack of a session of its own, from a part of its recording."""

        def residuals(own: Array) -> Array:
            values = dict(zip(self.unknowns, np.tile(unknowns, (len(own), 1)).T, strict=True))
            whole = self._whole(own)
            rows = self._of(values, whole, recording, "zeroing")
            return np.concatenate([rows, whole[:, self.robot.zeros :] / SLACK_ERROR], axis=1)

        unbound = np.full(len(self.own_scale), math.inf)
        found = _least(residuals, np.zeros(len(self.own_scale)), self.own_scale, (-unbound, unbound))
        return np.asarray(self._whole(found[None])[0])


def _least(residuals: Callable[[Array], Array], begin: Array, scale: Array, bounds: tuple[Array, Array]) -> Array:
    """Values with the least squares of residuals, which rows of values (V, ...) have."""

    def of_one(x: Array) -> Array:
        return np.asarray(residuals(x[None])[0])

    def slopes(x: Array) -> Array:
        return _slopes(residuals, x, scale)

    fitted = least_squares(of_one, begin, slopes, bounds, x_scale=scale, ftol=1e-5, xtol=1e-6, max_nfev=60)
    return np.asarray(fitted.x)


def _slopes(residuals: Callable[[Array], Array], x: Array, scale: Array) -> Array:
    """Derivatives of the residuals of rows (V, ...) by differences."""
    steps = _STEP * scale
    rows = residuals(np.concatenate([x[None], x + np.diag(steps)]))
    return np.asarray((rows[1:] - rows[0]).T / steps)
