"""The trials of an experiment: which there are, in what order, and what one of them shows."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.loop import DirectionName
from wristctl.config.plant import Push
from wristctl.wrist.directions import DIRECTIONS

_BEFORE = 0.5
"""Seconds before the push over which the load is taken as quiet."""


class Trial(NamedTuple):
    """One move and back."""

    number: int
    direction: DirectionName
    repetition: int
    push: float
    """Largest force against the bend [N], 0 without a push."""
    row: int
    """Of the settings' rows of controllers."""

    @property
    def scenario(self) -> str:
        """What its noise goes by: direction and push, whichever row and however often."""
        return f"{self.direction}, push {self.push:g} N"

    @property
    def plane(self) -> str:
        """The bending plane."""
        return DIRECTIONS[self.direction].plane

    def pushed(self, push: Push) -> Push:
        """The push of an experiment as it acts in this trial, on a bench and in simulation: against the bend."""
        return push.model_copy(update={"force": -DIRECTIONS[self.direction].sign * self.push})


def trials_of(settings: HwRunSettings, rng: np.random.Generator) -> list[Trial]:
    """All trials: planes in random order, since the wrist must be turned between them, and all of a plane shuffled."""
    pushes = [0.0] * settings.without_push + [settings.push.force] * (settings.push.force != 0.0)
    every = [
        (direction, repetition, push, row)
        for direction in dict.fromkeys(settings.directions)
        for repetition in range(settings.repetitions)
        for push in pushes
        for row in range(len(settings.rows))
    ]
    planes = list(dict.fromkeys(DIRECTIONS[direction].plane for direction, *_ in every))
    ordered = []
    for plane in rng.permutation(planes):
        members = [each for each in every if DIRECTIONS[each[0]].plane == plane]
        ordered += [members[k] for k in rng.permutation(len(members))]
    return [Trial(number, *each) for number, each in enumerate(ordered)]


class PushSeen(NamedTuple):
    """A push as the record shows it: when it began and ended [s], and its largest load torque [N m]."""

    start: float
    end: float
    torque: float


def push_seen(time: Array, load: Array, after: float, least: float) -> PushSeen | None:
    """The push in an estimated load (T,): where it leaves its course by `least` [N m] once the move is over.

    The load's course without a push is its median over the half second before `after` [s], when the push may begin at
    the earliest; None where the load never leaves it.
    """
    quiet = load[(time >= after - _BEFORE) & (time < after)]
    if not len(quiet):
        return None
    rise = np.where(time >= after, np.abs(load - np.median(quiet)), 0.0)
    peak = int(np.argmax(rise))
    if rise[peak] < least:
        return None
    within = rise < 0.25 * rise[peak]
    before, later = np.flatnonzero(within[:peak]), np.flatnonzero(within[peak:])
    end = peak + (later[0] if len(later) else len(time) - 1 - peak)
    return PushSeen(float(time[before[-1] + 1 if len(before) else 0]), float(time[end]), float(rise[peak]))


def recovery(time: Array, error: Array, move: float, end: float) -> float:
    """Seconds from the end of a push until |error| (T,) [rad] stays within 2 % of the move; nan if it never does."""
    outside = np.flatnonzero((time >= end) & (np.abs(error) > 0.02 * abs(move)))
    if not len(outside):
        return 0.0
    return float(time[outside[-1] + 1] - end) if outside[-1] + 1 < len(time) else float("nan")
