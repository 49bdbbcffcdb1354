"""What a fit in two planes tells: springs as an ellipse, the place of each tendon, and study files of them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import TendonPlace as Place
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_fit import Told
from wristctl.identification.fit import Fit
from wristctl.identification.intervals import NORMAL_95, Knowledge, interval
from wristctl.identification.measured_trials import MOST_DELAYED, PLANES, MeasuredTrial
from wristctl.identification.posterior import posterior_draws, posterior_yaml
from wristctl.identification.problem import Problem
from wristctl.identification.unknowns import identified_yaml, springs_of

# Half an interval of the axis [deg] beyond which it is not told.
_WIDEST_AXIS = 15.0
# Half intervals beyond which a parameter's value in another minimum is another value.
_ELSEWHERE = 2.0


def covariance_of(fit: Fit, knowledge: Knowledge) -> Array:
    """Covariance of the free parameters' coordinates, as wide as their intervals."""
    free = len(fit.problem.free)
    deviation = knowledge.deviation[:free]
    covariance: Array = knowledge.correlation[:free, :free] * np.outer(deviation, deviation)
    return covariance


def forces_are_scaled(problem: Problem, wrist: WristParameters) -> bool:
    """Whether anybody has said a force or a mass, without which spools and bends tell ratios alone.

    That is a tension, trials with several masses, a held damping or tendon stiffness, or the hand's mass: in the logs,
    where it is not the default, or given in the section `wrist`.
    """
    trials = problem.trials
    if not {"damping", "tendon_stiffness"}.isdisjoint(problem.settings.fixed):
        return True
    if any(np.any(trial.channel >= len(PLANES)) for trial in trials):
        return True
    default = WristParameters.model_fields["hand_mass"].default
    masses = _masses(trials)
    return "hand_mass" in wrist.model_fields_set or len(masses) > 1 or masses != {default}


def overruled_mass(problem: Problem, wrist: WristParameters) -> float | None:
    """Mass [kg] that the logs have in place of another one that the section `wrist` gives; None where there is none."""
    masses = _masses(problem.trials)
    given = "hand_mass" in wrist.model_fields_set and masses.isdisjoint({round(wrist.hand_mass, 6)})
    return masses.pop() if given and len(masses) == 1 else None


def _masses(trials: Sequence[MeasuredTrial]) -> set[float]:
    """Masses of the hand in trials [kg], each once."""
    return {round(trial.wrist.hand_mass, 6) for trial in trials}


def without_forces(told: Mapping[str, Told]) -> dict[str, Told]:
    """The same without ends of all that has newtons in it."""
    return {name: one._replace(low=-math.inf, high=math.inf) if "N" in one.unit else one for name, one in told.items()}


def told_of_bends(fit: Fit, knowledge: Knowledge) -> dict[str, Told]:
    """Every parameter found, with its 95 % interval; without its ends where the readings do not tell it.

    They do not where another minimum fits as well and has the parameter elsewhere.
    """
    rivals = _equals(fit, knowledge)
    problem, told = fit.problem, _springs_told(fit, knowledge, rivals)
    low, high = problem.bounds()
    for index, name in enumerate(problem.free):
        if name == "stiffness" or name.startswith("oblique"):
            continue
        unknown, half = problem.unknowns[name], float(knowledge.half_widths[index])
        ends = interval(fit, knowledge, name)
        tolerated = problem.settings.widest * unknown.tolerance
        wide = half > (math.log1p(tolerated) if unknown.log else tolerated)
        at_edge = unknown.low != 0.0 and min(fit.x[index] - low[index], high[index] - fit.x[index]) < 1e-6
        elsewhere = any(abs(x[index] - fit.x[index]) > _ELSEWHERE * half for x in rivals)
        if wide or at_edge or elsewhere or knowledge.assumed(index):
            ends = (-math.inf, math.inf)
        scale, unit = (math.degrees(1.0), "deg") if name.startswith("direction") else (1.0, unknown.unit)
        told[name] = Told(scale * fit.values[name], scale * ends[0], scale * ends[1], unit, unknown.meaning)
    return told


def _equals(fit: Fit, knowledge: Knowledge) -> list[Array]:
    """Coordinates of other minima whose chi-square is not significantly more, counting independent readings only."""
    count = sum(map(len, fit.residuals))
    return [rival.x for rival in fit.rivals if rival.excess * knowledge.effective < NORMAL_95**2 * count]


def _springs_told(fit: Fit, knowledge: Knowledge, rivals: Sequence[Array]) -> dict[str, Told]:
    """Stiffness along the axis and across it, and the axis, by the first order of the ellipse's numbers."""
    free, values = fit.problem.free, fit.values
    at = [free.index(name) for name in ("stiffness", "oblique_cos", "oblique_sin")]
    covariance = covariance_of(fit, knowledge)[np.ix_(at, at)]
    mean, p, q = (values[name] for name in ("stiffness", "oblique_cos", "oblique_sin"))
    springs, size = springs_of(mean, p, q), max(math.hypot(p, q), 1e-9)
    side = 1.0 if p >= 0.0 else -1.0
    others = [
        [values[name] for name in ("stiffness", "oblique_cos", "oblique_sin")]
        for values in (fit.problem.values(x) for x in rivals)
    ]
    told = {}
    for name, sign, meaning in (("stiffness", side, "along the axis"), ("stiffness_across", -side, "across the axis")):
        value = mean * (1.0 + sign * size)
        slope = np.array([value, sign * mean * p / size, sign * mean * q / size])
        half = NORMAL_95 * math.sqrt(slope @ covariance @ slope)
        ends = (value - half, value + half)
        same_axis = (m * (1.0 + sign * (p * other_p + q * other_q) / size) for m, other_p, other_q in others)
        elsewhere = any(abs(other - value) > _ELSEWHERE * half for other in same_axis)
        if elsewhere or half > fit.problem.settings.widest * value:
            ends = (-math.inf, math.inf)
        told[name] = Told(value, *ends, "N m/rad", f"bending stiffness {meaning}")
    slope = np.degrees([0.0, -q, p]) / (2.0 * size**2)
    axis, half = springs["stiffness_axis_deg"], NORMAL_95 * math.sqrt(slope @ covariance @ slope)
    turns = ((springs_of(*other)["stiffness_axis_deg"] - axis + 45.0) % 90.0 - 45.0 for other in others)
    elsewhere = any(abs(turn) > _ELSEWHERE * half for turn in turns)
    ends = (-math.inf, math.inf) if elsewhere or half >= _WIDEST_AXIS else (axis - half, axis + half)
    told["stiffness_axis_deg"] = Told(axis, *ends, "deg", "axis of the springs' ellipse, from ulnar toward flexion")
    return told


def _on_a_square(problem: Problem, values: Mapping[str, float]) -> dict[str, float]:
    """The values with those of a wrist whose tendons are on a square."""
    springs = springs_of(values["stiffness"], values["oblique_cos"], values["oblique_sin"])
    radii = [place.radius / values[f"gain_{number}"] for number, place in problem.places.items()]
    return {**values, **springs, "tendon_radius": float(np.mean(radii))}


def bends_yaml(
    fit: Fit, knowledge: Knowledge, wrist: WristParameters, count: int, rng: np.random.Generator
) -> tuple[str, str]:
    """A study file of what was found, and one of the whole wrist with a family of so many draws of what is left open.

    The first has each tendon's place. The second is for commands in one plane, whose wrist has its tendons on a square:
    there their radius is the mean. `wrist` has what was not to be found.
    """
    problem = fit.problem
    captured = [trial.captured[trial.of(0)] for trial in problem.trials]
    rate = 1.0 / float(np.median(np.concatenate([np.diff(times) for times in captured])))
    camera = {
        "frame_rate": rate,
        "delay_frames": float(np.clip(fit.values["delay"] * rate, 0.0, MOST_DELAYED)),
        "noise_deg": float(np.degrees(fit.noise)),
    }
    values = _on_a_square(problem, fit.values)
    places = [
        Place(
            angle_deg=math.degrees(fit.values[f"direction_{number}"]),
            radius=place.radius / fit.values[f"gain_{number}"],
            ends_at=place.ends_at,
            multiplicity=place.multiplicity,
        )
        for number, place in problem.places.items()
    ]
    draws = [_on_a_square(problem, draw) for draw in posterior_draws(fit, knowledge, count, rng)]
    family = identified_yaml(values, camera, known=wrist) + posterior_yaml(draws, values, camera, 1.0 / rate)
    return identified_yaml(values, camera, places), family
