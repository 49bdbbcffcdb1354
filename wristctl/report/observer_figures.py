"""Figure of an observer: its error against what it expects by what it believes, and the load that it estimates."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from wristctl.report.style import BLACK, BLUE, GREY, VERMILLION, figure, legend, title
from wristctl.simulation.trajectory import Trajectory

_NORMAL_95 = 1.96


def consistency(course: Trajectory, heading: str = "") -> Figure:
    """The observer's error [deg] in the band that it expects, and its estimate of the load torque [N m], over time."""
    assert course.seen is not None and course.load is not None
    error, band = np.degrees(course.seen - course.theta), _NORMAL_95 * np.degrees(course.expected)
    made, axes = figure(2, 1, height=4.2, sharex=True)
    upper, lower = axes[:, 0]
    upper.axhspan(-band, band, color=GREY, alpha=0.35, linewidth=0.0, label="95 % by what it believes")
    upper.plot(course.time, error, color=VERMILLION, linewidth=1.0, label="observer less true angle")
    upper.set_ylabel("error [deg]")
    within = 100.0 * np.mean(np.abs(error) <= band)
    title(upper, f"{course.label}: {within:.0f} % within, RMS {course.consistency:.2g} times what it expects")
    legend(upper, loc="upper right")
    lower.plot(course.time, course.load, color=BLUE, linewidth=1.0)
    lower.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    lower.set(xlabel="time [s]", ylabel="estimated load [N m]")
    title(lower, heading)
    return made
