"""A real robot as arcs on elastic tendons: what is published of it, what is unknown, what it is expected to show."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.wrist.quasistatic_arcs import SMOOTH, QuasistaticArcs
from wristctl.wrist.spatial.spatial_kinematics import spatial_tips

Term = Literal["tendon friction", "inner friction", "slack", "creep"]
"""What a model may have beside elastic arcs and tendons."""


class ArcUnknown(NamedTuple):
    """A number that is found: where the search begins, its bounds, its usual change, its unit and meaning."""

    begin: float
    low: float
    high: float
    scale: float
    unit: str
    meaning: str


UNKNOWNS: dict[str, ArcUnknown] = {
    "gain": ArcUnknown(1.0, 0.2, 5.0, 0.1, "", "length reeled in, over that published for the winch and radius"),
    "tendon": ArcUnknown(10.0, 0.05, 200.0, 3.0, "", "stiffness of a tendon times squared radius over the first arc's"),
    "stiffness": ArcUnknown(1.0, 0.1, 10.0, 0.3, "", "bending stiffness of an arc over that of the first"),
    "softening": ArcUnknown(0.8, -0.5, 0.999, 0.1, "1/kg", "share of the bending stiffness that a kilogram takes away"),
    "shortening": ArcUnknown(0.02, 1e-4, 3.0, 0.05, "", "compliance of an arc along its axis over that of bending"),
    "delay": ArcUnknown(0.05, 0.0, 0.3, 0.02, "s", "of the measured motion behind the spools"),
    "turn": ArcUnknown(0.0, -2.0 * math.pi, 2.0 * math.pi, 0.1, "rad", "direction of the first tendon of an arc"),
    "tilt_y": ArcUnknown(0.0, -0.5, 0.5, 0.02, "rad", "tilt of the base toward y"),
    "tilt_z": ArcUnknown(0.0, -0.5, 0.5, 0.02, "rad", "tilt of the base toward z"),
    "friction": ArcUnknown(0.1, 0.0, 3.0, 0.1, "", "coefficient of the tendons' friction"),
    "sheath": ArcUnknown(0.1, 0.0, 3.0, 0.1, "", "exponent that it adds before the robot: coefficient times angle"),
    "presliding": ArcUnknown(3e-4, 5e-6, 1e-2, 2e-4, "m", "path in which that turns round"),
    "inner_friction": ArcUnknown(0.02, 0.0, 1.0, 0.02, "rad", "torque of friction inside an arc over the stiffness"),
    "inner_presliding": ArcUnknown(0.03, 1e-3, 0.5, 0.02, "rad", "bend in which that turns round"),
    "creep": ArcUnknown(0.1, 0.0, 0.9, 0.1, "", "share of the bending stiffness that relaxes"),
    "creep_time": ArcUnknown(5.0, 0.5, 100.0, 5.0, "s", "time constant of that"),
    "damping": ArcUnknown(0.05, 0.0, 5.0, 0.05, "s", "damping of bending over its stiffness"),
    "inertia": ArcUnknown(5e-3, 0.0, 1.0, 2e-3, "s^2", "inertia of bending over its stiffness"),
    "force": ArcUnknown(0.6, 1e-4, 1e3, 0.2, "N m/rad", "bending stiffness of the first arc, by the tendons' tensions"),
}  # fmt: skip
"""By name; of a number for each arc the name is followed by _ and the arc's number."""
OF_TERM: dict[Term, tuple[str, ...]] = {
    "tendon friction": ("friction", "sheath", "presliding"),
    "inner friction": ("inner_friction", "inner_presliding"),
    "slack": (),
    "creep": ("creep", "creep_time"),
}
"""Unknowns that a term adds; slack adds a length for each tendon and session."""
# Least half of an interval over the value, or over the usual change, beyond which an unknown is not told.
_WIDE = {"damping": 0.5, "inertia": 0.5, "turn": 1.0, "delay": 2.5} | dict.fromkeys(
    [name for term in OF_TERM.values() for name in term], 1.0
)
SLACK_ERROR = 3e-3
"""How well it is known where a tendon is taut: standard deviation [m]."""


@dataclass(frozen=True)
class ArcRobot:
    """Published geometry: arcs in series, tendons at radii and angles that end with an arc; and what is measured."""

    lengths: tuple[float, ...]
    """Of the arcs [m]."""
    angles: tuple[float, ...]
    """Directions of the tendons from the first of those that end with the same arc [rad]."""
    radius: float
    """Radius of the circle of tendons [m]."""
    ends: tuple[int, ...]
    """Arcs that each tendon runs along, from the base."""
    measured: Literal["bend", "tip"]
    base: tuple[str, ...]
    """Unknowns of its model without any term."""
    begin: Mapping[str, float]
    """Where the search begins, other than UNKNOWNS have it."""
    known_to: Mapping[str, float] = field(default_factory=dict)
    """How well unknowns are known beforehand: standard deviations from where the search begins."""
    timed: bool = True
    """Whether its recordings have times, without which nothing is told of creep."""
    spans: int = 0
    """Straight spans of a tendon between discs along an arc; 0: it follows the arc."""
    weighed: bool = False
    """Whether samples count by the size of their residuals against what is known beforehand, not by 1 deg or 2 mm."""
    smooth: float = SMOOTH
    """Stretch below which a tendon passes smoothly from slack to taut [m]."""
    widest: float = 1.0
    """Half of a 95 % interval over the value, or over the unknown's usual change where it may be 0, beyond which it is
    not told; friction, presliding, creep, damping and inertia may be wider."""
    untold: tuple[str, ...] = ()
    """Unknowns that its data cannot tell."""

    @property
    def unit(self) -> str:
        """Unit in which people read what is measured."""
        return "deg" if self.measured == "bend" else "mm"

    @property
    def scale(self) -> float:
        """What is measured in that unit, over the same in SI units."""
        return math.degrees(1.0) if self.measured == "bend" else 1e3

    @property
    def words(self) -> str:
        """What its model is without any term."""
        return "elastic arcs and tendons"

    @property
    def terms(self) -> tuple[Term, ...]:
        """Terms that its model may have."""
        return tuple(term for term in OF_TERM if self.timed or term != "creep")

    def is_told(self, name: str, value: float, half: float) -> bool:
        """Whether a 95 % interval of so much to either side is narrow enough to be told."""
        if name in self.untold:
            return False
        root = name if name in UNKNOWNS else name.rpartition("_")[0]
        unknown, share = UNKNOWNS[root], max(self.widest, _WIDE.get(root, 0.0))
        return half <= share * max(abs(value), unknown.scale if unknown.low <= 0.0 else 0.0)

    def unknowns(self, terms: Sequence[Term]) -> dict[str, ArcUnknown]:
        """The unknowns of its model with these terms, those of arcs numbered."""
        names = [*self.base, *(name for term in OF_TERM if term in terms for name in OF_TERM[term])]
        chosen = {}
        for name in names:
            unknown = UNKNOWNS[name] if name in UNKNOWNS else UNKNOWNS[name.rpartition("_")[0]]
            chosen[name] = unknown._replace(begin=self.begin.get(name, unknown.begin))
        return chosen

    @cached_property
    def zeros(self) -> int:
        """Numbers of the sensor's zero: of two bends, or of the tip's place."""
        return 2 if self.measured == "bend" else 3

    def expected(
        self, values: Mapping[str, Array], zero: Array, slack: Array, recording: ArcRecording
    ) -> tuple[Array, Array]:
        """Bends (V, T, 2) [rad] or tips (V, T, 3) [m] of V variants, and the pulls at their spools (V, T, M) [N].

        Without the unknown "force" pulls are over the first arc's stiffness [1/m].

        Parameters
        ----------
        values : unknowns by name, (V,) each; a missing one has no effect
        zero : of the sensor (V, 2) [rad] or (V, 3) [m]
        slack : of each tendon (V, M) [m]
        recording : spools and times
        """
        gain = values.get("gain", np.ones(len(zero)))
        delays = values.get("delay")
        spools = np.broadcast_to(recording.spools, (len(zero), *recording.spools.shape))
        if delays is not None and recording.course is not None:
            different, which = np.unique(delays, return_inverse=True)
            spools = np.stack([recording.delayed(delay) for delay in different])[which]
        reeled = gain[:, None, None] * spools - slack[:, None, :]
        robot = self.arcs(values, recording.mass, len(zero))
        coordinates = robot.rest(reeled, recording.pause)
        pulls = robot.pulls(reeled, coordinates) * values.get("force", np.ones(len(zero)))[:, None, None]
        if delays is not None and recording.course is None:
            coordinates = np.stack([recording.later(*late) for late in zip(coordinates, delays, strict=True)])
        arcs = len(self.lengths)
        bends = coordinates[..., : 2 * arcs].reshape(*coordinates.shape[:2], arcs, 2)
        if self.measured == "bend":
            return bends.sum(axis=2) + zero[:, None, :], pulls
        tips = spatial_tips(coordinates[..., : 2 * arcs], self.lengths)
        tilt_y, tilt_z = (values.get(name, np.zeros(len(zero)))[:, None] for name in ("tilt_y", "tilt_z"))
        x, y, z = np.moveaxis(tips, -1, 0)
        leant = np.stack([x - tilt_y * y - tilt_z * z, y + tilt_y * x, z + tilt_z * x], axis=-1)
        return leant + zero[:, None, :], pulls

    def arcs(self, values: Mapping[str, Array], mass: float, variants: int) -> QuasistaticArcs:
        """The arcs under a mass [kg] on top; stiffness is over that of the first arc."""
        ones, count = np.ones(variants), len(self.lengths)
        ends, shortens = np.array(self.ends), "shortening" in values
        arms = np.zeros((variants, len(ends), (2 + shortens) * count))
        stiffness, tendon = np.ones((variants, arms.shape[2])), np.empty((variants, len(ends)))
        for t, (angle, end) in enumerate(zip(self.angles, ends, strict=True)):
            direction = angle + _of_arc(values, "turn", end, ones)
            for k in range(end):
                arms[:, t, 2 * k] = self.radius * np.cos(direction)
                arms[:, t, 2 * k + 1] = self.radius * np.sin(direction)
                if shortens:
                    arms[:, t, 2 * count + k] = self.radius
            tendon[:, t] = _of_arc(values, "tendon", end, ones) / self.radius**2
        for k in range(count):
            softened = 1.0 - values.get("softening", 0.0 * ones) * mass
            stiffness[:, 2 * k] = stiffness[:, 2 * k + 1] = softened * values.get(f"stiffness_{k + 1}", ones)
            if shortens:
                stiffness[:, 2 * count + k] = 1.0 / values["shortening"]
        others = {name: values.get(name, begin * ones) for name, begin in ABSENT.items()}
        return QuasistaticArcs(
            arms, ends, stiffness, tendon, others["friction"], others["sheath"], others["presliding"],
            others["inner_friction"], others["inner_presliding"], others["creep"], others["creep_time"],
            others["damping"], self.lengths, self.spans, others["inertia"], self.smooth,
        )  # fmt: skip


ABSENT = {
    "friction": 0.0, "sheath": 0.0, "presliding": 1.0, "inner_friction": 0.0, "inner_presliding": 1.0, "creep": 0.0,
    "creep_time": 1.0, "damping": 0.0, "inertia": 0.0,
}  # fmt: skip
"""Values of unknowns that have no effect."""


def inertia_of_arc(wrist: WristParameters) -> float:
    """Inertia of bending as one arc, at the straight wrist [kg m^2]."""
    return wrist.mass * wrist.length**2 / 20.0 + wrist.hand_mass * (0.5 * wrist.length + wrist.hand_offset) ** 2


def _of_arc(values: Mapping[str, Array], name: str, arc: int, ones: Array) -> Array:
    """The unknown of an arc, or that which all arcs share; nothing where there is neither."""
    return values.get(f"{name}_{arc}", values.get(name, 0.0 * ones))


@dataclass(frozen=True)
class ArcRecording:
    """Spools and what was measured at T samples, and which samples serve for what."""

    name: str
    session: str
    """Recordings of one session share the zero and the slack."""
    time: Array
    """(T,) [s]."""
    spools: Array
    """Length that each spool has reeled in (T, M) [m]."""
    measured: Array
    """Bends (T, 2) [rad] or tips (T, 3) [m]; a column is nan where nobody measured it."""
    pause: Array
    """Time since the sample before (T,) [s]; nan where a motion begins at the straight robot."""
    fitted: NDArray[np.bool_]
    """Samples that everything is fitted to (T,)."""
    zeroing: NDArray[np.bool_]
    """Samples that give the zero and the slack of their session alone (T,)."""
    asked: NDArray[np.bool_]
    """Samples that are predicted (T,)."""
    block: NDArray[np.int64]
    """Number of the block of samples that are drawn together (T,)."""
    mass: float = 0.0
    """On top of the robot [kg]."""
    beside: Array | None = None
    """What was measured beside it, nan where there is nothing: pulls at the spools (T, M) [N]; where tensions are given
    rates of both bends (T, 2) [rad/s]."""
    course: tuple[Array, Array] | None = None
    """Fine times (F,) [s] and spools (F, M) [m], where samples are means over the time between two; given tensions."""

    def delayed(self, delay: float) -> Array:
        """Spools (T, M) [m] a delay [s] earlier, by their course: means over the time of a sample."""
        assert self.course is not None
        return window_means(*self.course, self.time - delay, float(np.median(np.diff(self.time))))

    def later(self, coordinates: Array, delay: float) -> Array:
        """Coordinates (T, N) as they are seen a delay [s] later."""
        moved = [np.interp(self.time - delay, self.time, column) for column in coordinates.T]
        return np.stack(moved, axis=1)


def window_means(time: Array, values: Array, at: Array, width: float) -> Array:
    """Means (T, ...) of a course (F, ...) over windows of a width around times `at` (T,); beyond its ends it stays."""
    fine = np.concatenate([[time[0] - 1.0], time, [time[-1] + 1.0]])
    rows = np.concatenate([values[:1], values, values[-1:]])
    areas = np.concatenate([0.0 * rows[:1], np.cumsum(0.5 * np.diff(fine)[:, None] * (rows[1:] + rows[:-1]), axis=0)])
    ends = [
        np.stack([np.interp(at + side, fine, area) for area in areas.T], axis=1) for side in (-0.5 * width, 0.5 * width)
    ]
    means: Array = (ends[1] - ends[0]) / width
    return means
