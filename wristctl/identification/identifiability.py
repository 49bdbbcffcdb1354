"""What a set of trials cannot tell, and what would have to be added to them.

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
from wristctl.errors import Setting, UserError
from wristctl.identification.fit import Coordinate, Fit, Problem, linearise
from wristctl.identification.forward import SupposedWrist
from wristctl.identification.intervals import Knowledge, inverse, promised
from wristctl.identification.measured_trials import MeasuredTrial
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


def not_identified(fit: Fit, known: Knowledge) -> dict[str, float]:
    """The free parameters that the trials do not tell, with half their intervals as coordinates.

    Too wide an interval, a value at the edge of the search, or, all of them, too large a condition number.
    """
    low, high = fit.problem.bounds()
    settings, found = fit.problem.settings, {}
    for at, name in enumerate(fit.problem.free):
        half = float(known.half_widths[at])
        at_edge = name not in NOT_NEGATIVE and min(fit.x[at] - low[at], high[at] - fit.x[at]) < 1e-6
        if half > widest(name, settings) or at_edge or known.condition > settings.condition_limit:
            found[name] = half
    return found


@dataclass(frozen=True)
class Addition:
    """Trials that would help, and half the interval that each free parameter would then have, as a coordinate."""

    what: str
    half_widths: Mapping[str, float]
    enough: bool


Added = Callable[[MeasuredTrial], MeasuredTrial]

_ACROSS = 6.94
"""Gravity across each of the two bending planes of a level forearm that is rolled by 45 deg [m/s^2]."""
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


ADDITIONS: dict[str, tuple[Added, Added]] = {
    "the same moves three times as fast": (_fast, _as_is),
    f"another pose: the same moves {_POSE}": (_as_is, _across),
    f"a known mass: the same moves {_MASS}": (_as_is, _heavier),
    f"another pose and faster: the moves {_POSE}, three times as fast": (_fast, _across),
    f"a known mass and faster: the moves {_MASS}, three times as fast": (_fast, _heavier),
}
"""What may be added to trials: how the spools would move, and the load under which they would."""


def additions(fit: Fit, lacking: Mapping[str, float]) -> list[Addition]:
    """What each of ADDITIONS would bring, by the Jacobian of the trials there are and of those added.

    Parameters that the trials do not tell stand at their starting values for it.
    """
    x, begin = fit.x.copy(), fit.problem.begin()
    for name in lacking:
        at = fit.problem.coordinates[Coordinate(name)]
        x[at] = begin[at]
    return [_addition(fit, x, what, *change) for what, change in ADDITIONS.items()]


def _addition(fit: Fit, x: Array, what: str, move: Added, load: Added) -> Addition:
    moved = [_following(fit.problem, x, move(each), load) for each in fit.problem.trials]
    trials = [*fit.problem.trials, *(replace(each, run=f"{each.run} again") for each in moved)]
    problem = replace(fit.problem, trials=trials)
    wider = np.zeros(len(problem.coordinates))
    for name, at in fit.problem.coordinates.items():
        wider[problem.coordinates[name]] = x[at]
    slopes = [each / fit.noise for each in linearise(problem, wider).slopes]
    half = promised(problem, slopes)
    widths = {name: float(half[at]) for at, name in enumerate(problem.free)}
    enough = all(width <= widest(name, problem.settings) for name, width in widths.items())
    return Addition(what, widths, enough)


def _following(problem: Problem, x: Array, trial: MeasuredTrial, load: Added) -> MeasuredTrial:
    """The trial under another load, its angle as it was: one side's spools pull more, the other's keep theirs."""
    loaded = load(trial)
    before, after = (problem.simulate(each, [problem.candidate(each, x)])[0] for each in (trial, loaded))
    more = 2.0 * trial.wrist.tendon_offset * (before - after)
    pulls = np.stack([more, more, -more, -more], axis=1).clip(0.0)
    return replace(loaded, reeled=trial.reeled + pulls)


def refuse(lacking: Mapping[str, float], offered: list[Addition], condition: float, start: Mapping[str, float]) -> None:
    """UserError that names what the trials do not tell and what to add; nothing where nothing is lacking."""
    if not lacking:
        return
    told = ", ".join(f"{name} (+-{width_text(name, half)})" for name, half in lacking.items())
    best = next((each for each in offered if each.enough), None)
    add = best.what if best else f"repetitions of {min(offered, key=_worst).what}"
    name = next(iter(lacking))
    fixed = Setting(f"fix.{name}={start[name]:g}", "identify")
    raise UserError(
        f"these trials do not identify {told}; condition number {condition:.3g}",
        "identify",
        (f"add {add}; or hold what you know otherwise, for example ", fixed),
        exit_code=3,
    )


def _worst(addition: Addition) -> float:
    return max(half / UNKNOWNS[name].tolerance for name, half in addition.half_widths.items())


def _more(name: str) -> Callable[[SupposedWrist], SupposedWrist]:
    def changed(each: SupposedWrist) -> SupposedWrist:
        return each._replace(wrist=each.wrist.model_copy(update={name: 1.01 * getattr(each.wrist, name)}))

    return changed


def _turned(each: SupposedWrist) -> SupposedWrist:
    return each._replace(wrist=plant_of(each.wrist, TrueWrist(tilt_deg=1.0)))


KNOWN: dict[str, Callable[[SupposedWrist], SupposedWrist]] = {
    "1 % more mass of the hand": _more("hand_mass"),
    "1 % more distance of the hand's centre of mass": _more("hand_offset"),
    "1 % more length of the wrist": _more("length"),
    "1 % more mass of the wrist": _more("mass"),
    "a base that leans by 1 deg": _turned,
}
"""What identification takes as known, changed to see what depends on it."""
FINER = "8 segments in place of the model's"
"""As how finely it bends is taken as known too."""
_FINER = 8


def budget(fit: Fit, known: Knowledge) -> dict[str, dict[str, float]]:
    """By how much each free coordinate would move if one of KNOWN, or FINER, were so, as believed: to first order."""
    problem, weights = fit.problem, 1.0 / fit.noise**2
    push = {name: np.zeros(len(fit.x)) for name in (*KNOWN, FINER)}
    for trial, slopes in zip(problem.trials, fit.slopes, strict=True):
        own = problem.candidate(trial, fit.x)
        course = [*problem.simulate(trial, [own, *(change(own) for change in KNOWN.values())])]
        course += [*problem.simulate(trial, [own], _FINER)]
        expected, *others = (trial.shown(each, fit.values["delay"]) for each in course)
        for name, other in zip(push, others, strict=True):
            push[name] += weights * slopes.T @ (other - expected)
    bread = inverse(known.information)
    shifts = {name: -bread @ each for name, each in push.items()}
    return {name: {free: float(each[at]) for at, free in enumerate(problem.free)} for name, each in shifts.items()}
