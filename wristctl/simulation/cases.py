"""Many gains on many cases: what a search and a ranking are judged by.

A case is a world with a motion and its noise. Whatever is tried meets the same cases (common random numbers).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.seeds import Entropy
from wristctl.simulation.closed_loop import trajectory
from wristctl.simulation.metrics import METRICS, energy
from wristctl.simulation.motion import DERIVATIVES, Motion
from wristctl.simulation.oscillation import LIMIT_CYCLE, REST, chatter, oscillations, sustained
from wristctl.simulation.outcome import Outcome
from wristctl.simulation.rollout import How, columns_of, rollout, structure
from wristctl.simulation.worlds import plant_of

# Numbers that are kept of rollouts whose samples are wanted.
_RECORDED_AT_ONCE = 6_000_000
# Loops whose spectra are worked out at once.
_SPECTRA = 256

# Metrics of courses that are taken of many rollouts without a trajectory for each.
AT_ONCE = ("oscillation", "sustained", "energy", "substeps", "drift")


class Case(NamedTuple):
    """A rollout without its gains: the world, the motion, the noise; and the cell whose mean it is part of."""

    loop: Loop
    motion: Motion
    stream: Entropy
    cell: int

    @property
    def rests(self) -> bool:
        """Whether the reference rests long enough to settle and then to show a swing.

        On a moving one friction's kinks and the move's tail look like swings.
        """
        return self.motion.rest <= self.motion.horizon - REST


@dataclass(frozen=True)
class Measured:
    """Metrics of every gains on every case, (P, C) each."""

    metrics: dict[str, Array]
    failed: NDArray[np.bool_]
    lasted: Array
    """Share of the horizon that each stayed in its range."""
    rests: NDArray[np.bool_]
    """Whether the reference of each case comes to rest, (C,)."""
    tension_range: float = math.inf
    """The wrist's, from pretension to limit [N]; inf: whether it chatters is not known."""
    places: int = 2
    """Places of tendons."""

    @property
    def limit_cycles(self) -> NDArray[np.bool_]:
        """Whether the wrist swings although its reference rests, (P, C)."""
        cycling: NDArray[np.bool_] = (self.metrics["oscillation"] > LIMIT_CYCLE) & self.rests
        return cycling

    @property
    def chatter(self) -> Array:
        """Frequency at which tensions go from limit to limit and back, where it chatters, else 0, (P, C) [1/s]."""
        if math.isinf(self.tension_range):
            return np.zeros(self.failed.shape)
        return chatter(self.metrics["chattering"], self.tension_range, self.places)

    @property
    def unconverged(self) -> NDArray[np.bool_]:
        """Whether the motion depends on the integration step, (P, C)."""
        doubtful: NDArray[np.bool_] = self.metrics["drift"] > 0.0
        return doubtful

    @property
    def swings(self) -> NDArray[np.bool_]:
        """Whether a loop swings, chatters or has not converged, so that nobody can rely on its metrics, (P, C)."""
        return self.limit_cycles | (self.chatter > 0.0) | self.unconverged

    def swings_beside(self, without_feedback: Measured) -> NDArray[np.bool_]:
        """`swings`, and where it goes on swinging while its reference moves, (P, C); of `sustained` measurements.

        Feedforward cannot swing by itself: twice what it shows on the same case is allowed, and LIMIT_CYCLE beyond it.
        """
        return self.swings | self.swings_in_motion(without_feedback)

    def largest_swing(self, without_feedback: Measured) -> float:
        """Largest swing [rad], at rest or in motion as `swings_beside` has them; 0 where it never swings."""
        resting = np.nan_to_num(self.metrics["oscillation"]) * self.limit_cycles
        moving = np.nan_to_num(self.metrics["sustained"]) * self.swings_in_motion(without_feedback)
        return float(np.maximum(resting, moving).max())

    def swings_in_motion(self, without_feedback: Measured) -> NDArray[np.bool_]:
        """Whether it goes on swinging while its reference moves, by more than feedforward on the same case, (P, C)."""
        allowed = LIMIT_CYCLE + 2.0 * np.nan_to_num(without_feedback.metrics["sustained"])
        moving: NDArray[np.bool_] = (self.metrics["sustained"] > allowed) & ~self.rests
        return moving

    def of_motions(self, chosen: Sequence[int], motions: int) -> Measured:
        """Results of the `chosen` motions, of the cases of worlds with so many `motions` each."""
        return self.part(slice(None), np.flatnonzero(np.isin(np.arange(len(self.rests)) % motions, chosen)))

    def part(self, rows: slice, columns: slice | NDArray[np.int64]) -> Measured:
        """What was measured of some gains on some of the cases."""
        return replace(
            self,
            metrics={name: values[rows, columns] for name, values in self.metrics.items()},
            failed=self.failed[rows, columns],
            lasted=self.lasted[rows, columns],
            rests=self.rests[columns],
        )


def measure(
    law: Controller,
    gains: Array,
    cases: Sequence[Case],
    wrist: WristParameters,
    metrics: Sequence[str],
    progress: Callable[[float], object] | None = None,
    converge: bool = True,
) -> Measured:
    """Run gains (P, g) of a law on all the cases; with `converge` at integration steps that are short enough.

    `chattering` and `drift` are always among the metrics.
    """
    shape, metrics = (len(gains), len(cases)), list(dict.fromkeys([*metrics, "chattering", "drift"]))
    measured = {name: np.empty(shape) for name in metrics}
    failed, lasted = np.empty(shape, bool), np.empty(shape)
    finished, places = 0, 2
    for numbers in _alike(cases):
        for rows, columns in _pieces(len(gains), numbers, cases[numbers[0]], _recorded(metrics)):
            chosen = [cases[number] for number in columns]

            def so_far(share: float, before: int = finished, count: int = len(rows) * len(columns)) -> None:
                if progress is not None:
                    progress((before + share * count) / failed.size)

            outcome, values = _measured(law, gains[rows], chosen, wrist, metrics, converge, so_far)
            cells, places = np.ix_(rows, columns), outcome.places
            for name in metrics:
                measured[name][cells] = values[name].reshape(len(rows), -1)
            failed[cells] = outcome.failed.reshape(len(rows), -1)
            horizon = np.array([case.motion.horizon for case in chosen])
            lasted[cells] = outcome.until.reshape(len(rows), -1) / horizon
            finished += len(rows) * len(columns)
            if progress is not None:
                progress(finished / failed.size)
    rests, lasted = np.array([case.rests for case in cases]), np.clip(lasted, 0.0, 1.0)
    return Measured(measured, failed, lasted, rests, wrist.tension_range, places)


def _recorded(metrics: Sequence[str]) -> How:
    """Samples that the metrics need beyond sums."""
    if any(name not in AT_ONCE and METRICS[name].of_totals is None for name in metrics):
        return True
    return "briefly" if any(name in ("oscillation", "sustained", "energy") for name in metrics) else False


def _alike(cases: Sequence[Case]) -> list[list[int]]:
    """Cases that can run in one batch: of one structure, timing and length."""
    groups: dict[tuple[object, ...], list[int]] = {}
    for number, case in enumerate(cases):
        groups.setdefault((*structure(case.loop), len(case.motion.time)), []).append(number)
    return list(groups.values())


def _pieces(rows: int, columns: Sequence[int], like: Case, recorded: How) -> list[tuple[Sequence[int], Sequence[int]]]:
    """Rows and cases that are run at once: all, or as many as can be kept in memory."""
    if not recorded:
        return [(range(rows), columns)]
    most = at_most(like.loop, like.motion, recorded)
    parts = [columns[first : first + most] for first in range(0, len(columns), most)]
    rows_at_once = max(1, min(most, rows * len(columns)) // len(parts[0]))
    return [
        (range(first, min(first + rows_at_once, rows)), part)
        for part in parts
        for first in range(0, rows, rows_at_once)
    ]


def at_most(loop: Loop, followed: Motion, recorded: How) -> int:
    """Rollouts of such a loop whose samples can be kept in memory."""
    columns = columns_of(recorded, followed.planes * loop.plant_segments, followed.planes)
    return max(1, _RECORDED_AT_ONCE // (columns * len(followed.time)))


def at_once(metrics: Sequence[str], outcome: Outcome, which: NDArray[np.int64], step: float) -> dict[str, Array]:
    """Metrics that are taken of the samples, `step` [s] apart, of many rollouts without a trajectory for
    each; `which` are the references that they follow."""
    values = dict[str, Array]()
    for name, amplitudes in (("oscillation", oscillations), ("sustained", sustained)):
        if name in metrics:
            values[name] = _amplitudes(amplitudes, outcome, which, step)
    if "substeps" in metrics:
        values["substeps"] = outcome.steps.astype(float)
    if "drift" in metrics:
        values["drift"] = outcome.drift
    if "energy" in metrics:
        planes = zip(outcome.each("torque"), outcome.each("rate"), strict=True)
        values["energy"] = energy(np.sum([torque * rate for torque, rate in planes], axis=0), step)
    return values


def _measured(
    law: Controller,
    gains: Array,
    cases: Sequence[Case],
    wrist: WristParameters,
    metrics: Sequence[str],
    converge: bool,
    progress: Callable[[float], None],
) -> tuple[Outcome, dict[str, Array]]:
    """The metrics (rows * cases,) of a batch."""
    motions = list({id(case.motion): case.motion for case in cases}.values())
    numbers = {id(followed): number for number, followed in enumerate(motions)}
    rows, count = len(gains), len(cases)
    which = np.tile([numbers[id(case.motion)] for case in cases], rows)
    loops = [case.loop for case in cases] * rows
    one = all(loop is loops[0] for loop in loops)
    outcome = rollout(
        law, np.repeat(gains, count, axis=0), motions, which, loops[0] if one else loops, wrist,
        streams=[case.stream for case in cases] * rows, record=_recorded(metrics), converge=converge,
        progress=progress,
    )  # fmt: skip
    values = {
        name: outcome.metrics[name] for name in metrics if name not in AT_ONCE and METRICS[name].of_totals is not None
    }
    slow = [name for name in metrics if name not in values and name not in AT_ONCE]
    values |= at_once(metrics, outcome, which, float(motions[0].time[1]))
    if slow:
        plants = [plant_of(wrist, case.loop.plant) for case in cases]
        courses = [
            trajectory(outcome, lane, motions[which[lane]], plants[lane % count], cases[0].loop)
            for lane in range(rows * count)
        ]
        for name in slow:
            value = METRICS[name].of_trajectory
            assert value is not None
            values[name] = np.array([float(value(course)) for course in courses])
    return outcome, values


def _amplitudes(amplitudes: Callable[..., Array], outcome: Outcome, which: NDArray[np.int64], step: float) -> Array:
    """`oscillations` or `sustained` of every rollout, of its plane with most, without a trajectory for each."""
    swings = np.empty((outcome.planes, len(which)))
    with threadpool_limits(limits=1, user_api="blas"):
        for plane, theta in enumerate(outcome.each("bend")):
            for first in range(0, len(theta), _SPECTRA):
                chunk = slice(first, first + _SPECTRA)
                motions, followed = np.unique(which[chunk], return_inverse=True)
                wanted = outcome.references[motions, DERIVATIVES * plane]
                swings[plane, chunk] = amplitudes(theta[chunk], wanted, followed, step)
    most: Array = swings.max(axis=0)
    return most
