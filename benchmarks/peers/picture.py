"""The picture of one result: rates as bars, and how many times wristctl's rate is each peer's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.patches import Rectangle
from rates import Result, Variant
from report import number
from table import OURS

EQUAL, LARGER, MINE, LIMIT = "#4c78a8", "#b8c9dd", "#d1495b", "#8a8a8a"


def figure(result: Result, path: Path) -> None:
    """All cores, most lanes: a column for each number of segments, rates above ratios; path without its suffix."""
    segments, threads, lanes = result.axis("segments"), max(result.axis("threads")), max(result.axis("lanes"))
    most = max(len(result.variants(n)) for n in segments)
    fig, panels = plt.subplots(
        2, len(segments), figsize=(6.2 * len(segments), 0.62 * most + 2.0), sharex="row", squeeze=False
    )
    for column, n in zip(panels.T, segments, strict=True):
        measured = {v: rate for v in result.variants(n) if (rate := result.rate(v, n, threads, lanes))}
        order = sorted(measured, key=lambda v: measured[v])
        ours = next(measured[v] for v in order if v.side == OURS)
        _bars(column[0], order, [measured[v] for v in order], [number(measured[v]) for v in order])
        where = f"n = {n}, {lanes:,} lanes, {threads} thread{'s' if threads > 1 else ''}"
        column[0].set(title=where, xlabel="simulated seconds per second")
        others = [v for v in reversed(order) if v.side != OURS]
        ratios = [ours / measured[v] for v in others]
        _bars(column[1], others, ratios, [number(ratio) for ratio in ratios])
        column[1].axvline(1.0, color="k", lw=0.8, zorder=0)
        column[1].set(xlabel="times that wristctl is faster")
    names = {MINE: "wristctl", EQUAL: "error at most wristctl's", LARGER: "larger error", LIMIT: "the same loop in C"}
    patches = [Rectangle((0, 0), 1, 1, color=colour) for colour in names]
    fig.legend(patches, list(names.values()), loc="lower center", ncols=len(names), fontsize=8, frameon=False)
    fig.tight_layout(rect=(0, 0.04, 1, 1))
    with matplotlib.rc_context({"svg.hashsalt": "wristctl"}):
        fig.savefig(path.with_suffix(".svg"), metadata={"Date": None})
        fig.savefig(path.with_suffix(".png"), dpi=150)
    plt.close(fig)


def _bars(panel: Any, variants: list[Variant], values: list[float], labels: list[str]) -> None:
    bars = panel.barh([v.name for v in variants], values, color=[_colour(v) for v in variants], log=True)
    panel.bar_label(bars, labels, padding=3, fontsize=7, bbox={"color": "white", "pad": 0.5})
    panel.margins(x=0.18)
    panel.tick_params(labelsize=8)
    panel.spines[["top", "right"]].set_visible(False)


def _colour(variant: Variant) -> str:
    if variant.side == OURS:
        return MINE
    if variant.peer == "C":
        return LIMIT
    return EQUAL if variant.equal else LARGER
