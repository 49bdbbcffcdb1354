"""Figures of closed loops over time: angle, error, tensions and torque."""

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.comparison.repetition_spread import spread_over_time
from wristctl.plotting.style import (
    BLACK,
    DOTTED,
    GREY,
    ORANGE,
    PURPLE,
    THIN,
    WANTED,
    figure,
    legend,
    legend_below,
    line,
    logarithmic,
    title,
)
from wristctl.simulation.repetitions import Repeated
from wristctl.simulation.trajectory import Trajectory

# Errors below this [rad] are not shown on a logarithmic axis.
_SMALLEST = 1e-8
# Error that nobody can measure [deg].
_LEAST_DEG = 1e-3
# Samples in the close-up of tensions.
_LAST = 20
# Parts of a long course of which each is drawn by its least and its largest value.
_COLUMNS = 500


def angles(trajectories: Sequence[Trajectory], heading: str = "") -> Figure:
    """Desired and obtained bending angle [deg] over time [s], one line for each trajectory.

    The reference is drawn on its own where it differs from the desired angle (a network's error), and so is what the
    controller sees where that differs from the angle (a camera's delay).
    """
    picture, ((axes,),) = figure(height=3.4)
    for course in trajectories:
        axes.plot(course.time, np.degrees(course.theta), label=label(course), **line(course.label))
        if (measured := _apart(course.seen, course.theta)) is not None:
            axes.plot(course.time, np.degrees(measured), label=f"{course.label} as seen", **THIN)
    draw_desired(axes, trajectories)
    within_half_a_move(axes, trajectories)
    axes.set(xlabel="time [s]", ylabel="bending angle [deg]")
    title(axes, heading)
    legend_below(picture)
    return picture


def errors(trajectories: Sequence[Trajectory], heading: str = "", log: bool = False) -> Figure:
    """Error e = theta - theta_ref [rad] over time [s], as in the paper's figures of SMC and PID; `log` for |e|.

    Beside it, but not with `log`, the error that the controller sees where that differs (a camera's delay and noise).
    """
    picture, ((axes,),) = figure(height=3.4)
    for course in trajectories:
        error = np.where(np.abs(course.error) < _SMALLEST, np.nan, np.abs(course.error)) if log else course.error
        axes.plot(course.time, error, label=label(course), **line(course.label))
        if not log and (measured := _apart(course.seen, course.theta)) is not None:
            axes.plot(course.time, measured - course.theta_ref, label=f"{course.label} as seen", **THIN)
    if log:
        logarithmic(axes.yaxis)
    else:
        axes.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
        size = max(float(np.abs(course.theta_ref).max()) for course in trajectories)
        _at_most(axes, -2.0 * size - 0.01, 2.0 * size + 0.01)
    axes.set(xlabel="time [s]", ylabel="|error| [rad]" if log else "error [rad]")
    title(axes, heading)
    legend_below(picture)
    return picture


def overlay(trajectories: Sequence[Trajectory], heading: str = "") -> Figure:
    """Angle and, below it, size of the error [deg] over time [s], one line for each trajectory.

    What nobody can measure is drawn as 0.001 deg.
    """
    picture, ((above,), (below,)) = figure(2, 1, height=4.4, sharex=True)
    for course in trajectories:
        above.plot(course.time, np.degrees(course.theta), label=label(course), **line(course.label))
        error = np.maximum(np.degrees(np.abs(course.error)), _LEAST_DEG)
        below.plot(course.time, error, **line(course.label))
    draw_desired(above, trajectories)
    within_half_a_move(above, trajectories)
    logarithmic(below.yaxis)
    largest = max(float(np.degrees(np.abs(course.theta_ref)).max()) for course in trajectories)
    _at_most(below, 0.5 * _LEAST_DEG, 2.0 * largest + 1.0)
    above.set(ylabel="bending angle [deg]")
    below.set(xlabel="time [s]", ylabel="|error| [deg]")
    title(above, heading)
    legend_below(picture)
    return picture


def tensions(trajectory: Trajectory) -> Figure:
    """Tension per tendon [N] of both sides, and the torque [N m] that the law wants and that the tensions should give.

    Where tensions do not act as they are commanded (lag, steps, elastic tendons) both are drawn.
    On the right the last samples alone, so that tensions which jump at every tick can be told from a filled area.
    """
    picture, axes = figure(3, 2, height=6.0, sharex="col", sharey="row", width_ratios=(3, 1))
    acting = _apart(trajectory.acting, trajectory.tension)
    largest = max(
        float(np.nanmax(tensions_of_side))
        for tensions_of_side in (trajectory.tension, acting)
        if tensions_of_side is not None
    )
    end = float(trajectory.time[-1])
    close_up = slice(-_LAST, None), 1e3 * (trajectory.time - end)
    for column, (part, time) in zip(axes.T, ((slice(None), trajectory.time), close_up), strict=True):
        for panel, colour, tension in zip(column, (ORANGE, PURPLE), trajectory.tension.T, strict=False):
            drawn = envelope(time[part], tension[part])
            panel.step(*drawn, color=colour, linewidth=1.0, where="post", label="commanded")
        for panel, tension in zip(column, () if acting is None else acting.T, strict=False):
            panel.plot(*envelope(time[part], tension[part]), label="acting", **THIN)
        wanted = {"color": GREY, "label": "wanted by the law"}
        acting_style = {"color": BLACK, "label": "of the commanded tensions"}
        for torque, style in ((trajectory.torque_wanted, wanted), (trajectory.torque, acting_style)):
            column[2].step(*envelope(time[part], torque[part]), linewidth=1.0, where="post", **style)
    for panel, name in zip(axes[:, 0], ("+ side [N]", "- side [N]", "torque [N m]"), strict=True):
        panel.set_ylabel(name)
    for panel in axes[:2, 0]:
        panel.set_ylim(0.0, 1.05 * largest)
    size = 2.0 * float(np.nanmax(np.abs(trajectory.torque), initial=1e-3))
    _at_most(axes[2, 0], -size, size)
    axes[2, 0].set_xlabel("time [s]")
    axes[2, 1].set_xlabel(f"time - {end:.4g} s [ms]")
    title(axes[0, 0], f"{label(trajectory)}: tension per tendon, torque")
    title(axes[0, 1], f"last {_LAST} samples")
    if acting is not None:
        legend(axes[1, 0], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)
    legend(axes[2, 0], loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)
    return picture


def envelope(time: Array, course: Array) -> tuple[Array, Array]:
    """Envelope of a course (T,) that jumps at every sample: the least and largest value of each part."""
    samples_per_column = len(time) // _COLUMNS
    if samples_per_column < 4:
        return time, course
    covered = samples_per_column * _COLUMNS
    parts = course[:covered].reshape(_COLUMNS, samples_per_column)
    ends = (
        np.stack([parts.argmin(axis=1), parts.argmax(axis=1)], axis=1)
        + samples_per_column * np.arange(_COLUMNS)[:, None]
    )
    kept = np.unique(np.append(ends, np.arange(covered, len(time))))
    return time[kept], course[kept]


def _apart(angle: Array | None, true_angle: Array) -> Array | None:
    """The other course if it is not the known one, to a millionth of its size."""
    size = 1e-6 * float(np.nanmax(np.abs(true_angle), initial=1e-6))
    return None if angle is None or np.allclose(angle, true_angle, rtol=0.0, atol=size, equal_nan=True) else angle


def label(trajectory: Trajectory) -> str:
    """The trajectory's label, saying so if it diverged."""
    return trajectory.label if np.isfinite(trajectory.theta).all() else f"{trajectory.label} (diverged)"


def draw_desired(axes: Axes, trajectories: Sequence[Trajectory]) -> None:
    """Draw the desired angle [deg] as a band behind the lines, and each other reference dotted."""
    wanted = trajectories[0].theta_desired
    axes.plot(trajectories[0].time, np.degrees(wanted), **WANTED)
    drawn = [wanted]
    for course in trajectories:
        if not any(np.allclose(course.theta_ref, earlier, atol=1e-6) for earlier in drawn):
            drawn.append(course.theta_ref)
            axes.plot(course.time, np.degrees(course.theta_ref), label="reference", **DOTTED)


def within_half_a_move(axes: Axes, trajectories: Sequence[Trajectory]) -> None:
    """Let the axis of angles [deg] end half a move beyond what is desired, so that a diverging loop hides no other."""
    wanted = np.degrees(np.concatenate([course.theta_desired for course in trajectories]))
    low, high = wanted.min(initial=0.0), wanted.max(initial=0.0)
    margin = max(5.0, 0.5 * (high - low))
    _at_most(axes, low - margin, high + margin)


def _at_most(axes: Axes, low: float, high: float) -> None:
    """Keep the y axis within low to high."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low), min(top, high))


def error_sizes(repeated: Sequence[Repeated], heading: str = "") -> Figure:
    """Size of the error |theta - theta_ref| [rad] over time [s]: the repetitions' median with its 95 % interval.

    A repetition that diverged counts as the largest error; with fewer than six there is no band.
    """
    picture, ((axes,),) = figure(height=3.4)
    for loop in repeated:
        course, errors = loop.first.trajectory, np.abs(loop.errors)
        median, low, high = spread_over_time(errors)
        style = line(course.label)
        label = course.label + (f", {loop.failed.sum()} failed" if loop.failed.any() else "")
        axes.plot(course.time, np.where(np.isfinite(median), median, np.nan), label=label, **style)
        axes.fill_between(course.time, low, high, color=style["color"], alpha=0.25, linewidth=0.0)
    axes.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    axes.set(xlabel="time [s]", ylabel=f"median |error| of {len(repeated[0].errors)} [rad]")
    title(axes, heading)
    legend_below(picture)
    return picture
