"""What a model lacks: residuals against the frames' own noise, and causes that are tried on what is left over.

A cause is a change of the model that no parameter says (springs that creep, play in the spools). Its size is found
beside all coordinates, to first order, by one more column in the Jacobian: a score test (Rao, Proc. Cambridge Phil.
Soc. 44 (1948) 50) with the covariance of `intervals`, so that residuals that are alike do not pass for evidence. What
matters to a user is by how much each parameter would move if the cause were so.
"""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.plant import TendonFacts, TrueWrist
from wristctl.errors import Setting, UserError
from wristctl.identification.fit import Fit, frame_noise
from wristctl.identification.forward import SupposedWrist
from wristctl.identification.intervals import Knowledge, sandwich
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.processes import cores

EVIDENT = 3.5
"""Standard deviations beyond which a cause is told: one in 430 sound fits has one of them there by chance."""

_UNSURE = 5.0 / 3.0
"""Standard deviation of how far a wrist is on the way from the model's four segments to 8.

A bend without segments is at 4/3, and fits of wrists of 8 segments move by more than the first order tells."""

Supposed = tuple[MeasuredTrial, SupposedWrist]


class Cause(NamedTuple):
    """A change of the model by `size` in a unit, and what to do where it is so."""

    change: Callable[[MeasuredTrial, SupposedWrist], Supposed]
    size: float
    unit: str
    advice: str
    segments: int | None = None
    signed: bool = False
    """Whether less than none of it can be."""


def _creeping_springs(trial: MeasuredTrial, own: SupposedWrist) -> Supposed:
    return trial, own._replace(plant=TrueWrist(creep=0.01))


def _creeping_tendons(trial: MeasuredTrial, own: SupposedWrist) -> Supposed:
    return trial, own._replace(facts=TendonFacts(creep=0.01))


def _play(trial: MeasuredTrial, own: SupposedWrist) -> Supposed:
    reeled = trial.reeled.copy()
    for before, now in pairwise(reeled):
        np.clip(before, now, now + 2e-5, out=now)
    return replace(trial, reeled=reeled), own


def _flexion_more_damped(trial: MeasuredTrial, own: SupposedWrist) -> Supposed:
    factor = 1.01 if trial.plane == "flexion" else 1.0
    return trial, own._replace(wrist=own.wrist.model_copy(update={"damping": factor * own.wrist.damping}))


def _cut_finer(trial: MeasuredTrial, own: SupposedWrist) -> Supposed:
    return trial, own


_REST = "let the wrist rest before each trial and keep them short"
CAUSES: dict[str, Cause] = {
    "springs that creep": Cause(_creeping_springs, 1.0, "%", _REST),
    "tendons that creep": Cause(_creeping_tendons, 1.0, "%", _REST),
    "play between spools and tendons": Cause(_play, 20.0, "um", "take up the play, or pull the tendons tighter"),
    "more damping toward flexion": Cause(_flexion_more_damped, 1.0, "%", "identify each plane by itself", signed=True),
    "8 segments": Cause(_cut_finer, 100.0, "% of the way there", "set identify.segments=8", 8),
}
"""What else may be behind residuals: one of these lines each."""


@dataclass(frozen=True)
class Suspicion:
    """How much of a cause the residuals show, by which each free parameter would then move, as a coordinate."""

    cause: str
    size: float
    deviation: float
    shifts: Mapping[str, float]

    @property
    def evidence(self) -> float:
        """In standard deviations; less than none of what cannot be less than none speaks against it."""
        size = abs(self.size) if CAUSES[self.cause].signed else self.size
        return size / self.deviation

    @property
    def evident(self) -> bool:
        """Whether this is more than chance."""
        return self.evidence > EVIDENT

    @property
    def told(self) -> str:
        """In words."""
        unit = CAUSES[self.cause].unit
        return f"{self.cause} ({self.size:.2g} +- {1.96 * self.deviation:.2g} {unit})"


def suspicions(fit: Fit) -> list[Suspicion]:
    """Every cause that a trial can show, those that the residuals show best first."""
    problem = fit.problem

    def columns(trial: MeasuredTrial) -> list[Array]:
        own = problem.candidate(trial, fit.x)

        def shown(trial: MeasuredTrial, own: SupposedWrist, segments: int | None = None) -> Array:
            return trial.shown(problem.simulate(trial, [own], segments)[0], fit.values["delay"])

        expected = shown(trial, own)
        return [(shown(*each.change(trial, own), each.segments) - expected) / each.size for each in CAUSES.values()]

    with ThreadPoolExecutor(cores()) as pool:
        found = list(pool.map(columns, problem.trials))
    every = [_suspicion(fit, name, [each[at] for each in found]) for at, name in enumerate(CAUSES)]
    return sorted((each for each in every if each is not None), key=lambda each: -each.evidence)


def _suspicion(fit: Fit, cause: str, columns: list[Array]) -> Suspicion | None:
    if not any(each.any() for each in columns):
        return None
    weights, x = np.append(fit.problem.prior(), 0.0), np.append(fit.x, 0.0)
    slopes = [np.column_stack(each) / fit.noise for each in zip(fit.slopes, columns, strict=True)]
    residuals = [each / fit.noise for each in fit.residuals]
    bread, variance = sandwich(slopes, residuals, weights, len(fit.problem.free) + 1)
    push = sum((a.T @ b for a, b in zip(slopes, residuals, strict=True)), -(weights**2) * x)
    *step, size = bread @ push
    shifts = dict(zip(fit.problem.free, map(float, step), strict=False))
    return Suspicion(cause, float(size), float(np.sqrt(variance[-1, -1])), shifts)


class Misfit(NamedTuple):
    """Residuals of a plane's direction: their root mean square and the frames' own noise [rad]."""

    direction: str
    frames: int
    residual: float
    noise: float

    @property
    def ratio(self) -> float:
        """Chi-square over its degrees of freedom."""
        return (self.residual / self.noise) ** 2


def misfits(fit: Fit) -> list[Misfit]:
    """Of every direction that there are trials of."""
    own = dict[str, list[Array]]()
    for trial, residual in zip(fit.problem.trials, fit.residuals, strict=True):
        own.setdefault(trial.direction, []).append(residual)
    return [
        Misfit(name, len(every), float(np.sqrt(np.mean(every**2))), frame_noise(parts))
        for name, parts in own.items()
        for every in [np.concatenate(parts)]
    ]


def widened(known: Knowledge, suspected: list[Suspicion], finer: Mapping[str, float]) -> Knowledge:
    """The knowledge with deviations that count what else is behind them: what an evident cause would move, and how
    finely the wrist bends, which trials hardly tell: by most of what a `finer` bend would move."""
    deviation, count = known.deviation.copy(), len(finer)
    systematic = [np.array(list(each.shifts.values())) for each in suspected if each.evident]
    for shift in (*systematic, _UNSURE * np.array(list(finer.values()))):
        deviation[:count] = np.hypot(deviation[:count], shift)
    return replace(known, deviation=deviation)


def refuse_misfit(fit: Fit, known: Knowledge, suspected: list[Suspicion], found: list[Misfit]) -> None:
    """UserError where an evident cause would move a parameter out of its interval, or residuals are far above noise."""
    half = dict(zip(fit.problem.free, known.half_widths, strict=False))
    where, accept = "identify", Setting("misfit=tell", "identify")
    for each in suspected:
        worst = max(half, key=lambda name: abs(each.shifts[name]) / half[name])
        if each.evident and abs(each.shifts[worst]) > half[worst]:
            what = f"these trials look like {each.told}, which the model does not have; {worst} would be wrong by it"
            raise UserError(what, where, (f"{CAUSES[each.cause].advice}; or take it as it is: ", accept), exit_code=3)
    worst_fit = max(found, key=lambda each: each.ratio)
    if worst_fit.ratio > fit.problem.settings.lack_of_fit:
        like = next((each.told for each in suspected if each.evident), "none of the causes known")
        size, noise = (f"{np.degrees(each):.2g} deg" for each in (worst_fit.residual, worst_fit.noise))
        what = f"toward {worst_fit.direction} the model is off by {size}, frames by {noise}: it looks like {like}"
        raise UserError(what, where, ("look at the figures; or take it as it is: ", accept), exit_code=3)
