"""What a wrist in two planes did over time, with its metrics."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.simulation.oscillation import REST, oscillations
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

if TYPE_CHECKING:
    import pandas as pd

# Share of a wanted torque below which it was out of the tendons' reach.
FULL = 1.0 - 1e-9
_PLANES = ("ulnar", "flexion")
# Columns of a plane, by the attribute that holds them, (T, 2): unit and meaning.
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
    "pull": ("N", "commanded pull at this place of tendons"),
    "acting": ("N", "pull as it acts on the wrist: late and in steps behind real motors"),
    "spool": ("m", "length that each spool of this place has reeled in until the next control period"),
}


@dataclass(frozen=True)
class BendCourse:
    """What a wrist in two planes did, over T samples; planes in the order ulnar, flexion. nan after it has failed."""

    time: Array
    """(T,) [s]"""
    bend: Array
    """Bend of the last disc (T, 2) [rad]."""
    rate: Array
    """(T, 2) [rad/s]"""
    bend_ref: Array
    """(T, 2) [rad]"""
    bend_seen: Array
    """Bend that the laws see (T, 2) [rad]."""
    load_seen: Array
    """Load torque that the observer makes out (T, 2) [N m]."""
    torque_wanted: Array
    """What the laws want (T, 2) [N m]."""
    torque: Array
    """What the pulls give by the controller's model (T, 2) [N m]."""
    share: Array
    """Share of the wanted torque that the tendons could give (T,)."""
    pulls: Array
    """Commanded (T, places of tendons) [N]."""
    acting: Array
    """As they act on the wrist (T, places of tendons) [N]."""
    coordinates: Array
    """Bends of the plant's segments (T, 2n) [rad]."""
    length: float
    """Of the wrist as it is [m]."""
    length_known: float
    """Of the wrist as its controller knows it [m]."""
    spools: Array | None = None
    """Length that each spool has reeled in (T, places of tendons) [m]; None without spools."""

    @cached_property
    def tip(self) -> Array:
        """Last disc's centre (T, 3) [m]: along the base, toward ulnar, toward flexion."""
        return spatial_tips(self.coordinates, self.length)

    @cached_property
    def tip_desired(self) -> Array:
        """Tip of one arc that is bent as wanted (T, 3) [m]."""
        return spatial_tips(self.bend_ref, self.length_known)

    @property
    def rests(self) -> bool:
        """Whether the reference rests at the end, for as long as shows a swing of the loop's own."""
        late = self.bend_ref[-round(REST / float(self.time[1])) :]
        return bool(len(self.time) * self.time[1] >= REST and not np.ptp(late, axis=0).any())

    @property
    def failed(self) -> bool:
        """Whether the wrist left its range."""
        return bool(np.isnan(self.bend).any())

    @property
    def until(self) -> float:
        """Time when the wrist was last within its range [s]."""
        lost = np.isnan(self.bend[:, 0])
        return float(self.time[max(0, int(np.argmax(lost)) - 1)] if lost.any() else self.time[-1])

    @property
    def error(self) -> Array:
        """Bend less its reference (T, 2) [rad]."""
        return self.bend - self.bend_ref

    def metrics(self) -> dict[str, float]:
        """Errors by plane and as one norm [rad], of the tip [mm], and of the pulls; by name."""
        return {name: metric.value(self) for name, metric in BEND_METRICS.items()}

    def columns(self) -> dict[str, Array]:
        """Everything under the names of `column_meanings`, (T,) each."""
        columns = {"time": self.time}
        for name in _OF_A_PLANE:
            columns |= {f"{name}_{plane}": values for plane, values in zip(_PLANES, getattr(self, name).T, strict=True)}
        for name in _TIP:
            columns |= {f"{name}_{axis}": values for axis, values in zip(_AXES, getattr(self, name).T, strict=True)}
        for name, pulls in (("pull", self.pulls), ("acting", self.acting)):
            columns |= {f"{name}_{t}": values for t, values in enumerate(pulls.T, 1)}
        if self.spools is not None:
            columns |= {f"spool_{t}": reeled for t, reeled in enumerate(self.spools.T, 1)}
        for k in range(self.coordinates.shape[1] // 2):
            bends = self.coordinates[:, 2 * k : 2 * k + 2].T
            columns |= {f"bend_{k + 1}_{plane}": values for plane, values in zip(_PLANES, bends, strict=True)}
        return columns | {"share": self.share}

    def frame(self) -> pd.DataFrame:
        """The columns as a table."""
        import pandas as pd

        return pd.DataFrame(self.columns())


def column_meanings(names: list[str]) -> dict[str, tuple[str, str]]:
    """Unit and meaning of columns, by their names."""
    of = {"time": ("s", "time from the start of the motion")}
    of |= {f"{n}_{p}": (unit, f"{meaning}, {p}") for n, (unit, meaning) in _OF_A_PLANE.items() for p in _PLANES}
    of |= {f"{n}_{axis}": ("m", f"{text}, {where}") for n, text in _TIP.items() for axis, where in _AXES.items()}
    of["share"] = ("1", "share of the wanted torque that the tendons could give")
    for name in names:
        first, _, rest = name.partition("_")
        if name not in of:
            of[name] = _OF_A_TENDON[first] if rest.isdigit() else ("rad", "bend of one segment")
    return {name: of[name] for name in names}


class BendTotals(NamedTuple):
    """Sums over rollouts by the names of `wristctl.simulation.bend_sums.BEND_SUMS`, (count,) each."""

    sums: Mapping[str, Array]
    time: Array
    """Of the samples (T,) [s]."""


class BendMetric(NamedTuple):
    """A metric of a motion in two planes; it comes from a course, or from running sums (of many rollouts at once)."""

    unit: str
    formula: str
    value: Callable[[BendCourse], float]
    of_totals: Callable[[BendTotals], Array] | None = None
    of_error: bool = True
    """Whether it is of the error, and so means nothing where the wrist has failed."""


def _rms(values: Array) -> float:
    return float(np.sqrt(np.mean(values**2)))


def _norm(course: BendCourse) -> Array:
    return np.hypot(course.error[:, 0], course.error[:, 1])


def _late(course: BendCourse) -> float:
    return float(_norm(course)[-late_samples(len(course.time)) :].mean())


def late_samples(samples: int) -> int:
    """Number of samples in the last 10 % of the horizon."""
    return max(1, samples // 10)


def _share(of: BendTotals, name: str) -> Array:
    """A sum over the number of samples."""
    share: Array = of.sums[name] / len(of.time)
    return share


def _rms_of(of: BendTotals, *squares: str) -> Array:
    return np.sqrt(sum((_share(of, name) for name in squares), np.zeros(())))


def _tip_distance(course: BendCourse) -> Array:
    distance: Array = 1e3 * np.linalg.norm(course.tip - course.tip_desired, axis=1)
    return distance


def _chattering(course: BendCourse) -> float:
    return float(np.abs(np.diff(course.pulls, axis=0)).sum() / (course.time[-1] - course.time[0]))


def _oscillation(course: BendCourse) -> float:
    step, which = float(course.time[1] - course.time[0]), np.arange(2)
    if course.failed:
        return math.nan
    return float(np.max(oscillations(course.bend.T, course.bend_ref.T, which, step)))


BEND_METRICS: dict[str, BendMetric] = {
    "rmse_ulnar": BendMetric(
        "rad", "sqrt(mean e^2) over the horizon, toward ulnar", lambda c: _rms(c.error[:, 0]),
        lambda of: _rms_of(of, "squared_ulnar"),
    ),
    "rmse_flexion": BendMetric(
        "rad", "sqrt(mean e^2) over the horizon, toward flexion", lambda c: _rms(c.error[:, 1]),
        lambda of: _rms_of(of, "squared_flexion"),
    ),
    "rmse": BendMetric(
        "rad", "sqrt(mean |e|^2) over the horizon, |e| over both planes", lambda c: _rms(_norm(c)),
        lambda of: _rms_of(of, "squared_ulnar", "squared_flexion"),
    ),
    "largest_error": BendMetric(
        "rad", "largest |e| over both planes", lambda c: float(_norm(c).max()),
        lambda of: np.sqrt(of.sums["squared_most"]),
    ),
    "steady_state": BendMetric(
        "rad", "mean |e| over the last 10 % of the horizon", _late,
        lambda of: of.sums["late"] / late_samples(len(of.time)),
    ),
    "tip_rmse": BendMetric(
        "mm", "RMS distance of the tip from that of one arc bent as wanted", lambda c: _rms(_tip_distance(c)),
        lambda of: 1e3 * _rms_of(of, "squared_tip"), of_error=False,
    ),
    "oscillation": BendMetric(
        "rad", "half the peak-to-peak that is left at the end of the faster plane, the motion removed", _oscillation
    ),
    "peak_tension": BendMetric(
        "N", "largest pull that acts at a place of tendons", lambda c: float(c.acting.max()),
        lambda of: of.sums["peak"], of_error=False,
    ),
    "chattering": BendMetric(
        "N/s", "total variation of all commanded pulls per second", _chattering,
        lambda of: of.sums["variation"] / (of.time[-1] - of.time[0]), of_error=False,
    ),
    "saturation": BendMetric(
        "", "share of time in which the wanted torque was out of the tendons' reach",
        lambda c: float(np.mean(c.share < FULL)), lambda of: _share(of, "saturated"), of_error=False,
    ),
    "slack": BendMetric(
        "", "share of time in which a tendon was slack", lambda c: float(np.mean((c.acting <= 0.0).any(axis=1))),
        lambda of: _share(of, "slack"), of_error=False,
    ),
}  # fmt: skip
