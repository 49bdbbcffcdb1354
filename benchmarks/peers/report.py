"""Tables in Markdown and the picture of one result."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
import matplotlib.pyplot as plt

OURS = "wristctl"


def _rate(result: dict[str, Any], side: str, segments: int, threads: int, lanes: int) -> float | None:
    """Median rate; where a side was measured with fewer lanes only, the rate of those."""
    wanted = (side, segments, threads)
    rows = [row for row in result["speeds"] if (row["side"], row["segments"], row["threads"]) == wanted]
    rows = [row for row in rows if row["lanes"] <= lanes]
    return max(rows, key=lambda row: row["lanes"])["rate"] if rows else None


def _axes(result: dict[str, Any], name: str) -> list[int]:
    return sorted({row[name] for row in result["speeds"]})


def _number(value: float) -> str:
    return f"{value:,.0f}" if value >= 10 else f"{value:.2g}"


def markdown(result: dict[str, Any]) -> str:
    """A table for each number of segments and of threads: error, steps, rates and wristctl's ratio to each side."""
    parts = []
    lanes = _axes(result, "lanes")
    for n in _axes(result, "segments"):
        for threads in _axes(result, "threads"):
            head = "one thread" if threads == 1 else f"{threads} threads"
            parts.append(f"### n = {n}, {head}\n")
            counts = [f"{count:,} lane{'s' if count > 1 else ''}" for count in lanes]
            columns = ["side", "steps per ms", "error [rad]", *counts, "wristctl over it"]
            parts.append("| " + " | ".join(columns) + " |\n|" + "---|" * len(columns))
            for side, error in ((side, found["error"]) for side, found in result["errors"][str(n)].items()):
                steps = {int(key): value for key, value in result["sides"][side]["steps"].items()}[n]
                rates = [_rate(result, side, n, threads, count) for count in lanes]
                ours = [_rate(result, OURS, n, threads, count) for count in lanes]
                ratios = [f"{a / b:.2g}" if a and b else "-" for a, b in zip(ours, rates, strict=True)]
                cells = [side, str(steps), f"{error:.1e}"]
                cells += [_number(rate) if rate else "-" for rate in rates]
                parts.append("| " + " | ".join([*cells, " / ".join(ratios)]) + " |")
            parts.append("")
    return "\n".join(parts)


def figure(result: dict[str, Any], path: Path) -> None:
    """Rate against lanes, a panel for each number of segments, all cores; path without its suffix."""
    threads = max(_axes(result, "threads"))
    segments = _axes(result, "segments")
    fig, panels = plt.subplots(1, len(segments), figsize=(5.5 * len(segments), 4.2), sharey=True, squeeze=False)
    for panel, n in zip(panels[0], segments, strict=True):
        for side in result["errors"][str(n)]:
            lanes = _axes(result, "lanes")
            rates = [_rate(result, side, n, threads, count) for count in lanes]
            style = {"lw": 2.5, "color": "k"} if side == OURS else {"lw": 1.2}
            panel.loglog(lanes, rates, marker="o", ms=4, label=side, **style)
        panel.set(title=f"n = {n}, {threads} threads", xlabel="lanes")
        panel.grid(alpha=0.3)
    panels[0][0].set_ylabel("simulated seconds per second")
    panels[0][-1].legend(fontsize=7, loc="center left", bbox_to_anchor=(1.0, 0.5))
    fig.tight_layout()
    with matplotlib.rc_context({"svg.hashsalt": "wristctl"}):
        fig.savefig(path.with_suffix(".svg"), metadata={"Date": None})
        fig.savefig(path.with_suffix(".png"), dpi=150)
    plt.close(fig)
