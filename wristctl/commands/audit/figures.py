"""Figures of an audit: our numbers over the paper's, and the share of the box in which each claim holds."""

from collections.abc import Sequence
from textwrap import fill
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from wristctl.comparison.claims import Judgement
from wristctl.comparison.paper import FACTOR
from wristctl.comparison.robust import Strip
from wristctl.comparison.verdicts import FAILING
from wristctl.config.audit import VerdictName
from wristctl.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    SILVER,
    VERMILLION,
    WIDTH,
    figure,
    headed,
    legend_below,
    logarithmic,
    title,
    with_unit,
)

_COLOURS: dict[tuple[VerdictName, ...], tuple[str, str]] = {
    ("reproduced",): (GREEN, "holds"),
    ("better than the paper",): (BLUE, "ours is less"),
    FAILING: (VERMILLION, "ours is more, fails or never settles; the other way round"),
    ("not specified enough",): (SILVER, "alike within 5 %"),
}
# Letters of a line beside the bars.
_WIDE = 44
# Ratio beyond which a point is drawn at the edge.
_FURTHEST = 1e4


def shares(strips: Sequence[Strip], heading: str = "") -> Figure:
    """For each claim the shares of drawn settings with each verdict; beside it the unknown that decides it most."""
    fig, axes = figure(width=1.2 * WIDTH, height=max(2.6, 1.2 + 0.24 * len(strips)))
    panel = axes[0, 0]
    places = np.arange(len(strips))[::-1]
    left = np.zeros(len(strips))
    for verdicts, (colour, label) in _COLOURS.items():
        width = np.array([row.share(*verdicts).value for row in strips])
        if width.any():
            panel.barh(places, width, left=left, height=0.72, color=colour, label=label)
        left += width
    for place, claim_strip in zip(places, strips, strict=True):
        _beside(panel, place, f"{100 * claim_strip.share('reproduced').value:.1f} %", 40.0, ha="right", fontsize=8.0)
        caption, shade = (fill(claim_strip.told, _WIDE), "k") if claim_strip.told else ("none alone", GREY)
        _beside(panel, place, caption, 46.0, fontsize=6.0, color=shade, linespacing=0.95)
    panel.set_yticks(places, [row.claim.id for row in strips], fontsize=8.0)
    panel.set_xlim(0.0, 1.0)
    panel.set_ylim(-0.6, len(strips) - 0.4)
    panel.grid(False, axis="y")
    _beside(panel, len(strips) - 0.2, "holds in", 40.0, ha="right", fontsize=8.0)
    _beside(panel, len(strips) - 0.2, "by what decides most", 46.0, fontsize=8.0)
    draws, most = len(strips[0].verdicts), max(row.uncounted for row in strips)
    counted = f"{draws} settings" + f", without up to {most} that did not converge" * bool(most)
    panel.set_xlabel(f"share of {counted}", fontsize=10.0)
    headed(fig, heading)
    legend_below(fig, 2)
    return fig


def _beside(panel: Axes, place: float, text: str, right: float, **style: Any) -> None:
    """Text beside the axes, so many points to the right of them."""
    placement = {"xytext": (right, 0.0), "textcoords": "offset points", "va": "center"}
    panel.annotate(text, (1.0, place), xycoords=("axes fraction", "data"), annotation_clip=False, **placement | style)


def strip(one: Strip, values: Sequence[object], unit: str = "") -> Figure:
    """One claim: every drawn setting by the unknown that decides it most, our value over the paper's, and the verdict.

    What fails or never settles stands at the upper edge.
    """
    fig, axes = figure(height=3.0)
    panel = axes[0, 0]
    x, names = _places(values)
    failed = ~np.isfinite(one.ratios)
    y = np.clip(np.where(failed, _FURTHEST, one.ratios), 1.0 / _FURTHEST, _FURTHEST)
    for verdicts, (colour, label) in _COLOURS.items():
        matching = np.array([verdict in verdicts for verdict in one.verdicts])
        if matching.any():
            panel.plot(x[matching], y[matching], "o", ms=2.5, mew=0, alpha=0.6, color=colour, label=label)
    open_ = np.array([verdict is None for verdict in one.verdicts])
    if open_.any():
        style = {"ms": 2.5, "mew": 0.4, "mfc": "none", "color": GREY}
        panel.plot(x[open_], y[open_], "o", label="did not converge: not counted", **style)
    if names:
        panel.set_xticks(range(len(names)), names)
    elif x.min() > 0.0 and x.max() > 8.0 * x.min():
        logarithmic(panel.xaxis)
    logarithmic(panel.yaxis)
    if one.claim.sense != "about" or one.claim.evidence == "arrival":
        panel.axhline(1.0, color=GREY, lw=0.8)
    elif one.claim.than is None and one.claim.evidence != "symmetry":
        panel.axhspan(1.0 / FACTOR, FACTOR, color=GREEN, alpha=0.12, lw=0)
    if one.split is not None and not names:
        panel.axvline(one.split.at, color=GREY, lw=0.8, ls="--")
    if not names and np.isinf(np.array(values, float)).any():
        panel.text(x.max(), -0.02, "none", ha="center", va="top", fontsize=9.0, transform=panel.get_xaxis_transform())
    panel.set_xlabel(with_unit(one.leaves[0].name, unit), fontsize=10.0)
    over = f"{one.claim.than} over {one.claim.label}" if one.claim.than else "ours over the paper's"
    panel.set_ylabel("one side over the other" if one.claim.evidence == "symmetry" else over, fontsize=10.0)
    title(panel, fill(f"{one.claim.id}: {one.claim.says}", 78))
    legend_below(fig, 2)
    return fig


def _places(values: Sequence[object]) -> tuple[np.ndarray, list[str]]:
    """Numbers as they are, infinity beyond the largest; names side by side, spread a little."""
    spread = np.random.default_rng(0).uniform(-0.3, 0.3, len(values))
    if not isinstance(values[0], str):
        numbers = np.array(values, float)
        finite = np.isfinite(numbers)
        apart = np.where(finite, numbers, 1.6 * numbers[finite].max())
        few = len(set(numbers.tolist())) <= 12
        return (apart * np.exp(0.3 * spread) if few and apart.min() > 0.0 else apart), []
    names = list(dict.fromkeys(str(value) for value in values))
    return np.array([names.index(str(value)) for value in values]) + spread, names


_LOOPS = {"exact": (BLUE, "o"), "sampled": (ORANGE, "s"), "four-segments": (VERMILLION, "^")}
_REACH = (1e-8, 1e5)


def ours_over_the_papers(judged: Sequence[Judgement]) -> Figure:
    """Ranges over the stated motions, on each loop; the band is what counts as reproduced.

    What never settles, or fails, stands at the right edge; a hollow mark is of a law that the paper only names.
    """
    numeric = [j for j in judged if j.claim.value and j.claim.sense == "about" and any(name for name in j.found)]
    fig, axes = figure(height=1.2 + 0.26 * len(numeric))
    panel = axes[0, 0]
    panel.axvspan(1.0 / FACTOR, FACTOR, color=LIGHT, lw=0, zorder=0)
    named: set[str] = set()
    for place, judgement in enumerate(reversed(numeric)):
        assert judgement.claim.value
        for index, (loop, finding) in enumerate(judgement.found.items()):
            colour, mark = _LOOPS.get(loop, (GREY, "d"))
            ends = np.array([finding.low, finding.high]) / judgement.claim.value
            ends = np.clip(np.where(np.isfinite(ends), ends, _REACH[1]), *_REACH)
            label = None if loop in named else loop
            named.add(loop)
            fill = "none" if judgement.claim.unspecified else colour
            y = place + 0.24 * (1 - index)
            panel.plot(ends, [y, y], marker=mark, ms=4, mfc=fill, color=colour, lw=1.2, label=label)
    logarithmic(panel.xaxis)
    panel.set_xlim(_REACH[0] / 3.0, _REACH[1] * 3.0)
    panel.set_yticks(range(len(numeric)), [row.claim.id for row in reversed(numeric)], fontsize=8.0)
    panel.set_ylim(-0.6, len(numeric) - 0.4)
    panel.set_xlabel(
        "ours over the paper's (band: within a factor of 1.5; left edge: 0; right edge: never)", fontsize=9.0
    )
    legend_below(fig)
    return fig
