"""Figures of closed loops over time: angle, error, tensions and torque."""

from collections.abc import Callable, Sequence

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
from wristctl.simulation.trajectory import Trajectory, size_of

# Errors below this [rad] are not shown on a logarithmic axis.
_SMALLEST = 1e-8
# Error that nobody can measure [deg].
_LEAST_DEG = 1e-3
# Samples in the close-up of tensions.
_LAST = 20
# Parts of a long course of which each is drawn by its least and its largest value, and samples in a part from there on.
_COLUMNS, _SAMPLES_OF_PART = 500, 4


# Draws a part of courses over time on its axes, and names it.
Part = Callable[[Axes, Sequence[Trajectory]], None]


def over_time(courses: Sequence[Trajectory], *parts: str | Part, heading: str = "") -> Figure:
    """Courses over time [s], a line for each; the parts stand below each other.

    `angle` and `error` [deg] are drawn also as the controller sees them where that differs (a camera's delay and
    noise), a reference on its own where it differs from the desired angle (a network's error). `size` is that of the
    error, log, and `measurable size` the same with 0.001 deg for what nobody can measure.
    """
    picture, axes = figure(len(parts), 1, height=2.4 + len(parts), sharex=True)
    for panel, part in zip(axes[:, 0], parts, strict=True):
        (_PARTS[part] if isinstance(part, str) else part)(panel, courses)
    axes[-1, 0].set_xlabel("time [s]")
    title(axes[0, 0], heading)
    legend_below(picture)
    return picture


def one_motion(course: Trajectory, heading: str = "") -> Figure:
    """One motion on three panels over time [s]: bending angle [deg], its error [deg] and the tensions [N].

    The panel of tensions has the commanded one of each side.
    """
    picture, axes = figure(3, 1, height=5.4, sharex=True, height_ratios=(3, 2, 2))
    above, middle, below = axes[:, 0]
    _draw_angles(above, [course], "as seen")
    _draw_errors(middle, [course], "as seen")
    for side, shade, tension in zip("+-", (ORANGE, PURPLE), course.tension.T, strict=True):
        draw_course(below, course.time, tension, shade, label=f"{side} side")
    below.set_ylim(bottom=0.0)
    above.set_ylabel("angle [deg]")
    below.set(xlabel="time [s]", ylabel="tension [N]")
    picture.align_ylabels()
    title(above, heading)
    legend(above, loc="lower right")
    legend(below, loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderaxespad=0.0)
    return picture


def _draw_angles(axes: Axes, trajectories: Sequence[Trajectory], seen: str = "{} as seen") -> None:
    for course in trajectories:
        axes.plot(course.time, np.degrees(course.theta), label=label(course), **line(course.label))
        if (measured := _apart(course.seen, course.theta)) is not None:
            axes.plot(course.time, np.degrees(measured), label=seen.format(course.label), **THIN)
    _draw_desired(axes, trajectories)
    wanted = np.degrees(np.concatenate([course.theta_desired for course in trajectories]))
    low, high = wanted.min(initial=0.0), wanted.max(initial=0.0)
    margin = max(5.0, 0.5 * (high - low))  # so that a diverging loop hides no other
    _at_most(axes, low - margin, high + margin)
    axes.set_ylabel("bending angle [deg]")


def _draw_errors(axes: Axes, trajectories: Sequence[Trajectory], seen: str = "{} as seen") -> None:
    for course in trajectories:
        axes.plot(course.time, np.degrees(course.error), label=label(course), **line(course.label))
        if (measured := _apart(course.seen, course.theta)) is not None:
            error = np.degrees(measured - course.theta_ref)
            axes.plot(course.time, error, label=seen.format(course.label), **THIN)
    axes.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    largest = max(float(np.degrees(np.abs(course.theta_ref)).max()) for course in trajectories)
    _at_most(axes, -2.0 * largest - 0.5, 2.0 * largest + 0.5)
    axes.set_ylabel("error [deg]")


def _draw_sizes(axes: Axes, trajectories: Sequence[Trajectory]) -> None:
    for course in trajectories:
        size = np.degrees(np.where(course.distance < _SMALLEST, np.nan, course.distance))
        axes.plot(course.time, size, label=label(course), **line(course.label))
    logarithmic(axes.yaxis)
    axes.set_ylabel("|error| [deg]")


def draw_course(axes: Axes, time: Array, course: Array, shade: str, label: str = "") -> None:
    """Draw one course (T,) over time (T,) as it is held from sample to sample.

    A long one is a line of means in a pale band from least to largest: what jumps at every sample would fill an area.
    """
    parts = in_parts(course)
    if parts.shape[1] == 1:
        axes.step(time, course, color=shade, linewidth=1.0, where="post", label=label)
        return
    middle = in_parts(time).mean(axis=1)
    axes.fill_between(middle, parts.min(axis=1), parts.max(axis=1), color=shade, alpha=0.25, linewidth=0.0)
    axes.plot(middle, parts.mean(axis=1), color=shade, linewidth=1.2, label=label)


def in_parts(course: Array) -> Array:
    """Samples (T,) of a long course in parts (N, samples); samples that fill no part are left out.

    A short course is one sample a part.
    """
    size = len(course) // _COLUMNS if len(course) >= _SAMPLES_OF_PART * _COLUMNS else 1
    return course[: len(course) // size * size].reshape(-1, size)


def draw_sizes_of_errors(axes: Axes, trajectories: Sequence[Trajectory]) -> None:
    """Draw the size of each error [deg] over time [s] on a logarithmic axis.

    What nobody can measure is drawn as 0.001 deg, and the axis says so.
    """
    sizes = [np.degrees(course.distance) for course in trajectories]
    for course, size in zip(trajectories, sizes, strict=True):
        axes.plot(course.time, np.maximum(size, _LEAST_DEG), **line(course.label))
    logarithmic(axes.yaxis)
    largest = max(float(np.degrees(size_of(course.bend_ref)).max()) for course in trajectories)
    _at_most(axes, 0.5 * _LEAST_DEG, 2.0 * largest + 1.0)
    floored = any((size < _LEAST_DEG).any() for size in sizes)
    least = f"\n(less than {_LEAST_DEG:g} as {_LEAST_DEG:g})" if floored else ""
    axes.set(xlabel="time [s]", ylabel=f"|error| [deg]{least}")


def tensions(trajectory: Trajectory) -> Figure:
    """Tension per tendon [N] of both sides; below it the torque [N m] that is wanted and that of the tensions.

    Where tensions do not act as they are commanded (lag, steps, elastic tendons) both are drawn.
    On the right the last samples alone, so that tensions which jump at every tick can be told from a filled area.
    """
    picture, axes = figure(3, 2, height=6.0, sharex="col", sharey="row", width_ratios=(2, 1))
    acting = _apart(trajectory.acting, trajectory.tension)
    largest = max(
        float(np.nanmax(tensions_of_side))
        for tensions_of_side in (trajectory.tension, acting)
        if tensions_of_side is not None
    )
    end = float(trajectory.time[-1])
    close_up = slice(-_LAST, None), 1e3 * (trajectory.time - end)
    for column, (part, time) in zip(axes.T, ((slice(None), trajectory.time), close_up), strict=True):
        for panel, shade, side, tension in zip(column, (ORANGE, PURPLE), "+-", trajectory.tension.T, strict=False):
            draw_course(panel, time[part], tension[part], shade, f"tension of the {side} side")
        for panel, tension in zip(column, () if acting is None else acting.T, strict=False):
            panel.plot(*envelope(time[part], tension[part]), label="tension that acts", **THIN)
        draw_course(column[2], time[part], trajectory.torque_wanted[part], GREY, "torque wanted")
        draw_course(column[2], time[part], trajectory.torque[part], BLACK, "torque of the tensions")
    for panel, name in zip(axes[:, 0], ("tension [N]", "tension [N]", "torque [N m]"), strict=True):
        panel.set_ylabel(name)
    for panel in axes[:2, 0]:
        panel.set_ylim(0.0, 1.05 * largest)
    size = 2.0 * float(np.nanmax(np.abs(trajectory.torque), initial=1e-3))
    _at_most(axes[2, 0], -size, size)
    axes[2, 0].set_xlabel("time [s]")
    axes[2, 1].set_xlabel("to the end [ms]")
    title(axes[0, 0], label(trajectory))
    title(axes[0, 1], f"last {_LAST} samples")
    legend_below(picture, 2)
    return picture


def envelope(time: Array, course: Array) -> tuple[Array, Array]:
    """Envelope of a course (T,) that jumps at every sample: the least and largest value of each part."""
    samples_per_column = len(time) // _COLUMNS
    if samples_per_column < _SAMPLES_OF_PART:
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


def _draw_desired(axes: Axes, trajectories: Sequence[Trajectory]) -> None:
    """Draw the desired angle [deg] as a band behind the lines, and each other reference dotted."""
    wanted = trajectories[0].theta_desired
    axes.plot(trajectories[0].time, np.degrees(wanted), **WANTED)
    drawn = [wanted]
    for course in trajectories:
        if not any(np.allclose(course.theta_ref, earlier, atol=1e-6) for earlier in drawn):
            drawn.append(course.theta_ref)
            axes.plot(course.time, np.degrees(course.theta_ref), label="reference", **DOTTED)


def _at_most(axes: Axes, low: float, high: float) -> None:
    """Keep the y axis within low to high."""
    bottom, top = axes.get_ylim()
    axes.set_ylim(max(bottom, low), min(top, high))


def spread_of_sizes(repeated: Sequence[Repeated]) -> Part:
    """The part of `over_time` with the size of the error [deg]: the repetitions' median with its 95 % interval.

    A repetition that diverged counts as the largest error; with fewer than six there is no band.
    """

    def draw(axes: Axes, _: Sequence[Trajectory]) -> None:
        for loop in repeated:
            course = loop.first.trajectory
            errors = np.degrees(size_of(loop.errors.reshape(*loop.errors.shape[:2], -1)))
            median, low, high = spread_over_time(errors)
            style = line(course.label)
            label = course.label + (f", {loop.failed.sum()} failed" if loop.failed.any() else "")
            axes.plot(course.time, np.where(np.isfinite(median), median, np.nan), label=label, **style)
            axes.fill_between(course.time, low, high, color=style["color"], alpha=0.25, linewidth=0.0)
        axes.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
        axes.set_ylabel(f"median |error| of {len(repeated[0].errors)} [deg]")

    return draw


_PARTS: dict[str, Part] = {
    "angle": _draw_angles, "error": _draw_errors, "size": _draw_sizes, "measurable size": draw_sizes_of_errors,
}  # fmt: skip
