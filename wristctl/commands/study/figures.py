"""Figures of a study of all laws: who is best where, what terms buy, what accuracy costs, and world by world."""

from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

from wristctl.arrays import Array
from wristctl.comparison.bootstrap import plain
from wristctl.comparison.controller_ranking import labels_of
from wristctl.comparison.tuned_ranking import TermValue
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.plotting.kinds import Dot, draw_cells, draw_dots, draw_front, name_rows
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREY,
    SILVER,
    VERMILLION,
    colour,
    columns_within,
    figure,
    grid,
    headed,
    legend_below,
    logarithmic,
    numbered,
    title,
)

_COLOURS = "RdYlBu"
# Letters of what is best, and of what must not be used.
_LOOKS = {"best": {"fontweight": "bold"}, "unusable": {"fontstyle": "italic"}}
# Letters of a heading in an inch.
_LETTERS = 12
_AXES = (("chattering", "total variation of tension [N/s]"), ("energy", "work on the wrist [J]"))


def laws_by_rig(rankings: Mapping[str, WorldRanking]) -> Figure:
    """Feedforward's RMSE over each controller's on each family: bold where nothing is better, slanted if not usable."""
    labels = labels_of(rankings.values())
    times, kinds = np.full((len(labels), len(rankings)), np.nan), np.full((len(labels), len(rankings)), "", object)
    for column, ranking in enumerate(rankings.values()):
        for index, label in enumerate(ranking.labels):
            place, group = (labels.index(label), column), ranking.standing.group(index)
            times[place] = ranking.gains[index].value
            kinds[place] = "best" if group == 1 else "" if group else "unusable"
    order = np.argsort(-np.nanmean(np.log(times), axis=1), kind="stable")
    fig, ((axes,),) = figure(height=1.2 + 0.27 * len(labels))
    most = max(2.0, float(np.nanmax(times)))

    def said(row: int, column: int) -> dict[str, Any]:
        return {"s": plain(times[order[row], column]), **_LOOKS.get(kinds[order[row], column], {})}

    draw_cells(axes, times[order], _COLOURS, LogNorm(1.0 / most, most), said)
    axes.set_xticks(range(len(rankings)), [_short(name) for name in rankings])
    axes.set_yticks(range(len(labels)), [labels[line] for line in order])
    axes.xaxis.tick_top()
    heading = "How many times less RMSE than feedforward; bold: nothing is better; slanted: must not be used"
    headed(fig, heading)
    return fig


def _short(name: str) -> str:
    """Name of a family above a narrow column."""
    return name.replace(", steps", "\n(steps)")


def terms_by_rig(values: Sequence[TermValue]) -> Figure:
    """RMSE without each term over RMSE with it, with its interval, a panel for each family; grey where 1 is within."""
    families, terms = (list(dict.fromkeys(getattr(value, name) for value in values)) for name in ("family", "term"))
    fig, every = grid(len(families), columns_within(len(families), 0.8), 0.5 + 0.27 * len(terms), sharey=True)
    panels = dict(zip(families, every, strict=True))
    for term_value in values:
        place, times, edge = terms.index(term_value.term), term_value.times, {"markeredgecolor": BLACK}
        shade = SILVER if times.is_one else BLUE if times.value > 1.0 else VERMILLION
        dot = Dot(place, times.value, shade, (times.low, times.high), mark=edge)
        draw_dots(panels[term_value.family], [dot], 3.0)
    for family, panel in panels.items():
        panel.axvline(1.0, color=BLACK, linewidth=0.8)
        numbered(panel.xaxis, most=3)
        title(panel, _short(family))
    name_rows(every[0], terms)
    label = "times less RMSE, with 95 % interval; grey: cannot be told"
    fig.supxlabel(fill(label, round(_LETTERS * fig.get_figwidth())), fontsize=10.0)
    return fig


def pareto(ranking: WorldRanking) -> Figure:
    """RMSE over variation of tension and over work: a line joins the rows that no other beats in both.

    Rows that fail, swing or chatter too often, hollow, are left out where they lie far off.
    """
    fig, ((left, right),) = figure(1, 2, height=4.6, sharey=True)
    rmse = np.degrees([mean.value for mean in ranking.means])
    for axes, (metric, label) in zip((left, right), _AXES, strict=True):
        _front(axes, ranking.medians(metric), rmse, ranking)
        axes.set_xlabel(label)
    left.set_ylabel("RMSE [deg]")
    heading = f"{ranking.name}: error and its price; hollow: must not be used"
    headed(fig, heading)
    legend_below(fig, 4)
    return fig


def _front(axes: Axes, cost: Array, rmse: Array, ranking: WorldRanking) -> None:
    sound = np.array([ranking.standing.group(row) is not None for row in range(len(rmse))])
    draw_front(axes, cost, rmse, sound, {"color": GREY, "linewidth": 1.0, "zorder": 1})
    for index in ranking.standing.order:
        shade = colour(ranking.labels[index])
        axes.plot(cost[index], rmse[index], "o", color=shade, markersize=6.0, linestyle="none",
                  markerfacecolor=shade if sound[index] else "none", label=ranking.rows[index].label)  # fmt: skip
    logarithmic(axes.xaxis)
    logarithmic(axes.yaxis)
    axes.tick_params(axis="x", which="both", labelrotation=45)  # within a decade powers of ten stand close
    if sound.any():
        axes.set_xlim(cost[sound].min() / 1.5, cost[sound].max() * 1.5)
        axes.set_ylim(rmse[sound].min() / 1.3, rmse[sound].max() * 1.3)


def world_map(ranking: WorldRanking) -> Figure:
    """RMSE of each row over the least one in each world; worlds sorted by the least. Crosses fail, dots swing."""
    scores = np.array([row.rmse for row in ranking.rows])
    best = np.where(np.isfinite(scores), scores, np.inf).min(axis=0)
    worlds, rows = np.argsort(best, kind="stable"), np.array(ranking.standing.order)
    fig, ((axes,),) = figure(height=max(2.6, 1.3 + 0.22 * len(rows)))  # room for the label of its colours
    ratios = (scores / best)[np.ix_(rows, worlds)]
    drawn = draw_cells(axes, np.where(np.isfinite(ratios), ratios, np.nan), "viridis_r", LogNorm(1.0, 10.0))
    failed = np.argwhere(~np.isfinite(ratios))
    swings = np.argwhere(np.array([row.swings for row in ranking.rows])[np.ix_(rows, worlds)] & np.isfinite(ratios))
    for places, mark in ((failed, "x"), (swings, ".")):
        axes.plot(places[:, 1], places[:, 0], mark, color=VERMILLION, markersize=2.5, linestyle="none")
    axes.set_yticks(range(len(rows)), [ranking.rows[index].label for index in rows])
    axes.set_xlabel(f"{ranking.count} worlds, the easiest first")
    fig.colorbar(drawn, ax=axes, label="RMSE over the least one there [-]", extend="max")
    title(axes, f"{ranking.name}: world by world; x fails, a dot swings")
    return fig
