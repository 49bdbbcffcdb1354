"""Controllers ranked on the same cases: those of a condition, or drawn worlds.

Steps and smooth motions are ranked apart: a jump's error is much the same for every controller, and would hide all
others.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import LEVEL, MEASURABLE, GeometricMean, geometric_mean, paired_ratio, penalised
from wristctl.comparison.combinations import CLASSES, ComparedRow, class_of
from wristctl.comparison.tie_groups import Standing, standing
from wristctl.config.compare import CompareSettings
from wristctl.config.loop import Loop
from wristctl.config.wrist import WristParameters
from wristctl.simulation.oscillation import LIMIT_CYCLE, at_rest, chatter
from wristctl.simulation.repetitions import Repeated
from wristctl.tuning.objective import YARDSTICK

if TYPE_CHECKING:
    import pandas as pd

# Seed stream of the resampling: the same scores give the same intervals.
STREAM = 20_031
# Inverses in order of preference for a ranking: control is ranked by itself, and a network's error by `train`.
_INVERSES = ("none", "closed-form", "network")
# What may limit a row, with the metric that is the share of time in which it does.
LIMITS = {"tensions": "saturation", "motors": "motor_limited"}
# Share of time at their motors' limits from which it is motors, and not laws, that make the best alike: errors have
# grown by half an order of magnitude by then.
MOTORS_DECIDE = 0.05
# What a score is of.
Unit = Literal["case", "repetition", "world"]


class Traits(NamedTuple):
    """What a builder of a rig can tell of a condition."""

    rig: bool = False
    """Whether motors and tendons, or a camera, are simulated."""
    camera: bool = False
    """Whether angles come from a camera."""
    tendons: bool = False
    """Whether motors and tendons are simulated."""
    jumps: bool = False
    """Whether the reference jumps."""
    load: bool = False
    """Whether a force acts that no controller is told of."""
    unknown: bool = False
    """Whether the plant is not what its controller believes."""
    uneven: bool = False
    """Whether the plant is a chain of hinges, of another make than the controllers' model."""


class Fault(NamedTuple):
    """What is wrong with a row, by how much, and in how many cases or motions."""

    kind: Literal["fails", "swings", "chatters", "stops short", "pulls", "depends on step"]
    """It leaves its range; is in a limit cycle; has tensions that go from limit to limit; stays in its range and does
    not arrive; pulls harder than a tendon bears; or changes with the integration step."""
    size: float
    """A swing from peak to peak [rad], a rate of chatter [1/s] or a tension [N]; 0 where there is none."""
    times: int
    of: int
    unit: str
    """What is counted: cases, repetitions, worlds or motions."""


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Controllers with their gains on the same cases, repetitions or worlds, W of them."""

    name: str
    """Name of the condition or family; with `, steps` where the references jump and others do not."""
    unit: Unit
    """What a score is of."""
    labels: list[str]
    """controller/gains of each row, R of them."""
    scores: Array
    """RMSE [rad], (R, W); inf where the row failed."""
    standing: Standing
    swing: Array
    """Half of the largest swing at rest [rad], (R,); 0 where all rest."""
    chatter: Array
    """Largest rate at which a chattering row's tensions go from limit to limit and back, (R,) [1/s]; else 0."""
    unsound: dict[str, NDArray[np.int_]]
    """In how many of the W each row, where it does not fail, is in a limit cycle, chatters, or has not converged, (R,)
    each."""
    peak: Array
    """Largest tension of a row that is above what a tendon bears [N], (R,); 0 elsewhere."""
    away: NDArray[np.int_]
    """In how many motions each row stays within its range and does not arrive, (R,)."""
    motions: int
    """Number of motions; in each world where they are drawn."""
    traits: Traits
    loops: Sequence[str] = ()
    """Names of the loops of a condition; none of worlds."""
    at_limit: Mapping[str, Array] = field(default_factory=dict)
    """Share of time that each row was at a limit, by LIMITS, (R,) each; none where that is not known."""

    @property
    def motors_decide(self) -> bool:
        """Whether motors make several rows alike: those that tie for the best, or all where none can be used.

        Each of them waits for its motors for at least MOTORS_DECIDE of the time.
        """
        alike = self.standing.groups[0] if self.standing.groups else self.standing.order
        waits = self.at_limit.get("motors", np.zeros(len(self.labels)))
        return len(alike) > 1 and bool((waits[alike] >= MOTORS_DECIDE).all())

    @property
    def jumps(self) -> bool:
        """Whether the references jump."""
        return self.traits.jumps

    @property
    def count(self) -> int:
        """Number of cases, repetitions or worlds."""
        return int(self.scores.shape[1])

    @property
    def cases(self) -> str:
        """Their number and kind: 8 cases, 30 repetitions, 60 worlds."""
        return f"{self.count} {self.unit}{'s' * (self.count != 1)}"

    def fault(self, row: int) -> Fault | None:
        """The gravest fault of a row, also where it is too seldom to rule it out; None of a row without any."""
        stands, unsound = self.standing, self.unsound
        faults = [
            Fault("fails", 0.0, stands.failures[row].times, self.count, f"{self.unit}s"),
            Fault("swings", 2.0 * self.swing[row], int(unsound["limit cycle"][row]), self.count, f"{self.unit}s"),
            Fault("chatters", self.chatter[row], int(unsound["chatters"][row]), self.count, f"{self.unit}s"),
            Fault("stops short", 0.0, int(self.away[row]), self.motions, "motions"),
            Fault("pulls", self.peak[row], self.count * (self.peak[row] > 0.0), self.count, f"{self.unit}s"),
            Fault("depends on step", 0.0, int(unsound["not converged"][row]), self.count, f"{self.unit}s"),
            Fault("swings", 0.0, stands.swings[row].times, self.count, f"{self.unit}s"),
        ]
        return next((fault for fault in faults if fault.times), None)

    @property
    def more(self) -> str:
        """What would tell rows apart that these cases do not, in words."""
        return "more worlds" if self.unit == "world" else "more motions or the setting repetitions=5"

    @cached_property
    def means(self) -> list[GeometricMean]:
        """Geometric mean of each row's RMSE [rad]; a failure counts as 90 deg."""
        return [geometric_mean(row_scores, STREAM) for row_scores in penalised(self.scores)]

    @property
    def yardstick(self) -> int | None:
        """The row of feedforward; None where it has none."""
        return self.best(YARDSTICK)

    @cached_property
    def gains(self) -> list[GeometricMean]:
        """Ratio of feedforward's RMSE to every row's on the same cases; nan where feedforward is not among them."""
        base, rows = self.yardstick, range(len(self.labels))
        if base is None:
            return [GeometricMean(np.nan, 0.0, np.inf, LEVEL) for _ in rows]
        return [self.times_better(row, base) for row in rows]

    def best(self, controller: str) -> int | None:
        """The best row of a controller; None where it has none."""
        return next((row for row in self.standing.order if self.labels[row].split("/")[0] == controller), None)

    def of_label(self, label: str) -> GeometricMean:
        """Geometric mean of the RMSE [rad] of the row with a label."""
        return self.means[self.labels.index(label)]

    def times_better(self, row: int, reference_row: int) -> GeometricMean:
        """Ratio of a reference row's RMSE to another row's on the same cases."""
        penalised_scores = penalised(self.scores)
        return paired_ratio(penalised_scores[reference_row], penalised_scores[row], STREAM)

    def of(self, results: Sequence[ComparedRow]) -> list[ComparedRow]:
        """Results of a comparison under this condition with its kind of motion."""
        return [result for result in results if result.loop in self.loops and result.jumps == self.jumps]

    def line(self, row: int) -> dict[str, object]:
        """A row's label, group, fate and mean [rad] with its interval, as tables begin with them."""
        stands, mean = self.standing, self.means[row]
        names = {"row": self.labels[row], "group": stands.group(row), "fate": stands.fate(row)}
        return names | {"rmse": mean.value, "rmse_low": mean.low, "rmse_high": mean.high}


def labels_of(rankings: Iterable[Ranking]) -> list[str]:
    """Labels of the rows of all rankings, each once."""
    return list(dict.fromkeys(label for ranking in rankings for label in ranking.labels))


def probability_of_less(scores: Array) -> Array:
    """Share of the cases in which each row of scores (R, W) is less than each other, (R, R); equal ones count half.

    Scores are equal below what can be measured, and where both failed (inf).
    """
    floored = np.maximum(np.where(np.isnan(scores), np.inf, scores), MEASURABLE * (1.0 + 1e-9))
    less, equal = floored[:, None] < floored[None], floored[:, None] == floored[None]
    shares: Array = np.mean(less + 0.5 * equal, axis=2)
    return shares


def undominated(costs: Array) -> NDArray[np.bool_]:
    """Mask (R,) of the rows of `costs` (R, C) on Pareto's front.

    A row is on the front where no other row is at most as dear in all costs and cheaper in one.
    """
    no_dearer, cheaper = costs[None] <= costs[:, None], costs[None] < costs[:, None]
    beaten = np.any(np.all(no_dearer, axis=2) & np.any(cheaper, axis=2), axis=1)
    front: NDArray[np.bool_] = ~beaten & np.all(np.isfinite(costs), axis=1)
    return front


def traits_of(loops: Sequence[Loop], wrist: WristParameters, jumps: bool = False) -> Traits:
    """What holds of all of these loops."""
    classes = [class_of(loop, wrist) for loop in loops]
    camera = all(loop.sensor.level == "camera" for loop in loops)
    tendons = all(loop.actuator.winds for loop in loops)
    either = all(loop.sensor.level == "camera" or loop.actuator.winds for loop in loops)
    load, unknown = (all(name == kind for name in classes) for kind in ("pushed", "off-nominal"))
    uneven = all(loop.plant.model == "hinges" for loop in loops)
    return Traits(either, camera, tendons, jumps, load, unknown, uneven)


def class_rankings(results: Sequence[ComparedRow], settings: CompareSettings, wrist: WristParameters) -> list[Ranking]:
    """Rankings under each condition of a comparison, in the order of CLASSES, steps last."""
    through = next(inverse for inverse in _INVERSES if any(result.inverse == inverse for result in results))
    classes = {name: class_of(loop, wrist) for name, loop in settings.loops.items()}
    compared = [result for result in results if result.inverse == through]
    rankings = []
    for jumps in (False, True):
        for name in CLASSES:
            if in_class := [result for result in compared if classes[result.loop] == name and result.jumps == jumps]:
                loops = list(dict.fromkeys(result.loop for result in in_class))
                traits = traits_of([settings.loops[loop] for loop in loops], wrist, jumps)
                rankings.append(_ranked(f"{name}, steps" if jumps else name, in_class, loops, traits))
    return rankings


def _ranked(name: str, results: Sequence[ComparedRow], loops: Sequence[str], traits: Traits) -> Ranking:
    """Rows under one condition; over its cases, or over repetitions where all cases have more of them."""
    cells = list(dict.fromkeys((result.loop, result.reference) for result in results))
    repeated = {(result.label, result.loop, result.reference): result.repeated for result in results}
    everyone = dict.fromkeys(result.label for result in results)  # plain Python is left out of the fastest loops
    labels = [label for label in everyone if all((label, *cell) in repeated for cell in cells)]
    table = [[repeated[label, *cell] for cell in cells] for label in labels]
    repetitions = {len(cell.failed) for row in table for cell in row}
    redrawn = len(repetitions) == 1 and max(repetitions) > len(cells)
    logs = [[np.log(_rmse(cell)) for cell in row] for row in table]
    scores = np.exp([np.mean(row, axis=0) if redrawn else [log_rmse.mean() for log_rmse in row] for row in logs])

    def largest(values: list[list[Array]]) -> Array:
        return np.array([np.max(row, axis=0) if redrawn else [cell.max() for cell in row] for row in values])

    ripple = largest([[_ripple(cell) for cell in row] for row in table])
    slams = largest([[_chatter(cell) for cell in row] for row in table])
    drifts = largest([[cell.metrics.get("drift", np.zeros(len(cell.failed))) for cell in row] for row in table])
    flags = {"limit cycle": ripple > 0.0, "chatters": slams > 0.0, "not converged": drifts > 0.0}
    away = np.array([sum(not cell.arrives and not cell.failed.any() for cell in row) for row in table])
    peak = np.array([max(cell.beyond for cell in row) for row in table])
    return Ranking(
        name=name,
        unit="repetition" if redrawn else "case",
        labels=labels,
        scores=scores,
        standing=standing(scores, np.any(list(flags.values()), axis=0), STREAM, short=away > 0, unphysical=peak > 0.0),
        swing=ripple.max(axis=1),
        chatter=slams.max(axis=1),
        unsound=counted(flags, scores),
        peak=peak,
        away=away,
        motions=len(cells),
        traits=traits,
        loops=loops,
        at_limit=time_at_limits([[cell.metrics for cell in row] for row in table]),
    )


def _rmse(repeated: Repeated) -> Array:
    """RMSE of each repetition [rad], inf where it failed. What nobody can measure is no better than the least."""
    rmse = np.maximum(repeated.metrics["rmse"], MEASURABLE)
    return np.where(repeated.failed | ~np.isfinite(rmse), np.inf, rmse)


def _ripple(repeated: Repeated) -> Array:
    """Half of each repetition's swing at rest, where it is a limit cycle [rad]; else 0."""
    oscillation = repeated.metrics.get("oscillation", np.zeros(len(repeated.failed)))
    return np.where((oscillation > LIMIT_CYCLE) & at_rest(repeated.first.trajectory), oscillation, 0.0)


def _chatter(repeated: Repeated) -> Array:
    """Rate at which a chattering repetition's tensions go from limit to limit and back [1/s]; else 0."""
    variation = repeated.metrics.get("chattering", np.zeros(len(repeated.failed)))
    return chatter(variation, repeated.tension_range, repeated.first.trajectory.tension.shape[1])


def time_at_limits(rows: Sequence[Sequence[Mapping[str, Array]]]) -> dict[str, Array]:
    """Mean share of time that each row was at a limit, by LIMITS, (R,) each, of its cases' metrics; none if unknown."""
    return {
        limit: np.array([np.mean([metrics[name].mean() for metrics in row]) for row in rows])
        for limit, name in LIMITS.items()
        if all(name in metrics for row in rows for metrics in row)
    }


def counted(flags: dict[str, NDArray[np.bool_]], scores: Array) -> dict[str, NDArray[np.int_]]:
    """Number of cases (R,) in which a flag (R, W) holds and the row does not fail."""
    return {name: (holds & np.isfinite(scores)).sum(axis=1) for name, holds in flags.items()}


def standings_frame(rankings: Sequence[Ranking]) -> pd.DataFrame:
    """A line for each row of each ranking, in order: its group, what becomes of it, its mean, and how often it is lost.

    Angles in rad.
    """
    import pandas as pd

    lines = []
    for ranking in rankings:
        stands = ranking.standing
        for row in stands.order:
            lost = stands.lost[row]
            lines.append(
                {"class": ranking.name}
                | ranking.line(row)
                | {
                    "pairs": lost.n,
                    "fails": stands.failures[row].times,
                    "swings": stands.swings[row].times,
                    "lost_low": lost.low,
                    "lost_high": lost.high,
                    "motions": ranking.motions,
                    "does_not_arrive": int(ranking.away[row]),
                    "swing": 2.0 * ranking.swing[row],
                    "chatter": ranking.chatter[row],
                    "peak": ranking.peak[row],
                }
                | {f"at_limit_of_{limit}": shares[row] for limit, shares in ranking.at_limit.items()}
            )
    return pd.DataFrame(lines)
