"""The kinds of references: the entries of `wristctl.config.choices.REFERENCES`."""

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.simulation.reference import ReferenceKind


def minimum_jerk(time: Array, duration: float) -> Array:
    """The minimum-jerk course from 0 to 1 and two derivatives, (3, T), by the time (T,) since it began, ascending.

    From Flash and Hogan, J. Neurosci. 5 (1985) 1688.
    """
    course = np.zeros((3, len(time)))
    first, last = np.searchsorted(time, 0.0, "right"), np.searchsorted(time, duration, "left")
    course[0, last:] = 1.0
    smooth_stroke(time[first:last] / duration, duration, course[:, first:last])
    return course


def smooth_stroke(s: Array, duration: float, out: Array) -> None:
    """Smooth stroke within the move, into `out` (3, T), by the share s (T,) of the duration that has passed."""
    square, remaining = s**2, 1.0 - s
    np.multiply(s**3, 10.0 - 15.0 * s + 6.0 * square, out=out[0])
    np.divide(30.0 * square * remaining**2, duration, out=out[1])
    np.divide(60.0 * s * remaining * (1.0 - 2.0 * s), duration**2, out=out[2])


def _step(reference: Reference, time: Array) -> Array:
    return np.stack([np.where(time > -1e-9, 1.0, 0.0), 0.0 * time, 0.0 * time])


def _sine(reference: Reference, time: Array) -> Array:
    w, course = 2.0 * np.pi * reference.frequency, np.empty((3, len(time)))
    phase = w * time
    np.cos(phase, out=course[0])
    np.sin(phase, out=course[1])
    np.multiply(course[0], 0.5 * w * w, out=course[2])
    course[1] *= 0.5 * w
    course[0] *= -0.5
    course[0] += 0.5
    return course


def _minimum_jerk(reference: Reference, time: Array) -> Array:
    return minimum_jerk(time, reference.duration)


def _millimetres(tip: tuple[float, float]) -> str:
    return f"{1e3 * tip[0]:.3g}, {1e3 * tip[1]:.3g}"


def target_words(reference: Reference) -> str:
    """The angle or the tip position at the end, in words."""
    return f"{reference.end_deg:g} deg" if reference.tip is None else f"tip {_millimetres(reference.tip)} mm"


def _tips(reference: Reference) -> str:
    if reference.tips is not None:
        return " ".join(map(_millimetres, reference.tips))
    return " ".join(f"{100.0 * x:.3g}, {100.0 * y:.3g}" for x, y in reference.end_ratios) + " % of the length"


STEP = ReferenceKind(
    "a jump to an angle or a tip position",
    course=_step,
    rest=lambda reference, begin, horizon: begin,
    described=lambda reference: f"step {target_words(reference)}",
    jumps=True,
)
MINIMUM_JERK = ReferenceKind(
    "a smooth move of `duration` to an angle or a tip position (Flash and Hogan 1985)",
    course=_minimum_jerk,
    rest=lambda reference, begin, horizon: begin + reference.duration,
    described=lambda reference: f"minimum jerk {reference.duration:g} s {target_words(reference)}",
)
SINE = ReferenceKind(
    "swinging between straight and the angle at `frequency`",
    course=_sine,
    described=lambda reference: f"sine {reference.frequency:g} Hz {target_words(reference)}",
)
MULTI_STEP = ReferenceKind(
    "jumps through `angles_deg`, one each `duration`",
    course=_step,
    rest=lambda reference, begin, horizon: begin,
    described=lambda reference: (
        f"steps {reference.duration:g} s {' '.join(f'{angle:g}' for angle in reference.angles_deg)} deg"
    ),
    targets="angles_deg",
    jumps=True,
)
TIP_PATH = ReferenceKind(
    "smooth moves of `duration` through tip positions",
    course=_minimum_jerk,
    rest=lambda reference, begin, horizon: begin + reference.duration,
    described=lambda reference: f"tip path {reference.duration:g} s {_tips(reference)}",
    targets="tips",
)
