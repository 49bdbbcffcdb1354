"""Closed loops out of rollouts: trajectories, and the loop of a study's `simulate` section, repeated."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.choices import PLANTS
from wristctl.config.loop import DirectionName, Loop, Reference
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller, gains_of
from wristctl.simulation.batch import Start, sample_period
from wristctl.simulation.draws import Draws, is_random
from wristctl.simulation.metrics import of_trajectory
from wristctl.simulation.oscillation import LIMIT_CYCLE, oscillation_frequency
from wristctl.simulation.reference import Motion, motion, reference_name, toward
from wristctl.simulation.rollout import Outcome, rollout
from wristctl.simulation.trajectory import Trajectory
from wristctl.simulation.worlds import loop_facing, loops_of, plant_of
from wristctl.wrist.kinematics import Inverse

_TOGETHER = 64
"""Rollouts that are recorded at once."""


@dataclass(frozen=True)
class Simulation:
    """A trajectory with its metrics; `failed` where the wrist left its range, which it was in `until` then [s]."""

    trajectory: Trajectory
    metrics: dict[str, float]
    failed: bool
    until: float


@dataclass(frozen=True)
class Repeated:
    """The same loop several times, each with noise and a drawn plant of its own."""

    first: Simulation
    metrics: dict[str, Array]
    """Of each repetition, (R,)."""
    failed: NDArray[np.bool_]
    """(R,)"""
    until: Array
    """(R,) when each was last within its range [s]."""
    errors: Array
    """theta - theta_ref over time of the first repetitions, as many as are worth drawing, (<= R, T) [rad]."""
    bears: float = math.inf
    """Largest tension that a tendon bears [N]."""

    @classmethod
    def once(cls, done: Simulation) -> Repeated:
        """One simulation."""
        metrics = {name: np.array([value]) for name, value in done.metrics.items()}
        return cls(done, metrics, np.array([done.failed]), np.array([done.until]), done.trajectory.error[None])

    @property
    def failure(self) -> str:
        """In words how it failed; empty where it did not."""
        if not self.failed.any():
            return ""
        count = f" in {self.failed.sum()} of {len(self.failed)} repetitions" if len(self.failed) > 1 else ""
        return f"left its range at {self.until[self.failed].min():.3g} s{count}"

    @property
    def fate(self) -> str:
        """In words what became of it: that it failed, swings, or pulls harder than tendons can; else empty."""
        return "; ".join(each for each in (self._end, self._strain) if each)

    @property
    def _strain(self) -> str:
        """What no tendon bears; 1 % more is what a spool's steps and a swing of the wrist may add to the limit."""
        known = self.metrics.get("peak_tension", np.empty(0))
        most = float(np.nanmax(known)) if np.isfinite(known).any() else 0.0
        return f"NOT PHYSICAL: {most:.3g} N in a tendon that bears {self.bears:g}" if most > 1.01 * self.bears else ""

    @property
    def _end(self) -> str:
        if self.failure:
            return f"FAILED: {self.failure}"
        known = self.metrics.get("oscillation", np.empty(0))
        swing = float(np.median(known[np.isfinite(known)])) if np.isfinite(known).any() else 0.0
        if swing <= LIMIT_CYCLE:
            return ""
        rate = oscillation_frequency(self.first.trajectory)
        return f"LIMIT CYCLE: +-{np.degrees(swing):.2g} deg at {rate:.2g} Hz"

    def labelled(self, label: str) -> Repeated:
        """The same with this label on its trajectory."""
        course = replace(self.first.trajectory, label=label)
        return replace(self, first=replace(self.first, trajectory=course))


def repeat(
    law: Controller,
    gains: Array,
    motions: Sequence[Motion],
    which: NDArray[np.int64],
    loop: Loop,
    wrist: WristParameters,
    scenarios: Sequence[str],
    draws: Draws,
    repetitions: int = 1,
    start: Start | None = None,
    progress: Callable[[float], None] | None = None,
) -> list[Repeated]:
    """Each of the rows, gains (count, g) with the motion `which` (count,), as often as asked for.

    `scenarios` are the names of the motions' scenarios, which their noise goes by. Where nothing is drawn a repetition
    could not differ from another: such loops run once.
    """
    rows, times = len(gains), repetitions if is_random(loop) else 1
    loops = loops_of(loop, [draws.plant(each) for each in range(times)])
    each = max(1, _TOGETHER // rows)
    found: list[_Gathered] = [_Gathered() for _ in range(rows)]
    for first in range(0, times, each):
        now = range(first, min(first + each, times))

        def report(share: float, now: range = now) -> None:
            if progress is not None:
                progress((now.start + share * len(now)) / times)

        lane_loops = loop if len(now) == 1 and loops[now[0]] is loop else [loops[k] for k in now for _ in range(rows)]
        streams = [draws.camera(scenarios[motion], k) for k in now for motion in which]
        outcome = rollout(
            law, np.tile(gains, (len(now), 1)), motions, np.tile(which, len(now)), lane_loops, wrist, start, streams,
            record=True, progress=report,
        )  # fmt: skip
        for lane, k in enumerate(k for k in now for _ in range(rows)):
            plant = plant_of(wrist, loops[k].plant)
            found[lane % rows].add(simulation(outcome, lane, motions[which[lane % rows]], plant, loop.plant.model))
    return [each.repeated(wrist.tension_limit) for each in found]


class _Gathered:
    """Repetitions of one row as they come."""

    def __init__(self) -> None:
        self._first: Simulation | None = None
        self._metrics: list[dict[str, float]] = []
        self._failed: list[bool] = []
        self._until: list[float] = []
        self._errors: list[Array] = []

    def add(self, done: Simulation) -> None:
        self._first = self._first or done
        self._metrics.append(done.metrics)
        self._failed.append(done.failed)
        self._until.append(done.until)
        if len(self._errors) < _TOGETHER:
            self._errors.append(done.trajectory.error)

    def repeated(self, bears: float) -> Repeated:
        assert self._first is not None
        metrics = {name: np.array([each[name] for each in self._metrics]) for name in self._first.metrics}
        failed, until = np.array(self._failed), np.array(self._until)
        return Repeated(self._first, metrics, failed, until, np.array(self._errors), bears)


def simulation(outcome: Outcome, index: int, followed: Motion, plant: WristParameters, model: str) -> Simulation:
    """The recorded rollout `index` with all its metrics; `plant` is the wrist as it is, of this plant model."""
    course = trajectory(outcome, index, followed, plant, model)
    metrics = {name: float(values[index]) for name, values in outcome.metrics.items()}
    failed, until = bool(outcome.failed[index]), float(outcome.until[index])
    return Simulation(course, metrics | of_trajectory(course), failed, until)


def trajectory(outcome: Outcome, index: int, followed: Motion, plant: WristParameters, model: str) -> Trajectory:
    """The recorded rollout `index` as a Trajectory; `plant` is the wrist as it is, of this plant model."""
    coordinates = outcome.coordinates(index)
    return Trajectory(
        label="",
        time=followed.time,
        theta=outcome.column("theta", index),
        segment_theta=coordinates,
        rate=outcome.column("rate", index),
        theta_ref=followed.theta_ref,
        theta_desired=followed.theta_desired,
        tip=PLANTS[model].tips(plant, coordinates),
        tip_desired=followed.tip_desired,
        torque_wanted=outcome.column("torque_wanted", index),
        torque=outcome.column("torque", index),
        tension=_sides(outcome, "tension", index),
        acting=_sides(outcome, "acting", index),
        seen=outcome.column("seen", index),
        outside=followed.outside,
    )


def _sides(outcome: Outcome, name: str, index: int) -> Array:
    """A recorded pair of columns of the + and the - side, (T, 2)."""
    return np.stack([outcome.column(f"{name}_{side}", index) for side in ("plus", "minus")], axis=-1)


def scenario_of(reference: Reference, direction: DirectionName) -> str:
    """The name that a scenario's noise goes by: its reference and direction."""
    return f"{reference_name(reference)}, {direction}"


def _equilibrium(loop: Loop) -> Start:
    model, n = PLANTS[loop.plant.model], loop.plant_segments
    return lambda plant: model.rest(plant, n, (plant.pretension, plant.pretension))


def simulate(
    study: Study,
    network: Inverse | None = None,
    tuned: Mapping[str, Mapping[str, float]] | None = None,
    progress: Callable[[float], None] | None = None,
) -> Repeated:
    """Run the study's `simulate` section: one closed loop, as often as it says.

    `network` is needed where the reference has `inverse: network`, `tuned` (gains by controller and name) where the
    gains are `tuned`. Raises UserError for an unknown controller or preset, a reference out of reach, or a start in
    equilibrium of a wrist that buckles.
    """
    chosen, draws = study.simulate, Draws(study.seed)
    wrist, loop = loop_facing(study.wrist, chosen.loop, chosen.direction)
    law = controller(chosen.controller)
    gains = np.array([gains_of(law, chosen.gains, tuned)])
    reference = toward(chosen.reference, chosen.direction)
    followed = motion(reference, wrist, chosen.horizon, sample_period(loop.control_period), network)
    start = _equilibrium(loop) if chosen.start == "equilibrium" else None
    scenario = scenario_of(chosen.reference, chosen.direction)
    which = np.zeros(1, np.int64)
    (done,) = repeat(
        law, gains, [followed], which, loop, wrist, [scenario], draws, chosen.repetitions, start, progress
    )  # fmt: skip
    name = chosen.gains if isinstance(chosen.gains, str) else "given"
    return done.labelled(f"{law.name}/{name}")
