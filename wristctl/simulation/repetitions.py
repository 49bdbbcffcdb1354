"""Results of a closed loop that is run once or several times: its metrics, and in words how it ended."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.simulation.arrival import arrives
from wristctl.simulation.oscillation import LIMIT_CYCLE, at_rest, chatter, oscillation_frequency
from wristctl.simulation.trajectory import Trajectory

# Why a loop is no good.
MARKS = ("failed", "does not arrive", "limit cycle", "chatters", "not physical", "not converged")
# Times its limit that a tension may be: what a spool's steps and a swing of the wrist may add.
STRAIN = 1.01
# Repetitions of which the errors are kept.
_DRAWN = 64


@dataclass(frozen=True)
class Simulation:
    """A trajectory with its metrics; `failed` where the wrist left its range, which it was in `until` then [s]."""

    trajectory: Trajectory
    metrics: dict[str, float]
    failed: bool
    until: float


@dataclass(frozen=True)
class Repeated:
    """Repetitions of one loop, each with noise and a drawn plant of its own: whether it failed, and what is wrong."""

    first: Simulation
    metrics: dict[str, Array]
    """Metrics of each repetition, (R,)."""
    failed: NDArray[np.bool_]
    """(R,)"""
    until: Array
    """(R,) when each was last within its range [s]."""
    errors: Array
    """Errors over time of the first repetitions, as many as are worth drawing, (<= R, T) or (<= R, T, 2) [rad]."""
    bears: float = math.inf
    """Largest tension that a tendon bears [N]."""
    tension_range: float = math.inf
    """Largest tension less the least one [N]."""

    @classmethod
    def once(cls, simulation: Simulation) -> Repeated:
        """One simulation."""
        metrics = {name: np.array([value]) for name, value in simulation.metrics.items()}
        return cls(
            simulation,
            metrics,
            np.array([simulation.failed]),
            np.array([simulation.until]),
            simulation.trajectory.error[None],
        )

    @property
    def failure(self) -> str:
        """In words how it failed; empty where it did not."""
        if not self.failed.any():
            return ""
        count = f" in {self.failed.sum()} of {len(self.failed)} repetitions" if len(self.failed) > 1 else ""
        return f"left its range at {self.until[self.failed].min():.3g} s{count}"

    @property
    def marks(self) -> list[str]:
        """Why it is no good, in a word or two each; empty where it is sound."""
        if self.failure:
            return [MARKS[0]]
        holds = not self.arrives, self.swing > 0.0, self.chatter > 0.0, self.beyond > 0.0, self.drift > 0.0
        return [mark for mark, one in zip(MARKS[1:], holds, strict=True) if one]

    def median(self, name: str) -> float:
        """Median of a metric over the repetitions in which it is a number; nan where there is none."""
        values = self.metrics.get(name, np.empty(0))
        finite = values[np.isfinite(values)]
        return float(np.median(finite)) if len(finite) else math.nan

    @property
    def fate(self) -> str:
        """In words why it is no good, or may be: its marks with their numbers, and ripples; else empty."""
        return "; ".join(remark for remark in (self._end, self._strain, self._accuracy) if remark)

    @property
    def beyond(self) -> float:
        """Largest tension, where it is above what a tendon bears, else 0 [N]."""
        peaks = self.metrics.get("peak_tension", np.empty(0))
        most = float(np.nanmax(peaks)) if np.isfinite(peaks).any() else 0.0
        return most if most > STRAIN * self.bears else 0.0

    @property
    def swing(self) -> float:
        """Half of the swing at rest, the repetitions' median, where it is a limit cycle, else 0 [rad]."""
        return self._ripple if at_rest(self.first.trajectory) else 0.0

    @property
    def frequency(self) -> float:
        """Strongest frequency of the first repetition's swing [1/s]; nan where there is none."""
        return oscillation_frequency(self.first.trajectory)

    @property
    def _ripple(self) -> float:
        """Ripple, also where the reference has not rested, and a move's tail or friction looks like a swing."""
        ripple = self.median("oscillation")
        return ripple if ripple > LIMIT_CYCLE else 0.0

    @property
    def chatter(self) -> float:
        """Frequency at which tensions go from limit to limit and back, the median, where it chatters, else 0 [1/s]."""
        places = self.first.trajectory.tension.shape[1]
        return float(chatter(self.median("chattering"), self.tension_range, places))

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
            swing = f"+-{np.degrees(self._ripple):.2g} deg at {oscillation_frequency(self.first.trajectory):.2g} Hz"
            turning = f"RIPPLE: {swing} (a swing, friction, or the move's tail)"
            short.append(f"LIMIT CYCLE: {swing}" if self.swing > 0.0 else turning)
        if self.chatter > 0.0:
            short.append(f"CHATTERS: tensions go from limit to limit and back {self.chatter:.0f} times a second")
        return "; ".join(short)

    def labelled(self, label: str) -> Repeated:
        """Repetitions with this label on their trajectory."""
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

    def add(self, simulation: Simulation) -> None:
        """One more."""
        self._first = self._first or simulation
        self._metrics.append(simulation.metrics)
        self._failed.append(simulation.failed)
        self._until.append(simulation.until)
        if len(self._errors) < _DRAWN:
            self._errors.append(simulation.trajectory.error)

    def repeated(self, wrist: WristParameters) -> Repeated:
        """Repetitions gathered; `wrist` says what its tendons bear."""
        assert self._first is not None
        metrics = {name: np.array([values[name] for values in self._metrics]) for name in self._first.metrics}
        failed, until = np.array(self._failed), np.array(self._until)
        errors, tensions = np.array(self._errors), (wrist.tension_limit, wrist.tension_range)
        return Repeated(self._first, metrics, failed, until, errors, *tensions)
