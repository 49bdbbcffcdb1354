"""Figures of a validation: the motion and its prediction, what is left of it, and the error of each model."""

from collections.abc import Sequence

import numpy as np
from matplotlib.figure import Figure

from wristctl.identification.arc_fit import ArcFit
from wristctl.identification.model_choice import TriedModel
from wristctl.identification.real_robots import RealRobot
from wristctl.plotting.kinds import Dot, draw_dots, name_rows
from wristctl.plotting.style import BLACK, BLUE, GREY, VERMILLION, figure, legend, legend_below, title

# Recordings drawn at most.
_SHOWN = 3


def _parts(fits: Sequence[ArcFit]) -> list[tuple[ArcFit, int]]:
    """Fits with the number of a recording in which something is predicted."""
    return [(fit, k) for fit in fits for k, recording in enumerate(fit.recordings) if recording.asked.any()]


def motion(robot: RealRobot, fits: Sequence[ArcFit]) -> Figure:
    """Measured and predicted coordinates [deg or mm] of the predicted samples, over time with gaps between them.

    Recordings without times have their samples' numbers there. A coordinate that never moves, as the second bend of a
    log in one plane, is not drawn.
    """
    parts = _parts(fits)[:_SHOWN]
    names = ("y", "z") if robot.robot.measured == "bend" else ("x", "y", "z")
    moving = np.any([np.ptp(fit.recordings[k].measured, axis=0) > 0.0 for fit, k in parts], axis=0)
    axes_of = [(name, at) for at, name in enumerate(names) if moving[at]]
    picture, axes = figure(len(axes_of), len(parts), height=1.0 + 1.6 * len(axes_of), sharex="col")
    for column, (fit, k) in enumerate(parts):
        recording, wrong = fit.recordings[k], fit.errors[k]
        asked = recording.asked
        gaps = np.flatnonzero(np.diff(np.flatnonzero(asked)) > 1) + 1  # between what is predicted other samples lie
        across = recording.time[asked]
        for row, (name, at) in enumerate(axes_of):
            panel, measured = axes[row, column], robot.scale * recording.measured[asked, at]
            panel.plot(across, measured, ".", color=GREY, markersize=2.5, label="measured")
            model = np.insert(measured + robot.scale * wrong[asked, at], gaps, np.nan)
            panel.plot(np.insert(across, gaps, np.nan), model, color=BLUE, linewidth=1.0, label="model")
            if column == 0:
                what = "bend" if robot.robot.measured == "bend" else "tip"
                panel.set_ylabel(f"{what} {name} [{robot.unit}]")
        title(axes[0, column], recording.name if recording.name != "all" else robot.asked)
        axes[-1, column].set_xlabel("time [s]" if robot.robot.timed else "sample")
    legend_below(picture)
    return picture


def left_over(robot: RealRobot, fits: Sequence[ArcFit]) -> Figure:
    """Length of the error of each predicted sample [deg or mm], and its distribution.

    Samples stand at their numbers among all that were measured of the drawn recordings, as in the order of `motion`:
    where others were fitted there is a gap. The line and the distribution are of what is predicted in all recordings.
    """
    picture, ((left, right),) = figure(1, 2, height=3.2, width_ratios=(2, 1))
    whole, first = [], 0
    for number, (fit, k) in enumerate(_parts(fits)):
        recording, wrong = fit.recordings[k], fit.errors[k][fit.recordings[k].asked]
        if robot.centred:
            wrong = wrong - wrong.mean(axis=0)
        sizes = robot.scale * np.sqrt(np.sum(wrong**2, axis=1))
        whole.append(sizes)
        if number < _SHOWN:
            left.plot(first + np.flatnonzero(recording.asked), sizes, ".", markersize=2.5, label=recording.name)
            first += len(recording.time)
    sizes = np.concatenate(whole)
    right.hist(sizes, bins=40, color=GREY, orientation="horizontal")
    for panel in (left, right):
        panel.axhline(float(np.sqrt(np.mean(sizes**2))), color=BLACK, linewidth=0.8)
    left.set(xlabel="measured sample", ylabel=f"error [{robot.unit}]")
    right.set_xlabel("predicted samples")
    title(right, "line: root mean square")
    return picture


def errors_of_models(robot: RealRobot, models: Sequence[TriedModel]) -> Figure:
    """Error of the predicted part of each model with its 95 % interval, and of the authors' own."""
    picture, ((axes,),) = figure(1, 1, height=1.2 + 0.35 * len(models))
    scores = [[robot.scale * value for value in model.score[:3]] for model in models]
    draw_dots(axes, [Dot(place, error, BLUE, (low, high)) for place, (error, low, high) in enumerate(scores)])
    for name, error in robot.authors[:1]:
        axes.axvline(error, color=VERMILLION, linewidth=1.2, label=name)
    name_rows(axes, [model.words.replace("elastic ", "") for model in models])
    axes.set_xlabel(f"RMS error, {robot.asked} [{robot.unit}]")
    axes.set_xlim(left=0.0)
    if robot.authors:
        legend(axes)
    return picture
