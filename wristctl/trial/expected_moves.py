"""What small moves of one tendon should make of a slack wrist, by the believed one, and what it means otherwise."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.supervised_wait import Reading
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, away_of, in_plane
from wristctl.wrist.out_of_plane import across_of

# Springs that are stiffer than believed and friction may ask for so many times the pull that the model says, and with
# friction of the wrist's own; twice the steps stay wrong.
_HARDER, _RUBBING = 1.5, 2.5
# By how much longer than believed the path of a rigid tendon is taken to be: half of what a pulley may be off.
_LONGER = 1.015
# Shares of the believed bend that a small move may make: soft tendons and where zero was found.
LEAST, MOST = 0.6, 1.35
# Share of the least bend by which a wrist that nothing pulls may stand off without friction of its own.
_RUBS = 0.5
# Share of the least bend that a wrist without a taut tendon may move by: noise, and springs that creep.
SLACK = 0.7
_SCREWED = "check which tendon is on which motor, and markers.positive"


class Bend(NamedTuple):
    """In the plane, and away from the camera; rad, the latter nan where the marker's size is not measured.

    In two planes toward ulnar, and toward flexion.
    """

    theta: float
    away: float

    @property
    def askew(self) -> float:
        """Size of the bend, in any direction."""
        return math.hypot(self.theta, self.away if math.isfinite(self.away) else 0.0)

    def since(self, before: "Bend") -> "Bend":
        """By how much it differs from one before."""
        return Bend(self.theta - before.theta, self.away - before.away)


def middle(bends: Sequence[Bend]) -> Bend:
    """Mean of bends."""
    return Bend(*np.mean(bends, axis=0).tolist())


class ExpectedMoves:
    """By the believed wrist: the side of each axis in the plane and across it, and steps for one radian.

    A tendon that is alone bends the wrist toward itself, which is askew: by theta in the plane and, with springs that
    are alike, by as much across. So it shortens by c theta + c away, and stretches by K theta/(c k_t).
    """

    def __init__(self, settings: RigSettings, wrist: WristParameters, plane: str) -> None:
        self._homing, self._spools = settings.homing, spools_of(settings.actuator)
        self._softest = min(settings.safety.softest, self._spools.stiffness)
        self._plus, self._away = on_plus_side(plane), away_of(plane, settings.markers.positive)
        self._scale = 2.0 * settings.markers.distance / wrist.length
        beside_plane = next(direction.name for direction in DIRECTIONS.values() if direction.plane != plane)
        across = across_of(in_plane(wrist, plane), self._away).stiffness
        beside = across_of(in_plane(wrist, beside_plane), self._away).stiffness
        self._ratio = across / beside if across > 0.0 and beside > 0.0 else 1.0
        self._offset, self._stiffness = wrist.tendon_offset, max(0.0, across)

    def steps(self, stiffness: float | None = None, harder: float = 1.0) -> float:
        """Reeled in for one radian in the plane, by tendons as believed or of this stiffness; of any axis the same."""
        k = self._spools.stiffness if stiffness is None else stiffness
        path = self._offset * (1.0 + self._ratio) + harder * self._stiffness / (self._offset * k)
        return path / self._spools.step

    def tendon_stiffness(self, steps: Sequence[float]) -> float:
        """Stiffness of the tendons [N/m] by steps per radian (4,) that homing took: as believed, or less.

        What they take beyond the path of rigid tendons is stretch, but for what a pulley may be off.
        """
        rigid, believed = self.steps(math.inf), self._spools.stiffness
        stretch = float(np.mean(steps)) - _LONGER * rigid
        if stretch <= self.steps() - rigid:
            return believed
        return max(self._softest, believed * (self.steps() - rigid) / stretch)

    def bend(self, straight: Reading, reading: Reading) -> Bend:
        """Bend of the wrist against a reading of the straight wrist."""
        return Bend(reading.theta - straight.theta, -self._scale * math.log(reading.size / straight.size))

    def along(self, axis: int, bend: Bend) -> float:
        """What of a bend counts as that by an axis [rad]."""
        return bend.theta

    def toward(self, axis: int, bend: Bend) -> float:
        """How far a bend goes toward the tendon of an axis [rad]."""
        return bend.theta if self._plus[axis] else -bend.theta

    def size(self, bend: Bend) -> float:
        """Size of what counts of a bend, whichever axis has made it [rad]."""
        return abs(bend.theta)

    def _axis_of(self, plus: bool, away: int) -> int:
        """The axis that pulls to this side of the plane, and away from the camera (1) or toward it (-1)."""
        return next(k for k in range(4) if (bool(self._plus[k]), self._away[k]) == (plus, away))

    def judge_side(self, axis: int, bend: Bend) -> None:
        """Raises SafetyStop where a bend by reeling in is another tendon's. One of noise tells nothing."""
        noise = 0.5 * math.radians(self._homing.bend_deg)
        plus = bool(self._plus[axis]) if abs(bend.theta) < noise else bend.theta > 0.0
        away = self._away[axis] if not abs(bend.away) > noise else (1 if bend.away > 0.0 else -1)
        if (plus, away) == (bool(self._plus[axis]), self._away[axis]):
            return
        like = self._axis_of(plus, away)
        where = "to the other side than" if plus != self._plus[axis] else "across its plane otherwise than"
        problem = f"axis {axis} bends the wrist {where} tendon {ACTIVE[axis]} should: as tendon {ACTIVE[like]} would"
        likely = f"motors of axes {axis} and {like} exchanged, or tendons {ACTIVE[axis]} and {ACTIVE[like]}"
        if plus != self._plus[axis] and away != self._away[axis]:
            likely = f"it turns the wrong way while others are taut, or {likely}"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", _SCREWED)

    def judge_line(self, axis: int, moved: Bend, reeled: Sequence[int], bends: Sequence[Bend]) -> float:
        """Direction [rad] in which bends grow with what an axis has reeled in, nan in one plane.

        Raises SafetyStop where it is another tendon's; `moved` is the last bend against where the wrist rested before.
        """
        self.judge_side(axis, moved)
        return math.nan

    def _stretch(self, stays: float) -> float:
        """By how much friction that holds a wrist bent by `stays` [rad] stretches the softest tendon [m]."""
        return self._stiffness * stays / (self._offset * self._softest)

    def has_steps(self, steps: float, stays: float = 0.0) -> bool:
        """Whether steps per radian are those of the model, within `homing.steps_tolerance`.

        The tolerance is doubled where the wrist stays bent by `stays` [rad] when nothing pulls. Its own friction then
        carries a part of the torque of a small bend, and may keep it from bending across the plane.
        """
        rubs = stays > _RUBS * math.radians(self._homing.bend_deg)
        share, harder = (2.0 if rubs else 1.0) * self._homing.steps_tolerance, _RUBBING if rubs else _HARDER
        return (1.0 - share) * self.steps() <= steps <= (1.0 + share) * self.steps(self._softest, harder)

    def judge_steps(self, axis: int, steps: float, stays: float = 0.0) -> None:
        """Raises SafetyStop where steps per radian are not those of the model, as `has_steps`."""
        if self.has_steps(steps, stays):
            return
        fix = (
            "see the DIP switches of the drive and actuator.microstep, and measure the pulley (actuator.pulley_radius)"
        )
        ratio = steps / self.steps()
        problem = (
            f"axis {axis} (tendon {ACTIVE[axis]}) takes {steps:.0f} steps for one radian, {ratio:.2f} times what the "
            f"model says ({self.steps():.0f}); likely wrong microsteps (DIP switches), a wrong pulley, or "
            + ("a slipping tendon, or others that were taut" if ratio > 1.0 else "a marker that is not fixed")
        )
        raise SafetyStop(problem, "homing", fix)

    def judge_slack(self, axis: int, slack: float, stays: float = 0.0) -> None:
        """Raises SafetyStop where a tendon was taut before anything was reeled in.

        A wrist that stays bent by `stays` [rad] when nothing pulls has friction of its own, which stretches the tendon
        by which its taut point is found.
        """
        if slack >= -self._homing.taut - self._stretch(stays):
            return
        problem = f"tendon {ACTIVE[axis]} was taut by {-1e3 * slack:.2f} mm when homing began"
        raise SafetyStop(problem, "homing", "slacken all tendons first: wristctl hw slacken, or by hand")

    def judge_friction(self, axis: int, friction: float, stays: float) -> None:
        """Raises SafetyStop where a tendon sticks by more than `homing.sticks` between reeling in and letting go [m].

        A wrist that stays bent by up to `stays` [rad] when nothing pulls has friction of its own, which stretches a
        tendon by as much once more each way.
        """
        if friction <= self._homing.sticks + 2.0 * self._stretch(stays):
            return
        problem = f"tendon {ACTIVE[axis]} sticks: {1e3 * friction:.2f} mm between reeling in and letting go"
        fix = "see whether it chafes or its sheath is bent sharply; or raise homing.sticks"
        raise SafetyStop(problem, "homing", fix)

    def judge_slackened(self, bend: Bend) -> None:
        """Raises SafetyStop where a wrist that nothing should hold moves when its tendons are let out further."""
        if bend.askew <= SLACK * math.radians(self._homing.bend_deg):
            return
        away = 1 if bend.away > 0.0 else -1
        raise self.still_moved(bend, self._axis_of(bend.theta > 0.0, away), self._axis_of(bend.theta < 0.0, -away))

    def still_moved(self, bend: Bend, pulls: int, holds: int) -> SafetyStop:
        """The stop of a wrist that moved toward the tendon of one axis, away from another's."""
        problem = f"a slackened wrist still moved by {math.degrees(bend.askew):.1f} deg when it was slackened further"
        likely = (
            f"tendon {ACTIVE[holds]} is shorter than it was, caught or slipped on its pulley, or axis {pulls} "
            f"(tendon {ACTIVE[pulls]}) turns the wrong way"
        )
        fix = "see tendons and motors, then calibrate the wrist again"
        return SafetyStop(f"{problem}; likely {likely}", "homing", fix)

    def judge_cocontraction(self, bend: Bend) -> None:
        """Raises SafetyStop where a slackened wrist bends when one side's tendons are let out further."""
        if bend.askew <= SLACK * math.radians(self._homing.bend_deg):
            return
        raise self.against_each_other(bend, self._axis_of(bend.theta > 0.0, 1 if bend.away > 0.0 else -1))

    def against_each_other(self, bend: Bend, pulls: int) -> SafetyStop:
        """The stop of a wrist that bent toward the tendon of an axis."""
        problem = (
            f"tendons pull against each other: the slackened wrist bent by {math.degrees(bend.askew):.1f} deg when one "
            f"side was let out; likely tendon {ACTIVE[pulls]} (axis {pulls}) and one opposite are shorter than the "
            "motors' positions say: steps that nobody counted, a knot, or zero positions that are wrong; or a marker "
            "has slipped"
        )
        fix = "see tendons, motor cables and their shields, then calibrate the wrist again"
        return SafetyStop(problem, "homing", fix)

    def judge_small_move(self, axis: int, reeled: float, bend: Bend) -> None:
        """Raises SafetyStop where reeling in by so many steps beyond the taut point did not bend as it should."""
        meant = reeled / self.steps()
        if max(abs(bend.theta), abs(bend.away) if math.isfinite(bend.away) else 0.0) < LEAST * meant:
            raise self.bends_too_little(axis, bend.theta, meant)
        self.judge_side(axis, bend)
        if abs(bend.theta) > MOST * meant:
            self.judge_steps(axis, reeled / abs(bend.theta))

    def bends_too_little(self, axis: int, bend: float, meant: float) -> SafetyStop:
        """The stop of an axis that bends the wrist by less than was meant [rad]."""
        problem = (
            f"axis {axis} (tendon {ACTIVE[axis]}) bends the wrist by {math.degrees(bend):.1f} deg instead of "
            f"{math.degrees(meant):.1f} deg; likely it turns the wrong way, its tendon is off the pulley, or it "
            "has no power"
        )
        return SafetyStop(problem, "homing", "calibrate the wrist again; see motor, drive and tendon")
