"""Error over the size of what disturbs: how far a law holds, where loops differ by one number alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.combinations import ComparedRow
from wristctl.comparison.comparison_data import metrics_of
from wristctl.config.keys import field_at, unit_of
from wristctl.config.loop import Loop
from wristctl.report.style import figure, legend_below, line, logarithmic, title

_FEWEST = 3
"""Sizes from which on there is a course to draw."""


def series_of_sizes(loops: Mapping[str, Loop]) -> dict[str, dict[str, float]]:
    """Leaves in which at least three loops differ by a number and by nothing else: their sizes by name of the loop."""
    flat = {name: _leaves(loop.model_dump(), "") for name, loop in loops.items()}
    found: dict[str, dict[str, float]] = {}
    leaves = dict.fromkeys(leaf for each in flat.values() for leaf in each)
    for leaf in leaves:
        rest: dict[Any, dict[str, float]] = {}
        for name, each in flat.items():
            if isinstance(each.get(leaf), int | float) and not isinstance(each[leaf], bool):
                others = tuple(sorted((key, repr(value)) for key, value in each.items() if key != leaf))
                rest.setdefault(others, {})[name] = float(each[leaf])
        longest = max(rest.values(), key=len, default={})
        if len(set(longest.values())) >= _FEWEST:
            found[leaf] = dict(sorted(longest.items(), key=lambda pair: pair[1]))
    return found


def error_over_disturbance(results: Sequence[ComparedRow], leaf: str, sizes: Mapping[str, float]) -> Figure:
    """RMSE [deg], log, of each row over a leaf of the loop, medians over motions; a line ends where the row fails."""
    made, ((axes,),) = figure(height=3.6)
    for label in dict.fromkeys(each.label for each in results):
        errors = []
        for loop in sizes:
            own = [each for each in results if each.label == label and each.loop == loop]
            failed = any(each.repeated.failed.any() for each in own)
            errors.append(np.nan if failed else np.median([metrics_of(each)["rmse"] for each in own]))
        axes.plot(list(sizes.values()), np.degrees(errors), marker="o", markersize=3.5, label=label, **line(label))
    logarithmic(axes.yaxis)
    axes.set(xlabel=f"{leaf} [{_unit(leaf)}]", ylabel="RMSE [deg]")
    title(axes, f"error over {leaf}")
    legend_below(made)
    return made


def _unit(leaf: str) -> str:
    _, field = field_at(("simulate", "loop", *leaf.split(".")))
    return (unit_of(field) if field is not None else "") or "1"


def _leaves(node: Mapping[str, Any], begin: str) -> dict[str, Any]:
    """Leaves of nested mappings by their key paths."""
    found: dict[str, Any] = {}
    for key, value in node.items():
        found |= _leaves(value, f"{begin}{key}.") if isinstance(value, Mapping) else {f"{begin}{key}": value}
    return found
