"""Figures of rankings: errors at a glance, profiles, ratios to one baseline, and how probably one beats another."""

from collections import Counter
from collections.abc import Mapping, Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.colors import Normalize
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.comparison.bootstrap import penalised
from wristctl.comparison.controller_ranking import Ranking, labels_of, probability_of_less
from wristctl.comparison.tie_groups import performance_profiles
from wristctl.plotting.kinds import UNUSABLE, Dot, draw_cells, draw_dots, name_rows
from wristctl.plotting.style import (
    BLACK,
    GREY,
    SILVER,
    colour,
    columns_within,
    controller_in_words,
    figure,
    grid,
    legend_below,
    legend_under,
    line,
    logarithmic,
    numbered,
    title,
)

_FACTORS = np.geomspace(1.0, 30.0, 200)
# Controllers in one panel, at most.
_SHOWN = 7
# Marks of gains, and of further presets in their order.
_MARKS = {"default": "o", "printed": "v", "exchanged": "D", "tuned": "s"}
_FURTHER = ("^", "P", "h", "<", ">", "*")
# Width [in] of a figure from which controllers have room for words beside their names.
_ROOM = 6.0


def answer_figure(rankings: Sequence[Ranking], places: Mapping[str, str]) -> Figure:
    """RMSE [deg] of all controllers under every condition on one axis (log), each with its 95 % interval.

    A band is a condition, its best controller on top. Colours are controllers, marks their gains, and black crosses
    what must not be used. `places` are the words of each condition by the ranking's name.
    """
    most = max(len(ranking.labels) for ranking in rankings)
    labels = labels_of(rankings)
    marks = _marks(labels)
    picture, ((axes,),) = figure(height=1.4 + len(rankings) * (0.25 + 0.055 * most))
    for band, ranking in enumerate(rankings):
        dots = []
        for step, row in enumerate(ranking.standing.order):
            _, _, gains = ranking.labels[row].partition("/")
            dots.append(_dot(ranking, row, band + 0.9 * ((step + 0.5) / most - 0.5), {"marker": marks[gains]}))
        draw_dots(axes, dots, 1.0, 4.5)
        if band:
            axes.axhline(band - 0.5, color=SILVER, linewidth=0.8)
    axes.set_yticks(range(len(rankings)), [places[ranking.name] for ranking in rankings])
    axes.set_ylim(len(rankings) - 0.5, -0.5)
    axes.grid(False, axis="y")
    axes.tick_params(axis="y", length=0.0)
    numbered(axes.xaxis)
    wide = picture.get_figwidth() >= _ROOM
    axes.set_xlabel("RMSE [deg]: geometric mean with 95 % interval" if wide else "RMSE [deg], 95 % interval")
    every: dict[str, Any] = {"linestyle": "none", "markersize": 4.5}
    called = controller_in_words if wide else str
    names = dict.fromkeys(label.split("/")[0] for label in labels)
    alone = "o" if len(marks) > 1 else next(iter(marks.values()))
    handles = [Line2D([], [], marker=alone, color=colour(name), label=called(name), **every) for name in names]
    for gains, mark in marks.items() if len(marks) > 1 else ():  # hollow: a full grey mark is a controller
        words = f"{gains} gains" if gains else "preset by loop"
        handles.append(Line2D([], [], marker=mark, color=GREY, markerfacecolor="none", label=words, **every))
    if any(ranking.standing.unusable for ranking in rankings):
        handles.append(Line2D([], [], linestyle="none", label="must not be used", **UNUSABLE))
    legend_under(picture, handles, 3)
    return picture


def _dot(ranking: Ranking, row: int, place: float, mark: Mapping[str, Any], cases: bool = False) -> Dot:
    """Mean error of a row [deg] with its 95 % interval, and with those of its cases where they are asked for."""
    mean, scores = ranking.means[row], ranking.scores[row]
    points = np.degrees(scores[np.isfinite(scores)]) if cases else scores[:0]
    value, low, high = np.degrees([mean.value, mean.low, mean.high]).tolist()
    mark = UNUSABLE if row in ranking.standing.unusable else mark
    return Dot(place, value, colour(ranking.labels[row]), (low, high), points, mark)


def _marks(labels: Sequence[str]) -> dict[str, str]:
    """Mark of each kind of gains among the labels."""
    gains = list(dict.fromkeys(label.partition("/")[2] for label in labels))
    further = [name for name in gains if name not in _MARKS]
    marks = _MARKS | {name: _FURTHER[place % len(_FURTHER)] for place, name in enumerate(further)}
    return {name: marks[name] for name in gains}


def _panels(rankings: Sequence[Ranking], height: float, width: float, **shared: Any) -> tuple[Figure, list[Any]]:
    """A figure with a panel for each ranking."""
    columns = columns_within(len(rankings), width)
    picture, panels = grid(len(rankings), columns, height, **shared)
    for place, panel in enumerate(panels):
        panel.tick_params(axis="x", labelbottom=place + columns >= len(rankings))
    return picture, panels


def _label(panels: Sequence[Any], text: str) -> None:
    """A label below the middle of the last row of panels."""
    columns = panels[0].get_gridspec().ncols
    last = panels[(len(panels) - 1) // columns * columns :]
    last[(len(last) - 1) // 2].set_xlabel(text, loc="left" if len(last) < columns else "center")


def performance_profile(rankings: Sequence[Ranking], places: Mapping[str, str]) -> Figure:
    """Share of the cases in which each controller is within a factor of the best one there: a panel for each ranking.

    Drawn are the best two of each ranking and feedforward. What fails in a case is within no factor.
    """
    picture, panels = _panels(rankings, 1.9, 0.95, sharex=True, sharey=True)
    yardsticks = [one.labels[one.yardstick] for one in rankings if one.yardstick is not None]
    shown = list(dict.fromkeys([*_often_first(rankings)[: _SHOWN - 1], *yardsticks]))
    for panel, ranking in zip(panels, rankings, strict=True):
        scores = np.where(np.isfinite(ranking.scores), penalised(ranking.scores), np.inf)
        shares = performance_profiles(scores, _FACTORS)
        for label in shown:
            if label in ranking.labels:
                share = 100.0 * shares[ranking.labels.index(label)]
                panel.plot(_FACTORS, share, label=_called(label), **line(label))
        panel.set_xscale("log")
        panel.set_xticks([1.0, 3.0, 10.0, 30.0], ["1", "3", "10", "30"])
        panel.minorticks_off()
        panel.set(xlim=(1.0, _FACTORS[-1]), ylim=(0.0, 104.0))
        title(panel, places[ranking.name])
    _label(panels, "factor of the least RMSE in each case")
    panels[0].set_ylabel(f"{rankings[0].unit}s [%]")
    legend_below(picture)
    return picture


def _often_first(rankings: Sequence[Ranking]) -> list[str]:
    """Labels by the number of rankings in which nothing is better, then by their mean place."""
    first: Counter[str] = Counter()
    places: dict[str, list[int]] = {}
    for ranking in rankings:
        first.update(ranking.labels[row] for row in (ranking.standing.groups or [[]])[0])
        for place, row in enumerate(ranking.standing.order):
            places.setdefault(ranking.labels[row], []).append(place)
    return sorted(places, key=lambda label: (-first[label], float(np.mean(places[label]))))


def paired_ratios(rankings: Sequence[Ranking], baseline: str, places: Mapping[str, str]) -> Figure:
    """RMSE over that of one baseline, label controller/gains, in the same cases: a panel for each ranking that has it.

    A diamond is the geometric mean with its 95 % interval, a dot a case (Cumming's estimation plot). Black crosses must
    not be used. Left of the line is better than the baseline.
    """
    having = [ranking for ranking in rankings if baseline in ranking.labels]
    labels = _by_mean_ratio(having, baseline)
    picture, panels = _panels(having, 0.5 + 0.19 * len(labels), 0.95, sharex=True, sharey=True)
    for panel, ranking in zip(panels, having, strict=True):
        base = ranking.labels.index(baseline)
        scores, dots = penalised(ranking.scores), list[Dot]()
        for height, label in enumerate(labels):
            if label not in ranking.labels:
                continue
            row = ranking.labels.index(label)
            inverse = ranking.times_better(row, base)
            told = np.isfinite(inverse.high) and inverse.low > 0.0
            ends = (1.0 / inverse.high, 1.0 / inverse.low) if told else (np.nan, np.nan)
            mark = UNUSABLE if row in ranking.standing.unusable else {"marker": "D"}
            shade = colour(label)
            dots.append(Dot(height, 1.0 / inverse.value, shade, ends, scores[row] / scores[base], mark))
        draw_dots(panel, dots, size=3.5)
        panel.axvline(1.0, color=BLACK, linewidth=0.8)
        numbered(panel.xaxis, most=3)
        panel.minorticks_off()
        title(panel, places[ranking.name])
    panels[0].set_yticks(range(len(labels)), [_called(label) for label in labels])
    panels[0].set_ylim(len(labels) - 0.5, -0.5)
    _label(panels, f"RMSE over {_called(baseline)}'s [-]")
    marks: dict[str, Any] = {"linestyle": "none", "color": GREY}
    handles = [
        Line2D([], [], marker="D", markersize=3.5, label="geometric mean, 95 % interval", **marks),
        Line2D([], [], marker=".", markersize=4.0, label=f"a {having[0].unit}", **marks),
    ]
    if any(ranking.standing.unusable for ranking in having):
        handles.append(Line2D([], [], linestyle="none", label="must not be used", **UNUSABLE))
    legend_under(picture, handles, 3)
    return picture


def _by_mean_ratio(rankings: Sequence[Ranking], baseline: str) -> list[str]:
    """Labels by the mean logarithm of their ratio to the baseline, the least first; without the baseline itself."""
    ratios: dict[str, list[float]] = {}
    for ranking in rankings:
        base = ranking.of_label(baseline).value
        for label, mean in zip(ranking.labels, ranking.means, strict=True):
            if label != baseline:
                ratios.setdefault(label, []).append(np.log(mean.value / base))
    return sorted(ratios, key=lambda label: float(np.mean(ratios[label])))


def probability_of_better(ranking: Ranking, place: str) -> Figure:
    """Probability [%] that a controller (row) has less RMSE than another (column) in a case of this condition.

    It is the share of the cases; equal errors count half. Controllers from best to worst, without those that must not
    be used where two or more may.
    """
    order, bad = ranking.standing.order, ranking.standing.unusable
    usable = [row for row in order if row not in bad]
    order = usable if len(usable) > 1 else order
    shares = 100.0 * probability_of_less(ranking.scores)[np.ix_(order, order)]
    shares[np.tril_indices(len(order))] = np.nan  # what is below the diagonal follows from what is above
    shares = shares[:-1, 1:] if len(order) > 1 else shares
    names = [_called(ranking.labels[row]) for row in order]
    picture, ((axes,),) = figure(height=max(2.8, 1.5 + 0.28 * len(order)))

    def said(row: int, column: int) -> dict[str, Any]:
        return {"s": f"{shares[row, column]:.0f}", "fontsize": 7.5}

    room = picture.get_figwidth() / (len(order) + 5)
    drawn = draw_cells(axes, shares, "PuOr", Normalize(-40.0, 140.0), said if room > 0.24 else None)
    axes.set_xticks(range(shares.shape[1]), names[-shares.shape[1] :], rotation=90.0)
    axes.set_yticks(range(shares.shape[0]), names[: shares.shape[0]])
    title(axes, f"{place}, {ranking.cases}")
    wide = picture.get_figwidth() >= _ROOM
    bar = picture.colorbar(
        drawn,
        ax=axes,
        pad=0.02,
        label="row is better [%]",
        location="right" if wide else "bottom",
        aspect=20 + 10 * wide,
    )
    (bar.ax.set_ylim if wide else bar.ax.set_xlim)(0.0, 100.0)
    return picture


def ranking_intervals(ranking: Ranking) -> Figure:
    """RMSE of each row with its interval, best on top; a bar joins ties, black crosses must not be used.

    Small dots are the worlds.
    """
    order = ranking.standing.order
    picture, ((axes,),) = figure(height=0.8 + 0.28 * len(order))
    width = picture.get_figwidth()
    draw_dots(axes, [_dot(ranking, row, k, {"markeredgecolor": BLACK}, cases=True) for k, row in enumerate(order)])
    first = 0
    for group_rows in ranking.standing.groups:
        if len(group_rows) > 1:
            axes.plot([1.015, 1.015], [first - 0.3, first + len(group_rows) - 0.7], color=BLACK, linewidth=2.5,
                      transform=axes.get_yaxis_transform(), clip_on=False)  # fmt: skip
        first += len(group_rows)
    name_rows(axes, [_called(ranking.labels[row]) for row in order])
    logarithmic(axes.xaxis)
    axes.set_xlabel("RMSE [deg]")
    title(axes, fill(f"{ranking.name}, {ranking.cases}: a bar joins what cannot be told apart", round(9 * width)))
    return picture


def _called(label: str) -> str:
    return label.removesuffix("/default") if label.startswith("feedforward/") else label
