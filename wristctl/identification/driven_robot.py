"""A robot whose tendons' tensions, or motors' currents, are given: one arc, moved by the simulation's dynamics.

Currents of motors whose torque constant nobody knows have no scale in newtons: all that they tell is over it.
`stiffness` is the current that bends the wrist by a radian [A/rad], or with tensions the wrist's stiffness [N m/rad];
the gains of the tendons are over their mean, which is 1.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Literal

import numpy as np

from wristctl.arrays import Array
from wristctl.config.wrist import WristParameters
from wristctl.identification.arc_robot import OF_TERM, UNKNOWNS, ArcRecording, ArcRobot, ArcUnknown, Term
from wristctl.identification.driven_forward import STEP, courses_of_pulls, driven_arc
from wristctl.identification.forward import Supposed

Drive = Literal["tension", "current"]
"""What a log has of the tendons: tensions [N], or currents [A] without a torque constant."""
# Half of an interval beyond which it is not told: of a direction [rad], of a delay [s] and of the weight's share, of
# others over the value.
_ASIDE, _NARROW = math.radians(15.0), {"delay": 0.05, "weight": 0.1}
_WIDE = {"stiffness": 0.25, "gain": 0.25, "damping": 0.5, "inertia": 0.5}


@dataclass(frozen=True)
class DrivenRobot(ArcRobot):
    """A wrist of M tendons by their tensions or currents; its zeros are those of both bends."""

    drive: Drive = "tension"
    wrist: WristParameters = field(default_factory=WristParameters)
    """Its geometry, the shares of its masses, and the ratio of its springs."""
    planar: bool = False
    """Whether its tendons pull along one line, whose two sides `angles` are; else their directions are found."""
    quantity: Drive = "tension"
    """What its log has: currents may be taken as tensions."""
    numbers: tuple[int, ...] = ()
    """Of the tendons in a log."""
    signs: tuple[float, ...] = ()
    """What each column is multiplied by."""
    weighs: bool = False
    """Whether the wrist stands or hangs, so that its weight is found: by how its stiffness changes as it bends."""
    still: tuple[int, ...] = ()
    """Numbers of tendons that pull no more and no less in the log, whose places are as believed."""

    @property
    def words(self) -> str:
        """What its model is without any term."""
        return "an elastic arc"

    @property
    def terms(self) -> tuple[Term, ...]:
        """All but slack: a tendon without tension is one whose tension is given."""
        return tuple(term for term in OF_TERM if term != "slack")

    @property
    def tendons(self) -> int:
        """Number of tendons."""
        return len(self.angles)

    @property
    def moving(self) -> list[int]:
        """Numbers of the tendons that pull more and less."""
        return [number for number in self.numbers if number not in self.still]

    @cached_property
    def _own(self) -> dict[str, ArcUnknown]:
        """The unknowns of an arc under given tensions, without any term."""
        unit, what = ("N m/rad", "bending stiffness, by the tensions") if self.drive == "tension" else (
            "A/rad", "stiffness over the motors' gain: current that bends the wrist by a radian"
        )  # fmt: skip
        begin = self.begin["stiffness"]
        chosen = {"stiffness": ArcUnknown(begin, 0.02 * begin, 50.0 * begin, 0.1 * begin, unit, what)}
        if "arm" in self.known_to:
            chosen["arm"] = ArcUnknown(1.0, 0.5, 2.0, 0.01, "", "distance of the tendons from the axis, over believed")
        for number, angle in zip(self.numbers, self.angles, strict=True):
            if number in self.still:
                continue
            if not self.planar:
                meaning = f"of tendon {number}'s pull, from bend_y toward bend_z"
                ends = angle - math.pi, angle + math.pi
                chosen[f"direction_{number}"] = ArcUnknown(angle, *ends, 0.05, "rad", meaning)
            if number != self.moving[0]:
                meaning = f"of tendon {number}, over the mean of all"
                chosen[f"gain_{number}"] = ArcUnknown(1.0, 0.02, float(self.tendons), 0.05, "", meaning)
        for name in ("damping", "inertia", "delay"):
            chosen[name] = UNKNOWNS[name]
        if self.weighs:
            meaning = "share of the straight wrist's stiffness that weight takes as it stands; below 0: it hangs"
            chosen["weight"] = ArcUnknown(0.0, -0.9, 5.0, 0.05, "", meaning)
        chosen["delay"] = chosen["delay"]._replace(high=0.5, meaning="of the measured motion behind the tendons' log")
        return chosen

    def unknowns(self, terms: Sequence[Term]) -> dict[str, ArcUnknown]:
        """The unknowns of its model with these terms."""
        of_terms = {name: UNKNOWNS[name] for term in OF_TERM if term in terms for name in OF_TERM[term]}
        chosen = {**self._own, **of_terms}
        return {name: one._replace(begin=self.begin.get(name, one.begin)) for name, one in chosen.items()}

    def is_told(self, name: str, value: float, half: float) -> bool:
        """Whether a 95 % interval of so much to either side is narrow enough to be told."""
        kind = name.partition("_")[0]
        if name in self.untold:
            return False
        if kind == "direction":
            return half <= _ASIDE
        if name in _NARROW:
            return half <= _NARROW[name]
        if kind in _WIDE:
            return half <= max(self.widest, _WIDE[kind]) * abs(value)
        if name in self._own:
            return half <= self.widest * abs(value)
        return super().is_told(name, value, half)

    def expected(
        self, values: Mapping[str, Array], zero: Array, slack: Array, recording: ArcRecording
    ) -> tuple[Array, Array]:
        """Bends (V, T, 2) [rad] of V variants, and their rates (V, T, 2) [rad/s].

        Parameters
        ----------
        values : unknowns by name, (V,) each; a missing one has no effect
        zero : of the sensor (V, 2) [rad]
        slack : of none (V, M)
        recording : times, and the tendons' tensions or currents over a fine course
        """
        assert recording.course is not None
        clock, driven = recording.course
        arcs = [self._arc({name: float(column[v]) for name, column in values.items()}) for v in range(len(zero))]
        delays = values.get("delay", np.zeros(len(zero)))
        seen = np.empty((len(zero), len(recording.time), 4))
        for v, course in enumerate(courses_of_pulls(arcs, driven)):
            at = recording.time - delays[v]
            seen[v] = np.stack([np.interp(at, clock, column) for column in course.T], axis=1)
        return seen[..., :2] + zero[:, None, :], seen[..., 2:]

    def _arc(self, values: Mapping[str, float]) -> Supposed:
        """The arc of one variant."""
        directions = [values.get(f"direction_{k}", angle) for k, angle in zip(self.numbers, self.angles, strict=True)]
        gains = self.gains(values)
        radius = self.radius * values.get("arm", 1.0)
        toward = np.stack([np.cos(directions), np.sin(directions)], axis=1)
        arm = 1.0 if self.drive == "tension" else radius
        own = {**values, "inertia": max(values.get("inertia", 0.0), STEP**2)}
        return driven_arc(self.wrist, own, radius * toward, gains / (values["stiffness"] * arm))

    def gains(self, values: Mapping[str, float]) -> Array:
        """Gain of each tendon over the mean of those that move (M,)."""
        gains = {number: values.get(f"gain_{number}", 1.0) for number in self.numbers}
        first, *others = self.moving
        gains[first] = len(others) + 1.0 - sum(gains[number] for number in others)
        return np.array([gains[number] for number in self.numbers])
