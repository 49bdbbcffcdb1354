"""Figures of a sweep: metrics over what was set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from wristctl.commands.quantities import Quantity
from wristctl.commands.sweep.answer import FAILED, fates, least
from wristctl.plotting.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILLION,
    columns_within,
    figure,
    headed,
    legend_below,
    logarithmic,
)

if TYPE_CHECKING:
    import pandas as pd

# Range beyond which an axis is logarithmic; places at which a line of medians is drawn.
_DECADES, _BINS = 20.0, 25
# Median over largest value below which swept values crowd at the small ones.
_EVEN = 0.25
# Ticks of an axis of swept values, at most.
_TICKS = 5
# Colours of lines: as many values as a second key may have to have lines.
_HUES = (BLUE, ORANGE, GREEN, PURPLE, SKY, BLACK)
_DOT: dict[str, Any] = {"markersize": 6.0}
_RING: dict[str, Any] = {"markersize": 7.0, "fillstyle": "none"}
_CROSS: dict[str, Any] = {"markersize": 5.0, "clip_on": False}
# Width of a panel [in] that has room for the name of a setting.
_PANEL = 2.2


def over_setting(
    table: pd.DataFrame, key: Quantity, other_keys: Sequence[Quantity], metrics: Sequence[Quantity]
) -> Figure:
    """Metrics over one setting, under the answer in words.

    Where one further one was swept over few values, each of these has a line; else all else that was swept spreads the
    dots, and a line runs through their medians. Rings and crosses mark rollouts that are no good; a failed one is of
    no error, and its cross stands at the upper edge.
    """
    columns = columns_within(min(2, max(1, len(metrics))), _PANEL)
    rows = max(1, -(-len(metrics) // columns))
    picture, axes = figure(rows, columns, height=0.6 + 2.3 * rows, sharex=True)
    values = key.cell(table[key.name].to_numpy())
    labels = list(dict.fromkeys(map(str, values))) if values.dtype.kind not in "if" else None
    places = values.astype(float) if labels is None else np.array([labels.index(str(value)) for value in values], float)
    fate = table["fate"].to_numpy(str) if "fate" in table else np.full(len(table), "")
    failed = table["failed"].to_numpy(bool) if "failed" in table else np.zeros(len(table), bool)
    bad = (fate != "") & ~failed
    lines = _lines(table, other_keys)
    panels = [panel for row in axes.tolist() for panel in row]
    for panel, metric in zip(panels, metrics, strict=False):
        heights = np.where(failed, np.nan, metric.cell(table[metric.name].to_numpy(float)))
        for (label, chosen), hue in zip(lines, _HUES, strict=False):
            panel.plot(places[chosen], heights[chosen], ".", color=hue, label=label, **_DOT)
            if labels is None:
                _medians(panel, places[chosen], heights[chosen], hue if label else GREY)
        if bad.any():
            panel.plot(places[bad], heights[bad], "o", color=VERMILLION, **_RING)
        if failed.any():
            edge = panel.get_xaxis_transform()
            panel.plot(places[failed], np.ones(failed.sum()), "x", color=VERMILLION, transform=edge, **_CROSS)
        panel.set_ylabel(metric.head)
        if _is_wide(heights):
            logarithmic(panel.yaxis)
    for panel in axes[-1]:
        panel.set_xlabel(key.head)
        if labels is not None:
            panel.set_xticks(range(len(labels)), labels, rotation=30, ha="right")
            panel.margins(x=0.1)
        elif _is_wide(places) and np.median(places) < _EVEN * places.max():  # over decades, and not drawn evenly
            logarithmic(panel.xaxis)
        else:
            panel.xaxis.set_major_locator(MaxNLocator(_TICKS))
    for panel in panels[len(metrics) :]:
        panel.set_visible(False)
    if len(lines) > 1:
        legend_below(picture)
    headed(picture, _heading(table, [key, *other_keys], metrics, len(lines) > 1))
    return picture


def _lines(table: pd.DataFrame, other_keys: Sequence[Quantity]) -> list[tuple[str, NDArray[np.bool_]]]:
    """Names and rows of what has a line of its own: each value of the other key; else one without a name for all."""
    whole = [("", np.ones(len(table), bool))]
    if len(other_keys) != 1:
        return whole
    (key,) = other_keys
    values = list(dict.fromkeys(table[key.name]))
    if not 1 < len(values) <= len(_HUES):
        return whole
    return [(f"{key.words} = {key.said(value)}", (table[key.name] == value).to_numpy()) for value in values]


def _heading(table: pd.DataFrame, keys: Sequence[Quantity], metrics: Sequence[Quantity], lined: bool) -> str:
    """Where the main metric is least, and the meaning of dots, line, rings and crosses."""
    parts = [least(table, keys, metrics[0])] if metrics else []
    if len(keys) > 1 and not lined:
        line = ", line: median" * (table[keys[0].name].dtype.kind in "if")
        parts.append(f"dots: {', '.join(key.words for key in keys[1:])} as swept{line}")
    marks = fates(table)
    crosses = marks.pop(FAILED, 0)
    if marks:
        parts.append(f"rings: {', '.join(marks)}")
    if crosses:
        parts.append("crosses: left the range")
    return "; ".join([*parts, "less is better"])


def _is_wide(values: np.ndarray) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0.0 and finite.max() / finite.min() > _DECADES)


def _medians(panel: Axes, places: np.ndarray, heights: np.ndarray, hue: str) -> None:
    finite = np.isfinite(heights)
    places, heights = places[finite], heights[finite]
    if not places.size:
        return
    distinct = np.unique(places)
    edges = distinct if len(distinct) <= _BINS else np.quantile(distinct, np.linspace(0.0, 1.0, _BINS + 1))
    group = (
        np.searchsorted(edges, places, side="right") - 1 if len(distinct) > _BINS else np.searchsorted(edges, places)
    )
    levels = np.unique(group)
    line = [(float(np.median(places[group == level])), float(np.median(heights[group == level]))) for level in levels]
    panel.plot(*np.array(line).T, color=hue, linewidth=1.2)
