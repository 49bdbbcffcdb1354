"""Paths of a wrist that bends in two planes: its bend toward ulnar and toward flexion, each with two derivatives.

All begin at rest and straight, and get up to speed within a quarter of a turn.
"""

from collections.abc import Callable
from functools import partial

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.config.section import Parameter
from wristctl.errors import UserError
from wristctl.simulation.excitations import SPEED, limited_square, ramp
from wristctl.simulation.reference import ReferenceKind
from wristctl.simulation.references import minimum_jerk

# Share of a turn in which a motion gets up to its speed.
_SPEEDING = 0.25
# Time between samples of `bend_path` [s].
SAMPLE = 1e-3
# Direction of the dart-thrower's line, from ulnar toward flexion [deg].
_DIAGONAL_DEG = 40.0


def _phase(time: Array, turn: float) -> tuple[Array, Array, Array]:
    """Phase [rad] of a motion that comes to one turn in `turn` [s] from rest, with two derivatives.

    Its speed rises as a minimum jerk does.
    """
    rate, ramp = 2.0 * np.pi / turn, _SPEEDING * turn
    x = np.clip(time / ramp, 0.0, 1.0)
    phase = rate * ramp * x**4 * (2.5 - 3.0 * x + x * x) + rate * np.maximum(time - ramp, 0.0)
    return phase, rate * x**3 * (10.0 - 15.0 * x + 6.0 * x * x), rate / ramp * 30.0 * (x * (1.0 - x)) ** 2


def _of_phase(value: Array, slope: Array, curve: Array, phase: tuple[Array, Array, Array]) -> Array:
    """A function of the phase with two derivatives by time, (3, T), from its derivatives by the phase."""
    _, rate, acceleration = phase
    return np.stack([value, slope * rate, curve * rate**2 + slope * acceleration])


def circumduction(time: Array, size: float, turn: float) -> Array:
    """The hand circles about the straight wrist; the bend's size rises within half a turn, while it is turned already.

    Parameters
    ----------
    time
        Samples (T,) [s].
    size
        Largest bend [rad].
    turn
        Time of a turn [s].

    Returns the bend, its rate and its acceleration in both planes, (2, 3, T); so do the other paths.
    """
    phase = _phase(time, turn)
    cosine, sine = np.cos(phase[0]), np.sin(phase[0])
    around = np.stack([_of_phase(cosine, -sine, -cosine, phase), _of_phase(sine, cosine, -sine, phase)])
    r = size * minimum_jerk(time, 0.5 * turn)
    f, df, ddf = around[:, 0], around[:, 1], around[:, 2]
    return np.stack([r[0] * f, r[1] * f + r[0] * df, r[2] * f + 2.0 * r[1] * df + r[0] * ddf], axis=1)


def circle(time: Array, size: float, turn: float) -> Array:
    """A circle of bends through straight and `size` toward ulnar; parameters as `circumduction`."""
    phase = _phase(time, turn)
    cosine, sine = np.cos(phase[0]), np.sin(phase[0])
    forth, aside = _of_phase(1.0 - cosine, sine, cosine, phase), _of_phase(sine, cosine, -sine, phase)
    return 0.5 * size * np.stack([forth, aside])


def figure_of_8(time: Array, size: float, turn: float) -> Array:
    """A figure of 8 through straight, by `size` toward ulnar and radial; parameters as `circumduction`."""
    phase = _phase(time, turn)
    sine, cosine = np.sin(phase[0]), np.cos(phase[0])
    double, other = np.sin(2.0 * phase[0]), np.cos(2.0 * phase[0])
    long = _of_phase(sine, cosine, -sine, phase)
    return size * np.stack([long, 0.5 * _of_phase(double, 2.0 * other, -4.0 * double, phase)])


def dart_thrower(time: Array, size: float, turn: float) -> Array:
    """There and back on the line from radial extension to ulnar flexion; parameters as `circumduction`."""
    phase = _phase(time, turn)
    swing = _of_phase(np.sin(phase[0]), np.cos(phase[0]), -np.sin(phase[0]), phase)
    diagonal = np.deg2rad(_DIAGONAL_DEG)
    return size * np.stack([np.cos(diagonal) * swing, np.sin(diagonal) * swing])


# Bend paths by name: of the times, the largest bend and the time of a turn.
BEND_PATHS: dict[str, Callable[[Array, float, float], Array]] = {
    "circle": circle,
    "figure-of-8": figure_of_8,
    "circumduction": circumduction,
    "dart-thrower": dart_thrower,
}


def turned(path: Array, toward_deg: float) -> Array:
    """A path (2, 3, T) turned by an angle from ulnar toward flexion [deg]."""
    c, s = np.cos(np.deg2rad(toward_deg)), np.sin(np.deg2rad(toward_deg))
    result: Array = np.einsum("ij,jkt->ikt", np.array([[c, -s], [s, c]]), path)
    return result


def bend_path(name: str, size_deg: float, turn: float, horizon: float, toward_deg: float = 0.0) -> Array:
    """Bends of a named path with two derivatives, (2, 3, T), sampled every millisecond.

    Parameters
    ----------
    name
        One of BEND_PATHS.
    size_deg
        Largest bend [deg].
    turn
        Time of a turn [s].
    horizon
        Time of the last sample [s].
    toward_deg
        Angle by which the path is turned, from ulnar toward flexion [deg].

    Raises UserError for another name, or times that are not positive.
    """
    if name not in BEND_PATHS:
        raise UserError(f"no bend path '{name}'", "reference", f"one of {', '.join(BEND_PATHS)}")
    if not (turn > 0.0 and horizon >= SAMPLE):
        raise UserError(f"a turn of {turn:g} s over {horizon:g} s is no motion", "horizon", "positive times")
    time: Array = SAMPLE * np.arange(round(horizon / SAMPLE) + 1.0)
    return turned(BEND_PATHS[name](time, np.deg2rad(size_deg), turn), toward_deg)


_TOWARD = "angle by which the path is turned, from ulnar toward flexion"


def _turning(name: str, meaning: str, turn: float) -> ReferenceKind:
    """A bend path of so many seconds a turn as a reference: `angle_deg` is its largest bend."""

    def course(reference: Reference, time: Array) -> Array:
        size = np.deg2rad(reference.end_deg)
        path = BEND_PATHS[name](np.maximum(time, 0.0), size, reference.value("turn"))
        return turned(path, reference.value("toward_deg"))

    parameters = {"turn": Parameter(turn, "s", "time of a turn"), "toward_deg": Parameter(0.0, "deg", _TOWARD)}
    return ReferenceKind(
        meaning, course=course, described=partial(_described, name), targets="none", parameters=parameters, planes=2
    )


def _described(name: str, reference: Reference) -> str:
    toward = reference.value("toward_deg")
    aside = f", turned by {toward:g} deg" if toward else ""
    return f"{name} of {reference.end_deg:g} deg in {reference.value('turn'):g} s{aside}"


CIRCLE = _turning("circle", "bends on a circle through straight and `angle_deg` toward ulnar", 4.0)
FIGURE_OF_8 = _turning("figure-of-8", "a figure of 8 by `angle_deg` toward ulnar and radial", 4.0)
CIRCUMDUCTION = _turning("circumduction", "the hand circles about the straight wrist, bent by `angle_deg`", 4.0)
DART_THROWER = _turning("dart-thrower", "from radial extension to ulnar flexion and back, by `angle_deg` each", 1.5)


def _ellipse(reference: Reference, time: Array) -> Array:
    size, ratio = np.deg2rad(reference.end_deg), reference.value("ratio")
    path = circumduction(np.maximum(time, 0.0), size, reference.value("turn"))
    path[1] *= ratio
    return turned(path, reference.value("toward_deg"))


def _along(move: Array, reference: Reference) -> Array:
    """A move (3, T) on the line toward `toward_deg`, (2, 3, T)."""
    return turned(np.stack([move, np.zeros_like(move)]), reference.value("toward_deg"))


def _diagonal(reference: Reference, time: Array) -> Array:
    return _along(np.deg2rad(reference.end_deg) * minimum_jerk(time, reference.duration), reference)


def _diagonal_ramp(reference: Reference, time: Array) -> Array:
    return _along(np.deg2rad(reference.end_deg) * ramp(time, reference.duration), reference)


def _diagonal_square(reference: Reference, time: Array) -> Array:
    speed = reference.value("speed")
    return _along(limited_square(time, reference.end_deg, reference.frequency, speed), reference)


def _toward_words(reference: Reference) -> str:
    return f"{reference.end_deg:g} deg toward {reference.value('toward_deg'):g} deg"


_DIRECTION = Parameter(45.0, "deg", "direction of the move, from ulnar toward flexion")
ELLIPSE = ReferenceKind(
    "the hand goes around on an ellipse about the straight wrist, bent by `angle_deg` along it, `ratio` of that across",
    course=_ellipse,
    described=lambda reference: f"{_described('ellipse', reference)}, {reference.value('ratio'):g} as wide",
    targets="none",
    parameters={
        **CIRCUMDUCTION.parameters,
        "ratio": Parameter(0.5, "", "its width over its length"),
    },
    planes=2,
)
DIAGONAL = ReferenceKind(
    "a smooth move of `duration` from straight to `angle_deg` toward `toward_deg`, and rest there",
    course=_diagonal,
    described=lambda reference: f"minimum jerk {reference.duration:g} s {_toward_words(reference)}",
    targets="none",
    parameters={"toward_deg": _DIRECTION},
    planes=2,
)
DIAGONAL_RAMP = ReferenceKind(
    "a way from straight to `angle_deg` toward `toward_deg` at an even speed in `duration`, and rest there",
    course=_diagonal_ramp,
    described=lambda reference: f"ramp {reference.duration:g} s {_toward_words(reference)}",
    targets="none",
    parameters={"toward_deg": _DIRECTION},
    planes=2,
)
DIAGONAL_SQUARE = ReferenceKind(
    "to and fro between `angle_deg` toward `toward_deg` and as much to the other side at `speed`, held there, "
    "`frequency` times a second there and back",
    course=_diagonal_square,
    described=lambda reference: (
        f"square {reference.frequency:g} Hz +-{_toward_words(reference)} at {reference.value('speed'):g} deg/s"
    ),
    targets="none",
    parameters={"speed": SPEED, "toward_deg": _DIRECTION},
    planes=2,
)
