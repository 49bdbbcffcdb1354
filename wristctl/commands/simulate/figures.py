"""Figures of one closed loop: over time, its sliding surface, its observer, and the wrist."""

from collections.abc import Mapping
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.commands.inputs_of_loops import tuned_gains
from wristctl.commands.session import Session
from wristctl.commands.truth_table import truth_heading
from wristctl.config.study import Study
from wristctl.control.law import Surface
from wristctl.control.table import controller, gains_of
from wristctl.plotting.bend_figure import bend_motion, line_of
from wristctl.plotting.loop_figures import in_parts, one_motion, over_time, spread_of_sizes, tensions
from wristctl.plotting.spatial_view import motion_in_space
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREY,
    LIGHT,
    VERMILLION,
    figure,
    legend,
    legend_below,
    logarithmic,
    title,
)
from wristctl.plotting.wrist_drawing import stroboscope
from wristctl.simulation.repetitions import Repeated
from wristctl.simulation.trajectory import Trajectory
from wristctl.simulation.worlds import plant_of
from wristctl.wrist.spatial.held_bends import reach_of_bends
from wristctl.wrist.tendon_layout import TendonLayout

# Least rate [deg/s] to either side, and least |sigma| over its layer, that are drawn.
_FIRST_RATE, _LEAST_SHARE = 1e-9, 1e-6


def sliding(course: Trajectory, surface: Surface, gains: Mapping[str, float]) -> Figure:
    """Left the error and its rate over the surface; right |sigma| over the width of its layer, log, over time [s].

    The rate is the one that the controller reads. What comes before sigma stays in the layer is drawn in vermillion.
    """
    a, b, c = surface.weights(gains)
    step = float(course.time[1] - course.time[0])
    wanted = np.gradient(course.theta_ref, step)
    rate = course.rate - wanted if surface.of_error else course.rate
    sigma = a * course.error + b * rate + c * np.cumsum(course.error) * step
    share = np.abs(sigma) / surface.layer(gains)
    outside = np.flatnonzero(share > 1.0)
    reached = int(outside[-1]) + 1 if len(outside) else 0
    fig, ((plane, over_time),) = figure(1, 2, height=3.2)
    error, speed = np.degrees(course.error), np.degrees(rate)
    span = np.array([error.min(), error.max()]) if np.ptp(error) > 0.0 else np.array([-1.0, 1.0])
    layer = np.degrees(surface.layer(gains) / abs(b))
    plane.fill_between(span, -a / b * span - layer, -a / b * span + layer, color=LIGHT, linewidth=0.0, label="layer")
    plane.plot(span, -a / b * span, color=BLACK, linewidth=1.0, label="surface, without its integral")
    plane.set_ylim(1.1 * min(speed.min(), -_FIRST_RATE), 1.1 * max(speed.max(), _FIRST_RATE))
    phases = [(slice(0, reached + 1), VERMILLION, "reaching"), (slice(reached, None), BLUE, "in the layer for good")]
    for phase, colour, label in phases[: 1 if reached >= len(share) else 2]:
        _draw_phase(plane, error[phase], speed[phase], colour, label)
        _draw_share(over_time, course.time[phase], np.maximum(share[phase], _LEAST_SHARE), colour)
    over_time.axhline(1.0, color=BLACK, linewidth=0.8)
    logarithmic(over_time.yaxis)
    plane.set(xlabel="error [deg]", ylabel="rate [deg/s]")
    over_time.set(xlabel="time [s]", ylabel="|sigma| / layer [1]")
    title(plane, course.label)
    legend_below(fig, 2)
    return fig


def _draw_phase(axes: Axes, error: Array, speed: Array, shade: str, name: str) -> None:
    """A path in the phase plane: pale as it is, and that of its means, so that what jumps fills no area."""
    axes.plot(error, speed, color=shade, linewidth=0.4, alpha=0.2)
    axes.plot(in_parts(error).mean(axis=1), in_parts(speed).mean(axis=1), color=shade, linewidth=1.2, label=name)


def _draw_share(axes: Axes, time: Array, share: Array, shade: str) -> None:
    """A positive course for a logarithmic axis: its medians in a pale band from least to largest."""
    parts, middle = in_parts(share), in_parts(time).mean(axis=1)
    axes.fill_between(middle, parts.min(axis=1), parts.max(axis=1), color=shade, alpha=0.25, linewidth=0.0)
    axes.plot(middle, np.median(parts, axis=1), color=shade, linewidth=1.2)


_NORMAL_95 = 1.96


def consistency(course: Trajectory, heading: str = "") -> Figure:
    """The observer's error [deg] in the band that it expects, and its estimate of the load torque [N m], over time."""
    assert course.seen is not None and course.load is not None
    error, band = np.degrees(course.seen - course.theta), _NORMAL_95 * np.degrees(course.expected)
    fig, axes = figure(2, 1, height=4.2, sharex=True)
    upper, lower = axes[:, 0]
    upper.axhspan(-band, band, color=GREY, alpha=0.35, linewidth=0.0, label="band of 95 % that the observer expects")
    upper.plot(course.time, error, color=VERMILLION, linewidth=1.0, label="observed less true angle")
    upper.set_ylabel("error [deg]")
    within = 100.0 * np.mean(np.abs(error) <= band)
    title(upper, f"{within:.0f} % in the band, RMS {course.consistency:.2g} times as expected")
    legend(upper, loc="upper right")
    lower.plot(course.time, course.load, color=BLUE, linewidth=1.0)
    lower.axhline(0.0, color=BLACK, linewidth=0.8, zorder=1.0)
    lower.set(xlabel="time [s]", ylabel="estimated load [N m]")
    title(lower, heading)
    return fig


def draw(session: Session, study: Study, repeated: Repeated) -> None:
    """Draw a motion in one plane over time, and for later its observer, its sliding surface and the wrist."""
    settings, findings, course = study.simulate, session.findings, repeated.first.trajectory
    world, later = truth_heading(study.wrist, settings.loop), partial(findings.figure, later=True)
    caption = "Bending angle, error and tensions over time; what changes faster is a band about its mean"
    findings.figure("course", one_motion, course, heading=world, caption=caption)
    if len(repeated.failed) > 1:
        caption = "Size of the error over time: the repetitions' median with its 95 % interval"
        findings.figure("error-repetitions", over_time, [course], spread_of_sizes([repeated]), caption=caption)
    for part, caption in (("angle", "Desired and obtained bending angle over time"), ("error", "Its error over time")):
        later(part, over_time, [course], part, heading=world, caption=caption)
    findings.figure("tensions", tensions, course, later=not repeated.marks)
    if course.load is not None:
        later("observer", consistency, course, heading=world)
    law = controller(settings.controller)
    if law.surface is not None and not repeated.failed.any():
        gains = dict(
            zip(law.gains, gains_of(law, settings.gains, tuned_gains(session.inputs), settings.loop), strict=True)
        )
        caption = "How the motion comes to the controller's sliding surface: phase plane, and sigma over time"
        later("sliding", sliding, course, law.surface, gains, caption=caption)
    later("motion", stroboscope, course, study.wrist, plant=settings.loop.plant.model)


def draw_bends(session: Session, study: Study, repeated: Repeated) -> None:
    """Draw a motion in two planes: the plane of bends with what the tendons reach, and the wrist in space."""
    wrist, loop, findings, course = study.wrist, study.simulate.loop, session.findings, repeated.first.trajectory
    world, reach = truth_heading(wrist, loop), reach_of_bends(wrist, TendonLayout.of(wrist))
    findings.overview.figure = "bends"
    bends = "Bend" if line_of(course.bend_ref) is not None else "The plane of bends with what the tendons reach"
    caption = f"{bends}; errors of both planes and pulls over time"
    findings.figure("bends", bend_motion, course, reach, world, caption=caption)
    caption = "The wrist in space where it is bent most, and the path of its tip, wanted and reached"
    findings.figure(
        "space", motion_in_space, course, plant_of(wrist, loop.plant), world, loop.plant.model, caption=caption
    )
