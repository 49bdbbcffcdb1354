"""References: wanted angles or tip positions, evaluated into theta_ref and its derivatives before the loop runs."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import REFERENCES as _TABLE
from wristctl.config.choices import Choices
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.section import Parameter
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.interrupt import from_outside
from wristctl.plugins.places import raised_at
from wristctl.simulation.motion import Angles, Motion
from wristctl.wrist.directions import DIRECTIONS
from wristctl.wrist.kinematics import AnglePath, Inverse, TipPath, arc_path, arc_tip, exact_arc

# Form of the targets in a study: one angle or tip at the end, or the leaf with several, one every `duration`.
Targets = Literal["end", "angles_deg", "tips", "none"]

# Permitted distance of a target from the tips that one arc of the wrist reaches, as a share of the wrist's length.
TIP_TOLERANCE = 0.01


def targets_of(reference: Reference, form: Targets, wrist: WristParameters) -> list[tuple[float, float]]:
    """Angle [rad] and arc length [m] of each target in turn; UserError for one out of reach."""
    if form == "tips":
        where = "reference.tip_ratios" if reference.tips is None else "reference.tips"
        return [_tip_target(tip, where, wrist) for tip in reference.in_metres(wrist.length).tips or ()]
    if form == "angles_deg":
        return [_angle_target(angle, "reference.angles_deg", wrist) for angle in reference.angles_deg]
    if reference.tip is not None:
        return [_tip_target(reference.tip, "reference.tip", wrist)]
    return [_angle_target(reference.end_deg, "reference.angle_deg", wrist)]


def _angle_target(degrees: float, where: str, wrist: WristParameters) -> tuple[float, float]:
    if abs(degrees) > wrist.range_deg:
        raise UserError(
            f"reference of {degrees} deg is beyond the wrist's range of +-{wrist.range_deg} deg",
            where=where,
            fix="ask for less, or widen wrist.range_deg",
        )
    return float(np.deg2rad(degrees)), wrist.length


def _tip_target(tip: tuple[float, float], where: str, wrist: WristParameters) -> tuple[float, float]:
    if (missed := beyond_reach(tip, wrist)) is not None:
        why, nearest = missed
        fix = f"the nearest tip within reach, [{nearest[0]:.5f}, {nearest[1]:.5f}] m"
        if where != "reference.tip":
            fix += "; tip_ratios are multiples of the wrist's length"
        raise UserError(f"tip {tip} m {why}", where, fix)
    return _arc_to(tip)


def beyond_reach(tip: tuple[float, float], wrist: WristParameters) -> tuple[str, tuple[float, float]] | None:
    """Why no arc of the wrist ends at a tip, and the nearest tip where one does; None where one ends there.

    Tips are (along the base's tangent, across it) [m], in the plane of the bend.
    """
    angle, _ = _arc_to(tip)
    nearest = _nearest(tip, wrist.length, wrist.range_deg)
    off = math.dist(tip, nearest)
    if abs(angle) > np.deg2rad(wrist.range_deg):
        return f"asks for {np.rad2deg(angle):.1f} deg, beyond the range of +-{wrist.range_deg} deg", nearest
    if off > TIP_TOLERANCE * wrist.length:
        return f"is {1e3 * off:.3g} mm from where an arc of {1e3 * wrist.length:g} mm can end", nearest
    return None


@lru_cache(maxsize=64)
def _nearest(tip: tuple[float, float], length: float, range_deg: float) -> tuple[float, float]:
    """The nearest tip [m] that an arc of this length [m] reaches within its range, to a hundredth of a degree."""
    limit = np.deg2rad(range_deg)
    tips = arc_tip(np.linspace(-limit, limit, 2 * math.ceil(100.0 * range_deg) + 1), length)
    x, y = tips[np.argmin(np.hypot(*(tips - tip).T))].tolist()
    return x, y


@lru_cache(maxsize=64)
def _arc_to(tip: tuple[float, float]) -> tuple[float, float]:
    theta, length = exact_arc(np.array(tip))
    return float(theta), float(length)


# Time before a move begins [s]: there is nothing of it by then.
_EARLY = 1e-6


def _never(reference: Reference, begin: float, horizon: float) -> float:
    return horizon


@dataclass(frozen=True)
class ReferenceKind:
    """A kind of reference: one or more moves, each from where the last one ended to its target."""

    meaning: str
    course: Callable[[Reference, Array], Array]
    """One move from 0 to 1 with two derivatives, (3, T), by the time (T,), ascending, since it began; 0 before.

    Without targets the angle itself [rad], or, as (2, 3, T), that and the length of the arc [m]."""
    described: Callable[[Reference], str]
    """A short name of the reference: kind, duration and target."""
    rest: Callable[[Reference, float, float], float] = _never
    """When the reference rests, by when its last move begins and the horizon (which means never) [s]."""
    targets: Targets = "end"
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    """Leaves that it adds to a reference's section; `reference.value(name)` reads one."""
    plane: Literal["", "ulnar", "flexion"] = ""
    """Plane in which its angles are anatomical, whatever direction is named; empty: they count toward the direction."""
    planes: Literal[1, 2] = 1
    """Planes that it bends in. Of two the course is the bend toward ulnar and toward flexion, (2, 3, T)."""
    jumps: bool = False
    """Whether it asks for steps, which no wrist can follow: their errors are compared with each other alone."""


REFERENCES: Choices[ReferenceKind] = _TABLE


def reference_name(reference: Reference) -> str:
    """A short name: kind, duration and target."""
    return REFERENCES[reference.kind].described(reference)


def jumps(reference: Reference) -> bool:
    """Whether it is made of steps."""
    return bool(REFERENCES[reference.kind].jumps)


def toward(reference: Reference, direction: DirectionName) -> Reference:
    """The reference whose angles count toward this direction. Raises UserError for a motion of the other plane."""
    if REFERENCES[reference.kind].planes == 2:
        return reference
    if plane := REFERENCES[reference.kind].plane:
        if plane != DIRECTIONS[direction].plane:
            problem = f"{reference.kind} is a motion of the {plane} plane, and {direction} is not in it"
            raise UserError(problem, "direction", f"direction: {plane}")
        return reference
    return reference if DIRECTIONS[direction].sign > 0 else reference.mirrored()


def motion(
    reference: Reference,
    wrist: WristParameters,
    horizon: float,
    period: float,
    network: Inverse | None = None,
    later: bool = False,
) -> Motion:
    """Evaluate a reference on the grid of `period` [s] over the horizon [s].

    What is wanted is one arc whose angle and length move from rest, towards angles or tips. Its closed-form inverse
    gives that very angle back, whatever its length; a network makes its own angles of the path that its tip takes, and
    errors against theta_desired then show the network's own. What needs no network is worked out once, and angles of
    moves when they are asked for; with `later` also of courses without targets, which then may fail or bend too far
    only there. The arrays are read-only.
    """
    if REFERENCES[reference.kind].planes == 2:
        problem = f"{reference.kind} bends in two planes, and this loop in one"
        fix = "`wristctl simulate` runs it in two, with loop.planes: null; --sweep controller=ct-dob,pid-ff compares"
        raise UserError(problem, "reference.kind", fix)
    if reference.inverse == "network" or reference.file:  # a file may be another by now
        result = _evaluated(reference, wrist, horizon, period, network)
    else:
        result = _known(reference, wrist.length, wrist.range_deg, horizon, period)
    if not later and REFERENCES[reference.kind].targets == "none":
        _ = result.theta_desired
    return result


@lru_cache(maxsize=64)
def _known(reference: Reference, length: float, range_deg: float, horizon: float, period: float) -> Motion:
    if _bends_alone(reference):
        targets_of(reference, REFERENCES[reference.kind].targets, _ranging(range_deg))  # within its reach
        of_any = _bending(reference, horizon, period)
        return replace(of_any, tips=partial(_tips, of_any.angles, partial(_unstretched, length, len(of_any.time))))
    wrist = WristParameters(length=length, range_deg=range_deg)  # all that it depends on
    return _evaluated(reference, wrist, horizon, period, None)


def _bends_alone(reference: Reference) -> bool:
    """Whether it asks for angles, and the length of the arc stays."""
    return reference.tip is None and REFERENCES[reference.kind].targets in ("end", "angles_deg")


@lru_cache(maxsize=64)
def _bending(reference: Reference, horizon: float, period: float) -> Motion:
    """Such a motion, but for its tips: wrists of any length and range have the same angles, in the same arrays."""
    return _evaluated(reference, _ranging(180.0), horizon, period, None)


@lru_cache(maxsize=64)
def _ranging(range_deg: float) -> WristParameters:
    return WristParameters(range_deg=range_deg)


def _evaluated(
    reference: Reference, wrist: WristParameters, horizon: float, period: float, network: Inverse | None
) -> Motion:
    kind = REFERENCES[reference.kind]
    time = grid_of(horizon, period)
    angles, length, move, begin = (_whole if kind.targets == "none" else _moves)(reference, kind, wrist, time)
    rest_time, tips = kind.rest(reference, begin, horizon), partial(_tips, angles, length)
    if reference.inverse != "network":
        return Motion(time, angles, tips, move, begin, rest_time, horizon)
    estimate = estimated(network, arc_path(angles.rows, length()))
    reached = Angles.of(np.array([estimate.theta, estimate.rate, estimate.acceleration]))
    return Motion(time, reached, tips, move, begin, rest_time, horizon, float(np.mean(estimate.outside)), angles)


def estimated(network: Inverse | None, path: TipPath) -> AnglePath:
    """The network's bends of a path of the tip. Raises UserError without a network."""
    if network is None:
        raise UserError("the reference goes through a network, and none is given", "reference.inverse", "--network RUN")
    return network(path)


def by_angles(reference: Reference) -> Reference:
    """The reference without a network: the bends that one arc has."""
    tips = reference.tip is not None or reference.kind == "tip-path"
    return reference.model_copy(update={"inverse": "closed-form" if tips else "none"})


@lru_cache(maxsize=64)
def grid_of(horizon: float, period: float) -> Array:
    """Times [s] of the samples of a motion, read-only."""
    time: Array = np.arange(round(horizon / period), dtype=np.float64) * period
    time.setflags(write=False)
    return time


def _tips(angles: Angles, length: Callable[[], Array]) -> Array:
    position = arc_path(angles.rows, length()).position
    position.setflags(write=False)
    return position


@lru_cache(maxsize=64)
def _unstretched(length: float, samples: int) -> Array:
    return np.broadcast_to(np.array([[length], [0.0], [0.0]]), (3, samples))


def course_of(reference: Reference, kind: ReferenceKind, time: Array) -> Array:
    """Course of a reference; UserError where a plugin fails, or is no angle with two derivatives everywhere."""
    name, key = reference.kind, "reference.kind"
    if REFERENCES.belongs(name):
        return kind.course(reference, time)
    try:
        course = np.array(kind.course(reference, time), np.float64)  # theirs may be used again
    except BaseException as error:
        if isinstance(error, UserError) or from_outside(error):
            raise
        problem = f"the course failed at {raised_at(error) or name}: {type(error).__name__}: {error}"
        raise UserError(problem, key, "mend it; --debug shows more") from error
    if course.shape[-2:] != (3, len(time)):
        problem = f"the course of {name} is an array of {course.shape}, not of (3, {len(time)})"
        raise UserError(problem, key, "give angle, rate and acceleration at every time")
    if not (sound := np.isfinite(course).all(axis=tuple(range(course.ndim - 1)))).all():
        problem = f"the course of {name} is no number at {time[~sound][0]:.4g} s"
        raise UserError(problem, key, "make it finite at every time, before its begin too")
    return course


def _moves(
    reference: Reference, kind: ReferenceKind, wrist: WristParameters, time: Array
) -> tuple[Angles, Callable[[], Array], float | None, float]:
    """The angles, what gives the arc's length with two derivatives (3, T), the last move [rad], and when it begins."""
    targets = [(0.0, wrist.length), *targets_of(reference, kind.targets, wrist)]
    turns, stretches = ([to[k] - before[k] for before, to in pairwise(targets)] for k in (0, 1))

    def moved(by: Sequence[float], out: Array) -> None:
        for number, change in enumerate(by):
            begin = number * reference.duration
            first = np.searchsorted(time, begin - _EARLY) if number else 0
            if change and first < len(time):
                course = course_of(reference, kind, time[first:] - begin if number else time)
                course *= change
                out[:, first:] += course

    def bend(out: Array) -> None:
        out[:] = 0.0
        moved(turns, out)

    def length() -> Array:
        lengths = _unstretched(wrist.length, len(time)).copy()
        moved(stretches, lengths)
        return lengths

    return Angles(len(time), bend), length, turns[-1], (len(turns) - 1) * reference.duration


def _whole(
    reference: Reference, kind: ReferenceKind, wrist: WristParameters, time: Array
) -> tuple[Angles, Callable[[], Array], float | None, float]:
    """Angles and arc length of a course without targets: its last move is from straight to where it ends."""

    def bend(out: Array) -> None:
        course = course_of(reference, kind, time)
        out[:] = course if course.ndim == 2 else course[0]
        if max(out[0].max(initial=0.0), -out[0].min(initial=0.0)) > np.deg2rad(wrist.range_deg) * (1.0 + 1e-12):
            raise _beyond(reference, wrist, time, out[0])

    def length() -> Array:
        course = course_of(reference, kind, time)
        return course[1] if course.ndim == 3 else _unstretched(wrist.length, len(time))

    return Angles(len(time), bend), length, None, 0.0


def _beyond(reference: Reference, wrist: WristParameters, time: Array, angle: Array) -> UserError:
    largest = int(np.argmax(np.abs(angle)))
    return UserError(
        f"{reference_name(reference)} bends by {np.rad2deg(abs(angle[largest])):.1f} deg at {time[largest]:.3g} s, "
        f"beyond the wrist's range of +-{wrist.range_deg:g} deg",
        where="reference",
        fix="make it smaller (scale, angle_deg, offset_deg), see to the unit in a header, or widen wrist.range_deg",
    )
