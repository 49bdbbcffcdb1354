"""Figures of a ranking over worlds: intervals in order, and in how many worlds each row is how near to the best."""

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.tie_groups import performance_profiles
from wristctl.comparison.world_ranking import WorldRanking
from wristctl.plotting.style import BLACK, colour, figure, legend_below, line, logarithmic, title

_FACTORS, _SHOWN = np.geomspace(1.0, 30.0, 200), 6


def ranking_intervals(found: WorldRanking) -> Figure:
    """RMSE of each row with its interval, best on top; a bar joins ties, what has no place is grey, with the reason.

    Small dots are the worlds.
    """
    order = found.standing.order
    made, ((axes,),) = figure(height=0.8 + 0.28 * len(order))
    for place, at in enumerate(order):
        row, mean, group = found.rows[at], found.means[at], found.standing.group(at)
        own = "0.6" if group is None else colour(row.label.split("/")[0])
        worlds = np.degrees(row.rmse[np.isfinite(row.rmse)])
        axes.plot(worlds, np.full(len(worlds), place), ".", color=own, markersize=2.0, alpha=0.35)
        ends = np.degrees([[mean.value - mean.low], [mean.high - mean.value]])
        if np.isfinite(ends).all():
            axes.errorbar(np.degrees(mean.value), place, xerr=ends, color=own, capsize=3.0, linewidth=1.6)
        axes.plot(np.degrees(mean.value), place, "o", color=own, markersize=5.0, markeredgecolor=BLACK)
    first = 0
    for each in found.standing.groups:
        if len(each) > 1:
            axes.plot([1.015, 1.015], [first - 0.3, first + len(each) - 0.7], color=BLACK, linewidth=2.5,
                      transform=axes.get_yaxis_transform(), clip_on=False)  # fmt: skip
        first += len(each)
    labels = [found.rows[at].label + ("" if found.standing.group(at) else f" ({_why(found, at)})") for at in order]
    axes.set_yticks(range(len(order)), labels)
    axes.invert_yaxis()
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set_xlabel("RMSE [deg]")
    title(axes, f"{found.name}: geometric mean over {found.worlds} worlds with 95 % interval; a bar joins ties")
    return made


def _why(found: WorldRanking, at: int) -> str:
    """Why a row has no place."""
    fate = found.standing.fate(at)
    return "fails, swings or chatters" if fate == "unreliable" else fate


def world_profiles(found: WorldRanking) -> Figure:
    """Performance profiles: the share of worlds in which a row is within a factor of the best row there.

    Of many rows the best, and feedforward.
    """
    made, ((axes,),) = figure(height=3.8)
    shares = performance_profiles(np.array([row.rmse for row in found.rows]), _FACTORS)
    best = found.standing.order[:_SHOWN]
    for at in [*best, *({found.yardstick} - set(best))]:
        axes.plot(_FACTORS, 100.0 * shares[at], label=found.rows[at].label, **line(found.rows[at].label))
    axes.set_xscale("log")
    logarithmic(axes.xaxis)
    axes.set(xlabel="factor of the best row's RMSE", ylabel="worlds [%]", ylim=(0.0, 102.0), xlim=(1.0, _FACTORS[-1]))
    legend_below(made)
    return made
