"""Objective of a search for gains: their metrics on many cases beside those of `feedforward` there, in decades."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.tune import Objective
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller
from wristctl.simulation.arrival import SHORT
from wristctl.simulation.cases import Case, Measured, measure
from wristctl.simulation.metrics import METRICS
from wristctl.simulation.trajectory import size_of
from wristctl.tuning.margin import CHANGES, OwnLoop

# A law without feedback, which cannot be unstable: what every gains are measured by.
YARDSTICK = "feedforward"
# Rollouts of changed loops that cost hardly more than one.
_LANES_TOGETHER = 64
# Mean size of a sine over its RMS.
_MEAN_OF_SINE = 2.0 * np.sqrt(2.0) / np.pi
# Decades that a case counts where the wrist left its range at its very end, and one more where it did at once.
_FAILED = 3.0


def marks_of(law: Controller, gains: Array, cases: Sequence[Case], wrist: WristParameters) -> dict[str, int]:
    """On how many cases gains (g,) fail, stop short, swing, chatter, or do not converge, by mark without those of 0.

    They swing at rest, or in motion beside feedforward (`Measured.swings_in_motion`). They stop short where more than a
    fifth of the largest reference is missing at the end, as `arrives` has it, or of one that never rests on the whole.
    """
    metrics = ["oscillation", "sustained", "steady_state", "rmse"]
    measured = measure(law, gains[None], cases, wrist, metrics)
    cycles = measured.limit_cycles
    if not measured.rests.all():
        open_loop = measure(controller(YARDSTICK), np.zeros((1, 0)), cases, wrist, metrics)
        cycles = cycles | measured.swings_in_motion(open_loop)
    asked = np.array([float(np.max(size_of(case.motion.bend_ref))) for case in cases])
    off = np.where(measured.rests, measured.metrics["steady_state"], _MEAN_OF_SINE * measured.metrics["rmse"])
    holds = {
        "failed": measured.failed,
        "stops short": (off > SHORT * asked) & ~measured.failed,
        "limit cycle": cycles & ~measured.failed,
        "chatters": (measured.chatter > 0.0) & ~measured.failed,
        "not converged": measured.unconverged & ~measured.failed,
    }
    counts = {mark: int(worlds.sum()) for mark, worlds in holds.items()}
    return {mark: count for mark, count in counts.items() if count}


def metrics_of(weights: Objective) -> list[str]:
    """Metrics that an objective is made of, those by which swings are told among them."""
    return list(dict.fromkeys([*weights.weights(), *(["oscillation", "sustained"] if weights.swinging else [])]))


class Judge:
    """The objective of gains of any law on the same cases; the yardstick runs on them once.

    A case's value is the weighted sum of log10((metric + floor) / (the yardstick's + floor)); where it fails it is
    3 to 4 decades. The objective is the mean over all cases, plus a weight times the worst cell (a case with its
    repetitions), plus one times the square root of the share of cases that swing, chatter or do not converge:
    steep at the first of them, since no ranking relies on such gains, and never the same for two that do more and less.
    So does the share that they lose on the loop that they are tuned for, `own`, under the changes of
    `wristctl.tuning.margin`, which are the cases themselves where none are given.
    """

    def __init__(
        self, cases: Sequence[Case], wrist: WristParameters, weights: Objective, own: OwnLoop | None = None
    ) -> None:
        self._cases, self._wrist, self._weights = cases, wrist, weights
        self.own_loop = own or OwnLoop(cases, wrist, controller(YARDSTICK))
        self._cells = np.array([case.cell for case in cases])
        self._horizons = np.array([case.motion.horizon for case in cases])
        self._metrics = metrics_of(weights)
        self._yardstick = measure(controller(YARDSTICK), np.zeros((1, 0)), cases, wrist, self._metrics)

    @property
    def count(self) -> int:
        """Number of cases."""
        return len(self._cases)

    def __call__(self, law: Controller, gains: Array) -> Array:
        """Objective (P,) of gains (P, g)."""
        return self._on_the_cases(law, gains) + self._without_margin(law, gains)

    def beside(self, law: Controller, gains: Array, best: float) -> Array:
        """Objective (P,) of gains (P, g) in a search whose best so far is `best`.

        At the default integration step and without changes of the loop; only gains that would be the best are measured
        at steps that are short enough and under these changes, the most promising first, so that a search never ends
        with what the step alone makes good, or with gains that stand no change.
        """
        measured = measure(law, gains, self._cases, self._wrist, self._metrics, converge=False)
        values, costs = self.value(measured), dict[int, float]()
        while values[first := int(np.argmin(values))] < best:
            values[first] = self._on_the_cases(law, gains[first : first + 1])[0]
            if values[first] < best:
                values[first] += self._cost_of(first, law, gains, values < best, values, costs)
            best = min(best, float(values[first]))
        return values

    def choice(self, law: Controller, gains: Array, progress: Callable[[float], object] | None = None) -> Array:
        """Objective (P,) of gains (P, g) to choose the least by: what costs more without changes is not changed."""
        values, best, costs = self._on_the_cases(law, gains, progress), np.inf, dict[int, float]()
        while values[first := int(np.argmin(values))] < best:
            values[first] += self._cost_of(first, law, gains, values < best, values, costs)
            best = min(best, float(values[first]))
        return values

    def _cost_of(
        self,
        first: int,
        law: Controller,
        gains: Array,
        asked: NDArray[np.bool_],
        values: Array,
        costs: dict[int, float],
    ) -> float:
        """What a lack of margin costs the `first` of the gains; it is kept for those that are likely to be next."""
        if first not in costs:
            together = max(1, _LANES_TOGETHER // (len(CHANGES) * self.own_loop.count))
            likely = [int(each) for each in np.argsort(values) if asked[each] and each not in costs and each != first]
            chosen = [first, *likely[: together - 1]]
            costs |= dict(zip(chosen, map(float, self._without_margin(law, gains[chosen])), strict=True))
        return costs[first]

    def _on_the_cases(self, law: Controller, gains: Array, progress: Callable[[float], object] | None = None) -> Array:
        return self.value(measure(law, gains, self._cases, self._wrist, self._metrics, progress))

    def _without_margin(self, law: Controller, gains: Array) -> Array:
        """What it costs gains (P, g) that they lose a share of the changed loops, (P,) [decades]."""
        if not self._weights.margin:
            return np.zeros(len(gains))
        costs: Array = self._weights.margin * np.sqrt(self.own_loop.lost(law, gains).mean(axis=(1, 2)))
        return costs

    def value(self, measured: Measured) -> Array:
        """Objective (P,) of what was measured on the cases."""
        value = np.zeros(measured.failed.shape)
        for name, weight in self._weights.weights().items():
            own, known = self._sizes(name, measured.metrics[name]), self._known(name)
            value = value + weight * np.log10(own / known)
        lost = measured.failed | np.isnan(value)
        value = np.where(lost, _FAILED + 1.0 - measured.lasted, value)
        cells = np.stack([value[:, self._cells == cell].mean(axis=1) for cell in np.unique(self._cells)], axis=1)
        total: Array = value.mean(axis=1) + self._weights.worst * cells.max(axis=1)
        if self._weights.swinging:
            total = total + self._weights.swinging * np.sqrt(measured.swings_beside(self._yardstick).mean(axis=1))
        return total

    def _known(self, name: str) -> Array:
        """The yardstick's, (1, C); where that has failed, which is the same for all laws, its median elsewhere."""
        sizes = self._sizes(name, self._yardstick.metrics[name])
        finite = np.isfinite(sizes)
        return np.where(finite, sizes, np.median(sizes[finite]) if finite.any() else METRICS[name].floor)

    def _sizes(self, name: str, values: Array) -> Array:
        """A metric (.., C) with its floor; what never happens counts what its metric says of the horizon."""
        metric = METRICS[name]
        if name == "oscillation":
            values = np.where(np.isnan(values), 0.0, values)  # no time to rest; a failure counts by itself
        elif metric.never is not None:
            values = np.where(np.isnan(values), np.array([metric.never(horizon) for horizon in self._horizons]), values)
        costs: Array = values + metric.floor
        return costs
