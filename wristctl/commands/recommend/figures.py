"""Figures of a recommendation: errors over simulated rigs, and how they grow with speed and payload."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.commands.recommend.answer import Limit, Recommended
from wristctl.commands.recommend.expected import spread
from wristctl.plotting.kinds import Dot, draw_dots
from wristctl.plotting.style import BLUE, GREY, VERMILLION, figure, logarithmic


def errors(result: Recommended) -> Figure:
    """Every candidate's error on each rig, with median and the ends of 95 % of rigs; crosses are rigs that it loses.

    What cannot be relied on is grey, as is what has no feedback. A rig on which the wrist fails has no error: its cross
    stands at the right edge.
    """
    ranked = result.ranking
    order = ranked.standing.order[::-1]
    picture, ((axes,),) = figure(height=1.3 + 0.3 * len(order))
    jitter = np.random.default_rng(0).uniform(-0.18, 0.18, ranked.count)
    sizes = [np.degrees(ranked.rows[k].rmse) for k in order]
    finite = np.concatenate([row[np.isfinite(row)] for row in sizes])
    edge = 1.3 * float(finite.max()) if finite.size else 1.0
    dots = list[Dot]()
    for place, (k, row) in enumerate(zip(order, sizes, strict=True)):
        failed = ~np.isfinite(row)
        lost, at = failed | ranked.rows[k].swings, np.where(failed, edge, row)
        unreliable = k in ranked.standing.unreliable
        shade = GREY if unreliable or not result.candidates[k].gains else BLUE
        axes.plot(at[~lost], (place + jitter)[~lost], ".", color=shade, markersize=2.5, alpha=0.5)
        axes.plot(at[lost], (place + jitter)[lost], "x", color=VERMILLION, markersize=4.5, zorder=3)
        low, median, high = (
            edge if not math.isfinite(error) else math.degrees(error) for error in spread(ranked.rows[k].rmse)
        )
        dots.append(Dot(place, median, shade, (low, high)))
    draw_dots(axes, dots, 2.0, 6.0)
    axes.set_yticks(range(len(order)), [result.candidates[k].label for k in order])
    logarithmic(axes.xaxis, (1.0, 2.0, 5.0))
    axes.set_xlabel("RMSE on a simulated rig [deg]\ncross: swings or chatters there; at the right edge: fails")
    return picture


def limits(result: Recommended) -> Figure:
    """Median error of the recommended gains over the sines' frequency and over the payload; crosses lose rigs."""
    picture, ((left, right),) = figure(1, 2, height=2.6)
    _limit(left, result.motions, f"frequency of {'an ellipse' if result.bending else 'a sine to both sides'} [Hz]")
    _limit(right, result.payloads, "unknown payload [kg]")
    left.set_ylabel("median RMSE [deg]")
    return picture


def _limit(axes: Axes, tried: Sequence[Limit], label: str) -> None:
    values, sizes = [limit.value for limit in tried], np.degrees([limit.error for limit in tried])
    axes.plot(values, sizes, color=BLUE, linewidth=1.2)
    for place, (limit, size) in enumerate(zip(tried, sizes, strict=True)):
        axes.plot([limit.value], [size], "x" if limit.lost else "o", color=VERMILLION if limit.lost else BLUE)
        if limit.lost:  # beside a line that rises: left of it above, where it begins right of it below
            beside: Any = {"xytext": (-4, 5), "ha": "right"} if place else {"xytext": (5, -11), "ha": "left"}
            text = f"{limit.lost} of {limit.rigs} lost"
            axes.annotate(text, (limit.value, size), textcoords="offset points", fontsize=8.0, **beside)
    axes.set_ylim(0.0, 1.2 * np.nanmax(sizes))
    axes.set_xlabel(label)
