"""The loop of a study's `simulate` section in two planes, repeated: its motion, results, and in words how it ended."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.loop import DirectionName, Loop, Reference, sample_period
from wristctl.config.study import Study
from wristctl.config.wrist import WristParameters
from wristctl.control.table import controller, gains_of
from wristctl.errors import UserError
from wristctl.simulation.arrival import SHORT
from wristctl.simulation.bend_course import BendCourse
from wristctl.simulation.bend_outcome import BendOutcome
from wristctl.simulation.closed_loop import scenario_of
from wristctl.simulation.convergence import FINER, HALF, more_finely, tolerance
from wristctl.simulation.oscillation import LIMIT_CYCLE, chatter
from wristctl.simulation.recording import recorded_bends
from wristctl.simulation.reference import REFERENCES, course_of, motion, toward
from wristctl.simulation.repetitions import STRAIN, Repetitions
from wristctl.simulation.rollout import How
from wristctl.simulation.two_planes import check_bends, rollout_bends
from wristctl.simulation.worlds import Draws, World, is_random, loops_of
from wristctl.wrist.directions import DIRECTIONS, in_plane
from wristctl.wrist.tendon_layout import TendonLayout, off_both_sides

# Rollouts that are recorded at once.
_TOGETHER = 32
# Error [rad] that is none where nothing is asked for.
_STILL = math.radians(0.5)


def planes_of(loop: Loop, reference: Reference, wrist: WristParameters) -> int:
    """Planes that a loop bends in: two where the reference does, or where no tendons of the wrist pull in one alone.

    Raises UserError where these are more than the loop has, and for places of tendons that are no layout.
    """
    two = f"{reference.kind} bends" * (REFERENCES[reference.kind].planes == 2)
    if off_both_sides(wrist) is not None and TendonLayout.of(wrist).planes == 2:
        two = two or "these tendons bend the wrist"
    if two and loop.planes == 1:
        raise UserError(f"{two} in two planes, and the loop in one", "loop.planes", "loop.planes: null, or 2")
    return loop.planes or (2 if two else 1)


def bends_of(
    reference: Reference, direction: DirectionName, wrist: WristParameters, horizon: float, period: float
) -> Array:
    """Wanted bends with two derivatives, (2, 3, T), on the grid of `period` [s] over the horizon [s].

    A reference in one plane bends toward the direction; of a recording both planes are taken.
    """
    if reference.inverse == "network":
        fix = "inverse: closed-form, or loop.planes: 1"
        raise UserError("no network gives bends in two planes", "reference.inverse", fix)
    kind = REFERENCES[reference.kind]
    time = np.arange(round(horizon / period), dtype=np.float64) * period
    if kind.planes == 2:
        return course_of(reference, kind, time)
    if reference.file:
        return recorded_bends(reference, wrist, time)
    aim = DIRECTIONS[direction]
    references = np.zeros((2, 3, len(time)))
    facing = in_plane(wrist, direction)
    references[int(aim.plane == "flexion")] = motion(toward(reference, direction), facing, horizon, period).angles.rows
    return references


@dataclass(frozen=True)
class RepeatedBends(Repetitions):
    """Repetitions of one loop in two planes, each with noise and a drawn plant of its own."""

    first: BendCourse
    metrics: dict[str, Array]
    """Metrics of each repetition, (R,)."""
    failed: NDArray[np.bool_]
    """(R,)"""
    until: Array
    """(R,) when each was last within its range [s]."""
    bears: float
    """Largest tension that a tendon bears [N]."""
    tension_range: float
    """Largest tension less the least one [N]."""
    layout: TendonLayout
    substeps: int
    """Integration steps in a control period that it took."""
    step_change: float
    """Change of the first repetition's numbers with the integration step [rad]; 0 where they have converged."""

    @property
    def drift(self) -> float:
        """`step_change`."""
        return self.step_change

    @property
    def arrives(self) -> bool:
        """Whether at most a fifth of the largest bend is missing at the end."""
        largest = float(np.hypot(*self.first.bend_ref.T).max())
        return not self.first.failed and self.first.metrics()["steady_state"] <= max(SHORT * largest, _STILL)

    @property
    def swing(self) -> float:
        """Half of the swing at rest, the repetitions' median, where it is a limit cycle, else 0 [rad]."""
        ripple = self.median("oscillation") if self.first.rests else 0.0
        return ripple if ripple > LIMIT_CYCLE else 0.0

    @property
    def frequency(self) -> float:
        """Unknown: the swing may go round."""
        return math.nan

    @property
    def chatter(self) -> float:
        """Frequency at which pulls go from limit to limit and back, where it chatters, else 0 [1/s]."""
        return float(chatter(self.median("chattering"), self.tension_range, len(self.layout.places)))

    @property
    def beyond(self) -> float:
        """Largest pull, where it is above what a tendon bears, else 0 [N]."""
        peak = float(np.nanmax(self.first.acting.max(initial=0.0)))
        return peak if peak > STRAIN * self.bears else 0.0


def wanted_bends(study: Study, period: float) -> Array:
    """`bends_of` the study's `simulate` section. Raises UserError for what can be known of its loop before it runs."""
    chosen = study.simulate
    bends = bends_of(chosen.reference, chosen.direction, study.wrist, chosen.horizon, period)
    check_bends(controller(chosen.controller), bends[:, 0], study.wrist, chosen.loop)
    if chosen.start != "straight":
        raise UserError("a loop in two planes begins straight", "start", "start: straight")
    return bends


def simulate_bends(
    study: Study,
    tuned: Mapping[str, Mapping[str, float]] | None = None,
    progress: Callable[[float], None] | None = None,
) -> RepeatedBends:
    """Run the study's `simulate` section in two planes: one closed loop, as often as it says.

    Raises UserError for an unknown controller or preset, a reference out of reach, or what no loop in two planes has.
    """
    chosen, draws, wrist = study.simulate, Draws(study.seed), study.wrist
    loop, layout, law = chosen.loop, TendonLayout.of(study.wrist), controller(chosen.controller)
    gains = np.array([gains_of(law, chosen.gains, tuned)])
    references = wanted_bends(study, sample_period(loop.control_period))
    times = chosen.repetitions if is_random(loop) else 1
    loops = loops_of(loop, [draws.plant(repetition) for repetition in range(times)])
    scenario = scenario_of(chosen.reference, chosen.direction)
    streams = [draws.camera(scenario, repetition) for repetition in range(times)]

    def run(which: range, factor: int, record: How) -> BendOutcome:
        worlds = [World(more_finely(loops[k], factor) if factor > 1 else loops[k], wrist) for k in which]
        rows, noise = np.repeat(gains, len(which), axis=0), [streams[k] for k in which]
        return rollout_bends(law, rows, references, worlds, layout, None, noise, record=record)

    first, factor, drift = _converged(lambda factor: run(range(min(times, _TOGETHER)), factor, True), loop)
    outcomes = [first]
    for begin in range(_TOGETHER, times, _TOGETHER):
        if progress is not None:
            progress(begin / times)
        outcomes.append(run(range(begin, min(begin + _TOGETHER, times)), factor, "briefly"))
    if progress is not None:
        progress(1.0)
    metrics = [outcome.all_metrics() for outcome in outcomes]
    return RepeatedBends(
        first.courses[0],
        {name: np.concatenate([values[name] for values in metrics]) for name in metrics[0]},
        np.concatenate([outcome.failed for outcome in outcomes]),
        np.concatenate([outcome.until for outcome in outcomes]),
        wrist.tension_limit,
        wrist.tension_range,
        layout,
        factor * loop.steps,
        drift,
    )


def _converged(run: Callable[[int], BendOutcome], loop: Loop) -> tuple[BendOutcome, int, float]:
    """The first repetitions at a step that is short enough, the factor on its steps, and what still changes [rad].

    The step is halved until RMSE and error at the end of the first stay what they are; one given by hand stays.
    """
    before, change = run(1), math.inf
    for last, factor in zip((1, *FINER), FINER, strict=False):
        fine = run(factor)
        change = _difference(before, fine)
        if change == 0.0 or loop.substeps is not None:
            return before, last, change
        before = fine
    return before, FINER[-1], change


def _difference(one: BendOutcome, finer: BendOutcome) -> float:
    """Greater difference of the first's RMSE and error at the end [rad]; 0 where both are as good as the same."""
    if one.failed[0] or finer.failed[0]:
        return 0.0 if one.failed[0] == finer.failed[0] else math.inf
    largest = 0.0
    for name in ("rmse", "steady_state"):
        coarse, fine = float(one.metrics[name][0]), float(finer.metrics[name][0])
        apart = abs(coarse - fine)
        if apart > HALF * float(tolerance(np.array(fine))):
            largest = max(largest, apart)
    return largest
