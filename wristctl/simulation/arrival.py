"""Does a loop get where it is asked to, and if not, why: told from its course, never from saturation alone."""

import numpy as np

from wristctl.simulation.trajectory import Trajectory, rests, size_of

# Share of the move that may be missing at the end of what arrives.
SHORT = 0.2
# The last part of the horizon that is the end, as a divisor.
_LATE = 10
# Share of the move within which a wrist has hardly moved.
_STILL = 0.05
# Share of ticks at which a torque changes sides beyond which it is one that chatters.
_BOTH_WAYS = 0.2


def missing(course: Trajectory) -> float:
    """Missing share at the end: mean |e| over the last 10 % as a share of the largest reference.

    Of a reference that never rests over the last half, since it may pass where a wrist stands that does not move. 0
    where the reference stays at zero; inf where the wrist has failed.
    """
    late = max(1, len(course.time) // (_LATE if rests(course) else 2))
    asked = float(np.max(size_of(course.bend_ref)))
    if not np.isfinite(course.theta[-late:]).all():
        return np.inf
    return float(np.mean(course.distance[-late:]) / asked) if asked > 0.0 else 0.0


def arrives(course: Trajectory) -> bool:
    """Whether at most a fifth of the move is missing at the end; of a periodic reference, of its amplitude."""
    return missing(course) <= SHORT


def why_not(course: Trajectory, limit: float) -> str:
    """In words where a course ends that does not arrive, and what its torque does; `limit` is of the tension [N]."""
    late = max(1, len(course.time) // _LATE)
    ends, asked = (float(np.degrees(np.mean(angles[-late:]))) for angles in (course.theta, course.theta_ref))
    moved = float(np.max(np.abs(course.theta))) > _STILL * float(np.max(np.abs(course.theta_ref)))
    ending = f"ends at {ends:.2g} of {asked:.3g} deg" if moved else f"hardly moves: {ends:.2g} of {asked:.3g} deg"
    wanted, delivered = course.torque_wanted, course.torque
    turns = float(np.mean(np.sign(wanted[1:]) * np.sign(wanted[:-1]) < 0.0))
    cut = float(np.mean(np.abs(wanted - delivered) > 1e-6 * np.abs(wanted)))
    if turns > _BOTH_WAYS and cut > 0.5:
        return (
            f"{ending}; the controller asks for {_largest(wanted):.3g} N m to one side and the other, turning at "
            f"{100.0 * turns:.0f} % of samples, and tensions of {limit:g} N cut it off {100.0 * cut:.3g} % of the time"
        )
    if cut > 0.5:
        most, asked_for = _largest(delivered), _largest(wanted)
        return f"{ending}; tensions of {limit:g} N give at most {most:.3g} N m of the {asked_for:.3g} that it asks for"
    most = _largest(wanted[-late:])
    return f"{ending}; the controller asks for no more than {most:.3g} N m there: its gains are too small"


def _largest(torque: np.ndarray) -> float:
    return float(np.max(np.abs(torque)))
