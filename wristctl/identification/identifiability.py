"""Parameters that a set of trials does not identify, and trials that would.

Angles at given spool positions depend on ratios of stiffness, tendon stiffness and weight: only a known weight sets
their scale, and it has to act differently in different trials. Damping and delay both look like lag in slow moves. So
whether a parameter can be found is a question to the Jacobian, and so is which further trials would help.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import TrueWrist
from wristctl.config.wrist import WristParameters
from wristctl.errors import Setting, UserError
from wristctl.identification.fit import Fit, linearise
from wristctl.identification.intervals import Knowledge, inverse, promised
from wristctl.identification.measured_trials import MeasuredTrial
from wristctl.identification.problem import Coordinate, Problem
from wristctl.identification.unknowns import NOT_NEGATIVE, UNKNOWNS
from wristctl.simulation.worlds import plant_of


def widest(name: str, settings: IdentifySettings) -> float:
    """Half the widest interval, as a coordinate, with which a parameter counts as identified."""
    unknown = UNKNOWNS[name]
    tolerated = settings.widest * unknown.tolerance
    return float(np.log1p(tolerated)) if unknown.log else tolerated


def width_text(name: str, half: float) -> str:
    """Half an interval in words: a percentage, or in the parameter's own unit."""
    unknown = UNKNOWNS[name]
    if unknown.log:
        percent = 100.0 * np.expm1(min(half, 7.0))
        return f"{percent:.2g} %" if percent < 100.0 else f"{percent:.0f} %" if percent <= 1000.0 else "over 1000 %"
    return f"{1e3 * half:.2g} ms" if unknown.unit == "s" else f"{half:.2g}"


def not_identified(fit: Fit, knowledge: Knowledge) -> dict[str, float]:
    """The free parameters that the trials do not tell, with half their intervals as coordinates.

    Too wide an interval, a value at the edge of the search, or, all of them, too large a condition number.
    """
    low, high = fit.problem.bounds()
    settings, unidentified = fit.problem.settings, {}
    for index, name in enumerate(fit.problem.free):
        half = float(knowledge.half_widths[index])
        at_edge = name not in NOT_NEGATIVE and min(fit.x[index] - low[index], high[index] - fit.x[index]) < 1e-6
        if half > widest(name, settings) or at_edge or knowledge.condition > settings.condition_limit:
            unidentified[name] = half
    return unidentified


@dataclass(frozen=True)
class Addition:
    """Trials that would help, and half the interval that each free parameter would then have, as a coordinate."""

    what: str
    half_widths: Mapping[str, float]
    enough: bool


Added = Callable[[MeasuredTrial], MeasuredTrial]

# Gravity across each of the two bending planes of a level forearm that is rolled by 45 deg [m/s^2].
_ACROSS = 6.94
_POSE = f"of a level forearm rolled by 45 deg (wrist.gravity: [0, {_ACROSS}], wrist.gravity_flexion: {_ACROSS})"
_MASS = "with 0.2 kg more in the hand, added to wrist.hand_mass"


def _as_is(trial: MeasuredTrial) -> MeasuredTrial:
    return trial


def _fast(trial: MeasuredTrial) -> MeasuredTrial:
    return trial.faster(3.0)


def _across(trial: MeasuredTrial) -> MeasuredTrial:
    return replace(trial, wrist=trial.wrist.model_copy(update={"gravity": (0.0, _ACROSS)}))


def _heavier(trial: MeasuredTrial) -> MeasuredTrial:
    return replace(trial, wrist=trial.wrist.model_copy(update={"hand_mass": trial.wrist.hand_mass + 0.2}))


# Additions to a set of trials: motion of the spools, and load.
ADDITIONS: dict[str, tuple[Added, Added]] = {
    "the same moves three times as fast": (_fast, _as_is),
    f"another pose: the same moves {_POSE}": (_as_is, _across),
    f"a known mass: the same moves {_MASS}": (_as_is, _heavier),
    f"another pose and faster: the moves {_POSE}, three times as fast": (_fast, _across),
    f"a known mass and faster: the moves {_MASS}, three times as fast": (_fast, _heavier),
}


def additions(fit: Fit, lacking: Mapping[str, float]) -> list[Addition]:
    """Effect of every one of ADDITIONS, by the Jacobian of the trials there are and of those added.

    Parameters that the trials do not tell stand at their starting values for it.
    """
    x, begin = fit.x.copy(), fit.problem.begin()
    for name in lacking:
        column = fit.problem.coordinates[Coordinate(name)]
        x[column] = begin[column]
    return [_addition(fit, x, what, *change) for what, change in ADDITIONS.items()]


def _addition(fit: Fit, x: Array, what: str, move: Added, load: Added) -> Addition:
    moved = [_following(fit.problem, x, move(trial), load) for trial in fit.problem.trials]
    trials = [*fit.problem.trials, *(replace(trial, run=f"{trial.run} again") for trial in moved)]
    problem = replace(fit.problem, trials=trials)
    wider = np.zeros(len(problem.coordinates))
    for name, index in fit.problem.coordinates.items():
        wider[problem.coordinates[name]] = x[index]
    slopes = [slope / fit.noise for slope in linearise(problem, wider).slopes]
    half = promised(problem, slopes)
    widths = {name: float(half[index]) for index, name in enumerate(problem.free)}
    enough = all(width <= widest(name, problem.settings) for name, width in widths.items())
    return Addition(what, widths, enough)


def _following(problem: Problem, x: Array, trial: MeasuredTrial, load: Added) -> MeasuredTrial:
    """The trial under another load, its angle as it was: one side's spools pull more, the other's keep theirs."""
    loaded = load(trial)
    before, after = (problem.simulate(trial_run, [problem.candidate(trial_run, x)])[0] for trial_run in (trial, loaded))
    more = 2.0 * trial.wrist.tendon_offset * (before - after)[:, 0]
    pulls = np.stack([more, more, -more, -more], axis=1).clip(0.0)
    return replace(loaded, reeled=trial.reeled + pulls)


def refuse(lacking: Mapping[str, float], offered: list[Addition], condition: float, start: Mapping[str, float]) -> None:
    """UserError that names what the trials do not tell and what to add; nothing where nothing is lacking."""
    if not lacking:
        return
    told = ", ".join(lacking)
    best = next((addition for addition in offered if addition.enough), None)
    add = best.what if best else f"repetitions of {min(offered, key=worst).what}"
    name = next(iter(lacking))
    fixed = Setting(f"fix.{name}={start[name]:g}", "identify")
    raise UserError(
        f"these trials do not identify {told}; condition number {condition:.3g}",
        "identify",
        (f"add {add}; or hold what you know otherwise, for example ", fixed),
        exit_code=3,
    )


def worst(addition: Addition) -> float:
    """The largest half interval that an addition would leave, over the parameter's tolerance."""
    return max(half / UNKNOWNS[name].tolerance for name, half in addition.half_widths.items())


def _more(name: str) -> Callable[[WristParameters], WristParameters]:
    def changed(wrist: WristParameters) -> WristParameters:
        return wrist.model_copy(update={name: 1.01 * getattr(wrist, name)})

    return changed


def _turned(wrist: WristParameters) -> WristParameters:
    return plant_of(wrist, TrueWrist(tilt_deg=1.0))


# Changes of the facts of a trial's wrist that identification takes as known.
KNOWN: dict[str, Callable[[WristParameters], WristParameters]] = {
    "1 % more mass of the hand": _more("hand_mass"),
    "1 % more distance of the hand's centre of mass": _more("hand_offset"),
    "1 % more length of the wrist": _more("length"),
    "1 % more mass of the wrist": _more("mass"),
    "a base that leans by 1 deg": _turned,
}
# As how finely it bends is taken as known too.
FINER = "8 segments in place of the model's"
_FINER = 8


def budget(fit: Fit, knowledge: Knowledge) -> dict[str, dict[str, float]]:
    """Shift of every free coordinate under every change of KNOWN and under FINER, to first order."""
    problem, weights = fit.problem, 1.0 / fit.noise**2
    push = {name: np.zeros(len(fit.x)) for name in (*KNOWN, FINER)}
    for trial, slopes in zip(problem.trials, fit.slopes, strict=True):
        candidate = problem.candidate(trial, fit.x)
        others = [replace(trial, wrist=change(trial.wrist)) for change in KNOWN.values()]
        course = [*problem.simulate(trial, [candidate, *(problem.candidate(other, fit.x) for other in others)])]
        course += [*problem.simulate(trial, [candidate], _FINER)]
        expected, *pushed = (trial.shown(angle, fit.values["delay"]) for angle in course)
        for name, pushed_angle in zip(push, pushed, strict=True):
            push[name] += weights * slopes.T @ (pushed_angle - expected)
    bread = inverse(knowledge.information)
    shifts = {name: -bread @ pushes for name, pushes in push.items()}
    return {
        name: {free: float(shift[index]) for index, free in enumerate(problem.free)} for name, shift in shifts.items()
    }
