"""Figure of a motion in two planes: the bend toward ulnar and flexion, wanted and followed, with the tendons' reach."""

import numpy as np
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.plotting.style import BLACK, BLUE, SILVER
from wristctl.simulation.two_planes import BendCourse


def bend_figure(course: BendCourse, reach: Array) -> Figure:
    """The plane of bends; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    figure = Figure(figsize=(5.0, 5.0), layout="constrained")
    axes = figure.add_subplot()
    axes.plot(*np.rad2deg(reach).T, color=SILVER, label="in reach")
    axes.plot(*np.rad2deg(course.bend_ref).T, color=BLACK, linestyle="--", label="wanted")
    axes.plot(*np.rad2deg(course.bend).T, color=BLUE, label="followed")
    axes.set_aspect("equal")
    axes.set_xlabel("bend toward ulnar [deg]")
    axes.set_ylabel("bend toward flexion [deg]")
    axes.legend(loc="upper right")
    return figure
