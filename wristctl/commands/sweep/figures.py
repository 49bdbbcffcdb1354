"""Figures of a sweep: metrics over what was set."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from wristctl.plotting.style import BLUE, GREY, VERMILLION, columns_within, figure, logarithmic, with_unit

if TYPE_CHECKING:
    import pandas as pd

# Sections of the commands that can be swept.
_COMMANDS = ("simulate", "tune", "compare")
# Range beyond which an axis is logarithmic; places at which a line of medians is drawn.
_DECADES, _BINS = 20.0, 25
# Median over largest value below which swept values crowd at the small ones.
_EVEN = 0.25
# Ticks of an axis of swept values, at most.
_TICKS = 5
# Width of a panel [in] that has room for the name of a setting.
_PANEL = 2.2


def over_key(
    table: pd.DataFrame, key: str, other_keys: Sequence[str], metrics: Sequence[str], units: Mapping[str, str]
) -> Figure:
    """Metrics over one key: a dot for each rollout, crosses where the wrist failed, a line of medians.

    What else was swept spreads the dots.
    """
    columns = columns_within(min(2, max(1, len(metrics))), _PANEL)
    rows = max(1, -(-len(metrics) // columns))
    picture, axes = figure(rows, columns, height=0.4 + 2.3 * rows, sharex=True)
    values = table[key].to_numpy()
    named = values.dtype.kind not in "if"
    places, labels = (
        (np.unique(values.astype(str), return_inverse=True)[::-1]) if named else (values.astype(float), None)
    )
    failed = table["failed"].to_numpy(bool) if "failed" in table else np.zeros(len(table), bool)
    panels = [panel for row in axes.tolist() for panel in row]
    for panel, name in zip(panels, metrics, strict=False):
        heights = table[name].to_numpy(float)
        panel.plot(places[~failed], heights[~failed], ".", color=BLUE, markersize=3.0, alpha=0.6)
        panel.plot(places[failed], heights[failed], "x", color=VERMILLION, markersize=4.0)
        _medians(panel, places[~failed], heights[~failed])
        panel.set_ylabel(with_unit(name, units[name]))
        if _is_wide(heights):
            logarithmic(panel.yaxis)
    for panel in axes[-1]:
        panel.set_xlabel(with_unit(_setting(key), units[key]))
        if labels is not None:
            panel.set_xticks(range(len(labels)), labels, rotation=30, ha="right")
        elif _is_logarithmic(places):
            logarithmic(panel.xaxis)
        else:
            panel.xaxis.set_major_locator(MaxNLocator(_TICKS))
    for panel in panels[len(metrics) :]:
        panel.set_visible(False)
    spread = f"; {', '.join(other_keys)} as swept" if other_keys else ""
    crosses = "; crosses left their range" if failed.any() else ""
    picture.suptitle(f"over {_setting(key)}{spread}{crosses}", fontsize=10.0)
    return picture


def _setting(key: str) -> str:
    """The name of a setting without the command's section: `loop.control_period`."""
    section, _, rest = key.partition(".")
    return rest if section in _COMMANDS and rest else key


def _is_wide(values: np.ndarray) -> bool:
    finite = values[np.isfinite(values)]
    return bool(finite.size and finite.min() > 0.0 and finite.max() / finite.min() > _DECADES)


def _is_logarithmic(values: np.ndarray) -> bool:
    """Whether values reach over decades and were not drawn evenly."""
    return _is_wide(values) and bool(np.median(values) < _EVEN * values.max())


def _medians(panel: Axes, places: np.ndarray, heights: np.ndarray) -> None:
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
    panel.plot(*np.array(line).T, color=GREY, linewidth=1.2)
