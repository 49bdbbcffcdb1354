"""Figures of an identification: measured and expected angles and tensions, what is left over, what depends on what."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from wristctl.identification.fit import Fit
from wristctl.identification.friction_fit import FrictionFit
from wristctl.identification.intervals import Knowledge
from wristctl.identification.measured_trials import BOTH, PLANES, MeasuredTrial
from wristctl.plotting.kinds import draw_cells
from wristctl.plotting.style import BLACK, BLUE, GREY, THIN, VERMILLION, figure, legend, legend_below, title

# Trials drawn, spread over all of them.
_SHOWN = 8
_LAGS = 30


def angles(fit: Fit) -> Figure:
    """Measured angles and the model's at the frames [deg], and the difference, of up to eight trials; of bends four."""
    trials = fit.problem.trials
    two = trials[0].direction == BOTH
    chosen = sorted(set(np.linspace(0, len(trials) - 1, min(len(trials), _SHOWN // (1 + two))).round().astype(int)))
    height = max(2.6, 0.7 + (1.35 + 0.45 * two) * len(chosen))
    picture, axes = figure(len(chosen), 2, height=height, sharex=True, width_ratios=(3, 2))
    drawn = [fit.residuals[index][readings] for index in chosen for readings, *_ in _channels(trials[index])]
    most = 1.05 * float(np.degrees(np.abs(np.concatenate(drawn)).max()))
    titles = _short([trials[index].label for index in chosen])
    for (left, right), index, text in zip(axes, chosen, titles, strict=True):
        trial = trials[index]
        for readings, modelled, remaining, name in _channels(trial):
            time, angle = trial.captured[readings], np.degrees(trial.angle[readings])
            residual = np.degrees(fit.residuals[index][readings])
            left.plot(time, angle, ".", color=GREY, markersize=2.5, label="measured" if two else "marker")
            left.plot(time, angle - residual, color=modelled, linewidth=1.0, label=name)
            right.plot(time, residual, ".", color=remaining, markersize=2.0)
        right.axhline(0.0, color=BLACK, linewidth=0.8)
        right.set_ylim(-most, most)
        left.set_ylabel("bend [deg]" if two else "angle [deg]")
        title(left, text)
    title(axes[0, 1], "difference [deg]")
    for panel in axes[-1]:
        panel.set_xlabel("time [s]")
    legend_below(picture)
    return picture


def _channels(trial: MeasuredTrial) -> list[tuple[Any, str, str, str]]:
    """Readings of one angle each: which they are, colours of the model and of the difference, name of the model."""
    if trial.direction != BOTH:
        return [(slice(None), BLUE, VERMILLION, "model")]
    shades = zip(PLANES, (BLUE, VERMILLION), strict=True)
    return [(trial.of(k), shade, shade, f"model, {plane}") for k, (plane, shade) in enumerate(shades)]


def _short(labels: Sequence[str]) -> list[str]:
    """Labels `RUN, TRIAL` as titles of narrow panels: of several runs their last six letters, of one run none."""
    parts = [label.rpartition(", ") for label in labels]
    alike = len({run for run, _, _ in parts}) == 1
    return [trial if alike or not run else f"{run[-6:]}, {trial}" for run, _, trial in parts]


def residuals(fit: Fit, knowledge: Knowledge) -> Figure:
    """Distribution of the residuals [deg] beside a normal one, and their autocorrelation with its 95 % band."""
    picture, ((left, right),) = figure(1, 2, height=3.0)
    every = np.degrees(np.concatenate(fit.residuals))
    sd = np.degrees(fit.noise)
    left.hist(every, bins=60, density=True, color=GREY, label=f"residuals, sd {sd:.3f} deg")
    grid = np.linspace(-4.0 * sd, 4.0 * sd, 200)
    normal = np.exp(-0.5 * (grid / sd) ** 2) / (sd * np.sqrt(2.0 * np.pi))
    left.plot(grid, normal, color=BLACK, linewidth=1.0, label="normal")
    left.set(xlabel="marker less model [deg]", ylabel="density [1/deg]")
    left.margins(y=0.3)
    legend(left, loc="upper left")
    lags = np.arange(1, _LAGS + 1)
    power = sum(float(residual @ residual) for residual in fit.residuals)
    alike = [
        sum(float(residual[lag:] @ residual[:-lag]) for residual in fit.residuals if len(residual) > lag) / power
        for lag in lags
    ]
    band = 1.96 / np.sqrt(len(every))
    right.axhspan(-band, band, color=GREY, alpha=0.3, linewidth=0.0, label="95 % of white noise")
    right.vlines(lags, 0.0, alike, color=VERMILLION)
    right.set(xlabel="lag [frames]", ylabel="autocorrelation")
    title(right, f"worth {knowledge.effective:.0f} independent frames of {len(every)}")
    legend(right, loc="upper right")
    return picture


def correlations(fit: Fit, knowledge: Knowledge) -> Figure:
    """Correlations of the estimates."""
    names = fit.problem.free
    matrix = knowledge.correlation[: len(names), : len(names)]
    picture, ((axes,),) = figure(width=5.6, height=4.8)
    image = draw_cells(axes, matrix, "RdBu_r", Normalize(-1.0, 1.0), lambda row, at: {"s": f"{matrix[row, at]:.2f}"})
    axes.set_xticks(range(len(names)), names, rotation=30, ha="right")
    axes.set_yticks(range(len(names)), names)
    picture.colorbar(image, label="correlation")
    title(axes, f"condition number {knowledge.condition:.3g}")
    return picture


def measured(fit: FrictionFit) -> Figure:
    """A measured loop, after its first turn, and the fitted model: the angle over what drove it, less that of the same
    wrist without friction where spools did; tensions over the angle; and what is left over, in time."""
    problem, loop, rows = fit.problem, fit.problem.loop, len(fit.residuals)
    picture, axes = figure(rows, 2, height=0.8 + 2.4 * rows, width_ratios=(3, 2))
    time, samples = loop.time[problem.first :], problem.measured
    model = [sample - residual for sample, residual in zip(samples, fit.residuals, strict=True)]
    driver = loop.drive[problem.first :, 0]
    if loop.winch:
        lines = [(driver, np.degrees(samples[0]), driver, np.degrees(model[0]), "+ tension [N]", "angle [deg]")]
    else:
        free, mm = fit.without_friction, 1e3 * driver
        ylabel = "angle less that\nwithout friction [deg]"
        lines = [(mm, np.degrees(samples[0] - free), mm, np.degrees(model[0] - free), "+ spool [mm]", ylabel)]
    for side, number in (("+", 1), ("-", 2)):
        if number < rows:
            drawn = np.degrees(samples[0]), samples[number], np.degrees(model[0]), model[number]
            lines.append((*drawn, "angle [deg]", f"{side} tension [N]"))
    for (left, right), (x, y, model_x, model_y, below, beside), residual in zip(
        axes, lines, fit.residuals, strict=True
    ):
        left.plot(x, y, ".", color=GREY, markersize=2.5, label="measured")
        left.plot(model_x, model_y, color=BLUE, linewidth=1.0, label="model, fitted")
        left.set(xlabel=below, ylabel=beside)
        scale = 1.0 if "tension" in beside else 180.0 / np.pi
        right.plot(time, scale * residual, ".", color=VERMILLION, markersize=2.0)
        right.axhline(0.0, **THIN)
        right.set(xlabel="time [s]", ylabel="left over [N]" if "tension" in beside else "left over [deg]")
    legend_below(picture)
    return picture
