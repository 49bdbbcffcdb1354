"""Error and speed of every side: one set of processes at a time, alternating runs, all raw numbers kept."""

from __future__ import annotations

import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import truth
from running import Running
from table import Side

FEWEST_TICKS = 4


def errors(sides: tuple[Side, ...], file: Path, segments: int, implicit: np.ndarray) -> dict[str, dict[str, float]]:
    """Of each side: largest error of the tip angle [rad] against its reference trajectory, and against wristctl's."""
    found = {}
    for side in sides:
        say(f"error of {side.name}, n = {segments}")
        theta = _trajectory(side, file, segments, None)
        own = _trajectory(side, file, segments, side.fine[segments]) if side.fine else implicit
        found[side.name] = {"error": _far(theta, own), "model_difference": _far(own, implicit)}
    return found


def _trajectory(side: Side, file: Path, segments: int, steps: int | None) -> np.ndarray:
    with Running(side, file, segments, 1, steps) as running:
        return np.array(running.ask(1, truth.COMPARED, theta=True)["theta"])


def _far(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.max(np.abs(a - b)))


def speeds(
    sides: tuple[Side, ...], file: Path, segments: int, threads: int, lane_counts: list[int], budget: float, rounds: int
) -> list[dict[str, Any]]:
    """Simulated seconds per second of each side and number of lanes, one row each with its raw runs."""
    rows: list[dict[str, Any]] = []
    with ExitStack() as stack:
        running = [stack.enter_context(Running(side, file, segments, threads)) for side in sides]
        plans = []
        for each in running:
            for lanes in lane_counts:
                if lanes > each.side.most_lanes:
                    continue
                say(f"{each.side.name}, n = {segments}, {threads} threads, {lanes} lanes")
                prepare, ticks, repeats = _plan(each, lanes, budget)
                row = {"side": each.side.name, "segments": segments, "threads": threads, "lanes": lanes,
                       "ticks": ticks, "prepare": prepare, "rates": []}  # fmt: skip
                rows.append(row)
                plans.append((each, lanes, ticks, repeats, row))
        for _ in range(rounds):
            for each, lanes, ticks, repeats, row in sorted(plans, key=lambda plan: plan[1]):
                seconds = each.ask(lanes, ticks, repeats)["seconds"]
                row["rates"].append(lanes * ticks * repeats * truth.PERIOD / seconds)
    for row in rows:
        row["rate"] = float(np.median(row["rates"]))
    return rows


def _plan(running: Running, lanes: int, budget: float) -> tuple[float, int, int]:
    """Seconds to prepare, and the ticks and repeats that fill the budget [s]."""
    whole = round(truth.HORIZON / truth.PERIOD)
    prepare = running.ask(lanes, FEWEST_TICKS)["prepare"]
    ticks, longer = 0, FEWEST_TICKS
    while longer > 1.5 * ticks:  # what a call costs beside its ticks must not count for short runs
        ticks = longer
        each = running.ask(lanes, ticks)["seconds"] / ticks
        longer = int(np.clip(budget / each, FEWEST_TICKS, whole))
    return prepare, ticks, max(1, round(budget / (each * ticks)))


def say(message: str) -> None:
    """Progress for people, to stderr."""
    print(message, file=sys.stderr, flush=True)
