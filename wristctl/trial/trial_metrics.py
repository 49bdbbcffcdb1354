"""What the log of a trial shows, in numbers: made from the log alone, so that a stopped run is evaluated like any."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import Push
from wristctl.simulation.metrics import metrics_of, summed
from wristctl.simulation.motion import Motion
from wristctl.trial.spools import on_plus_side
from wristctl.trial.trials import Trial, push_seen, recovery
from wristctl.wrist.directions import ACTIVE

if TYPE_CHECKING:
    import pandas as pd


JUDGED = ("rmse", "settling", "steady_state")
"""The metrics of the paper's tables; also told of the true angle, where it is known."""

_EARLY = 0.5
"""Seconds by which a person may push too early."""
_LEAST_PUSH = 0.01
"""Load torque [N m] that counts as a push."""


def evaluated(
    trial: Trial, course: pd.DataFrame, followed: Motion, push: Push, period: float, truth: pd.DataFrame | None
) -> dict[str, float]:
    """Metrics of one whole trial by the estimated angle, of the true one as `true_...`, and what became of a push.

    `course` holds its rows of the log, `truth` those of an emulated bench, whose push ends when it should; by the log
    it ends when the estimated load has fallen again. All values are nan where the log is not whole.
    """
    time, theta, error = (course[name].to_numpy(float) for name in ("time", "theta", "error"))
    names = [*summed(), *(f"true_{name}" for name in JUDGED), "recovery", "true_recovery", "push_torque"]
    found = dict.fromkeys(names, math.nan)
    if not len(time) or time[-1] < followed.horizon - 1.5 * period:
        return found
    grid, goals = followed.time, followed.goals
    tensions = course[[f"tension_{tendon}" for tendon in ACTIVE]].to_numpy(float)
    plus = on_plus_side(trial.plane)
    sides = np.stack([tensions[:, plus].mean(axis=1), tensions[:, ~plus].mean(axis=1)], axis=1)
    tension = np.stack([np.interp(grid, time, side) for side in sides.T], axis=1)
    saturated = np.abs(course["torque_wanted"].to_numpy(float) - course["torque"].to_numpy(float)) > 1e-9

    def judged(angle: Array) -> dict[str, float]:
        flags = np.interp(grid, time, saturated.astype(float)) > 0.5
        return metrics_of(period, angle, followed.theta_ref, tension, goals, flags)

    found |= judged(np.interp(grid, time, theta))
    if trial.push:
        seen = push_seen(time, course["load"].to_numpy(float), max(followed.rest, push.start - _EARLY), _LEAST_PUSH)
        if seen is not None:
            found["push_torque"] = seen.torque
            found["recovery"] = recovery(time, error, goals.move, seen.end)
    if truth is not None and len(truth):
        angle = np.interp(grid, truth["time"], truth["theta"])
        found |= {f"true_{name}": value for name, value in judged(angle).items() if name in JUDGED}
        if trial.push:
            ended = push.start + push.duration
            found["true_recovery"] = recovery(grid, angle - followed.theta_ref, goals.move, ended)
    return found
