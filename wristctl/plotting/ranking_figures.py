"""Figures of a ranking over worlds: intervals in order, and in how many worlds each row is how near to the best."""

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.tie_groups import performance_profiles
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.plotting.style import BLACK, colour, figure, legend_below, line, logarithmic, title

_FACTORS, _SHOWN = np.geomspace(1.0, 30.0, 200), 6


def ranking_intervals(ranking: WorldRanking) -> Figure:
    """RMSE of each row with its interval, best on top; a bar joins ties, what has no place is grey, with the reason.

    Small dots are the worlds.
    """
    order = ranking.standing.order
    picture, ((axes,),) = figure(height=0.8 + 0.28 * len(order))
    for place, row_index in enumerate(order):
        row, mean, group = ranking.rows[row_index], ranking.means[row_index], ranking.standing.group(row_index)
        row_colour = "0.6" if group is None else colour(row.label.split("/")[0])
        worlds = np.degrees(row.rmse[np.isfinite(row.rmse)])
        axes.plot(worlds, np.full(len(worlds), place), ".", color=row_colour, markersize=2.0, alpha=0.35)
        ends = np.degrees([[mean.value - mean.low], [mean.high - mean.value]])
        if np.isfinite(ends).all():
            axes.errorbar(np.degrees(mean.value), place, xerr=ends, color=row_colour, capsize=3.0, linewidth=1.6)
        axes.plot(np.degrees(mean.value), place, "o", color=row_colour, markersize=5.0, markeredgecolor=BLACK)
    first = 0
    for group_rows in ranking.standing.groups:
        if len(group_rows) > 1:
            axes.plot([1.015, 1.015], [first - 0.3, first + len(group_rows) - 0.7], color=BLACK, linewidth=2.5,
                      transform=axes.get_yaxis_transform(), clip_on=False)  # fmt: skip
        first += len(group_rows)
    labels = [
        ranking.rows[row_index].label + ("" if ranking.standing.group(row_index) else f" ({_why(ranking, row_index)})")
        for row_index in order
    ]
    axes.set_yticks(range(len(order)), labels)
    axes.invert_yaxis()
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set_xlabel("RMSE [deg]")
    title(axes, f"{ranking.name}: geometric mean over {ranking.worlds} worlds with 95 % interval; a bar joins ties")
    return picture


def _why(ranking: WorldRanking, row_index: int) -> str:
    """Why a row has no place."""
    fate = ranking.standing.fate(row_index)
    return "fails, swings or chatters" if fate == "unreliable" else fate


def world_profiles(ranking: WorldRanking) -> Figure:
    """Performance profiles: the share of worlds in which a row is within a factor of the best row there.

    Of many rows the best, and feedforward.
    """
    picture, ((axes,),) = figure(height=3.8)
    shares = performance_profiles(np.array([row.rmse for row in ranking.rows]), _FACTORS)
    best = ranking.standing.order[:_SHOWN]
    for row_index in [*best, *({ranking.yardstick} - set(best))]:
        axes.plot(
            _FACTORS,
            100.0 * shares[row_index],
            label=ranking.rows[row_index].label,
            **line(ranking.rows[row_index].label),
        )
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set(xlabel="factor of the best row's RMSE", ylabel="worlds [%]", ylim=(0.0, 102.0), xlim=(1.0, _FACTORS[-1]))
    legend_below(picture)
    return picture
