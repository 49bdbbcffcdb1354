"""Figures of a linearised loop: Bode plot, sensitivity, step response, root locus, and the phase portrait."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    DOTTED,
    GREY,
    LIGHT,
    ORANGE,
    SKY,
    VERMILLION,
    figure,
    legend,
    legend_below,
    logarithmic,
    title,
)
from wristctl.stability.loop_analysis import LoopAnalysis, RootLocus
from wristctl.stability.margins import amplified, carried
from wristctl.stability.phase_portrait import PhasePortrait
from wristctl.stability.sampled_loop import Complex

_COLOURS = (SKY, ORANGE, VERMILLION, BLUE, GREY)
_TURN = 2.0 * np.pi
# Lines of the eigenvalues of a transfer in two planes, which often lie on each other.
_DASHES = ("-", (0, (2, 2)))
# Loop gain, and frequency [Hz], below which nothing is drawn.
_LEAST, _SLOWEST = 1e-4, 0.02


def bode(analyses: Sequence[LoopAnalysis], angles: Sequence[float], heading: str) -> Figure:
    """Magnitude and phase of the loop's transfer over frequency [Hz], a line for each resting angle [deg].

    Dots are where the gain is 1 and where the phase is -180 deg. A loop that feeds nothing back is shown as its plant:
    angle per torque. In two planes lines are the two eigenvalues of the transfer, the second one dashed.
    """
    fig, axes = figure(2, 1, height=5.2, sharex=True)
    gain, phase = axes[:, 0]
    alone = all(loop.is_open for loop in analyses)
    for analysis, angle, style in zip(analyses, angles, _styles(len(analyses)), strict=True):
        frequency, shown = _frequencies(analysis)
        loci = analysis.plant_loci if alone else analysis.loci
        for response, dashes, label in zip(loci, _DASHES, (f"at {angle:g} deg", None), strict=False):
            gain.plot(frequency[shown], np.abs(response)[shown], label=label, linestyle=dashes, **style)
            phase.plot(frequency[shown], _phase(response)[shown], linestyle=dashes, **style)
        if not alone:
            _mark(gain, analysis, style["color"])
    logarithmic(gain.xaxis)
    logarithmic(gain.yaxis)
    gain.set_ylabel("angle per torque [rad/(N m)]" if alone else "loop gain")
    phase.set(xlabel="frequency [Hz]", ylabel="phase [deg]")
    if not alone:
        gain.axhline(1.0, **DOTTED)
        phase.axhline(-180.0, **DOTTED)
        gain.set_ylim(bottom=max(_LEAST, gain.get_ylim()[0]))
    low, high = phase.get_ylim()
    phase.set_yticks(np.arange(90.0 * np.floor(low / 90.0), high + 90.0, 90.0 * max(1, round((high - low) / 540.0))))
    phase.set_ylim(low, high)
    title(gain, heading)
    legend(gain, loc="lower left")
    return fig


def _mark(axes: Axes, analysis: LoopAnalysis, colour: str) -> None:
    limits = [limit for limit in (analysis.margins.least, analysis.margins.most) if 0.0 < limit.value < np.inf]
    axes.plot([limit.omega / _TURN for limit in limits], [1.0 / limit.value for limit in limits], "o", color=colour)
    crossed = [crossing.omega / _TURN for crossing in analysis.margins.gain_crossings]
    axes.plot(crossed, np.ones(len(crossed)), "s", color=colour, markersize=4.0)


def _frequencies(analysis: LoopAnalysis) -> tuple[Array, NDArray[np.bool_]]:
    """Frequencies [Hz], and a mask of those that are drawn."""
    frequency = analysis.omega / _TURN
    return frequency, frequency >= min(_SLOWEST, 0.1 * frequency[-1])


def _phase(response: Complex) -> Array:
    """Degrees, without jumps, begun within half a turn of 0."""
    unwrapped = np.degrees(np.unwrap(np.angle(response)))
    return np.asarray(unwrapped - 360.0 * np.round(unwrapped[0] / 360.0))


def _styles(count: int) -> list[dict[str, Any]]:
    """One for each angle, the later ones thinner: they lie close together, and none must hide another."""
    return [{"color": _COLOURS[k % len(_COLOURS)], "linewidth": 1.0 + 1.2 * (count - 1 - k)} for k in range(count)]


def sensitivity(analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Figure:
    """|S| = |1/(1 + L)| and |T| = |L/(1 + L)| over frequency [Hz]; in two planes largest singular values."""
    fig, ((axes,),) = figure(height=3.2)
    for analysis, angle, style in zip(analyses, angles, _styles(len(analyses)), strict=True):
        frequency, shown = _frequencies(analysis)
        for name, of_transfer, dashes in (("S", amplified, "-"), ("T", carried, "--")):
            drawn = of_transfer(analysis.transfer)[shown]
            axes.plot(frequency[shown], drawn, linestyle=dashes, label=f"{name} at {angle:g} deg", **style)
    axes.axhline(1.0, **DOTTED)
    logarithmic(axes.xaxis)
    logarithmic(axes.yaxis)
    axes.set_ylim(bottom=max(1e-3, axes.get_ylim()[0]))
    axes.set(xlabel="frequency [Hz]", ylabel="amplification")
    legend_below(fig, 2)
    return fig


def step(analyses: Sequence[LoopAnalysis], angles: Sequence[float]) -> Figure:
    """The angle after a small step of the reference, as a share of it, over time [s], where the loop is stable."""
    fig, ((axes,),) = figure(height=3.2)
    lasts = 0.0
    for analysis, angle, style in zip(analyses, angles, _styles(len(analyses)), strict=True):
        if analysis.margins.stable:
            axes.plot(analysis.step.time, analysis.step.angle, label=f"at {angle:g} deg", **style)
            lasts = max(lasts, 2.0 * analysis.step.settling, 5.0 * analysis.step.rise)
    axes.axhline(1.0, **DOTTED)
    axes.set_xlim(0.0, lasts)
    axes.set(xlabel="time [s]", ylabel="angle / step")
    legend(axes, loc="lower right")
    return fig


# Times the frequencies of most poles beyond which the highest ones are drawn closer together.
_FAR = 20.0


def locus(root_locus: RootLocus, least_growth: float = -60.0) -> Figure:
    """Poles as the gain grows: decay or growth [1/s] and frequency [Hz]; black rings stand for the loop as it is.

    Where a pole that turns over at every tick lies far above the others, high frequencies are drawn closer together.
    """
    fig, ((axes,),) = figure(height=4.2)
    points = np.concatenate([poles for poles in root_locus.poles if len(poles)])
    shades = np.concatenate([np.full(len(p), f) for f, p in zip(root_locus.factors, root_locus.poles, strict=True)])
    current = root_locus.poles[len(root_locus.factors) // 2]
    near = np.log10(shades)
    shown = axes.scatter(points[:, 0], points[:, 1], c=near, s=8.0, cmap="viridis", linewidths=0.0)
    axes.scatter(current[:, 0], current[:, 1], s=42.0, facecolors="none", edgecolors=BLACK, label="as it is")
    axes.axvline(0.0, color=VERMILLION, linewidth=1.0)
    left = max(least_growth, float(points[:, 0].min())) if len(points) else least_growth
    right = max(5.0, min(float(points[:, 0].max()), -left)) if len(points) else 5.0
    axes.set_xlim(1.05 * left, 1.05 * right)
    inside = points[(points[:, 0] > 1.05 * left) & (points[:, 0] < 1.05 * right)]
    highest, usual = inside[:, 1].max(initial=1.0), np.quantile(inside[:, 1], 0.9) if len(inside) else 1.0
    if highest > _FAR * usual:
        axes.set_yscale("asinh", linear_width=max(float(usual), 1.0))
    axes.set_ylim(-0.02 * highest if highest <= _FAR * usual else -0.2 * max(usual, 1.0), 1.05 * highest)
    axes.set(xlabel="growth [1/s]; left of 0 it decays", ylabel="frequency [Hz]")
    bar = fig.colorbar(shown, ax=axes, label="log10 of the gain's factor")
    bar.ax.tick_params(labelsize=9.0)
    over = "the loop's gain" if root_locus.over == "loop" else root_locus.over
    title(axes, f"Root locus over {over}")
    legend_below(fig)
    return fig


def portrait(phase_portrait: PhasePortrait) -> Figure:
    """Error and its rate of the nonlinear loop, over the sliding surface (black) and its boundary layer (grey).

    Vermillion until a course has come into the layer for good, blue from then on.
    """
    fig, ((axes,),) = figure(height=4.2)
    for course in phase_portrait.courses:
        error, rate = np.degrees(course.error), np.degrees(course.rate)
        points = np.stack([error, rate], axis=1)
        late = course.time >= (course.reached if np.isfinite(course.reached) else np.inf)
        colours = np.where(late[1:], BLUE, VERMILLION)
        axes.add_collection(LineCollection(list(np.stack([points[:-1], points[1:]], axis=1)), colors=list(colours)))
        axes.plot(error[:1], rate[:1], "o", color=BLACK, markersize=4.0)
    axes.autoscale()
    low, high = axes.get_xlim()
    bottom, top = axes.get_ylim()
    across = np.array([low, high])
    line, layer = -phase_portrait.slope * across, np.degrees(phase_portrait.layer)
    axes.fill_between(across, line - layer, line + layer, color=LIGHT, linewidth=0.0, zorder=0.5)
    axes.plot(across, line, color=BLACK, linewidth=1.0, label="sliding surface, without its integral")
    for colour, label in ((VERMILLION, "reaching"), (BLUE, "within the layer for good")):
        axes.plot([], [], color=colour, label=label)
    axes.set(xlim=(low, high), ylim=(bottom, top), xlabel="error [deg]", ylabel="error rate [deg/s]")
    legend_below(fig, 3)
    return fig
