"""Nonlinear least squares of the forward model's angle against the marker's, at the times of the frames."""

from collections.abc import Collection, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.optimize import least_squares
from threadpoolctl import threadpool_limits

from wristctl.arrays import Array
from wristctl.config.identify import IdentifySettings
from wristctl.config.plant import Actuator
from wristctl.identification.forward import Supposed, across_plane, courses
from wristctl.identification.measured_trials import MeasuredTrial, frame_noise
from wristctl.identification.rotor_field import rotors_of
from wristctl.identification.unknowns import NOT_NEGATIVE, SIMULATED, UNKNOWNS, Unknown, tendons_of_values
from wristctl.processes import cores

# Steps of the finite differences, in parameters and in spools [m]. Where a tendon becomes taut one integration step
# earlier, the bend jumps by some 1e-6 rad: few steps this small meet such a jump, and hardly one on both sides.
_NUDGE, _NUDGE_M = 1e-6, 1e-8
# Friction with which a search begins that believes in none.
_OFF_THE_EDGE = 0.02
# Evaluations of one search; 10 to 20 are usual.
_MOST = 200
# Evaluations after which several beginnings are compared, and part of the best's chi-square by which others that go on
# may have more.
_FEW, _CLOSE = 12, 0.05
# Chi-square by the parabola through a minimum below which another end is the same minimum.
_APART = 4.0
# Linearisations of so many last points are kept.
_KEPT = 4


# Least noise of a marker's angle [rad].
_LEAST_NOISE = 1e-6


class Coordinate(NamedTuple):
    """Coordinate of a search: a parameter by name, or a small error of one place in one run.

    That is the camera's zero in a bending plane (ZERO), what a tendon's spool has reeled in unknown (SPOOL), or by how
    much one trial's clocks are further apart (CLOCK).
    """

    kind: str
    run: str = ""
    place: str | int = ""


ZERO, SPOOL, CLOCK = "camera's zero", "spool's zero", "trial's clock"


@dataclass(frozen=True)
class Problem:
    """Trials, the parameters to find and those that are held, each with the value at which it starts.

    Beside the parameters small errors are found, of which the size is known beforehand: the camera's zero angle of each
    run and plane, the zero of each spool of each run, and in two planes the clocks of each trial.
    """

    trials: Sequence[MeasuredTrial]
    start: Mapping[str, float]
    settings: IdentifySettings
    actuator: Actuator
    """As believed: what of the tendons is not found."""

    @property
    def unknowns(self) -> Mapping[str, Unknown]:
        """Parameters of the model, found or held, by name."""
        return UNKNOWNS

    @property
    def simulated(self) -> Collection[str]:
        """Parameters on which a simulated course depends."""
        return SIMULATED

    @cached_property
    def free(self) -> tuple[str, ...]:
        """The parameters to find; how the planes differ only where there are trials of both."""
        one_plane = len({plane for trial in self.trials for plane in trial.planes}) == 1
        held = {*self.settings.fixed, *(["flexion_ratio"] if one_plane else [])}
        return tuple(name for name in UNKNOWNS if name not in held)

    @cached_property
    def coordinates(self) -> dict[Coordinate, int]:
        """Index of every coordinate of the search: free parameters, zeros, spools."""
        free = [Coordinate(name) for name in self.free]
        zeros = [zero for trial in self.trials for zero in self.zeros(trial)]
        spools = [spool_zero(trial, tendon) for trial in self.trials for tendon in trial.tendons]
        clocks = [clock for trial in self.trials for clock in self.clocks(trial)]
        return {coordinate: index for index, coordinate in enumerate(dict.fromkeys([*free, *zeros, *spools, *clocks]))}

    def begin(self) -> Array:
        """The coordinates at the start; at an edge the search would stay there."""
        x = np.zeros(len(self.coordinates))
        for index, name in enumerate(self.free):
            x[index] = self.unknowns[name].coordinate(self.start[name], self.start[name])
            if name in NOT_NEGATIVE:
                x[index] = max(x[index], _OFF_THE_EDGE)
        return x

    def begins(self) -> list[Array]:
        """Coordinates at which searches begin, of which the best is taken."""
        return [self.begin()]

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
        }
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

    def clocks(self, trial: MeasuredTrial) -> tuple[Coordinate, ...]:
        """Coordinates by which a trial's frames are later than by the delay [s]; none where a board dates counts."""
        return ()

    def delay(self, trial: MeasuredTrial, x: Array) -> float:
        """How much older a trial's frames are than their time stamps [s] at coordinates x."""
        return float(self.values(x)["delay"] + sum(x[self.coordinates[clock]] for clock in self.clocks(trial)))

    def courses(self, trial: MeasuredTrial, points: Sequence[Array]) -> Array:
        """What a trial's wrist does at each of some coordinates: (count, T, P + M), as `trial.shown` takes it."""
        return self.simulate(trial, [self.candidate(trial, x) for x in points])

    def candidate(self, trial: MeasuredTrial, x: Array) -> Supposed:
        """The trial's wrist and tendons at coordinates x."""
        values = self.values(x)
        wrist_values = {name: values[name] for name in ("stiffness", "damping", "tendon_radius")}
        (plane,) = trial.planes
        if plane == "flexion":
            wrist_values["stiffness"] *= values["flexion_ratio"]
        one, two, three, four = (float(x[self.coordinates[spool_zero(trial, tendon)]]) for tendon in trial.tendons)
        tendons = self.actuator.model_copy(update=tendons_of_values(values))
        wrist = trial.wrist.model_copy(update=wrist_values)
        across = across_plane(wrist, plane, values["stiffness"], values["flexion_ratio"])
        rotors = rotors_of(self.settings)
        return Supposed(wrist, tendons, (one, two, three, four), rotors=rotors, across=across)

    def simulate(self, trial: MeasuredTrial, candidates: Sequence[Supposed], segments: int | None = None) -> Array:
        """Bends (count, T, 1) of the candidates in a trial; so many segments, or as many as the settings say."""
        return courses(candidates, trial.reeled, self.settings.step, segments or self.settings.segments)


# Largest of these errors [rad, m, s], and least error of a clock that counts as known [s].
_WIDEST, _LEAST_CLOCK = {ZERO: 0.2, SPOOL: 2e-3, CLOCK: 1e-2}, 1e-6


def spool_zero(trial: MeasuredTrial, tendon: int) -> Coordinate:
    """What a tendon's spool has reeled in unknown, in a trial's run."""
    return Coordinate(SPOOL, trial.run, tendon)


@dataclass(frozen=True)
class Linearisation:
    """The angles that the model expects in the frames, and their derivatives by the coordinates."""

    expected: list[Array]
    """Expected angles of every trial (F,) [rad], the camera's zero included."""
    slopes: list[Array]
    """Derivatives of every trial's angles (F, coordinates)."""


def linearise(problem: Problem, x: Array) -> Linearisation:
    """Expected angles and their derivatives at coordinates x; the finite differences are lanes beside the angles.

    Of the differences to either side the smaller one counts: a bend that jumps makes a difference too large. Stiffness,
    damping and tendons that grow together hardly change a bend that spools prescribe, so that a jump in one of their
    columns would look like knowledge of all three.
    """
    coordinates = problem.coordinates
    low, _ = problem.bounds()

    def one(trial: MeasuredTrial) -> tuple[Array, Array]:
        moved = [Coordinate(name) for name in problem.free if name in problem.simulated]
        moved += [spool_zero(trial, tendon) for tendon in trial.tendons]
        columns = np.array([coordinates[coordinate] for coordinate in moved])
        nudges = np.array([_NUDGE_M if coordinate.kind == SPOOL else _NUDGE for coordinate in moved])
        # of a parameter at its lower end there is one side alone
        backward = np.where(x[columns] - nudges < low[columns], nudges, -nudges)
        nudged = np.tile(x, (2 * len(moved), 1))
        nudged[np.arange(len(nudged)), np.tile(columns, 2)] += np.concatenate([nudges, backward])
        course, delay = problem.courses(trial, (x, *nudged)), problem.delay(trial, x)
        expected, *near = (trial.shown(angle, delay) for angle in course)
        slopes = np.zeros((len(expected), len(x)))
        sides = (np.array(near) - expected) / np.concatenate([nudges, backward])[:, None]
        forth, back = sides[: len(moved)], sides[len(moved) :]
        slopes[:, columns] = np.where(abs(forth) < abs(back), forth, back).T
        delays = [*[Coordinate("delay")] * ("delay" in problem.free), *problem.clocks(trial)]
        if delays:
            h = problem.settings.step
            early, late = (trial.shown(course[0], delay - shift) for shift in (-h, h))
            slopes[:, [coordinates[each] for each in delays]] = ((early - late) / (2.0 * h))[:, None]
        for zero, share in problem.zeros(trial).items():
            slopes[:, coordinates[zero]] = share
            expected = expected + share * x[coordinates[zero]]
        return expected, slopes

    with ThreadPoolExecutor(cores()) as pool:
        columns = list(pool.map(one, problem.trials))
    return Linearisation([each for each, _ in columns], [each for _, each in columns])


class Rival(NamedTuple):
    """Coordinates where another search ended, and by how much more chi-square [1] than the best one."""

    x: Array
    excess: float


@dataclass(frozen=True)
class Fit:
    """Result of a search over a wrist's parameters."""

    problem: Problem
    x: Array
    noise: float
    """Standard deviation of the residuals [rad]."""
    residuals: list[Array]
    """Marker's less expected angle, of each trial (F,) [rad]."""
    slopes: list[Array]
    evaluations: int
    rivals: tuple[Rival, ...] = ()
    """Other minima, where searches ended that began elsewhere."""

    @property
    def values(self) -> dict[str, float]:
        """Every parameter, found or fixed."""
        return self.problem.values(self.x)


def fit(problem: Problem) -> Fit:
    """The coordinates of least squares, with what is known beforehand counting by its own standard deviation.

    Where the residuals are not of the size that they were weighed with, the search goes on from there with their own.
    Of several beginnings the best after a few evaluations goes on, and those that are nearly as good.
    BLAS has one thread: on matrices this small its others only wait for each other, on cores that simulate.
    """
    search = _Search(problem)
    noise = max(frame_noise([trial.angle for trial in problem.trials]), _LEAST_NOISE)
    begins = [np.clip(x, *problem.bounds()) for x in problem.begins()]
    with threadpool_limits(limits=1, user_api="blas"):
        if len(begins) > 1:
            begins = sorted((search.descend(x, noise, _FEW) for x in begins), key=lambda x: search.cost(x, noise))
        first, *others = begins
        minima = [search.settle(first, noise)]
        (x, noise), *_ = minima
        for rival in search.rivals(others, x, noise):
            if rival.excess < _CLOSE * search.cost(x, noise):
                minima.append(search.settle(rival.x, noise))
        x, noise = min(minima, key=lambda minimum: search.cost(minimum[0], noise))
        rivals = search.rivals([end for end, _ in minima], x, noise)
        return Fit(problem, x, noise, search.residuals(x), search.at(x).slopes, search.evaluations, tuple(rivals))


class _Search:
    """Least squares of a problem, its linearisations counted and kept while a search stays where it was."""

    def __init__(self, problem: Problem) -> None:
        self.problem, self.weights, self.evaluations = problem, problem.prior(), 0
        self._kept: dict[bytes, Linearisation] = {}

    def at(self, x: Array) -> Linearisation:
        """Linearisation at coordinates x."""
        if (key := x.tobytes()) not in self._kept:
            if len(self._kept) >= _KEPT:
                del self._kept[next(iter(self._kept))]
            self._kept[key] = linearise(self.problem, x)
            self.evaluations += 1
        return self._kept[key]

    def residuals(self, x: Array) -> list[Array]:
        """Measured less expected readings of each trial."""
        return [t.angle - e for e, t in zip(self.at(x).expected, self.problem.trials, strict=True)]

    def cost(self, x: Array, noise: float) -> float:
        """Chi-square of readings with this noise, and of what is known beforehand."""
        squares = sum(float(residual @ residual) for residual in self.residuals(x))
        return squares / noise**2 + float(np.sum((self.weights * x) ** 2))

    def rivals(self, ends: Sequence[Array], x: Array, noise: float) -> list[Rival]:
        """Those ends that are not on the slopes of the minimum x: a parabola through it would have them much higher."""
        squares, rivals = self.weights**2, list[Rival]()
        for end in ends:
            away, excess = end - x, self.cost(end, noise) - self.cost(x, noise)
            parabola = sum(float(np.sum((slope @ away) ** 2)) for slope in self.at(x).slopes) / noise**2
            if parabola + float(squares @ away**2) > max(_APART, 2.0 * excess):
                rivals.append(Rival(end, excess))
        return rivals

    def descend(self, x: Array, noise: float, most: int) -> Array:
        """Coordinates after at most so many evaluations from x."""
        weighted = self.weights > 0.0

        def rows(x: Array) -> Array:
            parts = [-residual / noise for residual in self.residuals(x)]
            return np.concatenate([*parts, (self.weights * x)[weighted]])

        def slopes(x: Array) -> Array:
            return np.concatenate([*(slope / noise for slope in self.at(x).slopes), np.diag(self.weights)[weighted]])

        bounds = self.problem.bounds()
        solution = least_squares(rows, x, slopes, bounds=bounds, x_scale="jac", xtol=1e-5, ftol=1e-8, max_nfev=most)
        end: Array = solution.x
        return end

    def settle(self, x: Array, noise: float) -> tuple[Array, float]:
        """The minimum from x, and the standard deviation of its residuals, with which they are weighed there."""
        weighed, last = np.inf, self.evaluations + _MOST
        while abs(np.log(weighed / noise)) > 0.05 and self.evaluations < last:
            weighed = noise
            x = self.descend(x, weighed, _MOST)
            residuals = self.residuals(x)
            squares, count = sum(float(residual @ residual) for residual in residuals), sum(map(len, residuals))
            noise = float(np.sqrt(squares / max(1, count - len(self.problem.free))))
        return x, noise
