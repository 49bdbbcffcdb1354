"""The search for a wrist's parameters: trials, what is found of them and what is known beforehand."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.identification.forward import Places, Supposed, across_plane, courses
from wristctl.identification.measured_trials import BOTH, PLANES, MeasuredTrial
from wristctl.identification.rotor_field import rotors_of
from wristctl.identification.unknowns import (
    NOT_NEGATIVE,
    SHARED,
    UNKNOWNS,
    Unknown,
    believed_of,
    oblique_of,
    springs_of,
    tendons_of_values,
    unknowns_of_places,
)
from wristctl.wrist.tendon_layout import TendonLayout, TendonPlace

# Friction with which a search begins that believes in none.
_OFF_THE_EDGE = 0.02
# Pull by which tendons are tighter than believed where a search begins on that side [N].
_TIGHTER = 6.0


class Coordinate(NamedTuple):
    """Coordinate of a search: a parameter by name, or a small error of one place, most in one run.

    That is the camera's zero in a bending plane (ZERO), what a tendon's spool has reeled in unknown (SPOOL), by how
    much one trial's clocks are further apart (CLOCK), or how a plane's view is turned about the wrist's axis (TURN) and
    what share of the bend it shows too much (GAIN).
    """

    kind: str
    run: str = ""
    place: str | int = ""


ZERO, SPOOL, CLOCK, TURN, GAIN = "camera's zero", "spool's zero", "trial's clock", "view's turn", "view's gain"


@dataclass(frozen=True)
class Problem:
    """Trials, the parameters to find and those that are held, each with the value at which it starts.

    `start` is by the names of `unknowns`. Beside the parameters small errors are found, of which the size is known
    beforehand: the camera's zero angle of each run and plane, the zero of each spool of each run, and in two planes the
    clocks of each trial and the turn and the gain of each view. A trial that is late in one plane would look like
    softer springs there, as a wrist on tight tendons tells them by its inertia alone; a view that is turned moves all
    tendons.
    """

    trials: Sequence[MeasuredTrial]
    start: Mapping[str, float]
    settings: IdentifySettings
    actuator: Actuator
    """As believed: what of the tendons is not found."""
    places: Mapping[int, TendonPlace] = field(default_factory=dict)
    """In two planes the places of the tendons as believed, by their numbers."""

    @cached_property
    def unknowns(self) -> Mapping[str, Unknown]:
        """Parameters of the model, found or held, by name."""
        return unknowns_of_places(self.places) if self.places else UNKNOWNS

    @cached_property
    def free(self) -> tuple[str, ...]:
        """The parameters to find; how the planes differ only where there are trials of both."""
        one_plane = len({plane for trial in self.trials for plane in trial.planes}) == 1
        held = {*self.settings.fixed, *(["flexion_ratio"] if one_plane else [])}
        return tuple(name for name in self.unknowns if name not in held)

    @cached_property
    def coordinates(self) -> dict[Coordinate, int]:
        """Index of every coordinate of the search: free parameters, then small errors."""
        free = [Coordinate(name) for name in self.free]
        zeros = [zero for trial in self.trials for zero in self.zeros(trial)]
        spools = [spool_zero(trial, tendon) for trial in self.trials for tendon in trial.tendons]
        clocks = [clock for trial in self.trials for clock in self.clocks(trial)]
        views = [view for trial in self.trials for view in self.views(trial)]
        every = dict.fromkeys([*free, *zeros, *spools, *clocks, *views])
        return {coordinate: index for index, coordinate in enumerate(every)}

    def begin(self) -> Array:
        """The coordinates at the start; at an edge the search would stay there."""
        x = np.zeros(len(self.coordinates))
        for index, name in enumerate(self.free):
            x[index] = self.unknowns[name].coordinate(self.start[name], self.start[name])
            if name in NOT_NEGATIVE:
                x[index] = max(x[index], _OFF_THE_EDGE)
        return x

    def begins(self) -> list[Array]:
        """Coordinates at which searches begin, of which the best is taken: as believed, in two planes also tighter.

        A tendon that the search lets go slack where it was tight leaves the wrist to its springs, which then seem to be
        told. As slack begins with a kink, such a minimum is not left again; a search from the tight side finds others.
        """
        begin = self.begin()
        if not self.places:
            return [begin]
        spools = np.array([coordinate.kind == SPOOL for coordinate in self.coordinates])
        return [begin, np.where(spools, _TIGHTER / self.start["tendon_stiffness"], begin)]

    def bounds(self) -> tuple[Array, Array]:
        """Least and largest coordinates."""
        widest = np.array([_WIDEST[coordinate.kind] for coordinate in self.coordinates if coordinate.kind in _WIDEST])
        low, high = np.array([self.unknowns[name].bounds() for name in self.free]).reshape(-1, 2).T
        return np.concatenate([low, -widest]), np.concatenate([high, widest])

    def prior(self) -> Array:
        """One over the standard deviation with which each coordinate is known beforehand; 0 where nothing is known."""
        beginning = {
            "tendon_radius": 1.0 / self.settings.radius_error,
            "presliding": 1.0 / self.settings.presliding_error,
            ZERO: 1.0 / np.deg2rad(self.settings.zero_error_deg),
            SPOOL: 1.0 / self.settings.spool_error,
            CLOCK: 1.0 / max(self.settings.clock_error, _LEAST_CLOCK),
            TURN: 1.0 / np.deg2rad(self.settings.turn_error_deg),
            GAIN: 1.0 / self.settings.view_error,
        } | {f"gain_{number}": 1.0 / self.settings.radius_error for number in self.places}
        return np.array([beginning.get(coordinate.kind, 0.0) for coordinate in self.coordinates])

    def values(self, x: Array) -> dict[str, float]:
        """Every parameter at coordinates x, found or held."""
        held = {**self.start, **self.settings.fixed}
        for name, value in zip(self.free, x, strict=False):
            held[name] = self.unknowns[name].value(float(value), self.start[name])
        return {name: held[name] for name in self.unknowns}

    def zeros(self, trial: MeasuredTrial) -> dict[Coordinate, Array]:
        """The camera's zeros that a trial's readings (R,) hold, each with its share in every reading."""
        return {Coordinate(ZERO, trial.run, plane): trial.of(k).astype(float) for k, plane in enumerate(trial.planes)}

    def views(self, trial: MeasuredTrial) -> dict[Coordinate, Array]:
        """Errors of a trial's views in two planes, each with the bends (P, P) that it adds to those of the wrist.

        A view that is turned from ulnar toward flexion shows part of the other plane's bend. One instrument that takes
        both planes' bends has no such errors.
        """
        if not self.places or not trial.by_cameras:
            return {}
        ulnar, flexion = PLANES
        return {
            Coordinate(TURN, place=ulnar): np.array([[0.0, 1.0], [0.0, 0.0]]),
            Coordinate(TURN, place=flexion): np.array([[0.0, 0.0], [-1.0, 0.0]]),
            Coordinate(GAIN, place=ulnar): np.diag([1.0, 0.0]),
            Coordinate(GAIN, place=flexion): np.diag([0.0, 1.0]),
        }

    def viewed(self, trial: MeasuredTrial, courses: Array, x: Array) -> Array:
        """A trial's courses (..., P + M) as its views show them at coordinates x."""
        viewed, bends = courses.copy(), courses[..., : len(PLANES)]
        for view, added in self.views(trial).items():
            viewed[..., : len(PLANES)] += x[self.coordinates[view]] * bends @ added.T
        return viewed

    def clocks(self, trial: MeasuredTrial) -> tuple[Coordinate, ...]:
        """Coordinates by which a trial's frames are later than by the delay [s]; none where a board dates counts."""
        return (Coordinate(CLOCK, trial.label),) if trial.direction == BOTH else ()

    def delay(self, trial: MeasuredTrial, x: Array) -> float:
        """How much older a trial's frames are than their time stamps [s] at coordinates x."""
        return float(self.values(x)["delay"] + sum(x[self.coordinates[clock]] for clock in self.clocks(trial)))

    def courses(self, trial: MeasuredTrial, points: Sequence[Array]) -> Array:
        """What a trial's wrist does at each of some coordinates: (count, T, P + M), as `trial.shown` takes it."""
        return self.simulate(trial, [self.candidate(trial, x) for x in points])

    def candidate(self, trial: MeasuredTrial, x: Array) -> Supposed:
        """The trial's wrist and tendons at coordinates x."""
        values = self.values(x)
        wrist, places = trial.wrist.model_copy(update=self._wrist(trial, values)), self._places(trial, values)
        tendons = self.actuator.model_copy(update=tendons_of_values(values))
        taut = tuple(float(x[self.coordinates[spool_zero(trial, tendon)]]) for tendon in trial.tendons)
        across = None
        if not self.places:
            (plane,) = trial.planes
            across = across_plane(wrist, plane, values["stiffness"], values["flexion_ratio"])
        return Supposed(wrist, tendons, taut, places, rotors=rotors_of(self.settings), across=across)

    def _wrist(self, trial: MeasuredTrial, values: Mapping[str, float]) -> dict[str, float]:
        if self.places:
            springs = springs_of(values["stiffness"], values["oblique_cos"], values["oblique_sin"])
            return {**springs, "damping": values["damping"]}
        found = {name: values[name] for name in ("stiffness", "damping", "tendon_radius")}
        if trial.planes == ("flexion",):
            found["stiffness"] *= values["flexion_ratio"]
        return found

    def _places(self, trial: MeasuredTrial, values: Mapping[str, float]) -> Places | None:
        if not self.places:
            return None
        section = [
            place.radius / values[f"gain_{number}"] * np.array([math.cos(angle), math.sin(angle)])
            for number, place in self.places.items()
            for angle in [values[f"direction_{number}"]]
        ]
        believed = Places.of(TendonLayout(tuple(self.places.values())), trial.wrist.discs)
        return believed._replace(cross_section=np.array(section))

    def simulate(self, trial: MeasuredTrial, candidates: Sequence[Supposed], segments: int | None = None) -> Array:
        """Courses (count, T, P) of the candidates in a trial, of one with tensions (count, T, P + M).

        Of so many segments, or of as many as the settings say.
        """
        tensions = bool((trial.channel >= len(trial.planes)).any())
        return courses(candidates, trial.reeled, self.settings.step, segments or self.settings.segments, pulls=tensions)


# Largest of these errors [rad, m, s, 1], and least error of a clock that counts as known [s].
_WIDEST, _LEAST_CLOCK = {ZERO: 0.2, SPOOL: 2e-3, CLOCK: 1e-2, TURN: 0.1, GAIN: 0.1}, 1e-6


def spool_zero(trial: MeasuredTrial, tendon: int) -> Coordinate:
    """What a tendon's spool has reeled in unknown, in a trial's run."""
    return Coordinate(SPOOL, trial.run, tendon)


def bend_problem(
    trials: Sequence[MeasuredTrial], places: Mapping[int, TendonPlace], wrist: WristParameters, actuator: Actuator,
    settings: IdentifySettings,
) -> Problem:  # fmt: skip
    """The search over trials, begun at what is believed. Raises UserError for a held value that the model has not."""
    for name in settings.fixed:
        if name not in SHARED or name == "stiffness":
            fix = f"one of {', '.join(other for other in SHARED if other != 'stiffness')}"
            raise UserError(f"{name} of springs or tendons alike is no parameter here", f"identify.fix.{name}", fix)
    mean, p, q = oblique_of(wrist)
    believed = believed_of(wrist, actuator)
    start = {name: believed[name] for name in SHARED} | {"stiffness": mean, "oblique_cos": p, "oblique_sin": q}
    for number, place in places.items():
        start |= {f"direction_{number}": place.angle, f"gain_{number}": 1.0}
    return Problem(list(trials), start, settings, actuator, places)
