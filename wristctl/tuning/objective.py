"""Objective of a search for gains: their metrics on many cases beside those of `feedforward` there, in decades."""

from collections.abc import Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.config.tune import Objective
from wristctl.config.wrist import WristParameters
from wristctl.control.law import Controller
from wristctl.control.table import controller
from wristctl.simulation.cases import Case, Measured, measure
from wristctl.simulation.metrics import METRICS

# A law without feedback, which cannot be unstable: what every gains are measured by.
YARDSTICK = "feedforward"
# Decades that a case counts where the wrist left its range at its very end, and one more where it did at once.
_FAILED = 3.0


def marks_of(law: Controller, gains: Array, cases: Sequence[Case], wrist: WristParameters) -> dict[str, int]:
    """On how many cases gains (g,) fail, swing, chatter, or do not converge, by mark; without those of none.

    They swing at rest, or in motion beside feedforward (`Measured.swings_in_motion`).
    """
    metrics = ["oscillation", "sustained"]
    measured = measure(law, gains[None], cases, wrist, metrics)
    cycles = measured.limit_cycles
    if not measured.rests.all():
        open_loop = measure(controller(YARDSTICK), np.zeros((1, 0)), cases, wrist, metrics)
        cycles = cycles | measured.swings_in_motion(open_loop)
    holds = {
        "failed": measured.failed,
        "limit cycle": cycles & ~measured.failed,
        "chatters": (measured.chatter > 0.0) & ~measured.failed,
        "not converged": measured.unconverged & ~measured.failed,
    }
    counts = {mark: int(worlds.sum()) for mark, worlds in holds.items()}
    return {mark: count for mark, count in counts.items() if count}


class Judge:
    """The objective of gains of any law on the same cases; the yardstick runs on them once.

    A case's value is the weighted sum of log10((metric + floor) / (the yardstick's + floor)); where it fails it is
    3 to 4 decades. The objective is the mean over all cases, plus a weight times the worst cell (a case with its
    repetitions), plus one times the square root of the share of cases that swing, chatter or do not converge:
    steep at the first of them, since no ranking relies on such gains, and never the same for two that do more and less.
    """

    def __init__(self, cases: Sequence[Case], wrist: WristParameters, weights: Objective) -> None:
        self._cases, self._wrist, self._weights = cases, wrist, weights
        self._cells = np.array([case.cell for case in cases])
        self._horizons = np.array([case.motion.horizon for case in cases])
        self._metrics = list(
            dict.fromkeys([*weights.weights(), *(["oscillation", "sustained"] if weights.swinging else [])])
        )
        self._yardstick = measure(controller(YARDSTICK), np.zeros((1, 0)), cases, wrist, self._metrics)

    def __call__(self, law: Controller, gains: Array) -> Array:
        """Objective (P,) of gains (P, g)."""
        return self.value(measure(law, gains, self._cases, self._wrist, self._metrics))

    def beside(self, law: Controller, gains: Array, best: float) -> Array:
        """Objective (P,) of gains (P, g) in a search whose best so far is `best`.

        At the default integration step; only gains that would be the best are measured at steps that are short enough,
        the most promising first, so that a search never ends with what the step alone makes good.
        """
        measured = measure(law, gains, self._cases, self._wrist, self._metrics, converge=False)
        values = self.value(measured)
        while values[first := int(np.argmin(values))] < best:
            values[first] = self(law, gains[first : first + 1])[0]
            best = min(best, float(values[first]))
        return values

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
