"""Lack of fit of a model: residuals against the frames' own noise, and causes that are tried on what is left over.

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
from wristctl.identification.fit import Fit
from wristctl.identification.forward import Supposed
from wristctl.identification.intervals import Knowledge, sandwich
from wristctl.identification.measured_trials import LEAST_NOISE, MeasuredTrial, frame_noise
from wristctl.processes import cores

# Standard deviations beyond which a cause is told: one in 430 sound fits has one of them there by chance.
EVIDENT = 3.5

# Standard deviation of how far a wrist is on the way from the model's four segments to 8.
#
# A bend without segments is at 4/3, and fits of wrists of 8 segments move by more than the first order tells.
_UNSURE = 5.0 / 3.0

Changed = tuple[MeasuredTrial, Supposed]


class Cause(NamedTuple):
    """A change of the model by `size` in a unit, and what to do where it is so."""

    change: Callable[[MeasuredTrial, Supposed], Changed]
    size: float
    unit: str
    advice: str
    segments: int | None = None
    signed: bool = False
    """Whether less than none of it can be."""


def _creeping_springs(trial: MeasuredTrial, supposed: Supposed) -> Changed:
    return trial, supposed._replace(plant=TrueWrist(creep=0.01))


def _creeping_tendons(trial: MeasuredTrial, supposed: Supposed) -> Changed:
    return trial, supposed._replace(facts=TendonFacts(creep=0.01))


def _play(trial: MeasuredTrial, supposed: Supposed) -> Changed:
    reeled = trial.reeled.copy()
    for before, now in pairwise(reeled):
        np.clip(before, now, now + 2e-5, out=now)
    return replace(trial, reeled=reeled), supposed


def _flexion_more_damped(trial: MeasuredTrial, supposed: Supposed) -> Changed:
    factor = 1.01 if trial.planes == ("flexion",) else 1.0
    return trial, supposed._replace(
        wrist=supposed.wrist.model_copy(update={"damping": factor * supposed.wrist.damping})
    )


def _cut_finer(trial: MeasuredTrial, supposed: Supposed) -> Changed:
    return trial, supposed


_REST = "let the wrist rest before each trial and keep them short"
# Possible causes of residuals, one line a cause.
CAUSES: dict[str, Cause] = {
    "springs that creep": Cause(_creeping_springs, 1.0, "%", _REST),
    "tendons that creep": Cause(_creeping_tendons, 1.0, "%", _REST),
    "play between spools and tendons": Cause(_play, 20.0, "um", "take up the play, or pull the tendons tighter"),
    "more damping toward flexion": Cause(_flexion_more_damped, 1.0, "%", "identify each plane by itself", signed=True),
    "8 segments": Cause(_cut_finer, 100.0, "% of the way there", "set identify.segments=8", 8),
}


@dataclass(frozen=True)
class Suspicion:
    """Share of a cause in the residuals, and the shifts that it gives the free parameters' coordinates."""

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
        candidate = problem.candidate(trial, fit.x)

        def shown(trial: MeasuredTrial, supposed: Supposed, segments: int | None = None) -> Array:
            return trial.shown(problem.simulate(trial, [supposed], segments)[0], fit.values["delay"])

        expected = shown(trial, candidate)
        return [
            (shown(*cause.change(trial, candidate), cause.segments) - expected) / cause.size
            for cause in CAUSES.values()
        ]

    with ThreadPoolExecutor(cores()) as pool:
        cause_columns = list(pool.map(columns, problem.trials))
    every = [
        _suspicion(fit, name, [trial_columns[index] for trial_columns in cause_columns])
        for index, name in enumerate(CAUSES)
    ]
    return sorted(
        (suspicion for suspicion in every if suspicion is not None), key=lambda suspicion: -suspicion.evidence
    )


def _suspicion(fit: Fit, cause: str, columns: list[Array]) -> Suspicion | None:
    if not any(column.any() for column in columns):
        return None
    weights, x = np.append(fit.problem.prior(), 0.0), np.append(fit.x, 0.0)
    slopes = [np.column_stack(parts) / fit.noise for parts in zip(fit.slopes, columns, strict=True)]
    residuals = [residual / fit.noise for residual in fit.residuals]
    bread, variance = sandwich(slopes, residuals, weights, len(fit.problem.free) + 1)
    push = sum((a.T @ b for a, b in zip(slopes, residuals, strict=True)), -(weights**2) * x)
    *step, size = bread @ push
    shifts = dict(zip(fit.problem.free, map(float, step), strict=False))
    return Suspicion(cause, float(size), float(np.sqrt(variance[-1, -1])), shifts)


class Misfit(NamedTuple):
    """Residuals of a direction, a plane's bend or tensions: their root mean square and the frames' own noise [rad]."""

    direction: str
    frames: int
    residual: float
    noise: float

    @property
    def ratio(self) -> float:
        """Chi-square over its degrees of freedom; no noise counts as less than `LEAST_NOISE`."""
        return (self.residual / max(self.noise, LEAST_NOISE)) ** 2


def misfits(fit: Fit) -> list[Misfit]:
    """Misfit of every direction with trials; of trials in two planes that of each bend, and of tensions."""
    residuals_of = dict[str, list[Array]]()
    for trial, residual in zip(fit.problem.trials, fit.residuals, strict=True):
        for name, own in trial.named_channels():
            residuals_of.setdefault(name, []).append(residual[own])
    return [
        Misfit(name, len(every), float(np.sqrt(np.mean(every**2))), frame_noise(parts))
        for name, parts in residuals_of.items()
        for every in [np.concatenate(parts)]
    ]


def widened(knowledge: Knowledge, suspected: list[Suspicion], finer: Mapping[str, float]) -> Knowledge:
    """The knowledge with deviations that count what else is behind them: what an evident cause would move, and how
    finely the wrist bends, which trials hardly tell: by most of what a `finer` bend would move."""
    deviation, count = knowledge.deviation.copy(), len(finer)
    systematic = [np.array(list(suspicion.shifts.values())) for suspicion in suspected if suspicion.evident]
    for shift in (*systematic, _UNSURE * np.array(list(finer.values()))):
        deviation[:count] = np.hypot(deviation[:count], shift)
    return replace(knowledge, deviation=deviation)


def refuse_misfit(fit: Fit, knowledge: Knowledge, suspected: list[Suspicion], found: list[Misfit]) -> None:
    """UserError where an evident cause would move a parameter out of its interval, or residuals are far above noise."""
    half = dict(zip(fit.problem.free, knowledge.half_widths, strict=False))
    where, accept = "identify", Setting("misfit=tell", "identify")
    for suspicion in suspected:
        worst = max(half, key=lambda name: abs(suspicion.shifts[name]) / half[name])
        if suspicion.evident and abs(suspicion.shifts[worst]) > half[worst]:
            problem = (
                f"these trials look like {suspicion.told}, which the model does not have; {worst} would be wrong by it"
            )
            raise UserError(
                problem, where, (f"{CAUSES[suspicion.cause].advice}; or take it as it is: ", accept), exit_code=3
            )
    worst_fit = max(found, key=lambda misfit: misfit.ratio)
    if worst_fit.ratio > fit.problem.settings.lack_of_fit:
        like = next((suspicion.told for suspicion in suspected if suspicion.evident), "none of the causes known")
        size, noise = (f"{np.degrees(angle):.2g} deg" for angle in (worst_fit.residual, worst_fit.noise))
        problem = f"toward {worst_fit.direction} the model is off by {size}, frames by {noise}: it looks like {like}"
        raise UserError(problem, where, ("look at the figures; or take it as it is: ", accept), exit_code=3)
