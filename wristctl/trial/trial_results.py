"""What trials came to: motions as logged and as they truly were, metrics by both, and each trial in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import Loop
from wristctl.config.plant import Plant
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import in_a_first_repetition
from wristctl.control.table import controller, gains_of
from wristctl.records import Run
from wristctl.simulation.closed_loop import asked_of, repeat, scenario_of
from wristctl.simulation.error_ellipse import ErrorEllipse, error_ellipse
from wristctl.simulation.homed_worlds import homed
from wristctl.simulation.live_reference import recorded
from wristctl.simulation.metrics import metrics_of, summed
from wristctl.simulation.motion import Motion
from wristctl.simulation.oscillation import oscillation, oscillations
from wristctl.simulation.repetitions import Simulation
from wristctl.simulation.trajectory import Trajectory, size_of
from wristctl.simulation.worlds import Draws, plant_of
from wristctl.trial.log import column_of
from wristctl.trial.motions import motion_of
from wristctl.trial.rig_belief import PLANES, layout_of_rig, names_of_planes, places_of_tendons
from wristctl.trial.rig_settings import as_modelled, share_of_pair
from wristctl.trial.trials import Trial
from wristctl.wrist.kinematics import Inverse
from wristctl.wrist.plant import PLANTS_IN_SPACE
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips
from wristctl.wrist.tendon_layout import TendonLayout

if TYPE_CHECKING:
    import pandas as pd

# The metrics of the paper's tables; also told of the true angle, where it is known.
JUDGED = ("rmse", "settling", "steady_state", "oscillation")
# Of a motion in two planes: metrics that the log alone gives, and those that the true bend gives too.
TRULY = ("rmse_ulnar", "rmse_flexion", "rmse", "largest_error", "steady_state", "settling", "oscillation")
LOGGED = (*TRULY, "peak_tension", "chattering", "saturation")
# Columns of trials.csv beside the metrics of a motion in two planes: unit and meaning.
FURTHER: Mapping[str, tuple[str, str]] = {
    "recovery": ("s", "from the end of the push in the estimated load until |e| stays within 2 % of the largest bend"),
    "true_recovery": ("s", "the same by the emulated wrist's true bend, from the true end of the push"),
    "push_torque": ("N m", "largest load torque of the push, as estimated; empty where the wrist moves meanwhile"),
    "error_major": ("rad", "standard deviation of the error along the longer axis of its covariance"),
    "error_minor": ("rad", "the same across that axis"),
    "error_toward": ("rad", "direction of that axis, from ulnar toward flexion, within a right angle of ulnar"),
    "true_error_major": ("rad", "the same as error_major of the emulated wrist's true bend"),
    "true_error_minor": ("rad", "the same as error_minor of the emulated wrist's true bend"),
    "true_error_toward": ("rad", "the same as error_toward of the emulated wrist's true bend"),
}
# Columns of the error's ellipse, in the order of its values.
ELLIPSE = tuple(f"error_{name}" for name in ErrorEllipse._fields)
# File of a run that has the live reference as it was followed.
RECORD = "data/reference.csv"
# Seconds before the push over which the load is taken as quiet.
_BEFORE = 0.5
# Seconds by which a person may push too early.
EARLY = 0.5
# Load torque [N m] that counts as a push.
LEAST_PUSH = 0.01


def logged_course(course: pd.DataFrame, followed: Motion, wrist: WristParameters) -> Trajectory:
    """A trial in two planes as logged, on the grid of its motion: the bend as estimated, and pulls as commanded."""

    def planes(name: str) -> Array:
        return _on(followed.time, course, [f"{name}_{plane}" for plane in PLANES])

    bend = planes("bend")
    pulls = _on(followed.time, course, [name for name in course.columns if name.startswith("tension_")])
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


def true_course(logged: Trajectory, truth: pd.DataFrame, wrist: WristParameters, plant: Plant) -> Trajectory:
    """The same as it truly was on an emulated bench; its rate is still the estimated one."""
    time = logged.time
    segments = sum(name.startswith("bend_") and name[5].isdigit() for name in truth.columns) // len(PLANES)
    names = [f"bend_{k + 1}_{plane}" for k in range(segments) for plane in PLANES]
    bends = _on(time, truth, names)
    return replace(
        logged,
        theta=_on(time, truth, [f"bend_{plane}" for plane in PLANES]),
        acting=_on(time, truth, [name for name in truth.columns if name.startswith("pull_")]),
        segment_theta=bends,
        tip=PLANTS_IN_SPACE[plant.model].tips(plant_of(wrist, plant), bends),
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
    settings = run.config.hw_run
    reference = recorded(settings.reference, run.path / RECORD)
    rows = log[log["trial"] == number]
    if reference.inverse == "network":  # which the log has passed through already
        followed = _followed_in(rows, settings, run.config.wrist)
    else:
        followed = motion_of(settings.model_copy(update={"reference": reference}), run.config.wrist, name)
    course = logged_course(rows, followed, run.config.wrist)
    if not run.has("data/truth.csv"):
        return course
    truth = run.data("truth")
    return true_course(course, truth[truth["trial"] == number], run.config.wrist, settings.loop.plant)


def _followed_in(log: pd.DataFrame, settings: HwRunSettings, wrist: WristParameters) -> Motion:
    """The motion in two planes that a trial's ticks have followed."""
    time: Array = settings.control_period * np.arange(round(settings.horizon / settings.control_period), dtype=float)
    names = ("bend_ref", "rate_ref", "acceleration_ref")
    rows = [_on(time, log, [f"{name}_{plane}" for name in names]).T for plane in PLANES]
    return Motion.of_bends(np.stack(rows), settings.control_period, wrist.length)


class PushSeen(NamedTuple):
    """A push as the record shows it: when it began and ended [s], and its largest load torque [N m]."""

    start: float
    end: float
    torque: float


def push_seen(time: Array, load: Array, after: float, least: float) -> PushSeen | None:
    """The push in an estimated load (T,): where it leaves its course by `least` [N m] once the move is over.

    The load's course without a push is its median over the half second before `after` [s], when the push may begin at
    the earliest; None where the load never leaves it.
    """
    quiet = load[(time >= after - _BEFORE) & (time < after)]
    if not len(quiet):
        return None
    rise = np.where(time >= after, np.abs(load - np.median(quiet)), 0.0)
    peak = int(np.argmax(rise))
    if rise[peak] < least:
        return None
    within = rise < 0.25 * rise[peak]
    before, later = np.flatnonzero(within[:peak]), np.flatnonzero(within[peak:])
    end = peak + (later[0] if len(later) else len(time) - 1 - peak)
    return PushSeen(float(time[before[-1] + 1 if len(before) else 0]), float(time[end]), float(rise[peak]))


def recovery(time: Array, error: Array, move: float, end: float) -> float:
    """Seconds from the end of a push until |error| (T,) [rad] stays within 2 % of the move; nan if it never does."""
    outside = np.flatnonzero((time >= end) & (np.abs(error) > 0.02 * abs(move)))
    if not len(outside):
        return 0.0
    return float(time[outside[-1] + 1] - end) if outside[-1] + 1 < len(time) else float("nan")


def evaluated(
    trial: Trial, log: pd.DataFrame, followed: Motion, settings: HwRunSettings, truth: pd.DataFrame | None,
    layout: TendonLayout | None = None,
) -> dict[str, float]:  # fmt: skip
    """Metrics of one whole trial by the estimated bend, of the true one as `true_...`, and what became of a push.

    `log` holds its rows of the log, `truth` those of an emulated bench, whose push ends when it should; by the log it
    ends when the estimated load has fallen again. All values are nan where the log is not whole. `layout` has the
    tendons that the rig's motors wind; None: the board's four.
    """
    names, one = names_of_planes(followed.planes, trial.plane), followed.planes == 1
    by_log, truly = ((*summed(), "oscillation"), JUDGED) if one else (LOGGED, TRULY)
    spatial = () if one else ELLIPSE
    columns = [*by_log, *(f"true_{name}" for name in truly), *_OF_PUSH, *spatial, *(f"true_{name}" for name in spatial)]
    metrics = dict.fromkeys(columns, math.nan)
    grid, push, period = followed.time, settings.push, settings.control_period
    if log.empty or log["time"].iloc[-1] < followed.horizon - 1.5 * period:
        return metrics

    def rows(name: str, table: pd.DataFrame = log) -> Array:
        return table[[column_of(name, plane, len(names)) for plane in names]].to_numpy(float)

    def on_grid(values: Array, table: pd.DataFrame = log) -> Array:
        time = table["time"].to_numpy(float)
        return np.stack([np.interp(grid, time, column) for column in values.T], axis=1)

    pulls = [name for name in log.columns if name.startswith("tension_")]
    place, tensions = places_of_tendons(names, layout), log[pulls].to_numpy(float)
    tension = on_grid(np.stack([tensions[:, place == each].mean(axis=1) for each in range(place.max() + 1)], axis=1))
    beyond = np.abs(rows("torque_wanted") - rows("torque")).max(axis=1, keepdims=True) > 1e-9
    saturated = (on_grid(beyond.astype(float))[:, 0] > 0.5).astype(float)
    reach = followed.goals.move if one else float(size_of(followed.bend_ref).max())

    def judged(bend: Array) -> dict[str, float]:
        values = metrics_of(period, bend, followed.bend_ref, tension, followed.goals, saturated)
        swings = oscillations(bend.T, followed.bend_ref.T, np.arange(len(names)), period)
        values["oscillation"] = float(np.max(swings))
        if not one:
            values |= zip(ELLIPSE, error_ellipse(bend - followed.bend_ref), strict=True)
        return values

    def of(values: dict[str, float], chosen: Sequence[str]) -> dict[str, float]:
        return {name: values[name] for name in chosen}

    time = log["time"].to_numpy(float)
    metrics |= of(judged(on_grid(rows("bend"))), (*by_log, *spatial))
    quiet = max(followed.rest, push.start - EARLY) if one else push.start - EARLY
    if trial.push and followed.rest <= quiet:
        seen = push_seen(time, _load(time, rows("load"), quiet), quiet, LEAST_PUSH)
        if seen is not None:
            metrics["push_torque"] = seen.torque
            metrics["recovery"] = recovery(time, size_of(rows("error")), reach, seen.end)
    if truth is not None and len(truth):
        true = on_grid(rows("bend", truth), truth)
        metrics |= {f"true_{name}": value for name, value in of(judged(true), (*truly, *spatial)).items()}
        if trial.push:
            ended = push.start + push.duration
            metrics["true_recovery"] = recovery(grid, size_of(true - followed.bend_ref), reach, ended)
    return metrics


# Values of a row that a push has.
_OF_PUSH = ("recovery", "true_recovery", "push_torque")


def metrics_of_trials(
    folder: Path, trials: Sequence[Trial], motions: Mapping[str, Motion], settings: HwRunSettings,
    layout: TendonLayout | None = None,
) -> list[dict[str, float]]:  # fmt: skip
    """Metrics of each of these trials by the log in a folder, as `evaluated` gives them."""
    import pandas as pd

    logs, file = pd.read_csv(folder / "log.csv"), folder / "truth.csv"
    truths = pd.read_csv(file) if file.is_file() else None
    found = []
    for trial in trials:
        log, followed = logs[logs["trial"] == trial.number], motions[trial.direction]
        truth = None if truths is None else truths[truths["trial"] == trial.number]
        found.append(evaluated(trial, log, followed, settings, truth, layout))
    return found


def _load(time: Array, load: Array, after: float) -> Array:
    """The load (T,) [N m] of an estimate (T, P): in one plane signed, in two its size off what it was before."""
    if load.shape[1] == 1:
        return load[:, 0]
    return size_of(load - np.median(load[time < after][-50:], axis=0))


def in_pairs(wrist: WristParameters, layout: TendonLayout, loop: Loop) -> tuple[WristParameters, Loop]:
    """A rig in one plane with two tendons on either side, as models have it, in place of as many as it has.

    Each has the share of their stiffness and tension limits that makes a side the same.
    """
    share = share_of_pair(layout, 1)
    motors = loop.actuator.model_copy(update={"tendon_stiffness": share * loop.actuator.tendon_stiffness})
    tensions = {"pretension": share * wrist.pretension, "tension_limit": share * wrist.tension_limit}
    return as_modelled(wrist, layout, 1).model_copy(update=tensions), loop.model_copy(update={"actuator": motors})


def twin(
    study: Study, trial: Trial, network: Inverse | None, tuned: Mapping[str, Mapping[str, float]] | None,
    loop: Loop | None = None, seen: bool = False,
) -> Simulation:  # fmt: skip
    """Simulate a trial of the study's hw-run section; of a controller that learns a first repetition, as there.

    `loop` takes the place of the section's own, which on an emulated rig has the emulated wrist. With `seen` its bend
    is the one that its observer sees, as a trial's is whose true bend nobody knows.
    """
    settings, wrist, scenario = study.hw_run, study.wrist, trial.scenario
    row, followed = settings.rows[trial.row], motion_of(settings, wrist, trial.direction, network)
    law = in_a_first_repetition(controller(row.controller))
    if (layout := layout_of_rig(settings, wrist)) is not None and settings.planes == 1:
        wrist, loop = in_pairs(wrist, layout, loop or settings.loop)
        study = study.model_copy(update={"wrist": wrist})
    asked = (loop or settings.loop).model_copy(update={"disturbances": trial.disturbances(settings, followed)})
    if settings.homing.stretch == "measured":
        asked = homed(wrist, asked)
    if settings.planes == 1:  # the wrist may leave the plane in which its rig bends
        move = {"reference": settings.reference, "direction": trial.direction, "horizon": settings.horizon}
        chosen = study.simulate.model_copy(update={"loop": asked, **move})
        simulated = study.model_copy(update={"simulate": chosen})
        wrist, asked, followed = asked_of(simulated, settings.control_period, network)
        scenario = scenario_of(chosen.reference, chosen.direction)
    elif layout is None:
        wrist = wrist.model_copy(update={"tendons": "four"})  # the fifth in the centre is not wound
    gains = np.array([gains_of(law, row.gains, tuned)])
    (repeated,) = repeat(law, gains, [followed], np.zeros(1, np.int64), asked, wrist, [scenario], Draws(study.seed))
    return _as_seen(repeated.first, followed, settings.control_period) if seen else repeated.first


def _as_seen(simulated: Simulation, followed: Motion, period: float) -> Simulation:
    """A simulation with the bend that its observer sees, and errors and swing of that."""
    if simulated.trajectory.seen is None or simulated.failed:
        return simulated
    course = replace(simulated.trajectory, theta=simulated.trajectory.seen)
    values = metrics_of(period, course.theta, course.theta_ref, course.tension, followed.goals)
    values["oscillation"] = oscillation(course)
    told = {name: values[name] for name in TRULY if name in values}
    return replace(simulated, trajectory=course, metrics=simulated.metrics | told)
