"""What becomes of a closed loop that is run once or several times: its metrics, and in words how it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.simulation.arrival import arrives
from wristctl.simulation.oscillation import LIMIT_CYCLE, at_rest, oscillation_frequency
from wristctl.simulation.trajectory import Trajectory

_DRAWN = 64
"""Repetitions of which the errors are kept."""


@dataclass(frozen=True)
class Simulation:
    """A trajectory with its metrics; `failed` where the wrist left its range, which it was in `until` then [s]."""

    trajectory: Trajectory
    metrics: dict[str, float]
    failed: bool
    until: float


@dataclass(frozen=True)
class Repeated:
    """The same loop several times, each with noise and a drawn plant of its own."""

    first: Simulation
    metrics: dict[str, Array]
    """Of each repetition, (R,)."""
    failed: NDArray[np.bool_]
    """(R,)"""
    until: Array
    """(R,) when each was last within its range [s]."""
    errors: Array
    """theta - theta_ref over time of the first repetitions, as many as are worth drawing, (<= R, T) [rad]."""
    bears: float = math.inf
    """Largest tension that a tendon bears [N]."""

    @classmethod
    def once(cls, done: Simulation) -> Repeated:
        """One simulation."""
        metrics = {name: np.array([value]) for name, value in done.metrics.items()}
        return cls(done, metrics, np.array([done.failed]), np.array([done.until]), done.trajectory.error[None])

    @property
    def failure(self) -> str:
        """In words how it failed; empty where it did not."""
        if not self.failed.any():
            return ""
        count = f" in {self.failed.sum()} of {len(self.failed)} repetitions" if len(self.failed) > 1 else ""
        return f"left its range at {self.until[self.failed].min():.3g} s{count}"

    @property
    def fate(self) -> str:
        """In words what became of it: failed, short, swings, ripples, pulls harder than tendons can; else empty."""
        return "; ".join(each for each in (self._end, self._strain, self._accuracy) if each)

    @property
    def beyond(self) -> float:
        """Largest tension, where it is above what a tendon bears, else 0 [N].

        1 % more is what a spool's steps and a swing of the wrist may add to the limit.
        """
        known = self.metrics.get("peak_tension", np.empty(0))
        most = float(np.nanmax(known)) if np.isfinite(known).any() else 0.0
        return most if most > 1.01 * self.bears else 0.0

    @property
    def swing(self) -> float:
        """Half of the swing at rest, the repetitions' median, where it is a limit cycle, else 0 [rad]."""
        return self._ripple if at_rest(self.first.trajectory) else 0.0

    @property
    def _ripple(self) -> float:
        """The same also where the reference turns, and friction's kinks look like swings."""
        known = self.metrics.get("oscillation", np.empty(0))
        ripple = float(np.median(known[np.isfinite(known)])) if np.isfinite(known).any() else 0.0
        return ripple if ripple > LIMIT_CYCLE else 0.0

    @property
    def drift(self) -> float:
        """Largest change of a repetition's numbers with the integration step [rad]; 0 where all have converged."""
        return float(np.max(self.metrics.get("drift", np.zeros(1))))

    @property
    def arrives(self) -> bool:
        """Whether the first repetition ends where it was asked to."""
        return not self.first.failed and arrives(self.first.trajectory)

    @property
    def _strain(self) -> str:
        most = self.beyond
        return f"NOT PHYSICAL: {most:.3g} N in a tendon that bears {self.bears:g}" if most > 0.0 else ""

    @property
    def _accuracy(self) -> str:
        if self.drift == 0.0:
            return ""
        by = f"by {np.degrees(self.drift):.2g} deg " if math.isfinite(self.drift) else ""
        return f"NOT CONVERGED: changes {by}with the integration step"

    @property
    def _end(self) -> str:
        if self.failure:
            return f"FAILED: {self.failure}"
        short = [] if self.arrives else ["DOES NOT ARRIVE"]
        if self._ripple > 0.0:
            found = f"+-{np.degrees(self._ripple):.2g} deg at {oscillation_frequency(self.first.trajectory):.2g} Hz"
            turning = f"RIPPLE: {found} (a swing, or friction at the turns)"
            short.append(f"LIMIT CYCLE: {found}" if self.swing > 0.0 else turning)
        return "; ".join(short)

    def labelled(self, label: str) -> Repeated:
        """The same with this label on its trajectory."""
        course = replace(self.first.trajectory, label=label)
        return replace(self, first=replace(self.first, trajectory=course))


class Gathered:
    """Repetitions of one row as they come."""

    def __init__(self) -> None:
        self._first: Simulation | None = None
        self._metrics: list[dict[str, float]] = []
        self._failed: list[bool] = []
        self._until: list[float] = []
        self._errors: list[Array] = []

    def add(self, done: Simulation) -> None:
        """One more."""
        self._first = self._first or done
        self._metrics.append(done.metrics)
        self._failed.append(done.failed)
        self._until.append(done.until)
        if len(self._errors) < _DRAWN:
            self._errors.append(done.trajectory.error)

    def repeated(self, bears: float) -> Repeated:
        """All of them; `bears` is the largest tension that a tendon bears [N]."""
        assert self._first is not None
        metrics = {name: np.array([each[name] for each in self._metrics]) for name in self._first.metrics}
        failed, until = np.array(self._failed), np.array(self._until)
        return Repeated(self._first, metrics, failed, until, np.array(self._errors), bears)
