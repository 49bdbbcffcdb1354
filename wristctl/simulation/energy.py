"""The work that is done on a wrist."""

from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.trajectory import Trajectory


def energy(torque: Array, rate: Array, step: float) -> Any:
    """Integral of |torque * rate| [J] over torques [N m] and rates [rad/s] (..., T) sampled every `step` [s]."""
    return np.abs(torque * rate).sum(axis=-1) * step


def course_energy(course: Trajectory) -> float:
    """The same of one course."""
    return float(energy(course.torque, course.rate, float(course.time[1] - course.time[0])))
