"""What a control loop is in one bending plane, and in two: observer, law, paths of the tendons, columns of its log.

A loop asks one of both for all that depends on the number of planes; the exchange with the board is the same.
"""

import math
from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from wristctl.arrays import Array
from wristctl.config.hw_run import HwRunSettings
from wristctl.config.wrist import WristParameters
from wristctl.control.response import Estimate
from wristctl.simulation.motion import DERIVATIVES, Motion
from wristctl.trial.spatial_belief import PLANES, SpatialPaths, known_of_axes
from wristctl.trial.spatial_steering import SpatialAnswer, SpatialSteering
from wristctl.trial.spools import Paths
from wristctl.trial.steering import Answer, Steering
from wristctl.trial.tracking import Tracking
from wristctl.vision.marker import Sighting

# Values of a row of the log, by its columns.
Columns = dict[str, Any]


class Bending(Protocol):
    """Observer, law and tendons of a loop. Axes are those of the board; `sample` of a course is k, or its last."""

    steering: Any

    def course(self, motion: Any) -> Array:
        """The motion as the law follows it: its samples first, then bend, rate and acceleration last."""

    def bend(self, tracking: Tracking, sighting: Sighting, captured: float) -> Sighting:
        """The sighting, its angle the bend in its camera's plane, taken `captured` seconds after tick 0."""

    def stands(self, tracking: Tracking, sighting: Sighting, before: Any) -> Any:
        """Bend of a wrist that stands, by a usable sighting; `before` is what the last one gave, or None."""

    def see(self, sighting: Sighting, captured: float) -> bool:
        """Fuse a usable one; False where it is too old or yet to come."""

    def spools(self, reeled: Array) -> tuple[float, ...]:
        """What the models count of axes that have reeled in so much (4,) [m]."""

    def taut(self, bend: Any) -> Array:
        """Reeled-in lengths (4,) [m] of tendons that are just taut at this bend."""

    def aim(self, sample: Array) -> tuple[Array, Array]:
        """The same at a sample's bend, and the speeds (4,) [m/s] at which they change there."""

    def tension(self, answer: Any) -> Array:
        """Commanded tensions of the axes (4,) [N]."""

    def withhold(self, sample: Array, pulls: Array) -> None:
        """Tell the law which pulls (4,) [N] its motors are too slow to deliver."""

    def marker(self) -> Columns:
        """Columns of the camera's newest frames, where none has come."""

    def marked(self, sighting: Sighting, captured: float | None) -> Columns:
        """Columns of a frame, taken `captured` seconds after the motion began; None: it is not used."""

    def values(self, estimate: Estimate, motion: Any, course: Array, k: int | None, answer: Any) -> Columns:
        """Columns of estimate, reference at the sample `k` (None: behind the last) and answer (None: none)."""


class OnePlane:
    """A loop in one bending plane."""

    def __init__(self, settings: HwRunSettings, wrist: WristParameters, plane: str, period: float) -> None:
        self.steering: Any = Steering(wrist, settings.actuator, settings.sensor, period, 0.0)
        self._paths = Paths(wrist, plane)

    def course(self, motion: Motion) -> Array:
        """Angle, rate and acceleration (T, 3)."""
        return np.stack([motion.theta_ref, motion.rate_ref, motion.acceleration_ref], axis=1)

    def bend(self, tracking: Tracking, sighting: Sighting, captured: float) -> Sighting:
        """As it is."""
        return sighting

    def stands(self, tracking: Tracking, sighting: Sighting, before: Any) -> Any:
        """The angle."""
        return sighting.theta

    def see(self, sighting: Sighting, captured: float) -> bool:
        """Fuse an angle."""
        return bool(self.steering.see(sighting.theta, captured))

    def spools(self, reeled: Array) -> tuple[float, ...]:
        """Means of the + and the - side."""
        return self._paths.sides(reeled)

    def taut(self, bend: Any) -> Array:
        """At an angle."""
        return self._paths.taut(bend)[0]

    def aim(self, sample: Array) -> tuple[Array, Array]:
        """At the reference angle."""
        taut, arm = self._paths.taut(sample[0])
        return taut, arm * sample[1]

    def tension(self, answer: Answer) -> Array:
        """Both of a side pull alike."""
        return self._paths.each(answer.plus, answer.minus)

    def withhold(self, sample: Array, pulls: Array) -> None:
        """As torque."""
        self.steering.withheld = float(self._paths.taut(sample[0])[1] @ pulls)

    def marker(self) -> Columns:
        """Nothing measured."""
        return {"theta_measured": math.nan, "captured": math.nan, "verdict": ""}

    def marked(self, sighting: Sighting, captured: float | None) -> Columns:
        """The newest verdict, and the newest angle used."""
        verdict = {"verdict": str(sighting.verdict)}
        return verdict if captured is None else {**verdict, "theta_measured": sighting.theta, "captured": captured}

    def values(
        self, estimate: Estimate, motion: Motion, course: Array, k: int | None, answer: Answer | None
    ) -> Columns:
        """Columns by angle."""
        reference = (float(course[-1, 0]), 0.0, 0.0) if k is None else tuple(course[k].tolist())
        return {
            **estimate._asdict(),
            "theta_ref": reference[0],
            "rate_ref": reference[1],
            "acceleration_ref": reference[2],
            "theta_desired": float(motion.theta_desired[-1 if k is None else k]),
            "error": estimate.theta - reference[0],
            "torque_wanted": math.nan if answer is None else answer.torque_wanted,
            "torque": math.nan if answer is None else answer.torque,
        }


class TwoPlanes:
    """A loop in both bending planes, each of which a camera of its own sees."""

    def __init__(self, settings: HwRunSettings, wrist: WristParameters, period: float) -> None:
        self.steering: Any = SpatialSteering(wrist, settings.actuator, settings.sensor, period)
        self._paths = SpatialPaths(known_of_axes(wrist, settings.actuator))

    def course(self, motion: Motion) -> Array:
        """Bend, rate and acceleration of each plane (T, 2, 3)."""
        return np.ascontiguousarray(motion.angles.rows.reshape(2, DERIVATIVES, -1).transpose(2, 0, 1))

    def bend(self, tracking: Tracking, sighting: Sighting, captured: float) -> Sighting:
        """With what the other plane's bend, as it was believed then, does to the picture taken out."""
        other = float(self.steering.bend_at(captured)[1 - sighting.plane])
        return sighting._replace(theta=tracking.bend(sighting, other))

    def stands(self, tracking: Tracking, sighting: Sighting, before: Any) -> Any:
        """Both bends, of which the sighting shows one."""
        bend = np.zeros(2) if before is None else before.copy()
        bend[sighting.plane] = tracking.bend(sighting, float(bend[1 - sighting.plane]))
        return bend

    def see(self, sighting: Sighting, captured: float) -> bool:
        """Fuse one plane's bend."""
        return bool(self.steering.see(sighting.plane, sighting.theta, captured))

    def spools(self, reeled: Array) -> tuple[float, ...]:
        """Of each axis."""
        return tuple(reeled.tolist())

    def taut(self, bend: Any) -> Array:
        """At a bend (2,)."""
        return self._paths.taut(bend)[0]

    def aim(self, sample: Array) -> tuple[Array, Array]:
        """At the reference bend."""
        taut, arms = self._paths.taut(sample[:, 0])
        return taut, arms @ sample[:, 1]

    def tension(self, answer: SpatialAnswer) -> Array:
        """As allocated."""
        return answer.tension

    def withhold(self, sample: Array, pulls: Array) -> None:
        """As torque in each plane."""
        self.steering.withheld = pulls @ self._paths.taut(sample[:, 0])[1]

    def marker(self) -> Columns:
        """Nothing measured."""
        nothing = {"bend_measured": math.nan, "captured": math.nan, "verdict": ""}
        return {f"{name}_{plane}": value for name, value in nothing.items() for plane in PLANES}

    def marked(self, sighting: Sighting, captured: float | None) -> Columns:
        """The newest verdict, and the newest bend used, of the camera's plane."""
        plane = PLANES[sighting.plane]
        verdict = {f"verdict_{plane}": str(sighting.verdict)}
        if captured is None:
            return verdict
        return {**verdict, f"bend_measured_{plane}": sighting.theta, f"captured_{plane}": captured}

    def values(
        self, estimate: Estimate, motion: Motion, course: Array, k: int | None, answer: SpatialAnswer | None
    ) -> Columns:
        """Columns by plane."""
        reference = course[-1] * np.array([1.0, 0.0, 0.0]) if k is None else course[k]
        unknown = np.full(2, math.nan)
        each: Mapping[str, Array] = {
            "bend": estimate.theta,
            "rate": estimate.rate,
            "load": estimate.load,
            "bend_ref": reference[:, 0],
            "rate_ref": reference[:, 1],
            "acceleration_ref": reference[:, 2],
            "error": estimate.theta - reference[:, 0],
            "torque_wanted": unknown if answer is None else answer.torque_wanted,
            "torque": unknown if answer is None else answer.torque,
        }
        columns = {
            f"{name}_{plane}": value
            for name, values in each.items()
            for plane, value in zip(PLANES, np.asarray(values).tolist(), strict=True)
        }
        return {**columns, "share": math.nan if answer is None else answer.share}


def bending_of(settings: HwRunSettings, wrist: WristParameters, plane: str, period: float) -> Bending:
    """The loop of a rig: `wrist` is as this plane sees it, or in two planes as it is."""
    return TwoPlanes(settings, wrist, period) if settings.planes == 2 else OnePlane(settings, wrist, plane, period)
