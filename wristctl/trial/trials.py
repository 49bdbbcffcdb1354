"""The trials of an experiment: their order, their motions, what the log shows of them, and each in simulation."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, cast

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import DirectionName, Loop
from wristctl.config.plant import Disturbances, Push
from wristctl.config.simulate import SimulateSettings
from wristctl.config.study import Study
from wristctl.simulation.closed_loop import simulate
from wristctl.simulation.metrics import metrics_of, summed
from wristctl.simulation.motion import Motion
from wristctl.simulation.oscillation import oscillations
from wristctl.simulation.repetitions import Simulation
from wristctl.trial.motions import has_path
from wristctl.trial.spools import on_plus_side
from wristctl.wrist.directions import ACTIVE, DIRECTIONS
from wristctl.wrist.kinematics import Inverse

if TYPE_CHECKING:
    import pandas as pd


# Bend [rad] below which a push has nothing to be against.
_STRAIGHT = math.radians(1.0)
# Seconds before the push over which the load is taken as quiet.
_BEFORE = 0.5


class Trial(NamedTuple):
    """One move and back."""

    number: int
    direction: str
    """Of bending; of a path in two planes its name."""
    repetition: int
    push: float
    """Largest force against the bend [N], 0 without a push."""
    row: int
    """Index into the settings' rows of controllers."""

    @property
    def scenario(self) -> str:
        """Name that the trial's noise goes by: direction and push, without row and repetition."""
        return f"{self.direction}, push {self.push:g} N"

    @property
    def plane(self) -> str:
        """The bending plane; empty where it is no direction of one plane."""
        return DIRECTIONS[self.direction].plane if self.direction in DIRECTIONS else ""

    def pushed(self, push: Push) -> Push:
        """The push of an experiment as it acts in this trial, on a bench and in simulation: against the bend."""
        return push.model_copy(update={"force": -DIRECTIONS[self.direction].sign * self.push})

    def disturbances(self, settings: HwRunSettings, followed: Motion) -> Disturbances:
        """What disturbs this trial: in one plane its push against the bend, in two toward `push_toward_deg`.

        Without that it is against the bend that is wanted where the push begins.
        """
        if followed.planes == 1:
            return Disturbances(push=self.pushed(settings.push))
        toward = settings.push_toward_deg
        if toward is None:
            bend = [np.interp(settings.push.start, followed.time, plane) for plane in followed.bend_ref.T]
            toward = math.degrees(math.atan2(-bend[1], -bend[0])) if np.hypot(*bend) > _STRAIGHT else 90.0
        push = settings.push.model_copy(update={"force": self.push})
        return Disturbances(push=push, toward_deg=toward)


def motions_of(settings: HwRunSettings) -> list[str]:
    """Names of the motions: directions, or the one path in two planes that the reference is."""
    if settings.planes == 2 and has_path(settings):
        return [settings.reference.kind]
    return list(dict.fromkeys(settings.directions))


def trials_of(settings: HwRunSettings, rng: np.random.Generator) -> list[Trial]:
    """All trials: planes in random order, since the wrist must be turned between them, and all of a plane shuffled.

    On a rig that bends in two planes nobody turns the wrist, and all are shuffled.
    """
    pushes = [0.0] * settings.without_push + [settings.push.force] * (settings.push.force != 0.0)
    every = [
        (direction, repetition, push, row)
        for direction in motions_of(settings)
        for repetition in range(settings.repetitions)
        for push in pushes
        for row in range(len(settings.rows))
    ]
    turned = {name: "" if settings.planes == 2 else DIRECTIONS[name].plane for name in motions_of(settings)}
    ordered = []
    for plane in rng.permutation(list(dict.fromkeys(turned.values()))):
        members = [combination for combination in every if turned[combination[0]] == plane]
        ordered += [members[k] for k in rng.permutation(len(members))]
    return [Trial(number, *combination) for number, combination in enumerate(ordered)]


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


# The metrics of the paper's tables; also told of the true angle, where it is known.
JUDGED = ("rmse", "settling", "steady_state", "oscillation")

# Seconds by which a person may push too early.
EARLY = 0.5
# Load torque [N m] that counts as a push.
LEAST_PUSH = 0.01


def evaluated(
    trial: Trial, course: pd.DataFrame, followed: Motion, push: Push, period: float, truth: pd.DataFrame | None
) -> dict[str, float]:
    """Metrics of one whole trial by the estimated angle, of the true one as `true_...`, and what became of a push.

    `course` holds its rows of the log, `truth` those of an emulated bench, whose push ends when it should; by the log
    it ends when the estimated load has fallen again. All values are nan where the log is not whole.
    """
    time, theta, error = (course[name].to_numpy(float) for name in ("time", "theta", "error"))
    names = [*summed(), "oscillation", *(f"true_{name}" for name in JUDGED), "recovery", "true_recovery", "push_torque"]
    metrics = dict.fromkeys(names, math.nan)
    if not len(time) or time[-1] < followed.horizon - 1.5 * period:
        return metrics
    grid, goals = followed.time, followed.goals
    tensions = course[[f"tension_{tendon}" for tendon in ACTIVE]].to_numpy(float)
    plus = on_plus_side(trial.plane)
    sides = np.stack([tensions[:, plus].mean(axis=1), tensions[:, ~plus].mean(axis=1)], axis=1)
    tension = np.stack([np.interp(grid, time, side) for side in sides.T], axis=1)
    saturated = np.abs(course["torque_wanted"].to_numpy(float) - course["torque"].to_numpy(float)) > 1e-9

    def judged(angle: Array) -> dict[str, float]:
        flags, which = np.interp(grid, time, saturated.astype(float)) > 0.5, np.zeros(1, np.int64)
        swing = float(oscillations(angle[None], followed.theta_ref[None], which, period)[0])
        return metrics_of(period, angle, followed.theta_ref, tension, goals, flags) | {"oscillation": swing}

    metrics |= judged(np.interp(grid, time, theta))
    if trial.push:
        pushed = push_seen(time, course["load"].to_numpy(float), max(followed.rest, push.start - EARLY), LEAST_PUSH)
        if pushed is not None:
            metrics["push_torque"] = pushed.torque
            metrics["recovery"] = recovery(time, error, goals.move, pushed.end)
    if truth is not None and len(truth):
        angle = np.interp(grid, truth["time"], truth["theta"])
        metrics |= {f"true_{name}": value for name, value in judged(angle).items() if name in JUDGED}
        if trial.push:
            ended = push.start + push.duration
            metrics["true_recovery"] = recovery(grid, angle - followed.theta_ref, goals.move, ended)
    return metrics


def twin(
    study: Study, trial: Trial, network: Inverse | None, tuned: Mapping[str, Mapping[str, float]] | None,
    loop: Loop | None = None,
) -> Simulation:  # fmt: skip
    """Simulate a trial of the study's hw-run section; of a controller that learns a first repetition, as there.

    `loop` takes the place of the section's own, which on an emulated rig has the emulated wrist.
    """
    settings = study.hw_run
    row = settings.rows[trial.row]
    disturbances = Disturbances(push=trial.pushed(settings.push))
    chosen = SimulateSettings(
        controller=row.controller,
        gains=row.gains,
        loop=(loop or settings.loop).model_copy(update={"disturbances": disturbances}),
        reference=settings.reference,
        direction=cast(DirectionName, trial.direction),
        horizon=settings.horizon,
    )
    return simulate(study.model_copy(update={"simulate": chosen}), network, tuned, learns=False).first
