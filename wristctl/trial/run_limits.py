"""Residuals of runs against their limits, by their files alone: what stopped a run, how near each came, new limits."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
import pandas as pd

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.residuals import Judge, Limit, residual

# A proposed limit is so many times the largest value, and so large a share of the present limit at least: a few runs
# show a part of what a sound rig does.
MARGIN, LEAST = 1.5, 0.5

# Setting of `safety` by which each limit is set, where a rig's own scatter may ask for another.
SETTINGS = {
    "late": "late", "rate": "rate", "age": "stale", "pull": "tension", "jump": "jump_deg", "across": "across_deg",
    "load": "load", "apart": "follow_deg", "excess_pull": "excess_pull",
}  # fmt: skip


class Logged(NamedTuple):
    """Residuals of one run."""

    values: pd.DataFrame
    """data/residuals.csv: a row for each tick, with trial and clock."""
    limits: tuple[Limit, ...]
    settings: HwRunSettings
    wrist: WristParameters


class StopTick(NamedTuple):
    """Tick at which a limit stopped a run."""

    row: int
    """Of the run's residuals."""
    trial: int
    clock: float
    limit: Limit
    value: float


class Nearness(NamedTuple):
    """How near a residual came to its limit, over runs; SI units."""

    limit: Limit
    largest: float
    """Its size where that is largest."""
    run: int
    trial: int
    clock: float
    proposed: float | None
    """Limit to be set; None where there is no setting, or no evidence for one."""
    setting: str
    """The same as a key of hw-run with its value; empty without one."""

    @property
    def share(self) -> float:
        """Of the limit; 0 for one that never stops."""
        return self.largest / self.limit.limit if self.limit.limit > 0.0 else float(self.largest > 0.0)


def stop_of(logged: Logged) -> StopTick | None:
    """Judge every tick anew: the one that stops the run, None where none does."""
    judge, values = Judge(logged.limits), logged.values
    names = [limit.name for limit in logged.limits]
    clocks, sizes = values["clock"].to_numpy(float), values[names].to_numpy(float)
    for row, (clock, size) in enumerate(zip(clocks, sizes, strict=True)):
        now = dict(zip(names, size.tolist(), strict=True))
        if (limit := judge.beyond(float(clock), now)) is not None:
            return StopTick(row, int(values["trial"].iloc[row]), float(clock), limit, now[limit.name])
    return None


def nearness(runs: Sequence[Logged], stops: Sequence[StopTick | None]) -> list[Nearness]:
    """Largest of each residual over runs that share their limits, nearest to its limit first.

    Limits are proposed by ticks of runs that no limit has stopped, as `stop_of` each says: what stopped the others is
    what limits are for.
    """
    lines = []
    for limit in runs[0].limits:
        if not math.isfinite(limit.limit):
            continue
        sizes = [np.abs(run.values[limit.name].to_numpy(float)) for run in runs]
        number = int(np.argmax([_largest(size) for size in sizes]))
        values, largest = runs[number].values, _largest(sizes[number])
        row = int(np.nanargmax(sizes[number])) if np.isfinite(sizes[number]).any() else 0
        seen = max((_largest(size) for size, stop in zip(sizes, stops, strict=True) if stop is None), default=0.0)
        proposed, setting = _proposed(runs[number], limit, seen)
        place = int(values["trial"].iloc[row]), float(values["clock"].iloc[row])
        lines.append(Nearness(limit, largest, number, *place, proposed, setting))
    return sorted(lines, key=lambda line: -line.share)


def _largest(sizes: Array) -> float:
    return float(np.nanmax(sizes)) if np.isfinite(sizes).any() else 0.0


def _proposed(run: Logged, limit: Limit, seen: float) -> tuple[float | None, str]:
    """A limit by the largest value of sound runs, and the setting that makes it; nothing where none is known."""
    name = SETTINGS.get(limit.name)
    if name is None or seen <= 0.0:
        return None, ""
    wanted, present = max(MARGIN * seen, LEAST * limit.limit), getattr(run.settings.safety, name)
    setting, factor = f"safety.{name}", present / limit.limit
    if limit.name == "pull":  # whatever a rig has shown: the wrist bears no more
        wanted, factor = min(wanted, run.wrist.tension_limit), 1.0
        if limit.limit < run.settings.within(run.wrist).safety.tension:  # the trials needed less
            setting, factor = "tension_factor", run.settings.tension_factor / limit.limit
    value = float(f"{wanted * factor:.2g}")
    return value / factor, f"{setting}={value:g}"


def shown(name: str, value: float) -> str:
    """A residual's value as people read it."""
    return residual(name).shown(value)
