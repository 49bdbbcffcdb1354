"""References that never rest, or rest nowhere in particular: what a loop is tried and identified with."""

import numpy as np

from wristctl.arrays import Array
from wristctl.config.loop import Reference
from wristctl.config.section import Parameter
from wristctl.errors import UserError
from wristctl.seeds import stream
from wristctl.simulation.reference import ReferenceKind
from wristctl.simulation.references import target_words

SPEED = Parameter(90.0, "deg/s", "of its way from side to side")
"""Speed of a limited square."""
_OFFSET = Parameter(0.0, "deg", "middle of the motion", mirrors=True)


def _about(reference: Reference, swing: Array) -> Array:
    """The middle plus the angle times a swing within -1 and 1 with its two derivatives, (3, T) [rad], in its place."""
    swing *= np.deg2rad(reference.end_deg)
    swing[0] += np.deg2rad(reference.value("offset_deg"))
    return swing


def _held(swing: Array) -> Array:
    """A swing (T,) that jumps, with two derivatives."""
    course = np.zeros((3, len(swing)))
    course[0] = swing
    return course


def _turning(phase: Array, rate: Array | float, acceleration: Array | float) -> Array:
    """The sine of a phase that moves, with two derivatives."""
    course, cosine = np.empty((3, len(phase))), np.cos(phase)
    np.sin(phase, out=course[0])
    np.multiply(rate, cosine, out=course[1])
    np.multiply(-rate * rate, course[0], out=course[2])
    cosine *= acceleration
    course[2] += cosine
    return course


def _two_sided(reference: Reference, time: Array) -> Array:
    rate = 2.0 * np.pi * reference.frequency
    phase = rate * time + np.deg2rad(reference.value("phase_deg"))
    return _about(reference, _turning(phase, rate, 0.0))


def _chirp(reference: Reference, time: Array) -> Array:
    low, high = (2.0 * np.pi * frequency for frequency in (reference.frequency, _end_frequency(reference)))
    ramp, within = (high - low) / reference.duration, np.minimum(time, reference.duration)
    rate = low + ramp * within
    phase = 0.5 * (low + rate) * within + high * (time - within)
    return _about(reference, _turning(phase, rate, np.where(time < reference.duration, ramp, 0.0)))


def _end_frequency(reference: Reference) -> float:
    end = reference.value("end_frequency")
    if end <= 0.0:
        raise UserError(f"a chirp does not end at {end:g} 1/s", "reference.end_frequency", "a frequency above 0")
    return end


def _square(reference: Reference, time: Array) -> Array:
    periods = reference.frequency * time + 0.5e-9
    return _about(reference, _held(np.where(periods - np.floor(periods) < 0.5, 1.0, -1.0)))


def limited_square(time: Array, angle_deg: float, frequency: float, speed: float) -> Array:
    """To and fro between an angle and its negative at an even speed, held at both, with two derivatives.

    Parameters
    ----------
    time
        Samples (T,) [s].
    angle_deg
        The angle that it goes to first [deg].
    frequency
        How often it goes there and back [1/s].
    speed
        Of its way from side to side [deg/s].

    Returns (3, T) [rad]. Raises UserError for a speed at which it does not reach the other side in half a period.
    """
    half = 0.5 / frequency
    if not speed * half >= 2.0 * abs(angle_deg):
        problem = f"{speed:g} deg/s do not go from side to side by {2.0 * abs(angle_deg):g} deg in {half:g} s"
        raise UserError(problem, "reference.speed", "more, or a lower frequency")
    rate = speed / abs(angle_deg) if angle_deg else 0.0
    number = np.floor(np.maximum(time, 0.0) / half + 1e-9)
    aim = np.where(number % 2.0, -1.0, 1.0)
    begin = np.where(number, -aim, 0.0)
    way, passed = np.abs(aim - begin), rate * (np.maximum(time, 0.0) - number * half)
    course = np.zeros((3, len(time)))
    course[0] = begin + aim * np.clip(passed, 0.0, way)
    course[1] = np.where((time >= 0.0) & (passed < way), aim * rate, 0.0)
    course *= np.deg2rad(angle_deg)
    return course


def _limited_square(reference: Reference, time: Array) -> Array:
    course = limited_square(time, reference.end_deg, reference.frequency, reference.value("speed"))
    course[0] += np.deg2rad(reference.value("offset_deg"))
    return course


def ramp(time: Array, duration: float) -> Array:
    """The way from 0 to 1 at an even speed in `duration` [s] with two derivatives, (3, T), by the time (T,) [s]."""
    course = np.zeros((3, len(time)))
    course[0] = np.clip(time / duration, 0.0, 1.0)
    course[1] = np.where((time >= 0.0) & (time < duration), 1.0 / duration, 0.0)
    return course


def _ramp(reference: Reference, time: Array) -> Array:
    return ramp(time, reference.duration)


def _random_steps(reference: Reference, time: Array) -> Array:
    seed = reference.value("seed")
    if seed < 0 or seed != int(seed):
        raise UserError(f"{seed:g} is no seed", "reference.seed", "a whole number, 0 or more")
    held = np.floor(time / reference.duration + 1e-9).astype(np.int64)
    drawn = np.random.default_rng(stream(int(seed), "random steps")).uniform(-1.0, 1.0, int(held.max(initial=0)) + 1)
    return _about(reference, _held(drawn[held]))


def _swing(reference: Reference) -> str:
    middle = reference.value("offset_deg")
    return f"+-{abs(reference.end_deg):g} deg" + (f" about {middle:g} deg" if middle else "")


def _with_phase(reference: Reference) -> str:
    phase = reference.value("phase_deg")
    return f"{reference.frequency:g} Hz {_swing(reference)}" + (f" from {phase:g} deg" if phase else "")


TWO_SIDED_SINE = ReferenceKind(
    "offset + angle sin(2 pi `frequency` t + phase): to both sides",
    course=_two_sided,
    described=lambda reference: f"two-sided sine {_with_phase(reference)}",
    targets="none",
    parameters={"offset_deg": _OFFSET, "phase_deg": Parameter(0.0, "deg", "where in its cycle it begins")},
)
CHIRP = ReferenceKind(
    "a sine whose frequency rises from `frequency` by the same each second over `duration`, and then stays",
    course=_chirp,
    described=lambda reference: (
        f"chirp {reference.frequency:g} to {reference.value('end_frequency'):g} Hz "
        f"in {reference.duration:g} s {_swing(reference)}"
    ),
    targets="none",
    parameters={"end_frequency": Parameter(3.0, "1/s", "frequency at the end"), "offset_deg": _OFFSET},
)
SQUARE = ReferenceKind(
    "jumps between offset + angle and offset - angle, `frequency` times a second there and back",
    course=_square,
    described=lambda reference: f"square {reference.frequency:g} Hz {_swing(reference)}",
    targets="none",
    parameters={"offset_deg": _OFFSET},
    jumps=True,
)
LIMITED_SQUARE = ReferenceKind(
    "to and fro between angle and -angle at `speed`, held there, `frequency` times a second there and back",
    course=_limited_square,
    described=lambda reference: (
        f"square {reference.frequency:g} Hz {_swing(reference)} at {reference.value('speed'):g} deg/s"
    ),
    targets="none",
    parameters={"speed": SPEED, "offset_deg": _OFFSET},
)
RAMP = ReferenceKind(
    "a way to an angle or a tip position at an even speed in `duration`",
    course=_ramp,
    rest=lambda reference, begin, horizon: begin + reference.duration,
    described=lambda reference: f"ramp {reference.duration:g} s {target_words(reference)}",
)
RANDOM_STEPS = ReferenceKind(
    "jumps to angles drawn evenly between offset - angle and offset + angle, one each `duration`",
    course=_random_steps,
    described=lambda reference: (
        f"random steps {reference.duration:g} s {_swing(reference)} seed {reference.value('seed'):g}"
    ),
    targets="none",
    parameters={"seed": Parameter(0, "", "of the draw: another one, other angles"), "offset_deg": _OFFSET},
    jumps=True,
)
