"""Oddities of a trial within the limits, but beyond those of a sound rig."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.trial.tracking_monitor import Greatest

_LEAST_FRAMES = 20
# Standard errors.
_SURE = 3.0


class MarkerLag:
    """Lag of the marker in a motion's usable frames behind the angle that the spools should have made."""

    def __init__(self) -> None:
        self._frames: list[tuple[float, float, float]] = []

    def add(self, theta: float, predicted: float, rate: float) -> None:
        """Take in the marker's angle, the predicted one [rad] and its rate [rad/s]."""
        self._frames.append((theta, predicted, rate))

    def least(self) -> float:
        """The lag [s] that there is at least; -inf where the motion cannot tell.

        Of theta = a + b (predicted - lag rate) by least squares, less three standard errors.
        """
        theta, predicted, rate = np.array(self._frames).reshape(-1, 3).T
        if len(theta) < _LEAST_FRAMES:
            return -math.inf
        terms = np.stack([np.ones_like(theta), predicted, -rate], axis=1)
        coefficients, _, rank, _ = np.linalg.lstsq(terms, theta)
        _, scale, late = coefficients
        if rank < terms.shape[1] or scale <= 0.0:
            return -math.inf
        left = theta - terms @ coefficients
        variance = float(left @ left) / (len(theta) - terms.shape[1]) * np.linalg.inv(terms.T @ terms)[2, 2]
        return float((late - _SURE * math.sqrt(variance)) / scale)


# Share of a limit from which a value is worth a word, above what sound rigs of the default settings show.
_SHARE, _FOLLOWING = 0.6, {"apart": 0.35, "jump": 0.5, "across": 0.8}
# Shares beyond what is believed that are: of frames without an angle, of commands sent again, of ticks skipped.
_UNSEEN, _RESENT, _SKIPPED = 0.1, 0.002, 0.01
# Seconds; no stepper's tendons as believed lag by 3 ms.
_LAG = 0.015
# Limits as shares: of the marker's side, and of the control period.
_MOVED, _LONG = 0.03, 0.85


@dataclass
class Oddities:
    """Collected tick by tick over a trial; `words` says what was odd, nothing for a sound one."""

    settings: HwRunSettings
    greatest: Greatest = field(default_factory=Greatest)
    gap: float = 0.0
    """Longest time since the capture of a usable angle [s]."""
    late: float = 0.0
    span: float = 0.0
    """Duration of the trial [s]."""
    ticks: int = 0
    skipped: int = 0
    usable: int = 0
    """Frames whose angle was used."""
    resent: int = 0
    """Commands that had to be sent again."""
    reasons: dict[str, int] = field(default_factory=dict)
    """Counts of the verdicts but ok."""
    round_trips: list[float] = field(default_factory=list)
    """From each tick's command to its answer [s]."""
    lag: MarkerLag = field(default_factory=MarkerLag)
    moved: float = 0.0
    """Distance of the base's marker from its first place, in its sides."""
    _base: Array | None = None

    def base(self, corners: Array) -> None:
        """Take in the corners (4, 2) [px] of the base's marker, nan where it was not seen."""
        if not np.isfinite(corners).all():
            return
        if self._base is None:
            self._base = corners
        side = math.dist(*self._base[:2])
        if side > 0.0:
            self.moved = max(self.moved, float(np.hypot(*(corners - self._base).mean(axis=0))) / side)

    def tick(self, row: dict[str, Any], age: float, greatest: Greatest) -> None:
        """Take in a tick of the log, the age of the newest usable angle [s], and what has been greatest."""
        self.greatest = Greatest(*map(max, self.greatest, greatest))
        self.gap, self.late = max(self.gap, age), max(self.late, row["late"])
        self.span, self.ticks = row["time"], self.ticks + 1
        self.usable += math.isfinite(row["theta_measured"])
        if row["verdict"] not in ("", "ok"):
            self.reasons[row["verdict"]] = self.reasons.get(row["verdict"], 0) + 1

    def words(self) -> str:
        """Describe the oddities in one line."""
        limits, sensor = self.settings.safety, self.settings.sensor
        degrees = {"apart": limits.follow_deg, "jump": limits.jump_deg, "across": limits.across_deg}
        meanings = {"apart": "off its motors", "jump": "of jump between frames", "across": "across the plane"}
        oddities = [
            f"{value:.1f} deg {meanings[name]} (limit {limit:g})"
            for name, limit in degrees.items()
            if (value := math.degrees(getattr(self.greatest, name))) > _FOLLOWING[name] * limit
        ]
        if self.greatest.load > _SHARE * limits.load:
            oddities.append(f"a load of {self.greatest.load:.1f} N m (limit {limits.load:g})")
        if self.gap > _SHARE * limits.stale:
            oddities.append(f"no usable marker angle for {1e3 * self.gap:.0f} ms (limit {1e3 * limits.stale:g})")
        rate, believed = self.usable / max(self.span, 1e-9), sensor.frame_rate * (1.0 - sensor.dropped)
        if self.span > 0.5 and rate < (1.0 - _UNSEEN) * believed:
            why = max(self.reasons, key=lambda verdict: self.reasons[verdict], default="")
            problem = f"{rate:.0f} usable angles per second instead of {believed:.0f}"
            oddities.append(f"{problem} ({why})" if why else problem)
        if self.late > _SHARE * limits.late:
            oddities.append(f"a tick {1e3 * self.late:.0f} ms late (limit {1e3 * limits.late:g})")
        if self.skipped > _SKIPPED * self.ticks:
            oddities.append(f"{self.skipped} of {self.ticks + self.skipped} ticks skipped")
        if self.moved > _MOVED:
            oddities.append(
                f"the base's marker moved by {100.0 * self.moved:.0f} % of its side: camera or clamp is loose"
            )
        if self.round_trips and (taken := float(np.median(self.round_trips))) > _LONG * self.settings.control_period:
            oddities.append(
                f"the board's answers took {1e3 * taken:.1f} ms, of {1e3 * self.settings.control_period:g} ms"
            )
        if (lag := self.lag.least()) > _LAG:
            problem = f"the marker comes {1e3 * lag:.0f} ms or more after its motors"
            oddities.append(f"{problem}: pictures older than their stamps say, soft tendons or friction")
        if self.resent > _RESENT * self.ticks:
            oddities.append(f"{self.resent} commands sent again: see the cable")
        return "; ".join(oddities)
