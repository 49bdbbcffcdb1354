"""Numbers of many recorded courses at once, each over a horizon of its own: the strict readings of T2's columns."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array

READINGS = ("rmse", "rmse_move", "settling", "settling_after", "steady_state", "missing")
BAND = 0.02
"""About the final reference, over the move."""


class Courses(NamedTuple):
    """Recorded courses, sampled every `period` [s]."""

    theta: Array
    """(N, T), nan from where one has failed"""
    wanted: Array
    """(N, T)"""
    rests: Array
    """When each reference rests, (N,) [s]"""
    horizons: Array
    """How much of each counts, (N,) [s]"""
    period: float
    converged: NDArray[np.bool_]
    """Whose numbers do not depend on the integration step, (N,)"""


def readings(of: Courses) -> dict[str, Array]:
    """READINGS by name, (N,) each.

    They are the metrics of these names (wristctl.simulation.metrics) on the samples: RMSE of e over the horizon and
    over the motion, last time outside +-2 % of the final reference, from the start and from when the reference rests,
    and the mean |e| of the last 10 %. What has failed, or never settles, is nan.
    """
    theta, wanted, rests, horizons, period, _ = of
    time: Array = np.arange(theta.shape[1], dtype=np.float64) * period
    error, final = theta - wanted, wanted[:, -1:]
    inside: NDArray[np.bool_] = np.array(time[None, :] < horizons[:, None] - 0.5 * period, bool)
    alive: NDArray[np.bool_] = np.array(np.isfinite(np.where(inside, theta, 0.0)).all(axis=1), bool)
    kept = np.where(inside & alive[:, None], error, 0.0)
    count = inside.sum(axis=1)
    moving = inside & (time <= rests[:, None])
    late = inside & (time >= 0.9 * horizons[:, None] - 1e-9)
    away = np.abs(np.where(alive[:, None], theta, 0.0) - final)
    last = _last_exit(np.where(inside, away, 0.0), BAND * np.abs(final), time)
    settled = (rests < horizons) & (last < horizons - 1.5 * period)
    rmse = np.sqrt((kept**2).sum(axis=1) / count)
    of_move = np.sqrt((kept**2 * moving).sum(axis=1) / np.maximum(moving.sum(axis=1), 1))
    settling = np.where(settled, last, np.nan)
    found = {
        "rmse": rmse,
        "rmse_move": np.where(rests <= 0.0, rmse, of_move),
        "settling": settling,
        "settling_after": np.maximum(settling - rests, 0.0),
        "steady_state": (np.abs(kept) * late).sum(axis=1) / late.sum(axis=1),
    }
    found["missing"] = found["steady_state"] / np.abs(np.where(inside, wanted, 0.0)).max(axis=1)
    return {name: np.where(alive, values, np.nan) for name, values in found.items()}


def _last_exit(away: Array, band: Array, time: Array) -> Array:
    """The last time (N,) at which a distance (N, T) was beyond the band (N, 1); 0 where it never was."""
    outside: NDArray[np.bool_] = np.array(away > band, bool)
    return np.where(outside.any(axis=1), time[len(time) - 1 - outside[:, ::-1].argmax(axis=1)], 0.0)


def usual(of: Courses) -> tuple[list[str], Array]:
    """RMSE, settling time and steady-state error in every usual reading: their names, and (N, readings, 3).

    The RMSE is over the horizon; settling is the last exit from 1, 2 or 5 % of the angle about its final reference, or
    of the error about none; the steady-state error the mean |e| of the last 10 % or of the last second. No reading is
    of one sample: of a loop that swings it would be what the swing happens to pass.
    """
    time: Array = np.arange(of.theta.shape[1], dtype=np.float64) * of.period
    inside = time < of.horizons[:, None] - 0.5 * of.period
    alive: NDArray[np.bool_] = np.array(np.isfinite(np.where(inside, of.theta, 0.0)).all(axis=1), bool)
    theta, final = np.where(alive[:, None], of.theta, 0.0), of.wanted[:, -1:]
    size = np.where(inside, np.abs(theta - of.wanted), 0.0)
    rmse = np.sqrt((size**2).sum(axis=1) / inside.sum(axis=1))
    ends = {
        "last 10 %": 0.1 * of.horizons,
        "last second": np.minimum(1.0, of.horizons),
    }
    steady = {}
    for name, lasting in ends.items():
        late = inside & (time >= (of.horizons - lasting)[:, None] - 1e-9)
        steady[name] = (size * late).sum(axis=1) / late.sum(axis=1)
    names, columns = [], []
    for what, away in (("angle", np.where(inside, np.abs(theta - final), 0.0)), ("error", size)):
        for band in (0.01, 0.02, 0.05):
            last = _last_exit(away, band * np.abs(final), time)
            settled = (of.rests < of.horizons) & (last < of.horizons - 1.5 * of.period) & alive
            for name, error in steady.items():
                names.append(f"{what} within {100 * band:.0f} %, {name}")
                columns.append(np.where(settled[:, None], np.stack([rmse, last, error], axis=1), np.nan))
    return names, np.stack(columns, axis=1)
