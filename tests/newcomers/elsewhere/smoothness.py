"""How jerky a motion is."""

from __future__ import annotations

import numpy as np

from wristctl.simulation.metrics import Metric
from wristctl.simulation.trajectory import Trajectory


def _jerk(trajectory: Trajectory) -> float:
    step = float(trajectory.time[1] - trajectory.time[0])
    jerk = np.diff(trajectory.rate, 2, axis=0) / step**2
    return float(np.sqrt(trajectory.planes * np.mean(jerk**2)))


JERK = Metric("rad/s^3", "root mean square of the angle's third derivative", of_trajectory=_jerk, heading="jerk")
