"""The figure of a comparison's answer: every row in every class of conditions, and who cannot be relied on."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from wristctl.comparison.class_standing import ClassStanding
from wristctl.report.style import (
    BLACK,
    GREY,
    VERMILLION,
    colour,
    columns_within,
    figure,
    legend_under,
    logarithmic,
    title,
)

_BEST = "best, or tied with it"
_MARKS: dict[str, dict[str, Any]] = {
    _BEST: {"marker": "o", "markersize": 7.0, "markeredgecolor": BLACK},
    "ranked": {"marker": "o", "markersize": 4.5},
    "too few to tell": {"marker": "o", "markersize": 4.5, "markerfacecolor": "none"},
    "unreliable": {"marker": "x", "color": VERMILLION, "markersize": 6.0, "markeredgewidth": 1.8},
    "does not arrive": {"marker": "v", "color": GREY, "markersize": 5.5},
    "not physical": {"marker": "^", "color": GREY, "markersize": 5.5},
}
"""By what becomes of a row."""
_SHOWN = {"ranked": "behind it", "unreliable": "fails, swings or chatters"}


def answer_figure(found: Sequence[ClassStanding]) -> Figure:
    """RMSE [deg] of each row in each class, log, with its 95 % interval; rows from best to worst over all classes."""
    labels = _rows(found)
    columns = columns_within(len(found), 1.1)
    deep = -(-len(found) // columns)
    made, axes = figure(deep, columns, height=deep * (0.85 + 0.2 * len(labels)) + 0.95, sharey=True)
    for panel, each in zip(axes.ravel().tolist(), found, strict=False):
        _panel(panel, each, labels)
    for panel in axes.ravel().tolist()[len(found) :]:
        panel.set_visible(False)
    axes[0, 0].set_yticks(range(len(labels)), [label.removesuffix("/default") for label in labels])
    axes[0, 0].invert_yaxis()
    axes[-1, (columns - 1) // 2].set_xlabel("RMSE [deg]: geometric mean with 95 % interval", fontsize=9.0)
    plain: dict[str, Any] = {"linestyle": "none", "color": GREY}
    kinds = {_kind(each, row) for each in found for row in range(len(each.labels))}
    handles = [
        Line2D([], [], label=_SHOWN.get(name, name), **plain | mark) for name, mark in _MARKS.items() if name in kinds
    ]
    legend_under(made, handles, 3)
    return made


def _panel(panel: Axes, each: ClassStanding, labels: Sequence[str]) -> None:
    for row, label in enumerate(each.labels):
        mean, place, kind = each.means[row], labels.index(label), _kind(each, row)
        style = {"color": colour(label.split("/")[0])} | _MARKS[kind]
        ends = np.degrees([mean.low, mean.high])
        if np.isfinite(ends).all():
            panel.plot(ends, [place, place], color=style["color"], linewidth=1.4)
        panel.plot(np.degrees(mean.value), place, linestyle="none", **style)
    logarithmic(panel.xaxis)
    panel.set_ylim(-0.7, len(labels) - 0.3)
    panel.tick_params(axis="x", which="minor", labelbottom=False)
    panel.tick_params(axis="x", labelsize=7.5)
    title(panel, f"{fill(each.name, 12)}\n{each.cells}")


def _kind(each: ClassStanding, row: int) -> str:
    return _BEST if each.standing.group(row) == 1 else each.standing.fate(row)


def _rows(found: Sequence[ClassStanding]) -> list[str]:
    """Labels by their mean place over the classes."""
    places: dict[str, list[int]] = {}
    for each in found:
        for place, row in enumerate(each.standing.order):
            places.setdefault(each.labels[row], []).append(place)
    return sorted(places, key=lambda label: float(np.mean(places[label])))
