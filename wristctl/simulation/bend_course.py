"""What a wrist in two planes did over time, with its metrics."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from wristctl.arrays import Array
from wristctl.control.response import FULL
from wristctl.simulation.metrics import Metric, Totals, summary, summed, totals_of_series
from wristctl.simulation.motion import goals_of_bends
from wristctl.simulation.oscillation import REST, oscillations
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

if TYPE_CHECKING:
    import pandas as pd

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
    "pull": ("N", "commanded pull of one tendon at this place"),
    "acting": ("N", "pull of one tendon at this place as it acts on the wrist: late and in steps behind real motors"),
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
    """Commanded, of one tendon of each place (T, places) [N]."""
    acting: Array
    """As they act on the wrist, of one tendon of each place (T, places) [N]."""
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
        """Time until which the wrist was within its range [s]."""
        lost = np.isnan(self.bend[:, 0])
        return float(self.time[int(np.argmax(lost)) if lost.any() else -1])

    @property
    def error(self) -> Array:
        """Bend less its reference (T, 2) [rad]."""
        return self.bend - self.bend_ref

    def metrics(self) -> dict[str, float]:
        """BEND_METRICS by name, of the samples."""
        step, saturated = float(self.time[1] - self.time[0]), (self.share < FULL).astype(float)
        goals = goals_of_bends(self.bend_ref.T, self.time)
        totals = totals_of_series(step, self.bend, self.bend_ref, self.acting, saturated, goals)
        off = np.linalg.norm(self.tip - self.tip_desired, axis=1)
        totals.sums["squared_tip"][:] = np.sum(off**2)
        totals.sums["alive"][:] = float(not self.failed)
        values = {name: float(value[0]) for name, value in summary(totals, BEND_METRICS).items()}
        values["oscillation"] = self._oscillation(step)
        return {name: values[name] for name in BEND_METRICS}

    def _oscillation(self, step: float) -> float:
        if self.failed:
            return math.nan
        return float(np.max(oscillations(self.bend.T, self.bend_ref.T, np.arange(2), step)))

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


def _per_tick(name: str, of: Totals) -> Array:
    """A sum over the number of ticks."""
    mean: Array = of.sums[name] / of.sums["ticks"]
    return mean


# Metrics of a motion in two planes: those of one plane that come from sums, of the norm of the error over both planes;
# and of each plane by itself.
BEND_METRICS: dict[str, Metric] = {
    **{
        f"rmse_{plane}": Metric(
            "rad", f"sqrt(mean e^2) over the horizon, toward {plane}",
            lambda of, name=f"squared_{plane}": np.sqrt(_per_tick(name, of)),  # type: ignore[misc]
        )
        for plane in _PLANES
    },
    "largest_error": Metric(
        "rad", "largest |e| over both planes", lambda of: np.sqrt(of.sums["squared_most"]),
    ),
    **summed(),
    "tip_rmse": Metric(
        "mm", "RMS distance of the tip from that of one arc bent as wanted",
        lambda of: 1e3 * np.sqrt(_per_tick("squared_tip", of)), of_error=False,
    ),
    "oscillation": Metric(
        "rad", "half the peak-to-peak that is left at the end of the faster plane, the motion removed",
    ),
}  # fmt: skip
