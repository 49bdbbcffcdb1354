"""Trajectory of one rollout, sampled on a grid of about a millisecond."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array

if TYPE_CHECKING:
    import pandas as pd


# Columns of a trajectory's table in one plane with unit and meaning; the segments' angles theta_1 ... theta_n follow.
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
    "spool_plus": ("m", "length that each spool of the + side has reeled in, in whole microsteps"),
    "spool_minus": ("m", "length that each spool of the - side has reeled in, in whole microsteps"),
}


# The same in two planes: of each plane, of the tip, and of each tendon. Bends of segments, bend_1_ulnar ..., follow.
PLANES = ("ulnar", "flexion")
_OF_A_PLANE = {
    "bend": ("rad", "bend of the last disc"),
    "rate": ("rad/s", "rate of that bend"),
    "bend_seen": ("rad", "bend that the controller sees: behind a camera the observer's"),
    "load_seen": ("N m", "load torque as the observer estimates it; 0 where there is none"),
    "bend_ref": ("rad", "reference that the controller follows"),
    "error": ("rad", "bend less its reference"),
    "torque_wanted": ("N m", "torque that the controller wants"),
    "torque": ("N m", "torque of the commanded pulls on the one-segment model"),
}
_TIP = {"tip": "last disc's centre", "tip_desired": "tip of one arc that is bent as wanted"}
_AXES = {"x": "along the base tangent", "y": "toward ulnar", "z": "toward flexion"}
_OF_A_TENDON = {
    "pull": ("N", "commanded pull of one tendon at this place"),
    "acting": ("N", "pull of one tendon at this place as it acts on the wrist: late and in steps behind real motors"),
    "spool": ("m", "length that each spool of this place has reeled in, in whole microsteps"),
}


_FORMERLY = {"pulls": "tension", "coordinates": "segment_theta", "bend_seen": "seen", "load_seen": "load"}


@dataclass(frozen=True)
class Trajectory:
    """One closed loop over time: T samples, P planes, n plant segments; SI units. nan after a wrist has failed.

    What is of each plane is (T,) in one plane, and (T, 2) in two, toward ulnar and toward flexion. Places of tendons
    are the + and the - side in one plane, and those of the wrist's layout in two.
    """

    label: str
    """controller/gains, for example smc/exchanged"""
    time: Array
    theta: Array
    """Bend of the last disc, in one plane the sum of the segments' angles, (T,) or (T, 2)."""
    segment_theta: Array
    """The plant's coordinates, (T, n) or (T, 2n)."""
    rate: Array
    theta_ref: Array
    theta_desired: Array
    """True wanted bend, (T,) or (T, 2); differs from theta_ref by the network's own error."""
    tip: Array
    """(T, P + 1)"""
    tip_desired: Array
    """(T, P + 1)"""
    torque_wanted: Array
    torque: Array
    """Torque of the commanded tensions on the controller's one-segment model, (T,) or (T, 2)."""
    tension: Array
    """Commanded, of one tendon of each place, (T, places)."""
    acting: Array | None = None
    """Tension as it acts on the wrist, (T, places); None where it is as commanded or cannot be known."""
    seen: Array | None = None
    """Bend that the controller sees, (T,) or (T, 2); None where that is theta."""
    load: Array | None = None
    """Load torque as the observer estimates it, (T,) or (T, 2); None where there is no observer."""
    share: Array | None = None
    """Share of the wanted torque that the tendons could give, (T,), in two planes."""
    expected: float | Array = math.nan
    """Standard deviation of the observer's error of the bend by what it believes, in each plane [rad]."""
    substeps: int = 1
    """Integration steps in a control period that it took."""
    drift: float = 0.0
    """Change of its numbers with the integration step [rad]; 0 where they have converged."""
    outside: float = 0.0
    """Share of the wanted tips outside the domain of the network behind the reference."""
    spools: Array | None = None
    """Length that each spool of a place has reeled in [m], (T, places); None without spools."""

    if not TYPE_CHECKING:

        def __getattr__(self, name: str) -> object:
            """What loops in two planes had under names of their own."""
            if name not in _FORMERLY:
                raise AttributeError(f"a trajectory has no {name}")
            return getattr(self, _FORMERLY[name])

    @property
    def planes(self) -> int:
        """Planes that the wrist bends in."""
        return 1 if self.theta.ndim == 1 else self.theta.shape[1]

    @property
    def bend(self) -> Array:
        """theta as (T, P) [rad]."""
        return self.theta.reshape(len(self.time), -1)

    @property
    def bend_ref(self) -> Array:
        """theta_ref as (T, P) [rad]."""
        return self.theta_ref.reshape(len(self.time), -1)

    @property
    def error(self) -> Array:
        """e = theta - theta_ref (E12), (T,) or (T, 2)."""
        return self.theta - self.theta_ref

    @property
    def distance(self) -> Array:
        """|e|, over both planes its norm, (T,) [rad]."""
        return size_of(self.bend - self.bend_ref)

    @property
    def failed(self) -> bool:
        """Whether the wrist left its range."""
        return bool(np.isnan(self.theta).any())

    @property
    def consistency(self) -> float:
        """RMS of the observer's error over what it expects of itself; nan where there is no observer."""
        if self.seen is None or not np.all(np.asarray(self.expected) > 0.0):
            return math.nan
        return float(np.sqrt(np.mean((self.seen - self.theta) ** 2)) / np.sqrt(np.mean(np.square(self.expected))))

    @cached_property
    def tip_distance(self) -> Array:
        """Distance of the tip from where it should be [m], (T,)."""
        distance: Array = np.linalg.norm(self.tip - self.tip_desired, axis=1)
        return distance

    def columns(self) -> dict[str, Array]:
        """Everything under the names of `meanings`, (T,) each; spools where there are any."""
        flat, count = self.planes == 1, len(self.time)
        bend, ends = ("theta", [""]) if flat else ("bend", [f"_{plane}" for plane in PLANES])
        of_a_plane = {
            bend: self.theta, "rate": self.rate, f"{bend}_seen": self.theta if self.seen is None else self.seen,
            "load_seen": np.zeros_like(self.theta) if self.load is None else self.load, f"{bend}_ref": self.theta_ref,
            "error": self.error, "torque_wanted": self.torque_wanted, "torque": self.torque,
        }  # fmt: skip
        columns = {"time": self.time} | ({"theta_desired": self.theta_desired} if flat else {})
        for name, values in of_a_plane.items():
            columns |= {f"{name}{end}": column for end, column in zip(ends, values.reshape(count, -1).T, strict=True)}
        for name, path in (("tip", self.tip), ("tip_desired", self.tip_desired)):
            columns |= {f"{name}_{axis}": column for axis, column in zip(_AXES, path.T, strict=False)}
        acting = self.tension if self.acting is None else self.acting
        places = ("plus", "minus") if flat else range(1, self.tension.shape[1] + 1)
        for name, tendons in (
            ("tension" if flat else "pull", self.tension),
            ("acting", acting),
            ("spool", self.spools),
        ):
            if tendons is not None:
                columns |= {f"{name}_{place}": column for place, column in zip(places, tendons.T, strict=True)}
        for k, bends in enumerate(self.segment_theta.reshape(count, -1, self.planes).transpose(1, 2, 0), 1):
            columns |= {f"{bend}_{k}{end}": column for end, column in zip(ends, bends, strict=True)}
        if flat:
            return {name: columns[name] for name in dict.fromkeys((*COLUMNS, *columns)) if name in columns}
        return columns if self.share is None else columns | {"share": self.share}

    def frame(self) -> pd.DataFrame:
        """The columns as a table."""
        import pandas as pd

        return pd.DataFrame(self.columns())


def size_of(values: Array) -> Array:
    """Norms (..., T) of vectors (..., T, P): of one plane the absolute values themselves."""
    sizes: Array = np.hypot.reduce(np.abs(values), axis=-1)
    return sizes


def meanings(columns: Sequence[str]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of a trajectory's columns, by their names."""
    if "theta" in columns:
        segments = {name: ("rad", "bending angle of one segment") for name in columns if name not in COLUMNS}
        return {name: (COLUMNS | segments)[name] for name in columns}
    of = {"time": COLUMNS["time"]}
    of |= {f"{n}_{p}": (unit, f"{meaning}, {p}") for n, (unit, meaning) in _OF_A_PLANE.items() for p in PLANES}
    of |= {f"{n}_{axis}": ("m", f"{text}, {where}") for n, text in _TIP.items() for axis, where in _AXES.items()}
    of["share"] = ("1", "share of the wanted torque that the tendons could give")
    for name in columns:
        first, _, rest = name.partition("_")
        if name not in of:
            of[name] = _OF_A_TENDON[first] if rest.isdigit() else ("rad", "bend of one segment")
    return {name: of[name] for name in columns}


def rests(trajectory: Trajectory) -> bool:
    """Whether the reference comes to rest before the horizon: a periodic one never settles, and need not."""
    late = max(2, len(trajectory.time) // 20)
    return not np.ptp(trajectory.bend_ref[-late:], axis=0).any()
