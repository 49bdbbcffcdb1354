"""A recorded course's metrics by their formulas over whole series, which loops count sample by sample."""

import numpy as np

from wristctl.control.response import FULL
from wristctl.simulation.metrics import metrics_in, of_trajectory, summary, totals_of_series
from wristctl.simulation.motion import goals_of_bends
from wristctl.simulation.trajectory import Trajectory


def of_course(course: Trajectory) -> dict[str, float]:
    """All metrics of a trajectory that was recorded sample by sample, from straight to where its reference ends."""
    step, planes = float(course.time[1] - course.time[0]), course.planes
    acting = course.tension if course.acting is None else course.acting
    saturated = np.zeros(len(course.time)) if course.share is None else (course.share < FULL).astype(float)
    goals = goals_of_bends(course.bend_ref.T, course.time)
    totals = totals_of_series(step, course.bend, course.bend_ref, acting, saturated, goals)
    totals.sums["alive"][:] = float(not course.failed)
    values = {name: float(value[0]) for name, value in summary(totals, metrics_in(planes)).items()}
    return values | of_trajectory(course)
