"""The figure of the paper at its best: what is left, one move for two numbers, what T2 mixes, what optimisers find."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from wristctl.comparison.best_case import BestCase
from wristctl.comparison.paper import FACTOR, T2
from wristctl.plotting.style import (
    BLUE,
    GREEN,
    GREY,
    LIGHT,
    ORANGE,
    PURPLE,
    VERMILLION,
    colour,
    figure,
    logarithmic,
    title,
)


class Move(NamedTuple):
    """One minimum-jerk move under the exchanged controller in nearly continuous time."""

    duration: float
    rmse: float
    settling: float


class Weighed(NamedTuple):
    """The best of the grid's gains at one weight of chattering, and how much worse the printed ones are."""

    weight: float
    gains: tuple[float, float, float]
    rmse: float
    printed: float


def drawn(found: list[BestCase], moves: list[Move], weights: list[Weighed]) -> Figure:
    """What is left of each row, one move that gives two numbers, what T2 mixes, what an optimiser would return."""
    made, axes = figure(2, 2, height=6.6)
    _left(axes[0, 0], found)
    _one_move(axes[0, 1], moves)
    _mixed(axes[1, 0])
    _weighed(axes[1, 1], weights)
    return made


def _left(panel: Any, found: list[BestCase]) -> None:
    rows = list(dict.fromkeys((each.row, each.reading) for each in found if each.setting is not None))
    marks = (("o", "RMSE"), ("s", "settling"), ("^", "steady state"))
    panel.axvspan(1.0 / FACTOR, FACTOR, color=LIGHT, lw=0, zorder=0)
    for place, (name, reading) in enumerate(reversed(rows)):
        own = [each for each in found if (each.row, each.reading) == (name, reading) and each.setting is not None]
        seeds = dict.fromkeys(each.seed for each in own)
        own = [min((each for each in own if each.seed == seed), key=lambda each: each.factor) for seed in seeds]
        for each in own:
            ratios = np.array(each.ours) / np.array(T2[name.split("/")[0]])
            for at, ((mark, label), ratio) in enumerate(zip(marks, ratios, strict=True)):
                first = place == 0 and each is own[0]
                style = {"color": colour(name.split("/")[0]), "ms": 5, "mfc": "none", "label": label if first else None}
                panel.plot(ratio, place + 0.22 * (1 - at), mark, **style)
    panel.set_yticks(range(len(rows)), [f"{name}\n{reading}" for name, reading in reversed(rows)], fontsize=8.0)
    panel.set_xlim(0.62, 1.6)
    panel.axvline(1.0, color=GREY, lw=0.8)
    panel.set_xlabel("ours over the paper's (smc/printed: no setting)", fontsize=9.0)
    panel.legend(fontsize=8.0, frameon=False, loc="center right")
    title(panel, "a  the best of each seed")


def _one_move(panel: Any, moves: list[Move]) -> None:
    time = [each.duration for each in moves]
    panel.plot(time, [each.rmse / T2["smc"].rmse for each in moves], color=BLUE, label="RMSE over 5 s / 2.7e-4 rad")
    panel.plot(time, [each.settling / T2["smc"].settling for each in moves], color=VERMILLION, label="settling / 1.2 s")
    panel.axhline(1.0, color=GREY, lw=0.8)
    panel.set_xlabel("duration of the minimum-jerk move [s]", fontsize=9.0)
    panel.set_ylabel("ours over the paper's", fontsize=9.0)
    panel.legend(fontsize=8.0, frameon=False)
    panel.set(xlim=(1.0, 2.2), ylim=(0.0, 2.5))
    title(panel, "b  exchanged: one move gives both")


def _mixed(panel: Any) -> None:
    time = np.linspace(0.3, 4.0, 100)
    bound = 0.01 * math.radians(30.0) * np.sqrt(time / 10.0)
    panel.fill_between(time, 1e-5, bound, color=LIGHT, lw=0)
    panel.text(3.95, 4e-5, "no error that decays from\na step can lie here", fontsize=8.0, color=GREY, ha="right")
    slow = math.radians(30.0) * np.sqrt(time / math.log(100.0) / 2.0 / 10.0)
    panel.plot(time, slow, color=GREY, lw=1.0, ls="--", label="exponential answer to a step")
    for name, row in T2.items():
        panel.plot(row.settling, row.rmse, "o", color=colour(name))
        panel.annotate(
            name,
            (row.settling, row.rmse),
            xytext=(5, -9 if name == "mrac" else 4),
            textcoords="offset points",
            fontsize=8.0,
        )
    logarithmic(panel.yaxis)
    panel.set(ylim=(1e-5, 1.0))
    panel.set_xlabel("settling time printed in T2 [s]", fontsize=9.0)
    panel.set_ylabel("RMSE printed [rad]", fontsize=9.0)
    panel.legend(fontsize=8.0, frameon=False, loc="upper right")
    title(panel, "c  T2 mixes two kinds of RMSE")


def _weighed(panel: Any, weights: list[Weighed]) -> None:
    x = [each.weight for each in weights]
    for at, (name, hue) in enumerate((("P1", PURPLE), ("P2", ORANGE), ("P3", GREEN))):
        panel.plot(x, [each.gains[at] for each in weights], color=hue, label=name, lw=2.5 - 0.7 * at)
    still = next((each.weight for each in weights if each.rmse > 0.1), None)
    if still is not None:
        panel.axvspan(still, x[-1], color=LIGHT, lw=0)
        panel.text(x[-1], 2e-2, "standing\nstill wins ", fontsize=8.0, color=GREY, ha="right")
    logarithmic(panel.xaxis)
    logarithmic(panel.yaxis)
    panel.set_xlabel("weight of chattering [rad s/N]", fontsize=9.0)
    panel.set_ylabel("best of 343 gains", fontsize=9.0)
    panel.legend(fontsize=8.0, frameon=False, loc="upper left", bbox_to_anchor=(0.02, 0.92))
    title(panel, "d  what an optimiser returns")
