"""What small moves of one tendon should make of a slack wrist before two cameras: it bends toward that tendon's place.

The direction alone says which tendon it is.
"""

import math
from collections.abc import Sequence

import numpy as np

from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import LEAST, MOST, SLACK, Bend, ExpectedMoves
from wristctl.trial.rig_belief import PLANES, pull_directions
from wristctl.trial.safety import SafetyStop
from wristctl.trial.supervised_wait import Reading
from wristctl.wrist.directions import ACTIVE, in_plane
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.spatial.spatial_segments import ellipse

_LAYOUT = "check which tendon is on which motor, markers.positive of both cameras, and which camera sees which plane"


class SpatialMoves(ExpectedMoves):
    """By the believed wrist: the direction in which each axis bends it, and steps for one radian.

    A tendon at a place c that pulls T alone bends the wrist by K^-1 c T, which takes c.K^-1 c T off its path, and
    stretches it by T/k_t.
    """

    def __init__(self, settings: RigSettings, wrist: WristParameters) -> None:
        super().__init__(settings, wrist, "ulnar")
        along, across = wrist.stiffness, wrist.stiffness * wrist.flexion_ratio
        yy, yz, zz = ellipse(along, across, math.radians(wrist.stiffness_axis_deg))
        sinking = [across_of(in_plane(wrist, plane), (0,) * 4).stiffness for plane in PLANES]
        springs = np.array([[yy, yz], [yz, zz]])
        springs[np.diag_indices(2)] += np.array(sinking) - [in_plane(wrist, plane).stiffness for plane in PLANES]
        places = wrist.tendon_radius * np.stack([np.cos(pull_directions()), np.sin(pull_directions())], axis=1)
        bends = np.linalg.solve(springs, places.T).T
        self._toward = bends / np.hypot(*bends.T)[:, None]
        self._path = (places * self._toward).sum(axis=1)
        self._pull = 1.0 / np.hypot(*bends.T)
        self._astray = math.radians(settings.homing.direction_deg)

    def steps(self, stiffness: float | None = None, harder: float = 1.0) -> float:
        """Reeled in for one radian toward an axis' own direction, the mean over all axes."""
        k = self._spools.stiffness if stiffness is None else stiffness
        return float(np.mean(self._path + harder * np.maximum(0.0, self._pull) / k)) / self._spools.step

    def bend(self, straight: Reading, reading: Reading) -> Bend:
        """Bend of the wrist toward ulnar and flexion against a reading of the straight wrist."""
        return Bend(reading.theta - straight.theta, reading.beside - straight.beside)

    def along(self, axis: int, bend: Bend) -> float:
        """The part of a bend toward an axis' direction [rad]."""
        return float(self._toward[axis] @ bend)

    def toward(self, axis: int, bend: Bend) -> float:
        """How far a bend goes toward the tendon of an axis [rad]."""
        return self.along(axis, bend)

    def size(self, bend: Bend) -> float:
        """Size of the bend [rad]."""
        return bend.askew

    def place(self, axis: int) -> float:
        """Direction [rad] in which an axis bends the wrist, from ulnar toward flexion."""
        return math.atan2(self._toward[axis][1], self._toward[axis][0])

    def _off(self, bend: Bend) -> list[float]:
        """Angle between a bend and the direction of each axis [rad]."""
        unit = np.array(bend) / bend.askew
        return [math.acos(max(-1.0, min(1.0, float(toward @ unit)))) for toward in self._toward]

    def judge_side(self, axis: int, bend: Bend) -> None:
        """Raises SafetyStop where a bend is not toward the axis' tendon, by more than `homing.direction_deg`."""
        off = self._off(bend)
        if not off[axis] > self._astray:
            return
        toward, meant = (math.degrees(angle) % 360.0 for angle in (math.atan2(bend.away, bend.theta), self.place(axis)))
        nearest = int(np.argmin(off))
        tendon, other = ACTIVE[axis], ACTIVE[nearest]
        problem = f"axis {axis} bends the wrist toward {toward:.0f} deg, and tendon {tendon} is at {meant:.0f} deg"
        if off[nearest] > self._astray:
            likely = "tendons that run through other holes, or cameras that do not look square at their planes"
        else:
            turns = "it turns the wrong way while others are taut, or " * (off[axis] > math.pi - self._astray)
            exchanged = f"motors of axes {axis} and {nearest} exchanged, or tendons {tendon} and {other}"
            likely, problem = f"{turns}{exchanged}", f"{problem}: as tendon {other} would"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", _LAYOUT)

    def judge_line(self, axis: int, moved: Bend, reeled: Sequence[int], bends: Sequence[Bend]) -> float:
        """The direction [rad] of a line through the straight wrist and the bends, from ulnar toward flexion.

        Raises SafetyStop where it is not the axis' own.
        """
        slope, offset = np.polyfit(reeled, [self.along(axis, bent) for bent in bends], 1)
        grown = Bend(*((slope * np.array(reeled) + offset) @ np.array(bends)).tolist())
        self.judge_side(axis, grown)
        return math.atan2(grown.away, grown.theta)

    def _nearest(self, bend: Bend) -> tuple[int, int]:
        """The axis toward which a bend is, and the one away from which it is."""
        off = self._off(bend)
        return int(np.argmin(off)), int(np.argmax(off))

    def judge_slackened(self, bend: Bend) -> None:
        """Raises SafetyStop where a wrist that nothing should hold moves when its tendons are let out further."""
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self.still_moved(bend, *self._nearest(bend))

    def judge_cocontraction(self, bend: Bend) -> None:
        """Raises SafetyStop where a slackened wrist bends when one side's tendons are let out further."""
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self.against_each_other(bend, self._nearest(bend)[0])

    def judge_small_move(self, axis: int, reeled: float, bend: Bend) -> None:
        """Raises SafetyStop where reeling in by so many steps beyond the taut point did not bend as it should."""
        meant = reeled / self.steps()
        if bend.askew < LEAST * meant:
            raise self.bends_too_little(axis, bend.askew, meant)
        self.judge_side(axis, bend)
        if bend.askew > MOST * meant:
            self.judge_steps(axis, reeled / bend.askew)
