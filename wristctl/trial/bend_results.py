"""What trials in two planes came to: motions as logged and as they truly were, metrics, and each in simulation."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.plant import Push
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import in_a_first_repetition
from wristctl.control.table import controller, gains_of
from wristctl.records import Run
from wristctl.simulation.closed_loop import follow
from wristctl.simulation.metrics import of_course
from wristctl.simulation.motion import Motion
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.trajectory import Trajectory, size_of
from wristctl.simulation.worlds import Draws, loops_of
from wristctl.trial.motions import motion_of
from wristctl.trial.rig_belief import PLANES, layout_of_axes
from wristctl.trial.trials import EARLY, LEAST_PUSH, Trial, push_seen, recovery
from wristctl.wrist.directions import ACTIVE
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

# Metrics of a motion that the log alone gives, and of those the ones that the true bend gives too.
LOGGED = (
    "rmse_ulnar", "rmse_flexion", "rmse", "largest_error", "steady_state", "oscillation", "peak_tension", "chattering",
    "saturation",
)  # fmt: skip
TRULY = ("rmse_ulnar", "rmse_flexion", "rmse", "largest_error", "steady_state", "oscillation")
# Columns of trials.csv beside the metrics: unit and meaning.
FURTHER: Mapping[str, tuple[str, str]] = {
    "settling": ("s", "time from which |e| stays within 2 % of the largest bend; empty where it never does"),
    "true_settling": ("s", "the same of the emulated wrist's true bend"),
    "recovery": ("s", "from the end of the push in the estimated load until |e| stays within 2 % of the largest bend"),
    "true_recovery": ("s", "the same by the emulated wrist's true bend, from the true end of the push"),
    "push_torque": ("N m", "largest load torque of the push, as estimated; empty where the wrist moves meanwhile"),
}
# Share of the largest bend within which an error is small.
_BAND = 0.02


def logged_course(course: pd.DataFrame, followed: Motion, wrist: WristParameters) -> Trajectory:
    """A trial as logged, on the grid of its motion: the bend as estimated, and pulls as commanded."""

    def planes(name: str) -> Array:
        return _on(followed.time, course, [f"{name}_{plane}" for plane in PLANES])

    bend = planes("bend")
    pulls = _on(followed.time, course, [f"tension_{tendon}" for tendon in ACTIVE])
    return Trajectory(
        label="",
        time=followed.time,
        theta=bend,
        segment_theta=bend,
        rate=planes("rate"),
        theta_ref=followed.bend_ref,
        theta_desired=followed.bend_ref,
        tip=spatial_tips(bend, wrist.length),
        tip_desired=spatial_tips(followed.bend_ref, wrist.length),
        torque_wanted=planes("torque_wanted"),
        torque=planes("torque"),
        tension=pulls,
        seen=bend,
        load=planes("load"),
        share=_on(followed.time, course, ["share"])[:, 0],
    )


def true_course(logged: Trajectory, truth: pd.DataFrame, length: float) -> Trajectory:
    """The same as it truly was on an emulated bench, of a wrist so long [m]; its rate is still the estimated one."""
    time = logged.time
    segments = sum(name.startswith("bend_") and name[5].isdigit() for name in truth.columns) // len(PLANES)
    names = [f"bend_{k + 1}_{plane}" for k in range(segments) for plane in PLANES]
    bends = _on(time, truth, names)
    return replace(
        logged,
        theta=_on(time, truth, [f"bend_{plane}" for plane in PLANES]),
        acting=_on(time, truth, [f"pull_{tendon}" for tendon in ACTIVE]),
        segment_theta=bends,
        tip=spatial_tips(bends, length),
    )


def _on(time: Array, table: pd.DataFrame, names: list[str]) -> Array:
    at = table["time"].to_numpy(float)
    return np.stack([np.interp(time, at, table[name].to_numpy(float)) for name in names], axis=1)


def first_course(run: Run) -> Trajectory | None:
    """The first trial of a run in two planes that went to its end: as it truly was, where that is known."""
    trials, log = run.data("trials"), run.data("log")
    done = trials[trials["outcome"] == "ok"]
    if done.empty:
        return None
    number, name = done.iloc[0]["trial"], str(done.iloc[0]["direction"])
    followed = motion_of(run.config.hw_run, run.config.wrist, name)
    course = logged_course(log[log["trial"] == number], followed, run.config.wrist)
    if not run.has("data/truth.csv"):
        return course
    truth = run.data("truth")
    return true_course(course, truth[truth["trial"] == number], run.config.wrist.length)


def whole(course: pd.DataFrame, followed: Motion) -> bool:
    """Whether a trial's log goes to the end of its motion."""
    return bool(len(course) and course["time"].iloc[-1] >= followed.horizon - 1.5 * followed.time[1])


def bends_evaluated(
    trial: Trial, course: pd.DataFrame, followed: Motion, push: Push, wrist: WristParameters,
    truth: pd.DataFrame | None,
) -> dict[str, float]:  # fmt: skip
    """Metrics of one whole trial by the estimated bend, of the true one as `true_...`, and what became of a push.

    `course` holds its rows of the log, `truth` those of an emulated bench. All values are nan where the log is not
    whole, and those of the push where the wrist moves meanwhile, but by the true bend.
    """
    metrics = dict.fromkeys([*LOGGED, *(f"true_{name}" for name in TRULY), *FURTHER], math.nan)
    if not whole(course, followed):
        return metrics
    logged = logged_course(course, followed, wrist)
    by_log = of_course(logged)
    metrics |= {name: by_log[name] for name in LOGGED}
    metrics["settling"] = _settling(logged)
    if trial.push and followed.rest < push.start - EARLY:
        seen_load = np.asarray(logged.load)
        load = seen_load - np.median(seen_load[logged.time < push.start - EARLY][-50:], axis=0)
        seen = push_seen(logged.time, np.hypot(*load.T), push.start - EARLY, LEAST_PUSH)
        if seen is not None:
            metrics["push_torque"] = seen.torque
            metrics["recovery"] = _recovery(logged, seen.end)
    if truth is not None and len(truth):
        true = true_course(logged, truth, wrist.length)
        truly = of_course(true)
        metrics |= {f"true_{name}": truly[name] for name in TRULY}
        metrics["true_settling"] = _settling(true)
        if trial.push:
            metrics["true_recovery"] = _recovery(true, push.start + push.duration)
    return metrics


def _size(course: Trajectory) -> float:
    return float(size_of(course.bend_ref).max())


def _settling(course: Trajectory) -> float:
    outside = np.flatnonzero(course.distance > _BAND * _size(course))
    if not len(outside):
        return 0.0
    return float(course.time[outside[-1] + 1]) if outside[-1] + 1 < len(course.time) else math.nan


def _recovery(course: Trajectory, end: float) -> float:
    return recovery(course.time, course.distance, _size(course), end)


def bend_twin(
    study: Study, trial: Trial, followed: Motion, tuned: Mapping[str, Mapping[str, float]] | None,
    loop: Loop | None = None,
) -> Simulation:  # fmt: skip
    """Simulate a trial in two planes of the study's hw-run section, or of a loop in the place of that section's."""
    settings, draws, wrist = study.hw_run, Draws(study.seed), study.wrist
    row = settings.rows[trial.row]
    law = in_a_first_repetition(controller(row.controller))
    disturbed = (loop or settings.loop).model_copy(update={"disturbances": trial.disturbances(settings, followed)})
    (loop,) = loops_of(disturbed, [draws.plant(0)])
    layout_of_axes(wrist)
    wound = wrist.model_copy(update={"tendons": "four"})  # the fifth in the centre is not
    gains, stream = np.array(gains_of(law, row.gains, tuned)), draws.camera(trial.scenario, 0)
    return follow(law, gains, followed, wound, loop, stream=stream)
