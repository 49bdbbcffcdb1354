"""The search for a wrist's parameters in two planes: springs as an ellipse, and the place of each tendon.

The springs' stiffness is m (1 + [[p, q], [q, -p]]) over bends toward ulnar and flexion: its mean m, and two numbers
that are well behaved where the springs are nearly alike all around and their axis is not to be told. They stand in a
table as the stiffness along the ellipse's axis, that across, and the axis' direction.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import TendonPlace as Place
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.arc_fit import Told
from wristctl.identification.fit import CLOCK, SPOOL, Coordinate, Fit, Problem, spool_zero
from wristctl.identification.forward import Places, Supposed, courses
from wristctl.identification.intervals import NORMAL_95, Knowledge, interval
from wristctl.identification.measured_trials import MOST_DELAYED, PLANES, MeasuredTrial
from wristctl.identification.posterior import posterior_draws, posterior_yaml
from wristctl.identification.rotor_field import rotors_of
from wristctl.identification.unknowns import UNKNOWNS, Unknown, believed_of, identified_yaml, tendons_of_values
from wristctl.wrist.spatial.spatial_segments import ellipse
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

# Largest part of the springs' mean that an axis may have more or less, and error of a tendon's direction [rad].
_OBLIQUE, _ASIDE = 0.6, 0.6
_SHARED = ("stiffness", "damping", "tendon_stiffness", "friction", "sheath_friction", "presliding", "delay")
# Pull by which tendons are tighter than believed where a search begins on that side [N].
_TIGHTER = 6.0
# Half an interval of the axis [deg] beyond which it is not told.
_WIDEST_AXIS = 15.0
# Half intervals beyond which a parameter's value in another minimum is another value.
_ELSEWHERE = 2.0


def oblique_of(wrist: WristParameters) -> tuple[float, float, float]:
    """Mean stiffness [N m/rad] and the two numbers of the ellipse."""
    across = wrist.stiffness * wrist.flexion_ratio
    yy, yz, zz = ellipse(wrist.stiffness, across, math.radians(wrist.stiffness_axis_deg))
    mean = 0.5 * (yy + zz)
    return float(mean), float(0.5 * (yy - zz) / mean), float(yz / mean)


def springs_of(mean: float, p: float, q: float) -> dict[str, float]:
    """Stiffness, flexion_ratio and stiffness_axis_deg of a wrist; the axis is within 45 deg of ulnar."""
    side = 1.0 if p >= 0.0 else -1.0
    size = side * math.hypot(p, q)
    axis = 0.5 * math.degrees(math.atan2(side * q, side * p))
    return {
        "stiffness": mean * (1.0 + size),
        "flexion_ratio": (1.0 - size) / (1.0 + size),
        "stiffness_axis_deg": axis,
    }


@dataclass(frozen=True)
class BendProblem(Problem):
    """Trials in two planes, the parameters to find and those that are held.

    `start` is by the names of `unknowns`. Beside the parameters the camera's zeros of each run and plane, the zero of
    each spool of each run and the clocks of each trial are found: one that is late in one plane would look like softer
    springs there, as a wrist on tight tendons tells them by its inertia alone.
    """

    places: Mapping[int, TendonPlace]
    """Places of the tendons as believed, by their numbers."""

    @cached_property
    def unknowns(self) -> Mapping[str, Unknown]:
        """Those of all planes; direction and gain are of each tendon."""
        found = {name: UNKNOWNS[name] for name in _SHARED}
        found["stiffness"] = UNKNOWNS["stiffness"]._replace(meaning="bending stiffness, mean of all directions")
        for name, meaning in (("oblique_cos", "ulnar less flexion"), ("oblique_sin", "between the planes")):
            found[name] = Unknown(name, "", f"of the springs, {meaning}", False, -_OBLIQUE, _OBLIQUE, 0.4)
        for number, place in self.places.items():
            ends = place.angle - _ASIDE, place.angle + _ASIDE
            direction, gain = f"direction_{number}", f"gain_{number}"
            found[direction] = Unknown(direction, "rad", "of a tendon, from ulnar toward flexion", False, *ends, 0.2)
            found[gain] = Unknown(gain, "", "bend for a length reeled in, over that believed", True, 0.8, 1.25, 1.0)
        return found

    @property
    def simulated(self) -> Collection[str]:
        """All but the delay."""
        return [name for name in self.unknowns if name != "delay"]

    @cached_property
    def free(self) -> tuple[str, ...]:
        """The parameters to find."""
        return tuple(name for name in self.unknowns if name not in self.settings.fixed)

    def begins(self) -> list[Array]:
        """As believed, and with all tendons tighter.

        A tendon that the search lets go slack where it was tight leaves the wrist to its springs, which then seem to be
        told. As slack begins with a kink, such a minimum is not left again; a search from the tight side finds others.
        """
        tighter = self.begin()
        for coordinate, index in self.coordinates.items():
            if coordinate.kind == SPOOL:
                tighter[index] = _TIGHTER / self.start["tendon_stiffness"]
        return [self.begin(), tighter]

    def prior(self) -> Array:
        """One over the standard deviation with which each coordinate is known beforehand; 0 where nothing is known."""
        weights = super().prior()
        for coordinate, index in self.coordinates.items():
            if coordinate.kind.startswith("gain_"):
                weights[index] = 1.0 / self.settings.radius_error
        return weights

    def clocks(self, trial: MeasuredTrial) -> tuple[Coordinate, ...]:
        """Its own."""
        return (Coordinate(CLOCK, trial.label),)

    def courses(self, trial: MeasuredTrial, points: Sequence[Array]) -> Array:
        """Bends and tensions, these as large as the trial's readings, (count, T, 2 + M)."""
        supposed, tensions = [self.candidate(trial, x) for x in points], bool(np.any(trial.channel >= len(PLANES)))
        return courses(supposed, trial.reeled, self.settings.step, self.settings.segments, pulls=tensions)

    def candidate(self, trial: MeasuredTrial, x: Array) -> Supposed:
        """The trial's wrist and tendons at coordinates x."""
        values = self.values(x)
        springs = springs_of(values["stiffness"], values["oblique_cos"], values["oblique_sin"])
        wrist = trial.wrist.model_copy(update={**springs, "damping": values["damping"]})
        tendons = self.actuator.model_copy(update=tendons_of_values(values))
        taut = tuple(float(x[self.coordinates[spool_zero(trial, tendon)]]) for tendon in trial.tendons)
        layout = TendonLayout(tuple(self.places.values()))
        places = Places.of(layout, wrist.discs)._replace(cross_section=self._cross_section(values))
        return Supposed(wrist, tendons, taut, places, rotors=rotors_of(self.settings))

    def planar(self, values: Mapping[str, float]) -> dict[str, float]:
        """The values with those of a wrist whose tendons are on a square."""
        springs = springs_of(values["stiffness"], values["oblique_cos"], values["oblique_sin"])
        radii = [place.radius / values[f"gain_{number}"] for number, place in self.places.items()]
        return {**values, **springs, "tendon_radius": float(np.mean(radii))}

    def _cross_section(self, values: Mapping[str, float]) -> Array:
        return np.array(
            [
                place.radius / values[f"gain_{number}"] * np.array([math.cos(angle), math.sin(angle)])
                for number, place in self.places.items()
                for angle in [values[f"direction_{number}"]]
            ]
        )


def bend_problem(
    trials: Sequence[MeasuredTrial], places: Mapping[int, TendonPlace], wrist: WristParameters, actuator: Actuator,
    settings: IdentifySettings,
) -> BendProblem:  # fmt: skip
    """The search over trials, begun at what is believed. Raises UserError for a held value that the model has not."""
    for name in settings.fixed:
        if name not in _SHARED or name == "stiffness":
            fix = f"one of {', '.join(other for other in _SHARED if other != 'stiffness')}"
            raise UserError(f"{name} of springs or tendons alike is no parameter here", f"identify.fix.{name}", fix)
    mean, p, q = oblique_of(wrist)
    believed = believed_of(wrist, actuator)
    start = {name: believed[name] for name in _SHARED} | {"stiffness": mean, "oblique_cos": p, "oblique_sin": q}
    for number, place in places.items():
        start |= {f"direction_{number}": place.angle, f"gain_{number}": 1.0}
    return BendProblem(list(trials), start, settings, actuator, places)


def covariance_of(fit: Fit, knowledge: Knowledge) -> Array:
    """Covariance of the free parameters' coordinates, as wide as their intervals."""
    free = len(fit.problem.free)
    deviation = knowledge.deviation[:free]
    covariance: Array = knowledge.correlation[:free, :free] * np.outer(deviation, deviation)
    return covariance


def forces_are_scaled(problem: BendProblem, wrist: WristParameters) -> bool:
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


def overruled_mass(problem: BendProblem, wrist: WristParameters) -> float | None:
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


def bends_yaml(
    fit: Fit, knowledge: Knowledge, wrist: WristParameters, count: int, rng: np.random.Generator
) -> tuple[str, str]:
    """A study file of what was found, and one of the whole wrist with a family of so many draws of what is left open.

    The first has each tendon's place. The second is for commands in one plane, whose wrist has its tendons on a square:
    there their radius is the mean. `wrist` has what was not to be found.
    """
    problem = fit.problem
    assert isinstance(problem, BendProblem)
    captured = [trial.captured[trial.of(0)] for trial in problem.trials]
    rate = 1.0 / float(np.median(np.concatenate([np.diff(times) for times in captured])))
    camera = {
        "frame_rate": rate,
        "delay_frames": float(np.clip(fit.values["delay"] * rate, 0.0, MOST_DELAYED)),
        "noise_deg": float(np.degrees(fit.noise)),
    }
    values = problem.planar(fit.values)
    places = [
        Place(
            angle_deg=math.degrees(fit.values[f"direction_{number}"]),
            radius=place.radius / fit.values[f"gain_{number}"],
            ends_at=place.ends_at,
            multiplicity=place.multiplicity,
        )
        for number, place in problem.places.items()
    ]
    draws = [problem.planar(draw) for draw in posterior_draws(fit, knowledge, count, rng)]
    family = identified_yaml(values, camera, known=wrist) + posterior_yaml(draws, values, camera, 1.0 / rate)
    return identified_yaml(values, camera, places), family
