"""The soft neck of UC3M, a spring that three tendons bend: one elastic arc, fitted to two loads and asked for a third.

The bend is a vector in the plane across the straight neck: in the plane of bending a tendon at direction d has the
arm r d. A tendon pulls only where it is stretched; a load on top makes the neck softer in proportion to its mass.
Friction and inertia are left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from wristctl.arrays import Array
from wristctl.errors import UserError
from wristctl.records.log_converters import read_log

RADIUS = 0.052
"""Radius of the tendons' circle [m], by the authors' Kinematics.cpp."""
FITTED_LOADS, ASKED_LOAD = (0, 1000), 500
"""Loads [g] of the recordings that are fitted, and of the one that is predicted."""
ZEROS_UNTIL = 20.0
"""Time [s] up to which the predicted recording may give its zeros."""
_DIRECTIONS = np.array([[math.cos(angle), math.sin(angle)] for angle in np.radians([0.0, 120.0, 240.0])])
_PERIOD, _BLOCK, _DRAWS = 0.1, 5.0, 4000
# Bend below which a tendon passes smoothly from slack to taut [rad], and weight of slack [deg/mm].
_SMOOTH, _SLACK_WEIGHT = 1e-3, 0.3
_BEGIN = np.array([1.0, 10.0, 0.9, 0.02, 0.05, 1.5])
_LOW, _HIGH = np.array([0.5, 0.5, -0.5, 0.0, 0.0, -math.pi]), np.array([1.5, 100.0, 0.999, 3.0, 0.3, math.pi])
_OWN_HIGH = np.array([1.0, 1.0, 6.0, 6.0, 6.0])


@dataclass(frozen=True)
class NeckRecording:
    """A recording at even steps: spools (T, 3) [m] at each moment with those before it, and the bend (T, 2) [rad]."""

    time: Array
    spools: Array
    bend: Array
    mass: float
    """Load [kg]."""

    def delayed(self, delay: float) -> Array:
        """Spools (T, 3) [m] a delay [s] earlier."""
        return np.stack([np.interp(self.time - delay, self.time, spool) for spool in self.spools.T], axis=1)


@dataclass(frozen=True)
class NeckPrediction:
    """The load that was not fitted: RMS vector error of its bend after the zeros were found, and the interval [deg]."""

    error: float
    low: float
    high: float
    fitted: dict[int, float]
    """RMS error [deg] of each fitted recording, by its load [g]."""
    parameters: dict[str, float]
    linear: float
    """RMS error [deg] of a linear map of the motors with the same parts fitted."""


def static_bend(lift: Array, mass: float, tendon: float, softening: float, compression: float) -> Array:
    """Bend (T, 2) [rad] at which tendons and spring balance.

    Parameters
    ----------
    lift : reeled length of each tendon over its arm (T, 3) [rad]
    mass : load [kg]
    tendon : stiffness of a tendon times its squared arm, over the stiffness of the neck
    softening : share of the neck's stiffness that a kilogram takes away [1/kg]
    compression : shortening of the neck per pull, over that of bending
    """
    bend, shorter, stiffness = np.zeros((len(lift), 2)), np.zeros(len(lift)), 1.0 - softening * mass
    for _ in range(60):
        stretch = lift - bend @ _DIRECTIONS.T - shorter[:, None]
        smooth = np.hypot(stretch, _SMOOTH)
        pull, taut = 0.5 * tendon * (stretch + smooth), 0.5 * tendon * (1.0 + stretch / smooth)
        wrong = np.column_stack([stiffness * bend - pull @ _DIRECTIONS, shorter - compression * pull.sum(axis=1)])
        slope = np.empty((len(lift), 3, 3))
        slope[:, :2, :2] = stiffness * np.eye(2) + np.einsum("tk,ki,kj->tij", taut, _DIRECTIONS, _DIRECTIONS)
        slope[:, :2, 2] = taut @ _DIRECTIONS
        slope[:, 2, :2] = compression * slope[:, :2, 2]
        slope[:, 2, 2] = 1.0 + compression * taut.sum(axis=1)
        change = np.linalg.solve(slope, wrong[..., None])[..., 0]
        bend, shorter = bend - change[:, :2], shorter - change[:, 2]
        if np.abs(change).max() < 1e-7:
            break
    return bend


def read_neck(folder: Path, load: int) -> NeckRecording:
    """Recording of the open loop with a load [g]: in the repository's tree, or with its folders in the file's name."""
    files = sorted(file for file in folder.rglob(f"*spring_test_{load}gr.csv") if "openloop" in str(file))
    if not files:
        problem = f"no recording of the open loop with {load} g"
        raise UserError(problem, str(folder), "imu_openloop/spring_test_*gr.csv of HUMASoft/Data-and-Results")
    log = read_log(files[0], "humasoft")
    columns = log.columns
    stride = max(1, round(_PERIOD / float(np.median(np.diff(columns["time"])))))
    if "bend_y" in columns:
        bend = np.column_stack([columns["bend_y"], columns["bend_z"]])
    else:
        size, angle = columns["inclination"], columns["orientation"]
        bend = np.column_stack([size * np.cos(angle), size * np.sin(angle)])
    spools = np.column_stack([columns[f"spool_{k}"] for k in (1, 2, 3)])
    return NeckRecording(columns["time"][::stride], spools[::stride], bend[::stride], 1e-3 * load)


def expected_bend(recording: NeckRecording, shared: Array, own: Array) -> Array:
    """Bend (T, 2) [rad] of the model.

    Parameters
    ----------
    shared : gain of the winches, tendon, softening, compression, delay [s], turn of the sensor [rad]
    own : zeros of the sensor [rad, rad] and slack of each tendon [mm] in this recording
    """
    gain, tendon, softening, compression, delay, turn = shared
    lift = gain / RADIUS * (recording.delayed(delay) - 1e-3 * own[2:])
    c, s = math.cos(turn), math.sin(turn)
    bend = static_bend(lift, recording.mass, tendon, softening, compression)
    turned: Array = bend @ np.array([[c, s], [-s, c]]) + own[:2]
    return turned


def predict_third_load(folder: Path) -> NeckPrediction:
    """Fit 0 g and 1,000 g together, take the zeros of 500 g from its first 20 s, and predict the rest of it."""
    recordings = [read_neck(folder, load) for load in FITTED_LOADS]
    asked = read_neck(folder, ASKED_LOAD)
    begin = asked.time < ZEROS_UNTIL

    def residuals(x: Array) -> Array:
        rows, owns = [], x[6:].reshape(-1, 5)
        for recording, own in zip(recordings, owns, strict=True):
            rows += [np.degrees(expected_bend(recording, x[:6], own) - recording.bend).ravel(), _SLACK_WEIGHT * own[2:]]
        every: Array = np.concatenate(rows)
        return every

    scale = np.r_[0.1, 3.0, 0.1, 0.05, 0.02, 0.05, np.tile([0.02, 0.02, 0.5, 0.5, 0.5], 2)]
    bounds = np.r_[_LOW, np.tile(-_OWN_HIGH, 2)], np.r_[_HIGH, np.tile(_OWN_HIGH, 2)]
    x = least_squares(residuals, np.r_[_BEGIN, np.zeros(10)], x_scale=scale, ftol=1e-8, max_nfev=200, bounds=bounds).x

    def zeros(own: Array) -> Array:
        wrong = expected_bend(asked, x[:6], own) - asked.bend
        rows: Array = np.r_[np.degrees(wrong[begin]).ravel(), _SLACK_WEIGHT * own[2:]]
        return rows

    own = least_squares(zeros, np.zeros(5)).x
    wrong = np.degrees(expected_bend(asked, x[:6], own) - asked.bend)[~begin]
    error, low, high = error_by_blocks(wrong, asked.time[~begin])
    parts = zip(FITTED_LOADS, recordings, x[6:].reshape(-1, 5), strict=True)
    fitted = {load: _rms(np.degrees(expected_bend(one, x[:6], its) - one.bend)) for load, one, its in parts}
    names = ("gain of the winches", "tendon", "softening [1/kg]", "compression", "delay [s]", "turn [rad]")
    return NeckPrediction(
        error, low, high, fitted, dict(zip(names, x.tolist(), strict=False)), _linear(recordings, asked, begin)
    )


def error_by_blocks(wrong: Array, time: Array) -> tuple[float, float, float]:
    """RMS of the vector error (T, 2), and its 95 % interval by a bootstrap of blocks of 5 s."""
    block = ((time - time[0]) // _BLOCK).astype(int)
    squares = np.sum(wrong**2, axis=1)
    sums, counts = np.bincount(block, squares), np.bincount(block)
    drawn = np.random.default_rng(0).integers(len(sums), size=(_DRAWS, len(sums)))
    low, high = np.quantile(np.sqrt(sums[drawn].sum(axis=1) / counts[drawn].sum(axis=1)), [0.025, 0.975])
    return _rms(wrong), float(low), float(high)


def _linear(recordings: list[NeckRecording], asked: NeckRecording, begin: NDArray[np.bool_]) -> float:
    """Error [deg] of a linear map of the motors 50 ms earlier, whose zeros the begin of the asked recording gives."""
    spools = [recording.delayed(0.05) for recording in recordings]
    zeros = np.repeat(np.eye(len(spools)), [len(part) for part in spools], axis=0)
    rows = np.column_stack([np.concatenate(spools), zeros])
    slopes = np.linalg.lstsq(rows, np.concatenate([one.bend for one in recordings]), rcond=None)[0][:3]
    wrong = asked.delayed(0.05) @ slopes - asked.bend
    return _rms(np.degrees(wrong - wrong[begin].mean(axis=0))[~begin])


def _rms(wrong: Array) -> float:
    return float(np.sqrt(np.mean(np.sum(wrong**2, axis=1))))
