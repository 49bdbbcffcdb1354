"""Transitions of a wrist that moves: bend, rate and torque of each plane, and the acceleration until the next tick."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.learning import DataSettings
from wristctl.config.wrist import WristParameters
from wristctl.errors import UserError
from wristctl.learning.dataset import asked_of, planes_of_samples
from wristctl.learning.domain import Domain

# Numbers of recordings, ticks or samples.
Rows = NDArray[np.int64]

# Recordings that are drawn, and the time of each [s].
RECORDINGS, SECONDS = 24, 2.0
# Time in which a wrist that rests at first has come to its motion [s], which is left out.
_BEGINS = 0.3
# Sines of a motion, their lowest frequency [Hz] and the highest over it; share of the wrist's range that it fills.
_SINES, _LOWEST, _SPREAD, _FILLS = 4, 0.2, 25.0, 0.7
# Random accelerations: smooth between levels that are so far apart in time [s], of up to the wrist's range in the last
# one [s]. Jumps of torque would show what one segment does not have: the bend of several begins to move at once.
_SHORTEST, _LONGEST, _THROUGH = 0.03, 0.12, 0.1
# Gains of ct-dob, which follows whatever the wrist is: soft, so that the random part shows.
_GAINS = {"w": 10.0, "zeta": 0.7, "wo": 20.0}


@dataclass(frozen=True)
class Transitions:
    """R recordings of T ticks in P planes, and the N ticks among them that a network learns from; SI units."""

    bend: Array
    """(R, T, P) bend of the last disc at each tick [rad]"""
    rate: Array
    """(R, T, P) [rad/s]"""
    torque: Array
    """(R, T, P) torque of the commanded tensions, from each tick to the next [N m]"""
    period: float
    """Time between two ticks [s]."""
    recording: Rows
    """(N,) recording of each sample"""
    tick: Rows
    """(N,) its tick, never the last of a recording"""

    names = ()
    segments = 1
    held_out = None
    domain = Domain((1.0, -1.0), (1.0, -1.0))
    """A network of the dynamics knows no tip at all."""

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return int(self.bend.shape[2])

    @property
    def inputs(self) -> Array:
        """Bends, rates and torques (N, 3 P)."""
        return np.hstack([values[self.recording, self.tick] for values in (self.bend, self.rate, self.torque)])

    @property
    def targets(self) -> Array:
        """Mean acceleration until the next tick (N, P) [rad/s^2]."""
        later = self.rate[self.recording, self.tick + 1]
        acceleration: Array = (later - self.rate[self.recording, self.tick]) / self.period
        return acceleration

    def arrays(self) -> dict[str, Array]:
        """The transitions as named arrays; `from_arrays` reads them back without loss."""
        return {name: np.asarray(value) for name, value in vars(self).items()}

    @staticmethod
    def from_arrays(arrays: Mapping[str, Array]) -> Transitions:
        """Transitions from what `arrays` gave. Raises KeyError where an array is missing."""
        bend, rate, torque = (np.asarray(arrays[name], np.float64) for name in ("bend", "rate", "torque"))
        recording, tick = (arrays[name].astype(np.int64) for name in ("recording", "tick"))
        return Transitions(bend, rate, torque, float(arrays["period"]), recording, tick)


def draw_transitions(settings: DataSettings, wrist: WristParameters, rng: np.random.Generator) -> Transitions:
    """Simulate the wrist in `settings.loop` along random motions under random torques, and draw samples of that.

    Computed torque with an observer follows sums of sines, softly; on top come random accelerations. A loop of one
    plane bends toward ulnar. Raises UserError for periods below a millisecond, and where the wrist leaves its range in
    most recordings.
    """
    from wristctl.control.table import controller
    from wristctl.simulation.motion import Motion
    from wristctl.simulation.rollout import rollout
    from wristctl.simulation.worlds import loop_facing

    planes, loop, period = planes_of_samples(settings, wrist), settings.loop, settings.loop.control_period
    if period < 1e-3:
        raise UserError("transitions are recorded every millisecond at most", "gen-data.loop.control_period", "1e-3")
    if planes == 1:
        wrist, loop = loop_facing(wrist, asked_of(settings).loop, "ulnar")
    bends = [_excitation(planes, period, wrist, rng) for _ in range(RECORDINGS)]
    motions = [Motion.of_bends(motion, period, wrist.length) for motion in bends]
    which, streams = np.arange(RECORDINGS), [tuple(rng.integers(2**32, size=2).tolist()) for _ in range(RECORDINGS)]
    law = controller("ct-dob")
    gains = np.tile(law.values(_GAINS), (RECORDINGS, 1))
    outcome = rollout(law, gains, motions, which, loop, wrist, None, streams, record=True)
    sound, skipped = np.flatnonzero(~outcome.failed), round(_BEGINS / period)
    if 2 * len(sound) < RECORDINGS:
        problem = f"the wrist leaves its range in {RECORDINGS - len(sound)} of {RECORDINGS} random motions"
        raise UserError(problem, "gen-data.loop", "lower its loads, or the difference from the wrist as believed")
    bend, rate, torque = (
        np.stack([outcome.part(name, lane)[skipped:] for lane in sound.tolist()]) for name in ("bend", "rate", "torque")
    )
    ticks = bend.shape[1] - 1
    chosen = np.sort(rng.permutation(len(sound) * ticks)[: settings.drawn_samples])
    return Transitions(bend, rate, torque, period, *np.divmod(chosen, ticks))


def _excitation(planes: int, period: float, wrist: WristParameters, rng: np.random.Generator) -> Array:
    """A random motion as a controller is told of it (P, 3, T): its acceleration has a random part of its own."""
    time = period * np.arange(round((_BEGINS + SECONDS) / period))
    frequency = 2.0 * math.pi * _LOWEST * _SPREAD ** rng.random((planes, _SINES, 1))
    phase, size = rng.uniform(0.0, 2.0 * math.pi, frequency.shape), rng.random(frequency.shape)
    angle = frequency * time + phase
    sines = (size * np.sin(angle), size * frequency * np.cos(angle), -size * frequency**2 * np.sin(angle))
    motion: Array = np.stack([values.sum(axis=1) for values in sines], axis=1)
    bend = math.radians(wrist.range_deg)
    motion *= _FILLS * bend * rng.uniform(0.2, 1.0) / np.hypot.reduce(motion[:, 0], axis=0).max()
    for plane in motion:
        knots = np.cumsum(rng.uniform(_SHORTEST, _LONGEST, math.ceil(time[-1] / _SHORTEST) + 1))
        levels = rng.uniform(-1.0, 1.0, len(knots) + 1) * bend / (planes * _THROUGH**2)
        last = np.searchsorted(knots, time)
        begun = np.concatenate([[0.0], knots])[last]
        share = (time - begun) / (knots[last] - begun)
        plane[2] += levels[last] + (levels[last + 1] - levels[last]) * share * share * (3.0 - 2.0 * share)
    return motion
