"""Figures of repetitions: what all of them have in common, and how far they lie apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.statistics import spread_over_time
from wristctl.report.style import BLACK, figure, legend_below, line, title
from wristctl.simulation.repetitions import Repeated


def error_sizes(repeated: Sequence[Repeated], heading: str = "") -> Figure:
    """Size of the error |theta - theta_ref| [rad] over time [s]: the repetitions' median with its 95 % interval.

    A repetition that diverged counts as the largest error; with fewer than six there is no band.
    """
    made, ((axes,),) = figure(height=3.4)
    for each in repeated:
        course, errors = each.first.trajectory, np.abs(each.errors)
        median, low, high = spread_over_time(errors)
        style = line(course.label)
        label = course.label + (f", {each.failed.sum()} failed" if each.failed.any() else "")
        axes.plot(course.time, np.where(np.isfinite(median), median, np.nan), label=label, **style)
        axes.fill_between(course.time, low, high, color=style["color"], alpha=0.25, linewidth=0.0)
    axes.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    axes.set(xlabel="time [s]", ylabel=f"median |error| of {len(repeated[0].errors)} [rad]")
    title(axes, heading)
    legend_below(made)
    return made
