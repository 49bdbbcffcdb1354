"""Figures of searches for gains: how the swarm converges, and where its gains go."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.control.law import Gain
from wristctl.report.style import BLACK, colour, figure, legend_below, logarithmic, title
from wristctl.tuning.search import Search


def convergence(searches: Sequence[Search]) -> Figure:
    """Objective over the iterations (log): best so far and the swarm's median, for each controller.

    The median has a gap where at least half of the candidates failed.
    """
    made, ((axes,),) = figure(height=3.6)
    for search in searches:
        label = f"{search.controller}, best so far ({search.objective:.4g})"
        axes.plot(_iterations(search), search.best_so_far, color=colour(search.controller), label=label)
    for search in searches:
        median, label = np.median(search.values, axis=1), f"{search.controller}, median of the swarm"
        axes.plot(_iterations(search), median, ":", color=colour(search.controller), linewidth=1.0, label=label)
    logarithmic(axes.yaxis)
    axes.xaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set(xlabel="iteration", ylabel="objective [1]")
    legend_below(made, 2)
    return made


def gain_history(search: Search, gains: Mapping[str, Gain]) -> Figure:
    """Every gain over the iterations, on the decades of its search box: best so far, the swarm's median and 10-90 %."""
    made, axes = figure(len(gains), 1, height=0.9 + 1.6 * len(gains), sharex=True)
    iterations, best = _iterations(search), _best_so_far(search)
    for at, (panel, (name, gain)) in enumerate(zip(axes[:, 0], gains.items(), strict=True)):
        low, median, high = np.percentile(search.tried[:, :, at], (10.0, 50.0, 90.0), axis=1)
        own = colour(search.controller)
        panel.fill_between(iterations, low, high, color=own, alpha=0.2, linewidth=0.0, label="10-90 % of the swarm")
        panel.plot(iterations, median, color=own, linewidth=1.0, linestyle=":", label="median of the swarm")
        panel.step(iterations, best[:, at], color=BLACK, where="post", label="best so far")
        logarithmic(panel.yaxis)
        panel.set(ylim=(gain.low / 1.5, gain.high * 1.5), ylabel=f"{name} [{gain.unit or '1'}]")
    axes[-1, 0].xaxis.set_major_locator(MaxNLocator(integer=True))
    axes[-1, 0].set_xlabel("iteration")
    title(axes[0, 0], f"Gains of {search.controller} in their search boxes")
    legend_below(made)
    return made


def _iterations(search: Search) -> NDArray[np.int_]:
    """Numbers of the iterations, from 1."""
    return np.arange(1, len(search.values) + 1)


def _best_so_far(search: Search) -> Array:
    """Gains of the best candidate up to each iteration, (I, g)."""
    each = search.tried[_iterations(search) - 1, search.values.argmin(axis=1)]
    least = search.best_so_far
    better = np.concatenate([[True], least[1:] < least[:-1]])
    found: Array = each[np.maximum.accumulate(np.where(better, np.arange(len(least)), 0))]
    return found
