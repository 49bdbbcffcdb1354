"""Figures of trials in two planes: paths in the plane of bends, and errors of both planes over time."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    LIGHT,
    ORANGE,
    SILVER,
    SIMULATED,
    VERMILLION,
    WANTED,
    figure,
    legend_below,
    title,
)
from wristctl.simulation.trajectory import Trajectory

_PLANES = ("ulnar", "flexion")


class TrialBends(NamedTuple):
    """One trial: as logged, as it truly was on a bench, and in simulation."""

    motion: str
    logged: Trajectory
    true: Trajectory | None
    simulated: Trajectory
    push: tuple[float, float] | None
    """When the push began and ended [s]."""


def paths_of_bends(trials: Sequence[TrialBends], reach: Array, heading: str = "") -> Figure:
    """Paths in the plane of bends [deg]; `reach` is a closed line (K, 2) [rad], as `reach_of_bends` gives it."""
    picture = Figure(figsize=(5.2, 5.6), layout="constrained")
    axes = picture.add_subplot()
    axes.plot(*np.rad2deg(reach).T, color=SILVER, label="in reach")
    for trial in trials:
        axes.plot(*np.rad2deg(trial.logged.bend_ref).T, **WANTED | {"label": "wanted"})
        axes.plot(*np.rad2deg(trial.logged.bend).T, color=BLUE, linewidth=1.0, label="measured")
        if trial.true is not None:
            axes.plot(*np.rad2deg(trial.true.bend).T, color=VERMILLION, linewidth=0.8, label="true")
    axes.set_aspect("equal", adjustable="datalim")  # a box of another shape would push the title off the picture
    axes.set(xlabel="bend toward ulnar [deg]", ylabel="bend toward flexion [deg]")
    title(axes, heading)
    legend_below(picture)
    return picture


def errors_of_bends(trials: Sequence[TrialBends], heading: str = "") -> Figure:
    """Errors [deg] over time [s], one row of panels for each motion, one column for each plane."""
    picture, axes = figure(len(trials), 2, height=0.9 + 1.7 * len(trials), sharex=True, sharey=True)
    for trial, panels in zip(trials, axes, strict=True):
        for plane, panel in enumerate(panels):
            lines = [(trial.logged, BLUE, "measured", {}), (trial.simulated, ORANGE, "simulated", SIMULATED)]
            if trial.true is not None:
                lines.insert(1, (trial.true, VERMILLION, "true", {}))
            for course, colour, label, style in lines:
                error = np.degrees(course.error[:, plane])
                panel.plot(course.time, error, **{"color": colour, "linewidth": 1.0, "label": label} | style)
            panel.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
            if trial.push is not None:
                panel.axvspan(*trial.push, color=LIGHT, zorder=0.5, label="push")
            title(panel, f"{trial.motion}, toward {_PLANES[plane]}")
    for panel in axes[-1]:
        panel.set_xlabel("time [s]")
    picture.suptitle(heading, fontsize=10.0)
    picture.supylabel("error [deg]", fontsize=10.0)
    legend_below(picture)
    return picture
