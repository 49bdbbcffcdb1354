"""Speed of every side: one set of processes at a time, alternating runs, all raw numbers kept."""

from __future__ import annotations

from contextlib import ExitStack
from pathlib import Path
from typing import Any

import numpy as np
import truth
from running import Failed, Running
from say import say
from table import Side

LONGEST = 1.5
"""A run is the whole horizon, as users run it, or as much of it as a side does in this time [s]."""


def speeds(
    sides: list[tuple[Side, int]], file: Path, segments: int, threads: int, lane_counts: list[int], budget: float,
    rounds: int,
) -> list[dict[str, Any]]:  # fmt: skip
    """Simulated seconds per second of each side with its steps a tick, a row for each number of lanes, raw runs kept.

    A row whose side failed has `failed` instead of rates.
    """
    rows: list[dict[str, Any]] = []
    with ExitStack() as stack:
        plans = []
        for side, steps in sides:
            running = stack.enter_context(Running(side, file, threads, steps))
            for lanes in lane_counts:
                if lanes > side.most_lanes or (lanes == 1 and threads > 1):
                    continue
                say(f"{side.name}, n = {segments}, {steps} steps, {threads} threads, {lanes} lanes")
                row: dict[str, Any] = {
                    "side": side.name,
                    "segments": segments,
                    "threads": threads,
                    "lanes": lanes,
                    "steps": steps,
                }
                rows.append(row)
                try:
                    prepare, ticks, repeats = _plan(running, lanes, budget)
                except Failed as failure:
                    say(f"  left out: {failure}")
                    row["failed"] = str(failure)
                    break
                row |= {"ticks": ticks, "prepare": prepare, "rates": []}
                plans.append((running, lanes, ticks, repeats, row))
        say(f"{rounds} alternating rounds, n = {segments}, {threads} threads")
        for _ in range(rounds):
            for running, lanes, ticks, repeats, row in sorted(plans, key=lambda plan: plan[1]):
                seconds = running.ask(lanes, ticks, repeats)["seconds"]
                row["rates"].append(lanes * ticks * repeats * truth.PERIOD / seconds)
    for row in rows:
        if "rates" in row:
            row["rate"] = float(np.median(row["rates"]))
    return rows


def _plan(running: Running, lanes: int, budget: float) -> tuple[float, int, int]:
    """Seconds to prepare, and the ticks and repeats of a run, together the budget [s] at least."""
    whole = round(truth.HORIZON / truth.PERIOD)
    first = running.ask(lanes, 2)
    prepare = first["prepare"]
    ticks, seconds = 2, min(first["seconds"], running.ask(lanes, 2)["seconds"])
    while ticks < whole and seconds < LONGEST / 2.0:  # what a run costs beside its ticks shows in a short one
        ticks = int(np.clip(ticks * LONGEST / seconds, ticks, min(whole, 10 * ticks)))
        seconds = running.ask(lanes, ticks)["seconds"]
    return prepare, ticks, max(1, round(budget / seconds))
