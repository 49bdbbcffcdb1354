"""References: wanted angles or tip positions, evaluated into theta_ref and its derivatives before the loop runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache, partial
from itertools import pairwise
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.config.choices import REFERENCES as _TABLE
from wristctl.config.choices import Choices
from wristctl.config.errors import UserError
from wristctl.config.foreign import raised_at
from wristctl.config.loop import DirectionName, Reference
from wristctl.config.section import Parameter
from wristctl.config.wrist import WristParameters
from wristctl.simulation.motion import Angles, Motion
from wristctl.wrist.directions import DIRECTIONS
from wristctl.wrist.kinematics import Inverse, arc_path, exact_arc, exact_inverse


def _never(reference: Reference, begin: float, horizon: float) -> float:
    return horizon


@dataclass(frozen=True)
class ReferenceKind:
    """A kind of reference: one or more moves, each from where the last one ended to its target."""

    meaning: str
    course: Callable[[Reference, Array], Array]
    """One move from 0 to 1 with two derivatives, (3, T), by the time (T,) since it began; 0 before.

    Without targets the angle itself [rad], or, as (2, 3, T), that and the length of the arc [m]."""
    described: Callable[[Reference], str]
    """A short name of the reference: kind, duration and target."""
    rest: Callable[[Reference, float, float], float] = _never
    """When the reference rests, by when its last move begins and the horizon (which means never) [s]."""
    targets: Literal["end", "angles_deg", "tips", "none"] = "end"
    """Where its targets stand: one angle or tip at the end, or the leaf with several, one every `duration`."""
    parameters: Mapping[str, Parameter] = field(default_factory=dict)
    """Leaves that it adds to a reference's section; `reference.value(name)` reads one."""
    plane: Literal["", "ulnar", "flexion"] = ""
    """Plane in which its angles are anatomical, whatever direction is named; empty: they count toward the direction."""


REFERENCES: Choices[ReferenceKind] = _TABLE


def reference_name(reference: Reference) -> str:
    """A short name: kind, duration and target."""
    return REFERENCES[reference.kind].described(reference)


def toward(reference: Reference, direction: DirectionName) -> Reference:
    """The reference whose angles count toward this direction. Raises UserError for a motion of the other plane."""
    if plane := REFERENCES[reference.kind].plane:
        if plane != DIRECTIONS[direction].plane:
            what = f"{reference.kind} is a motion of the {plane} plane, and {direction} is not in it"
            raise UserError(what, "direction", f"direction: {plane}")
        return reference
    return reference if DIRECTIONS[direction].sign > 0 else reference.mirrored()


def motion(
    reference: Reference, wrist: WristParameters, horizon: float, period: float, network: Inverse | None = None
) -> Motion:
    """Evaluate a reference on the grid of `period` [s] over the horizon [s].

    Tip targets, or angles with inverse `network` or `closed-form`, become a tip path (an arc whose angle and length
    move from rest) that the inverse turns into angles; errors against theta_desired then show the inverse's own error.
    What needs no network is worked out once, and angles of moves when they are asked for; the arrays are read-only.
    """
    if reference.inverse == "network" or reference.file:  # a file may be another by now
        return _evaluated(reference, wrist, horizon, period, network)
    return _known(reference, wrist.length, wrist.range_deg, horizon, period)


@lru_cache(maxsize=64)
def _known(reference: Reference, length: float, range_deg: float, horizon: float, period: float) -> Motion:
    if _bends_alone(reference):
        of_any = _bending(reference, range_deg, horizon, period)
        return replace(of_any, tips=lambda: _tips(of_any.angles, _unstretched(length, len(of_any.time))))
    wrist = WristParameters(length=length, range_deg=range_deg)  # all that it depends on
    return _evaluated(reference, wrist, horizon, period, None)


def _bends_alone(reference: Reference) -> bool:
    """Whether it asks for angles, and the length of the arc stays."""
    targets = REFERENCES[reference.kind].targets
    return reference.inverse == "none" and reference.tip is None and targets in ("end", "angles_deg")


@lru_cache(maxsize=64)
def _bending(reference: Reference, range_deg: float, horizon: float, period: float) -> Motion:
    """Such a motion, but for its tips: wrists of any length have the same angles, in the same arrays."""
    return _evaluated(reference, _ranging(range_deg), horizon, period, None)


@lru_cache(maxsize=64)
def _ranging(range_deg: float) -> WristParameters:
    return WristParameters(range_deg=range_deg)


def _evaluated(
    reference: Reference, wrist: WristParameters, horizon: float, period: float, network: Inverse | None
) -> Motion:
    kind = REFERENCES[reference.kind]
    time = _grid(horizon, period)
    angles, length, move, begin = (_whole if kind.targets == "none" else _moves)(reference, kind, wrist, time)
    rest, tips = kind.rest(reference, begin, horizon), partial(_tips, angles, length)
    if reference.inverse == "none":
        return Motion(time, angles, tips, move, begin, rest, horizon)
    found = _inverse(reference, network)(arc_path(angles.rows, length))
    outside, reached = float(np.mean(found.outside)), Angles.of(found.theta, found.rate, found.acceleration)
    return Motion(time, reached, tips, move, begin, rest, horizon, outside, angles)


@lru_cache(maxsize=64)
def _grid(horizon: float, period: float) -> Array:
    time: Array = np.arange(round(horizon / period), dtype=np.float64) * period
    time.setflags(write=False)
    return time


def _tips(angles: Angles, length: Array) -> Array:
    found = arc_path(angles.rows, length).position
    found.setflags(write=False)
    return found


@lru_cache(maxsize=64)
def _unstretched(length: float, samples: int) -> Array:
    return np.broadcast_to(np.array([[length], [0.0], [0.0]]), (3, samples))


def _course(reference: Reference, kind: ReferenceKind, time: Array) -> Array:
    """Its course; UserError for one from elsewhere that fails, or is no angle with two derivatives everywhere."""
    name, key = reference.kind, "reference.kind"
    if REFERENCES.belongs(name):
        return kind.course(reference, time)
    try:
        found = np.asarray(kind.course(reference, time), np.float64)
    except UserError:
        raise
    except Exception as error:
        what = f"the course failed at {raised_at(error, __file__, name)}: {type(error).__name__}: {error}"
        raise UserError(what, key, "mend it; --debug shows more") from error
    if found.shape[-2:] != (3, len(time)):
        what = f"the course of {name} is an array of {found.shape}, not of (3, {len(time)})"
        raise UserError(what, key, "give angle, rate and acceleration at every time")
    if not (sound := np.isfinite(found).all(axis=tuple(range(found.ndim - 1)))).all():
        what = f"the course of {name} is no number at {time[~sound][0]:.4g} s"
        raise UserError(what, key, "make it finite at every time, before its begin too")
    return found


def _moves(
    reference: Reference, kind: ReferenceKind, wrist: WristParameters, time: Array
) -> tuple[Angles, Array, float, float]:
    """The angles, the length of the arc with two derivatives (3, T), the last move [rad], and when it begins."""
    targets = [(0.0, wrist.length), *_targets(reference, kind, wrist)]
    turns, stretches = ([to[k] - before[k] for before, to in pairwise(targets)] for k in (0, 1))

    def course(number: int) -> Array:
        return _course(reference, kind, time - number * reference.duration if number else time)

    def bend(out: Array) -> None:
        np.multiply(turns[0], course(0), out=out)
        for number in range(1, len(turns)):
            out += turns[number] * course(number)
        out += 0.0  # no zero is negative

    length = _unstretched(wrist.length, len(time))
    for number, stretch in enumerate(stretches):
        if stretch:
            length = length + stretch * course(number)
    return Angles(len(time), bend), length, turns[-1], (len(turns) - 1) * reference.duration


def _whole(
    reference: Reference, kind: ReferenceKind, wrist: WristParameters, time: Array
) -> tuple[Angles, Array, float, float]:
    """The same of a course that has no targets: its last move is from straight to where it ends."""
    course = _course(reference, kind, time)
    bend, length = course if course.ndim == 3 else (course, _unstretched(wrist.length, len(time)))
    most = float(np.abs(bend[0]).max(initial=0.0))
    if most > np.deg2rad(wrist.range_deg) * (1.0 + 1e-12):
        at = time[int(np.argmax(np.abs(bend[0])))]
        raise UserError(
            f"{reference_name(reference)} bends by {np.rad2deg(most):.1f} deg at {at:.3g} s, "
            f"beyond the wrist's range of +-{wrist.range_deg:g} deg",
            where="reference",
            fix="make it smaller (scale, angle_deg, offset_deg), see to the unit in a header, or widen wrist.range_deg",
        )
    return Angles.of(*bend), length, float(bend[0, -1]), 0.0


def _targets(reference: Reference, kind: ReferenceKind, wrist: WristParameters) -> list[tuple[float, float]]:
    """Angle [rad] and arc length [m] of each target in turn."""
    if kind.targets == "tips":
        return [_tip_target(tip, "reference.tips", wrist) for tip in reference.tips]
    if kind.targets == "angles_deg":
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
    theta, arc = exact_arc(np.array(tip))
    angle, length = float(theta), float(arc)
    if abs(angle) > np.deg2rad(wrist.range_deg) or not 0.0 < length < np.inf:
        raise UserError(
            f"tip {tip} m asks for {np.rad2deg(angle):.1f} deg, beyond the range of +-{wrist.range_deg} deg",
            where=where,
            fix="choose a tip position within reach",
        )
    return angle, length


def _inverse(reference: Reference, network: Inverse | None) -> Inverse:
    if reference.inverse == "closed-form":
        return exact_inverse
    if network is None:
        raise UserError("the reference goes through a network, and none is given", "reference.inverse", "--network RUN")
    return network
