"""Motions of daily living in one plane and in two, as curves between the ends that were measured of people.

Cited are the ends; the course between them is ours: smooth strokes (minimum jerk, Flash and Hogan 1985) of `duration`
from straight to one end, to the other and back to straight, over and over. Angles are anatomical, flexion + and
extension -, ulnar deviation + and radial deviation - (Wu et al., ISB, J. Biomech. 38 (2005) 981), whatever direction of
its plane is named. A motion in one plane is the component that this plane has; those in two take both ends at once.
"""

from collections.abc import Callable, Sequence
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.config.section import Parameter
from wristctl.simulation.reference import ReferenceKind
from wristctl.simulation.references import smooth_stroke

_RYU = "Ryu et al., J. Hand Surg. 16A (1991) 409"
_PALMER = "Palmer et al. 1985, as cited by Nelson et al. 1994"
_BRUMFIELD = "Brumfield and Champoux, Clin. Orthop. 187 (1984) 23"
_MODERN = "22 tasks of today, J. Hand Surg. 2022"


def _task(
    name: str, plane: Literal["ulnar", "flexion"], low_deg: float, high_deg: float, activity: str, source: str
) -> ReferenceKind:
    """A task that takes the wrist from `low_deg` to `high_deg` in a plane; an end at 0 is where it starts."""
    ends = [end for end in (high_deg, low_deg) if end != 0.0]
    signs = ("extension", "flexion") if plane == "flexion" else ("radial", "ulnar")
    stations = " to ".join(f"{abs(end):g} deg {signs[end > 0.0]}" for end in (low_deg, high_deg) if end != 0.0)
    told = f"{activity}: {stations} ({source})"
    return _repeated(name, told, lambda reference, time: _strokes(reference, time, ends), plane)


def _task_in_two_planes(
    name: str, low_deg: tuple[float, float], high_deg: tuple[float, float], activity: str, source: str
) -> ReferenceKind:
    """A task that takes the wrist from one end (ulnar, flexion) to the other, in both planes at once."""

    def course(reference: Reference, time: Array) -> Array:
        return np.stack([_strokes(reference, time, ends) for ends in zip(high_deg, low_deg, strict=True)])

    (radial, extension), (ulnar, flexion) = low_deg, high_deg
    stations = (
        f"{-extension:g} deg extension with {-radial:g} deg radial to {flexion:g} deg flexion with {ulnar:g} deg ulnar"
    )
    told = f"{activity}: {stations} ({source}; the dart-thrower's coupling of both planes is ours)"
    return _repeated(name, told, course, planes=2)


def _repeated(
    name: str,
    told: str,
    course: Callable[[Reference, Array], Array],
    plane: Literal["", "ulnar", "flexion"] = "",
    planes: Literal[1, 2] = 1,
) -> ReferenceKind:
    """A task that is done over and over."""
    return ReferenceKind(
        told,
        course=course,
        described=lambda reference: f"adl:{name} {reference.duration:g} s strokes" + _scaled(reference),
        targets="none",
        parameters={"scale": Parameter(1.0, "", "factor on the angles")},
        plane=plane,
        planes=planes,
    )


def _strokes(reference: Reference, time: Array, ends_deg: Sequence[float]) -> Array:
    """Smooth strokes from straight to each end in turn and back, over and over, (3, T)."""
    angles = np.deg2rad([0.0, *ends_deg, 0.0]) * reference.value("scale")
    strokes = time / reference.duration
    number = np.floor(strokes + 1e-12).astype(np.int64)
    before = np.resize(angles[:-1], number.max(initial=0) + 2)
    rows = np.empty((3, len(time)))
    smooth_stroke(np.maximum(strokes - number, 0.0), reference.duration, rows)
    rows *= np.diff(before)[number]
    rows[0] += before[number]
    return rows


def _scaled(reference: Reference) -> str:
    scale = reference.value("scale")
    return "" if scale == 1.0 else f" x{scale:g}"


PERSONAL_CARE = _task("personal-care", "flexion", -15.0, 10.0, "placing the hand on the body", _BRUMFIELD)
EATING = _task("eating", "flexion", -35.0, 5.0, "eating, drinking, telephoning, reading", _BRUMFIELD)
STIRRING = _task("stirring", "flexion", 0.0, 46.6, "stirring", _MODERN)
COMBING = _task("combing", "flexion", -63.8, 0.0, "combing one's hair", _MODERN)
JAR = _task("jar", "ulnar", -15.6, 0.0, "opening a jar", _MODERN)
PHONE = _task("phone", "ulnar", 0.0, 32.5, "telephoning", _MODERN)
MEAN_FLEXION = _task("mean-flexion", "flexion", -30.0, 5.0, "mean over tasks and people", _PALMER)
MEAN_DEVIATION = _task("mean-deviation", "ulnar", -10.0, 15.0, "mean over tasks and people", _PALMER)
MOST_FLEXION = _task("most-flexion", "flexion", -40.0, 40.0, "most placing and motion tasks", _RYU)
MEAN = _task_in_two_planes("mean", (-10.0, -30.0), (15.0, 5.0), "mean over tasks and people", _PALMER)
ALL = _task_in_two_planes("all", (-17.0, -60.0), (40.0, 54.0), "every task", _RYU)
ALL_FLEXION = _task("all-flexion", "flexion", -60.0, 54.0, "every task", _RYU)
ALL_DEVIATION = _task("all-deviation", "ulnar", -17.0, 40.0, "every task", _RYU)
