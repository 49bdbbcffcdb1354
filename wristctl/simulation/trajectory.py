"""Trajectory of one rollout, sampled on a grid of about a millisecond."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array

if TYPE_CHECKING:
    import pandas as pd


# Columns of a trajectory's table with unit and meaning; the segments' angles theta_1 ... theta_n [rad] follow.
COLUMNS: dict[str, tuple[str, str]] = {
    "time": ("s", "time from the start of the move"),
    "theta": ("rad", "bending angle of the last disc"),
    "rate": ("rad/s", "its rate"),
    "theta_seen": ("rad", "bending angle that the controller sees: behind a camera the observer's"),
    "load_seen": ("N m", "load torque as the observer estimates it; 0 where there is none"),
    "theta_ref": ("rad", "reference angle that the controller follows"),
    "theta_desired": ("rad", "true wanted angle"),
    "error": ("rad", "theta - theta_ref (E12)"),
    "tip_x": ("m", "last disc's centre along the base tangent"),
    "tip_y": ("m", "last disc's centre across"),
    "tip_desired_x": ("m", "wanted tip position"),
    "tip_desired_y": ("m", "wanted tip position"),
    "torque_wanted": ("N m", "the law's torque"),
    "torque": ("N m", "torque of the tensions on the one-segment model"),
    "tension_plus": ("N", "commanded tension of each tendon of the + side"),
    "tension_minus": ("N", "commanded tension of each tendon of the - side"),
    "acting_plus": ("N", "tension of the + side as it acts on the wrist: late and in steps behind real motors"),
    "acting_minus": ("N", "tension of the - side as it acts on the wrist"),
    "spool_plus": ("m", "length that each spool of the + side has reeled in until the next control period"),
    "spool_minus": ("m", "length that each spool of the - side has reeled in until the next control period"),
}


@dataclass(frozen=True)
class Trajectory:
    """One closed loop over time: T samples, n plant segments; SI units."""

    label: str
    """controller/gains, for example smc/exchanged"""
    time: Array
    theta: Array
    """Bending angle of the last disc, the sum of the segments' angles, (T,)."""
    segment_theta: Array
    """(T, n)"""
    rate: Array
    theta_ref: Array
    theta_desired: Array
    """True wanted angle, (T,); differs from theta_ref by the network's own error."""
    tip: Array
    """(T, 2)"""
    tip_desired: Array
    """(T, 2)"""
    torque_wanted: Array
    torque: Array
    """Torque of the commanded tensions on the controller's one-segment model, (T,)."""
    tension: Array
    """Commanded, per tendon of the + and the - side, (T, 2)."""
    acting: Array | None = None
    """Tension as it acts on the wrist, (T, 2); None where it is as commanded or cannot be known."""
    seen: Array | None = None
    """Angle that the controller sees, (T,); None where that is theta."""
    load: Array | None = None
    """Load torque as the observer estimates it, (T,); None where there is no observer."""
    expected: float = math.nan
    """Standard deviation of the observer's error of the angle by what it believes [rad]."""
    substeps: int = 1
    """Integration steps in a control period that it took."""
    drift: float = 0.0
    """Change of its numbers with the integration step [rad]; 0 where they have converged."""
    outside: float = 0.0
    """Share of the wanted tips outside the domain of the network behind the reference."""
    spools: Array | None = None
    """Length that each spool of the + and the - side has reeled in [m], (T, 2); None without spools."""

    @property
    def error(self) -> Array:
        """e = theta - theta_ref (E12), (T,)."""
        return self.theta - self.theta_ref

    @property
    def consistency(self) -> float:
        """RMS of the observer's error over what it expects of itself; nan where there is no observer."""
        if self.seen is None or not self.expected > 0.0:
            return math.nan
        return float(np.sqrt(np.mean((self.seen - self.theta) ** 2)) / self.expected)

    @cached_property
    def tip_distance(self) -> Array:
        """Distance of the tip from where it should be [m], (T,)."""
        distance: Array = np.linalg.norm(self.tip - self.tip_desired, axis=1)
        return distance

    def columns(self) -> dict[str, Array]:
        """Everything under the names of COLUMNS, (T,) each; spools where there are any."""
        acting = self.tension if self.acting is None else self.acting
        columns = {
            "time": self.time,
            "theta": self.theta,
            "rate": self.rate,
            "theta_seen": self.theta if self.seen is None else self.seen,
            "load_seen": np.zeros_like(self.theta) if self.load is None else self.load,
            "theta_ref": self.theta_ref,
            "theta_desired": self.theta_desired,
            "error": self.error,
            "tip_x": self.tip[:, 0],
            "tip_y": self.tip[:, 1],
            "tip_desired_x": self.tip_desired[:, 0],
            "tip_desired_y": self.tip_desired[:, 1],
            "torque_wanted": self.torque_wanted,
            "torque": self.torque,
            "tension_plus": self.tension[:, 0],
            "tension_minus": self.tension[:, 1],
            "acting_plus": acting[:, 0],
            "acting_minus": acting[:, 1],
        }
        if self.spools is not None:
            columns |= {"spool_plus": self.spools[:, 0], "spool_minus": self.spools[:, 1]}
        return columns | {f"theta_{k + 1}": column for k, column in enumerate(self.segment_theta.T)}

    def frame(self) -> pd.DataFrame:
        """The columns as a table."""
        import pandas as pd

        return pd.DataFrame(self.columns())


def rests(trajectory: Trajectory) -> bool:
    """Whether the reference comes to rest before the horizon: a periodic one never settles, and need not."""
    late = max(2, len(trajectory.time) // 20)
    return bool(np.ptp(trajectory.theta_ref[-late:]) == 0.0)
