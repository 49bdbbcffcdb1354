"""What small moves of one tendon should make of a slack wrist, by the believed one, and what it means otherwise."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.rig_belief import PLANES, pull_directions
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.supervised_wait import Reading
from wristctl.wrist.directions import ACTIVE, OPPOSITE_AXES, away_of, in_plane
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.spatial.spatial_segments import ellipse

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
_SCREWED = (
    "check which tendon is on which motor, and markers.positive",
    "check which tendon is on which motor, markers.positive of both cameras, and which camera sees which plane",
)
"""What to do about tendons that bend the wrist elsewhere, before one camera and before two."""


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


class _Alone(NamedTuple):
    """One tendon alone, of each axis: where it bends the wrist, and what its spool reels in for a radian.

    The spool reels in path + torque/(lever k_t), of a tendon of the stiffness k_t.
    """

    toward: Array
    """(4, 2), as a Bend has it: a unit vector, or before one camera 1 and -1 for the sides in the plane and across."""
    path: Array
    """(4,) [m/rad]"""
    torque: Array
    """(4,)"""
    lever: Array
    """(4,)"""


def _before_one_camera(wrist: WristParameters, plane: str, away: Sequence[int], torque: float, ratio: float) -> _Alone:
    """It bends the wrist askew: by theta in the plane and, with springs that are alike, by as much across.

    So it shortens by c theta + c away, and stretches by K theta/(c k_t), for one radian in the plane.
    """
    sides, c = np.where(on_plus_side(plane), 1.0, -1.0), wrist.tendon_offset
    toward = np.stack([sides, np.array(away, float)], axis=1)
    return _Alone(toward, np.full(AXES, c * (1.0 + ratio)), np.full(AXES, torque), np.full(AXES, c))


def _before_two(wrist: WristParameters) -> _Alone:
    """Of the board's four, before two cameras."""
    places = wrist.tendon_radius * np.stack([np.cos(pull_directions()), np.sin(pull_directions())], axis=1)
    toward, path, sizes = bends_alone(wrist, places)
    return _Alone(toward, path, np.ones(AXES), sizes)


def bends_alone(wrist: WristParameters, places: Array) -> tuple[Array, Array, Array]:
    """A small bend of a slack wrist by one tendon alone, of each at its place c (T, 2) [m].

    It bends the wrist by K^-1 c T for a pull T, which takes c.K^-1 c T off its path. Returns where to, unit vectors
    (T, 2); what a radian takes off the path (T,) [m/rad]; and the bend by a newton (T,) [rad/N].
    """
    along, across = wrist.stiffness, wrist.stiffness * wrist.flexion_ratio
    yy, yz, zz = ellipse(along, across, math.radians(wrist.stiffness_axis_deg))
    sinking = [across_of(in_plane(wrist, plane), (0,) * AXES).stiffness for plane in PLANES]
    springs = np.array([[yy, yz], [yz, zz]])
    springs[np.diag_indices(2)] += np.array(sinking) - [in_plane(wrist, plane).stiffness for plane in PLANES]
    bends = np.linalg.solve(springs, places.T).T
    sizes = np.hypot(*bends.T)
    toward = bends / sizes[:, None]
    return toward, (places * toward).sum(axis=1), sizes


class ExpectedMoves:
    """By the believed wrist: where each axis bends it, alone, and the steps for one radian of what counts.

    Before one camera a bend counts in its plane, and of the bend across the side alone is told; before two both count,
    and its direction tells the tendon.
    """

    def __init__(self, settings: RigSettings, wrist: WristParameters, plane: str) -> None:
        self._homing, self._spools, self._planes = settings.homing, spools_of(settings.actuator), settings.planes
        self._softest = min(settings.safety.softest, self._spools.stiffness)
        self._astray = math.radians(settings.homing.direction_deg)
        self._scale = 2.0 * settings.markers.distance / wrist.length
        facing = plane or PLANES[0]
        away = away_of(facing, settings.markers.positive)
        other = next(name for name in PLANES if name != facing)
        across, beside = (across_of(in_plane(wrist, name), away).stiffness for name in (facing, other))
        ratio = across / beside if across > 0.0 and beside > 0.0 else 1.0
        self._offset, self._stiffness = wrist.tendon_offset, max(0.0, across)
        one = self._planes == 1
        self._alone = _before_one_camera(wrist, plane, away, self._stiffness, ratio) if one else _before_two(wrist)

    def steps(self, stiffness: float | None = None, harder: float = 1.0) -> float:
        """Reeled in for one radian of what counts, by tendons as believed or of this stiffness; mean of all axes."""
        k, (_, path, torque, lever) = self._spools.stiffness if stiffness is None else stiffness, self._alone
        return math.fsum(path + harder * torque / (lever * k)) / AXES / self._spools.step

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
        theta = reading.theta - straight.theta
        if self._planes == 1:
            return Bend(theta, -self._scale * math.log(reading.size / straight.size))
        return Bend(theta, reading.beside - straight.beside)

    def along(self, axis: int, bend: Bend) -> float:
        """How far what counts of a bend goes toward the tendon of an axis [rad]."""
        return float(self._alone.toward[axis, : self._planes] @ bend[: self._planes])

    def size(self, bend: Bend) -> float:
        """Size of what counts of a bend, whichever axis has made it [rad]."""
        return math.hypot(*bend[: self._planes])

    def place(self, axis: int) -> float:
        """Direction [rad] in which an axis bends the wrist, from the first part of a bend toward the second."""
        toward, aside = self._alone.toward[axis]
        return math.atan2(aside, toward)

    def _nearest(self, bend: Bend) -> tuple[int, int]:
        """The axis toward which a bend is, and the one away from which it is."""
        shares = self._alone.toward @ np.nan_to_num(bend)
        return int(np.argmax(shares)), int(np.argmin(shares))

    def _told(self, axis: int, bend: Bend) -> tuple[int | None, str]:
        """The axis as whose a bend by this one is seen, None for no axis; and in words where that bends the wrist.

        One camera tells sides, of parts of a bend that are no noise; two tell a direction.
        """
        own, meant = self._alone.toward[axis], f"tendon {ACTIVE[axis]}"
        if self._planes == 1:
            noise = 0.5 * math.radians(self._homing.bend_deg)
            sides = np.where(np.abs(np.nan_to_num(bend)) < noise, own, np.sign(bend))
            where = "to the other side than" if sides[0] != own[0] else "across its plane otherwise than"
            return self._nearest(Bend(*sides.tolist()))[0], f"{where} {meant} should"
        off = np.arccos(np.clip(self._alone.toward @ bend / bend.askew, -1.0, 1.0))
        toward, place = (math.degrees(angle) % 360.0 for angle in (math.atan2(bend.away, bend.theta), self.place(axis)))
        nearest = axis if off[axis] <= self._astray else int(np.argmin(off))
        told = nearest if off[nearest] <= self._astray else None
        return told, f"toward {toward:.0f} deg, and {meant} is at {place:.0f} deg"

    def judge_side(self, axis: int, bend: Bend) -> None:
        """Raises SafetyStop where a bend by reeling in is another tendon's, or before two cameras no tendon's."""
        like, where = self._told(axis, bend)
        if like == axis:
            return
        problem = f"axis {axis} bends the wrist {where}"
        likely = "tendons that run through other holes, or cameras that do not look square at their planes"
        if like is not None:
            problem = f"{problem}: as tendon {ACTIVE[like]} would"
            likely = f"motors of axes {axis} and {like} exchanged, or tendons {ACTIVE[axis]} and {ACTIVE[like]}"
            if {axis, like} in map(set, OPPOSITE_AXES):
                likely = f"it turns the wrong way while others are taut, or {likely}"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", _SCREWED[self._planes - 1])

    def judge_line(self, axis: int, moved: Bend, reeled: Sequence[int], bends: Sequence[Bend]) -> float:
        """Direction [rad] in which bends grow with what an axis has reeled in, nan before one camera.

        Raises SafetyStop where it is another tendon's; `moved` is the last bend against where the wrist rested before.
        """
        if self._planes == 1:
            self.judge_side(axis, moved)
            return math.nan
        slope, offset = np.polyfit(reeled, [self.along(axis, bent) for bent in bends], 1)
        grown = Bend(*((slope * np.array(reeled) + offset) @ np.array(bends)).tolist())
        self.judge_side(axis, grown)
        return math.atan2(grown.away, grown.theta)

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
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self._still_moved(bend, *self._nearest(bend))

    def _still_moved(self, bend: Bend, pulls: int, holds: int) -> SafetyStop:
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
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self._against_each_other(bend, self._nearest(bend)[0])

    def _against_each_other(self, bend: Bend, pulls: int) -> SafetyStop:
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
        meant, size = reeled / self.steps(), self.size(bend)
        if max(size, abs(np.nan_to_num(bend.away))) < LEAST * meant:
            raise self.bends_too_little(axis, bend, meant)
        self.judge_side(axis, bend)
        if size > MOST * meant:
            self.judge_steps(axis, reeled / size)

    def bends_too_little(self, axis: int, bend: Bend, meant: float) -> SafetyStop:
        """The stop of an axis that bends the wrist by less than was meant [rad]."""
        problem = (
            f"axis {axis} (tendon {ACTIVE[axis]}) bends the wrist by {math.degrees(self.along(axis, bend)):.1f} deg "
            f"instead of {math.degrees(meant):.1f} deg; likely it turns the wrong way, its tendon is off the pulley, "
            "or it has no power"
        )
        return SafetyStop(problem, "homing", "calibrate the wrist again; see motor, drive and tendon")
