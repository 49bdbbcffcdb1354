"""Figures of searches for gains: how the swarm converges, and where its gains go."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from wristctl.arrays import Array
from wristctl.control.law import Gain
from wristctl.control.table import controller
from wristctl.plotting.style import BLACK, ORANGE, SKY, colour, figure, legend_below, logarithmic, title
from wristctl.tuning.objective import Judge
from wristctl.tuning.search import Search

# Share of the candidates that the axis of a search reaches, and its least height [decades].
_TYPICAL, _FLAT = 0.75, 0.05
# Factor by which gains are less or more.
_APART = 1.5
# Candidates beyond which their axis is logarithmic.
_LONG = 500


def convergence(searches: Sequence[Search]) -> Figure:
    """Best objective against the budget of each search; a thin line for each restart, a thick one for their median.

    Dots are candidates; the worst quarter of them may lie beyond the axis.
    """
    picture, ((axes,),) = figure(height=3.6)
    lowest, highest, last = np.inf, -np.inf, 1
    for search in searches:
        best, line_colour = search.best_so_far, colour(search.controller)
        budget = search.tried.values.shape[1] * np.arange(1, best.shape[1] + 1)
        if len(best) > 1:
            axes.plot(budget, best.T, color=line_colour, linewidth=0.6, alpha=0.6)
        complete = best[np.isfinite(best).all(axis=1)] if np.isfinite(best).all(axis=1).any() else best[:1]
        axes.plot(budget, np.median(complete, axis=0), color=line_colour, linewidth=1.6, label=search.controller)
        tried = search.tried.values
        axes.scatter(
            np.arange(1, tried.size + 1),
            tried.ravel(),
            s=4.0,
            color=line_colour,
            alpha=0.35,
            linewidths=0.0,
            zorder=1.5,
        )
        finite = tried[np.isfinite(tried)]
        lowest, highest, last = (
            min(lowest, finite.min(initial=lowest)),
            max(highest, np.quantile(finite, _TYPICAL) if finite.size else highest),
            max(last, tried.size),
        )
    if np.isfinite([lowest, highest]).all():
        margin = 0.05 * max(highest - lowest, _FLAT)
        axes.set_ylim(lowest - margin, highest + margin)
    below, above = axes.get_ylim()
    beyond = "" if below < 0.0 < above else " (0, beyond the axis)"
    axes.axhline(0.0, color=BLACK, linewidth=0.8, linestyle=":", label=f"feedforward{beyond}")
    if last > _LONG:
        axes.set_xscale("log")
    axes.set(xlabel="candidates tried [1]", ylabel="objective [decades beside feedforward]")
    legend_below(picture, 4)
    return picture


def gain_history(search: Search, gains: Mapping[str, Gain]) -> Figure:
    """Every gain over the iterations, on the decades of its search box: best so far, the swarm's median and 10-90 %."""
    picture, axes = figure(len(gains), 1, height=0.9 + 1.6 * len(gains), sharex=True)
    values, best = search.tried.values, _best_so_far(search)
    iterations = np.arange(1, len(values) + 1)
    for index, (panel, (name, gain)) in enumerate(zip(axes[:, 0], gains.items(), strict=True)):
        low, median, high = np.percentile(search.tried.gains[:, :, index], (10.0, 50.0, 90.0), axis=1)
        line_colour = colour(search.controller)
        panel.fill_between(
            iterations, low, high, color=line_colour, alpha=0.2, linewidth=0.0, label="10-90 % of the swarm"
        )
        panel.plot(iterations, median, color=line_colour, linewidth=1.0, linestyle=":", label="median of the swarm")
        panel.step(iterations, best[:, index], color=BLACK, where="post", label="best so far")
        logarithmic(panel.yaxis)
        panel.set(ylim=(gain.low / 1.5, gain.high * 1.5), ylabel=f"{name} [{gain.unit or '1'}]")
    axes[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[-1, 0].set_xlabel("iteration")
    title(axes[0, 0], f"Gains of {search.controller} in their search boxes")
    legend_below(picture)
    return picture


def _best_so_far(search: Search) -> Array:
    """Gains of the best candidate up to each iteration, (I, g)."""
    values = search.tried.values
    gains_of_least = search.tried.gains[np.arange(len(values)), values.argmin(axis=1)]
    least = np.minimum.accumulate(values.min(axis=1))
    better = np.concatenate([[True], least[1:] < least[:-1]])
    best_gains: Array = gains_of_least[np.maximum.accumulate(np.where(better, np.arange(len(least)), 0))]
    return best_gains


def tornado(name: str, gains: Mapping[str, float], judge: Judge) -> Figure:
    """The tornado of the gains found, judged as they were chosen."""
    law = controller(name)
    base = np.array(law.values(gains))
    tried = np.tile(base, (1 + 2 * len(base), 1))
    for index in range(len(base)):
        tried[1 + 2 * index, index] /= _APART
        tried[2 + 2 * index, index] *= _APART
    return gain_sensitivity(name, list(law.gains), _APART, judge(law, tried))


def gain_sensitivity(name: str, gains: Sequence[str], factor: float, values: Array) -> Figure:
    """A tornado: the objective [decades beside feedforward] where one gain is `factor` times less or more.

    `values` (1 + 2 g,) are of the gains found, then of each gain less and more; the most sensitive is on top.
    """
    nominal, less, more = values[0], values[1::2], values[2::2]
    order = np.argsort(np.maximum(np.abs(less - nominal), np.abs(more - nominal)))
    picture, ((axes,),) = figure(height=1.5 + 0.35 * len(gains))
    for side, shifted, shade in (("less", less, SKY), ("more", more, ORANGE)):
        axes.barh(
            range(len(gains)),
            shifted[order] - nominal,
            left=nominal,
            color=shade,
            label=f"{factor:g} times {side}",
            alpha=0.85,
        )
    axes.axvline(nominal, color=BLACK, linewidth=0.8)
    axes.set_yticks(range(len(gains)), [gains[index] for index in order])
    axes.set_xlabel("objective [decades beside feedforward]")
    title(axes, f"{name}: what one gain by itself does to the objective")
    legend_below(picture, 2)
    return picture
