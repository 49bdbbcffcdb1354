"""Kinds of figures that several commands draw: dots with intervals, what accuracy costs, maps of numbers."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Normalize
from matplotlib.image import AxesImage

from wristctl.arrays import Array
from wristctl.comparison.controller_ranking import undominated
from wristctl.plotting.style import BLACK, undress

# Mark of what must not be used: in black, which is no controller's colour.
UNUSABLE: dict[str, Any] = {"marker": "x", "color": BLACK, "markersize": 4.5, "markeredgewidth": 1.2}
# Weights of red, green and blue in the lightness of a colour.
_LIGHTNESS = (0.299, 0.587, 0.114)


class Dot(NamedTuple):
    """A value in one row of a figure, and what is known of it."""

    place: float
    """Height of the row."""
    value: float
    shade: str
    ends: tuple[float, float] = (np.nan, np.nan)
    """Of its interval."""
    points: Array = np.empty(0)
    """What the value is of, (N,)."""
    mark: Mapping[str, Any] = {}
    """What is other than a full circle of its shade."""


def draw_dots(axes: Axes, dots: Sequence[Dot], width: float = 1.6, size: float = 5.0) -> None:
    """Draw values as dots with lines for their intervals, `width` points wide, and small dots for what they are of.

    Beside small dots an interval has its ends marked.
    """
    for place, value, shade, ends, points, mark in dots:
        if len(points):
            axes.plot(points, np.full(len(points), place), ".", color=shade, markersize=2.5, alpha=0.4)
        if np.isfinite(ends).all():
            axes.plot(ends, [place, place], color=shade, linewidth=width, marker="|" if len(points) else "")
        axes.plot(value, place, **{"marker": "o", "color": shade, "markersize": size, "linestyle": "none", **mark})


def name_rows(axes: Axes, names: Sequence[str]) -> None:
    """Name the rows of a figure, the first one on top."""
    axes.set_yticks(range(len(names)), names)
    axes.invert_yaxis()


def draw_front(axes: Axes, cost: Array, error: Array, sound: Array, style: Mapping[str, Any]) -> None:
    """Draw the line through the points (N,) that no other beats in both cost and error, of those that are `sound`."""
    front = np.flatnonzero(sound)[undominated(np.column_stack([cost, error])[sound])]
    front = front[np.argsort(cost[front])]
    axes.plot(cost[front], error[front], **style)


def draw_cells(
    axes: Axes, values: Array, cmap: str, norm: Normalize, text: Callable[[int, int], Mapping[str, Any]] | None = None
) -> AxesImage:
    """Draw numbers (R, C) as coloured cells, the first row on top, nothing where they are nan.

    `text` gives the words in a cell, as keywords of a text, by row and column; they are white on dark ground.
    """
    undress(axes)
    drawn = axes.imshow(values, cmap=cmap, norm=norm, aspect="auto")
    dark = drawn.to_rgba(np.nan_to_num(values))[..., :3] @ np.array(_LIGHTNESS) < 0.5
    for row, column in np.argwhere(np.isfinite(values)).tolist() if text else ():
        style = {"ha": "center", "va": "center", "color": "w" if dark[row, column] else "k", "fontsize": 8.5}
        axes.text(column, row, **style | dict(text(row, column)))  # type: ignore[misc]
    return drawn
