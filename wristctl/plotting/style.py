"""One look for all figures: plain axes, units on every axis, colours that colour-blind readers tell apart.

Figures are made without pyplot, so drawing leaves no state behind and needs no display.
"""

import math
import zlib
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from textwrap import fill
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.axis import Axis
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.text import Text
from matplotlib.ticker import LogFormatterSciNotation, LogLocator, MaxNLocator, NullFormatter
from numpy.typing import NDArray

from wristctl.config.former_names import label_today

BLACK, GREY, SILVER, LIGHT = "#000000", "#7F7F7F", "#C8C8C8", "#D9D9D9"
ORANGE, SKY, GREEN = "#E69F00", "#56B4E9", "#009E73"
# Okabe and Ito's colours without the yellow, which is lost on white; black is kept for what is wanted.
BLUE, VERMILLION, PURPLE = "#0072B2", "#D55E00", "#CC79A7"
# Colours of tendons by their numbers, from the first.
TENDON_COLOURS = (BLUE, VERMILLION, ORANGE, PURPLE, GREY, BLACK)
# From Tol's muted scheme, for what Okabe and Ito's eight do not reach.
INDIGO, WINE, OLIVE, ROSE = "#332288", "#882255", "#999933", "#CC6677"

# Width of a figure [in]; text is 9 to 10 points.
WIDTH = 7.0

# Colour of each controller, and what it is, in words that stand beside its name.
_CONTROLLERS = {
    "smc": (BLUE, "sliding mode"),
    "pid": (VERMILLION, ""),
    "mrac": (ORANGE, "model reference adaptive"),
    "gvsc": (SKY, "variable strain"),
    "nc": (PURPLE, "neuro-controller"),
    "smc-tracking": (INDIGO, "tracking sliding mode"),
    "super-twisting": (WINE, ""),
    "computed-torque": (GREEN, ""),
    "feedforward": (GREY, "open loop"),
    "ct-dob": ("#1b7837", "computed torque, observer"),
    "mpc": ("#8c510a", "model predictive"),
    "clf-qp": ("#01665e", "control Lyapunov function"),
    "adrc": ("#c51b7d", "disturbance rejection"),
    "lqi": ("#35978f", "linear quadratic"),
    "nn-mrac": ("#bf812d", "adaptive network"),
    "impedance": ("#80cdc1", "impedance, network"),
    "fopi": ("#d6604d", "fractional PI"),
    "ilc": ("#dfc27d", "iterative learning"),
    "pd-ff": ("#9970ab", "PD, feedforward"),
    "pid-ff": ("#a020c8", "PID, feedforward"),
    "pid-dob": ("#4575b4", "PID, observer"),
    "smc-dob": ("#762a83", "sliding mode, observer"),
}
_OTHERS = (OLIVE, BLACK, ROSE)
# Line style of the desired angle: a band behind the lines. Long lines are drawn in pieces, so it must hide its own.
WANTED: dict[str, Any] = {"color": SILVER, "linewidth": 5.0, "zorder": 1.9, "label": "desired"}
# Line style of what differs a little from a line beside it: seen, not so; acting, not commanded.
THIN: dict[str, Any] = {"color": BLACK, "linewidth": 0.7}
DOTTED: dict[str, Any] = {"color": BLACK, "linewidth": 1.0, "linestyle": ":"}
SIMULATED: dict[str, Any] = {"linewidth": 1.0, "linestyle": ":"}
DISTORTED: dict[str, Any] = {"color": GREY, "linewidth": 0.8, "linestyle": ":"}
STRAIGHT: dict[str, Any] = {"color": BLUE, "linewidth": 1.0}
_DASHES: dict[str, Any] = {
    "tuned": "-",
    "default": "-",
    "hardware": (0, (9, 1)),
    "exchanged": (0, (5, 1.5)),
    "printed": (0, (1.2, 1.2)),
    "initial": (0, (5, 1.5, 1.2, 1.5)),
}
_OTHER_DASHES = (0, (8, 1.5, 1.2, 1.5, 1.2, 1.5))
_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")
_LEGEND: dict[str, Any] = {"fontsize": 9.0, "frameon": False, "handlelength": 2.4}


# Width [in] that figures are drawn for now; None: their own.
_PAPER: ContextVar[float | None] = ContextVar("_PAPER", default=None)
# Scale of letters in a column of a page, and the width [in] below which a figure fills a column.
_SMALLEST, _PRINTED = 0.72, 6.0
# Letters of a heading to an inch.
_LETTERS_OF_HEADING = 12.5
# Mean width of a letter of a title [in]; height of a legend's row [in], and rows that figures have room for.
_LETTER, _ROW, _ROWS = 0.076, 0.19, 2
# Width [in] of a figure that axes in one column, and axes side by side, leave to labels.
_BESIDE_ONE, _BESIDE_SEVERAL = 0.5, 1.5


@contextmanager
def for_paper(width: float | None) -> Iterator[None]:
    """Within the block figures are laid out for this width [in], with letters as a journal prints them."""
    token = _PAPER.set(width)
    try:
        yield
    finally:
        _PAPER.reset(token)


def columns_within(wanted: int, panel_width: float) -> int:
    """Number of panels side by side, where one panel needs `panel_width` [in] beside 1.5 in for names."""
    return max(1, min(wanted, int(((_PAPER.get() or WIDTH) - 1.5) / panel_width)))


def fit(picture: Figure) -> None:
    """Give a figure that was laid out for a narrow column letters and marks of that size."""
    width = _PAPER.get()
    if width is None or width >= _PRINTED:
        return
    for text in picture.findobj(Text):
        text.set_fontsize(_SMALLEST * float(text.get_fontsize()))
    for axes in picture.axes:
        for axis in (axes.xaxis, axes.yaxis):
            for which in ("major", "minor"):
                size = axis.get_tick_params(which).get("labelsize", 9.0)
                axis.set_tick_params(which=which, labelsize=_SMALLEST * float(size))
    for drawn in picture.findobj(Line2D):
        drawn.set_linewidth(_SMALLEST * drawn.get_linewidth())
        drawn.set_markersize(_SMALLEST * drawn.get_markersize())


def figure(
    rows: int = 1, cols: int = 1, *, width: float = WIDTH, height: float | None = None, **subplots: Any
) -> tuple[Figure, NDArray[np.object_]]:
    """A figure of width x height [in] and its axes, always as an array (rows, cols).

    `subplots` goes to Figure.subplots: sharex, sharey, width_ratios, height_ratios. Without a height every
    row gets 0.55 of its axes' width, at least 1.8 in.
    """
    paper = _PAPER.get()
    tall = rows * max(1.8, 0.55 * width / cols) if height is None else height
    if paper is not None:
        tall, width = tall * max(0.85, min(1.0, paper / width)), paper
    picture = Figure(figsize=(width, tall), layout="constrained")
    axes = picture.subplots(rows, cols, squeeze=False, **subplots)
    for panel in axes.flat:  # set on the axes itself: ticks are made when drawn, outside any rc context
        panel.spines[["top", "right"]].set_visible(False)
        panel.tick_params(which="both", labelsize=9.0)
        panel.grid(True, color=LIGHT, linewidth=0.6)
        panel.set_axisbelow(True)
    return picture, axes


def grid(count: int, columns: int, height: float, **options: Any) -> tuple[Figure, list[Axes]]:
    """A figure of so many panels, in as many columns at most, each row so high [in] beside 0.9 in for labels.

    Places that are left over are hidden. `options` are those of `figure`.
    """
    columns = max(1, min(columns, count))
    rows = -(-count // columns)
    picture, axes = figure(rows, columns, height=0.9 + rows * height, **options)
    panels: list[Axes] = axes.ravel().tolist()
    for panel in panels[count:]:
        panel.set_visible(False)
    return picture, panels[:count]


def undress(axes: Axes) -> None:
    """No grid, frame or tick marks: for drawings and images."""
    axes.grid(False)
    axes.spines[:].set_visible(False)
    axes.tick_params(which="both", length=0.0)


class PowersOfTen(LogFormatterSciNotation):
    """Powers of ten such as 10⁻³ as plain text: to parse them as formulas takes longer than to draw all the rest."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        formula: str = super().__call__(x, pos)
        plain = formula.replace(r"$\mathdefault{", "").replace(r"\times", "\u00d7").replace("}$", "").rstrip("}")
        base, _, power = plain.removesuffix("\u00d710^{0").partition("^{")
        return base + power.translate(_RAISED)


def logarithmic(axis: Axis, steps: Sequence[float] = ()) -> None:
    """Give an axis a logarithmic scale in powers of ten, or of plain numbers with these steps within a decade."""
    axis.axes.set(**{f"{axis.axis_name}scale": "log"})  # type: ignore[attr-defined]  # XAxis and YAxis have it
    if steps:
        axis.set_major_locator(LogLocator(subs=steps))
    axis.set_major_formatter("{x:g}" if steps else PowersOfTen())
    axis.set_minor_formatter(NullFormatter() if steps else PowersOfTen())


class Numbered(LogLocator):
    """Powers of ten; where fewer than two are in sight, 1, 2 and 5 times these, or round numbers of a narrow range."""

    def tick_values(self, vmin: float, vmax: float) -> Sequence[float]:
        """Places of ticks within a range, and beside it."""
        low, high = sorted((vmin, vmax))
        if low <= 0.0 or not math.isfinite(high):
            return super().tick_values(vmin, vmax)
        first, last = math.floor(math.log10(low)), math.ceil(math.log10(high))
        powers = [10.0**power for power in range(first, last + 1)]
        if len(_within(powers, low, high)) >= 2:
            return super().tick_values(vmin, vmax)
        steps = _within([step * power for power in powers for step in (1.0, 2.0, 5.0)], low, high)
        return steps if len(steps) >= 2 else _within(MaxNLocator(3).tick_values(low, high), low, high)


def _within(places: Sequence[float], low: float, high: float) -> list[float]:
    return [place for place in places if low <= place <= high]


class Numbers(PowersOfTen):
    """Powers of ten, and plain numbers between them."""

    def __init__(self) -> None:
        super().__init__(minor_thresholds=(math.inf, math.inf))  # every tick of its locator has a number

    def __call__(self, x: float, pos: int | None = None) -> str:
        if 1e-3 <= x < 1e5 and not np.isclose(np.log10(x) % 1.0, (0.0, 1.0), atol=1e-9).any():
            return f"{x:g}"
        return super().__call__(x, pos)


def numbered(axis: Axis, most: int | None = None) -> None:
    """Give an axis a logarithmic scale of whose ticks two at least have numbers, however narrow its range is.

    Of powers of ten it has at most `most`, and none of the small ticks between them has a number.
    """
    logarithmic(axis)
    axis.set_major_locator(Numbered(numticks=most))
    axis.set_major_formatter(Numbers())
    axis.set_minor_formatter(NullFormatter())


def title(axes: Axes, text: str) -> None:
    """A title at the left edge, no larger than the labels, in as many lines as its axes' width needs."""
    if place := axes.get_subplotspec():
        ratios = np.array(place.get_gridspec().get_width_ratios() or np.ones(place.get_gridspec().ncols), float)
        share = float(ratios[place.colspan.start : place.colspan.stop].sum() / ratios.sum())
        picture = axes.get_figure()
        width = picture.get_figwidth() if isinstance(picture, Figure) else WIDTH
        room = share * (width - (_BESIDE_ONE if share == 1.0 else _BESIDE_SEVERAL))
        letters = max(1, int(room / (_LETTER * _letters(width))))
        text = "\n".join(
            fill(part, letters, break_long_words=False, break_on_hyphens=False) for part in text.split("\n")
        )
    axes.set_title(text, loc="left", fontsize=10.0)


def headed(picture: Figure, text: str) -> None:
    """A heading over all axes of a figure at its left edge, in as many lines as its width needs."""
    letters = round(_LETTERS_OF_HEADING * picture.get_figwidth())
    picture.suptitle(fill(text, letters), fontsize=10.0, x=0.01, ha="left")


def with_unit(name: str, unit: str) -> str:
    """A quantity's label; what has no unit is a name alone."""
    return name if unit in ("", "1") else f"{name} [{unit}]"


def legend(axes: Axes, **options: Any) -> None:
    """A frameless legend inside the axes."""
    axes.legend(**_LEGEND | options)


def legend_below(figure: Figure, columns: int = 3) -> None:
    """One legend for all axes of a figure, below them, each label once."""
    legends = [axes.get_legend_handles_labels() for axes in figure.axes]
    handles = {label: handle for pair in legends for handle, label in zip(*pair, strict=True)}
    legend_under(figure, list(handles.values()), columns, list(handles))


def legend_under(figure: Figure, handles: Sequence[Any], columns: int, labels: Sequence[str] | None = None) -> None:
    """A legend of these below a figure's axes, in as many columns as there is room for.

    Figures have room for two rows; for each further one the figure grows, so that its axes keep their height.
    """
    if not handles:
        return
    names = list(labels) if labels else [str(handle.get_label()) for handle in handles]
    scale = _letters(figure.get_figwidth())
    room = int(figure.get_figwidth() / (0.075 * scale * (max(map(len, names)) + 8.3)))
    side_by_side = max(1, min(columns, len(handles), room))
    further = max(0, -(-len(handles) // side_by_side) - _ROWS)
    figure.set_figheight(figure.get_figheight() + _ROW * scale * further)
    figure.legend(list(handles), names, **_LEGEND | {"loc": "outside lower center", "ncols": side_by_side})


def _letters(width: float) -> float:
    """Scale of letters in a figure of this width [in]: `fit` gives them to what is laid out for a column."""
    return _SMALLEST if _PAPER.get() is not None and width < _PRINTED else 1.0


def colour(label: str) -> str:
    """Colour of a controller, or of "controller/gains", in every figure; one without its own has one by its name."""
    controller = label.partition("/")[0]
    known = _CONTROLLERS.get(controller)
    return known[0] if known else _OTHERS[zlib.crc32(controller.encode()) % len(_OTHERS)]


def controller_in_words(controller: str) -> str:
    """The controller's name, and what it is: smc (sliding mode)."""
    _, words = _CONTROLLERS.get(controller, ("", ""))
    return f"{controller} ({words})" if words else controller


def line(label: str) -> dict[str, Any]:
    """Line style of "controller/gains": colour by controller, dashes by gains."""
    controller, _, gains = label_today(label).partition("/")
    return {"color": colour(controller), "linestyle": _DASHES.get(gains or "default", _OTHER_DASHES)}


def darkened(name: str) -> Colormap:
    """A diverging map whose middle is not lost on white paper."""
    colours = mpl.colormaps[name](np.linspace(0.0, 1.0, 256))
    middle = 1.0 - 0.45 * np.exp(-((np.linspace(-1.0, 1.0, 256) / 0.35) ** 2))
    colours[:, :3] *= middle[:, None]
    return ListedColormap(colours)
