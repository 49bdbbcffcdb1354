"""What small moves of one tendon should make of a slack wrist, by the believed one, and what it means otherwise."""

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from wristctl.arrays import Array
from wristctl.board.messages import AXES
from wristctl.config.hw_run import RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.rig_belief import PLANES, names_of_planes, numbers_of, places_of_tendons, pull_directions
from wristctl.trial.rig_words import AGAINST, why_dead, words_of_board, words_of_rig
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import on_plus_side, spools_of
from wristctl.trial.supervised_wait import Reading
from wristctl.wrist.directions import OPPOSITE_AXES, away_of, in_plane
from wristctl.wrist.lone_tendons import bends_alone, stiffness_by_length
from wristctl.wrist.out_of_plane import across_of
from wristctl.wrist.tendon_layout import TendonLayout

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

    The spool reels in path + torque/(lever k_t), (T,) [m/rad], of a tendon of the stiffness k_t.
    """

    toward: Array
    """(T, 2), as a Bend has it: a unit vector, or before one camera 1 and -1 for the sides in the plane and across."""
    path: Array
    torque: Array
    lever: Array


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


def _of_layout(wrist: WristParameters, layout: TendonLayout, planes: int) -> _Alone:
    """Of these tendons, whose bend is measured in so many planes: of one plane as that sees it."""
    toward, path, sizes = bends_alone(wrist, layout.cross_section)
    seen = np.hypot.reduce(toward[:, :planes], axis=1)
    sides = np.zeros_like(toward)
    sides[:, :planes] = toward[:, :planes] / seen[:, None]
    return _Alone(sides, path / seen, np.ones(len(path)), sizes * seen)


def _turns(toward: Array) -> tuple[tuple[int, ...], ...]:
    """Pairs of axes of which each is the one most opposite to the other; axes without one alone."""
    against = np.argmin(toward @ toward.T, axis=1).tolist()
    found = list[tuple[int, ...]]()
    for axis, other in enumerate(against):
        if against[other] != axis:
            found.append((axis,))
        elif axis < other:
            found.append((axis, other))
    return tuple(found)


class ExpectedMoves:
    """By the believed wrist: where each axis bends it, alone, and the steps for one radian of what counts.

    Before one camera a bend counts in its plane, and of the bend across the side alone is told; before two both count,
    and its direction tells the tendon.
    """

    def __init__(
        self, settings: RigSettings, wrist: WristParameters, plane: str, layout: TendonLayout | None = None
    ) -> None:
        self._homing, self._spools, self._planes = settings.homing, spools_of(settings.actuator), settings.planes
        self._softest = min(settings.safety.softest, self._spools.stiffness)
        self._astray = math.radians(settings.homing.direction_deg)
        self._scale = 2.0 * settings.markers.distance / wrist.length
        facing = plane or PLANES[0]
        away = away_of(facing, settings.markers.positive)
        other = next(name for name in PLANES if name != facing)
        across, beside = (across_of(in_plane(wrist, name), away).stiffness for name in (facing, other))
        ratio = across / beside if across > 0.0 and beside > 0.0 else 1.0
        self.lever, self._stiffness = wrist.tendon_offset, max(0.0, across)
        self.own, self._numbers = getattr(settings, "rig", None) is not None, numbers_of(layout)
        self._alike = layout is None
        named = names_of_planes(settings.planes, facing)
        self._words = (words_of_rig if self.own else words_of_board)(self._numbers, named)
        if layout is not None:
            self.lever = float(np.abs(layout.cross_section).max())
            self._alone = _of_layout(wrist, layout, settings.planes)
        elif self._planes == 1:
            self._alone = _before_one_camera(wrist, plane, away, self._stiffness, ratio)
        else:
            self._alone = _before_two(wrist)
        places = places_of_tendons((facing,), layout)
        self.plus = places == 0
        """Which axes (T,) wind a tendon of the first plane's + side."""
        self.turns = OPPOSITE_AXES if layout is None else _turns(self._alone.toward)
        """Axes that are measured one after the other: opposite pairs, and those alone that have none."""

    def steps(self, stiffness: float | None = None, harder: float = 1.0, axis: int | None = None) -> float:
        """Steps for one radian of what counts, by tendons as believed or of this stiffness: their mean, or an axis'."""
        k, (_, path, torque, lever) = self._spools.stiffness if stiffness is None else stiffness, self._alone
        steps = path + harder * torque / (lever * k)
        if axis is not None and not self._alike:
            return float(steps[axis]) / self._spools.step
        return math.fsum(steps) / len(path) / self._spools.step

    def tendon_stiffness(self, steps: Sequence[float]) -> float:
        """Stiffness of the tendons [N/m] by steps per radian (4,) that homing took: as believed, or less.

        What they take beyond the path of rigid tendons is stretch, but for what a pulley may be off.
        """
        rigid, believed = self.steps(math.inf), self._spools.stiffness
        stretch = float(np.mean(steps)) - _LONGER * rigid
        if stretch <= self.steps() - rigid:
            return believed
        return max(self._softest, believed * (self.steps() - rigid) / stretch)

    def measured_stiffness(self, steps: Sequence[float]) -> float:
        """Stiffness [N/m] of tendons on the believed wrist that take the steps per radian (T,) which homing took.

        Springs, tendons, their friction and pulleys that differ from what is believed all come in as stretch, so that
        spools wind as far as this wrist asks for a bend; within `stiffness_by_length`.
        """
        rigid, believed = self.steps(math.inf), self._spools.stiffness
        return stiffness_by_length(believed, believed * (self.steps() - rigid), float(np.mean(steps)) - rigid)

    def wound_by(self, steps: Sequence[float]) -> float | None:
        """`measured_stiffness` where spools are to wind by it; None where by what is believed."""
        return self.measured_stiffness(steps) if self._homing.stretch == "measured" else None

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

    def against(self, axis: int) -> int:
        """The axis that bends the wrist most opposite to one."""
        return int(np.argmin(self._alone.toward[:, : self._planes] @ self._alone.toward[axis, : self._planes]))

    def toward(self, axis: int) -> Array:
        """Direction in which an axis bends the wrist, as far as it is measured (P,)."""
        return self._alone.toward[axis, : self._planes]

    def place(self, axis: int) -> float:
        """Direction [rad] in which an axis bends the wrist, from the first part of a bend toward the second."""
        toward, aside = self._alone.toward[axis]
        return math.atan2(aside, toward)

    def _nearest(self, bend: Bend) -> tuple[int, int]:
        """The axis toward which a bend is, and the one away from which it is."""
        shares = self._alone.toward @ np.nan_to_num(bend)
        return int(np.argmax(shares)), int(np.argmin(shares))

    def told(self, axis: int, bend: Bend) -> tuple[int | None, str]:
        """The axis as whose a bend by this one is seen, None for no axis; and in words where that bends the wrist.

        One camera tells sides, of parts of a bend that are no noise; two tell a direction.
        """
        own, meant = self._alone.toward[axis], f"tendon {self._numbers[axis]}"
        if self._planes == 1:
            noise = 0.5 * math.radians(self._homing.bend_deg)
            sides = np.where(np.abs(np.nan_to_num(bend)) < noise, own, np.sign(bend))
            where = "to the other side than" if sides[0] != own[0] else "across its plane otherwise than"
            shares = self._alone.toward @ sides
            like = axis if shares[axis] >= shares.max() else int(np.argmax(shares))
            return like, f"{where} {meant} should"
        off = np.arccos(np.clip(self._alone.toward @ bend / bend.askew, -1.0, 1.0))
        toward, place = (math.degrees(angle) % 360.0 for angle in (math.atan2(bend.away, bend.theta), self.place(axis)))
        nearest = axis if off[axis] <= self._astray else int(np.argmin(off))
        told = nearest if off[nearest] <= self._astray else None
        return told, f"toward {toward:.0f} deg, and {meant} is at {place:.0f} deg"

    def judge_side(self, axis: int, bend: Bend) -> None:
        """Raises SafetyStop where a bend by reeling in is another tendon's, or before two cameras no tendon's."""
        like, where = self.told(axis, bend)
        if like == axis:
            return
        problem = f"{self._words.names[axis]} bends the wrist {where}"
        likely = f"tendons that run through other holes, or {self._words.askew}"
        if like is not None:
            problem = f"{problem}: as tendon {self._numbers[like]} would"
            one, other = (self._numbers[each] for each in (axis, like))
            motors = self._words.exchanged.format(axis, like, one, other)
            likely = f"{motors} exchanged, or tendons {one} and {other}"
            if {axis, like} in map(set, self.turns):
                likely = f"it turns the wrong way while others are taut, or {likely}"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", self._words.wiring)

    def wrong_sense(self, axis: int) -> SafetyStop:
        """The stop of a rig's motor that reels in by a smaller target."""
        problem = f"{self._words.names[axis]} has the wrong sense: a smaller target reels it in"
        return SafetyStop(problem, "homing", f"turn the sign of {self._words.names[axis]} in send() and connect()")

    def does_not_bend(self, axis: int, one_way: bool) -> SafetyStop:
        """The stop of a motor that bends the wrist nowhere, tried the `one_way` that a calibration says or both."""
        problem = f"{self._words.motors[axis]} does not bend the wrist within {1e3 * self._homing.slack:g} mm"
        return SafetyStop(f"{problem}; likely {why_dead(one_way)}", "homing", self._words.dead.format(axis=axis))

    def bent_too_far(self, axis: int, bend: Bend) -> SafetyStop:
        """The stop of a motor that bends the wrist further than homing does."""
        bent = math.degrees(math.copysign(self.size(bend), self.along(axis, bend)))
        problem = f"{self._words.names[axis]} bent the wrist by {bent:.1f} deg while homing"
        return SafetyStop(problem, "homing", "slacken all tendons first")

    def pulls_differently(self, axis: int) -> SafetyStop:
        """The stop of a tendon without a line."""
        return SafetyStop(f"tendon {self._numbers[axis]} pulls differently each time", "homing", "see whether it slips")

    def judge_line(self, axis: int, moved: Bend, reeled: Sequence[int], bends: Sequence[Bend]) -> float:
        """Direction [rad] in which bends grow with what an axis has reeled in, nan before one camera.

        They grow from straight, unless they tell that a wrist that its friction holds began three standard errors off.
        Raises SafetyStop where it is another tendon's; `moved` is the last bend against where the wrist rested before.
        """
        if self._planes == 1:
            self.judge_side(axis, moved)
            return math.nan
        x, y = self._alone.toward[axis]
        seen, aside = (np.array(bends) @ np.array([[x, -y], [y, x]])).T
        along = np.polyval(np.polyfit(reeled, seen, 1), reeled)
        (turned, off), covariance = np.polyfit(along, aside, 1, cov="unscaled")
        if off**2 <= 9.0 * np.sum((aside - turned * along - off) ** 2) / (len(aside) - 2) * covariance[1, 1]:
            turned = float(along @ aside / (along @ along))
        self.judge_side(axis, grown := Bend(x - turned * y, y + turned * x))
        return math.atan2(grown.away, grown.theta)

    def _stretch(self, stays: float) -> float:
        """By how much friction that holds a wrist bent by `stays` [rad] stretches the softest tendon [m]."""
        return self._stiffness * stays / (self.lever * self._softest)

    def _rubs(self, stays: float) -> str:
        """Friction of a wrist's own as a cause, before others; empty of one that stays bent by so little [rad]."""
        if stays <= _RUBS * math.radians(self._homing.bend_deg):
            return ""
        return f"friction inside the wrist, which stays bent by {math.degrees(stays):.1f} deg when nothing pulls, or "

    def has_steps(self, axis: int, steps: float, stays: float = 0.0) -> bool:
        """Whether steps per radian are those of the model, within `homing.steps_tolerance`.

        The tolerance is doubled where the wrist stays bent by `stays` [rad] when nothing pulls. Its own friction then
        carries a part of the torque of a small bend, and may keep it from bending across the plane.
        """
        rubs = bool(self._rubs(stays))
        share, harder = (2.0 if rubs else 1.0) * self._homing.steps_tolerance, _RUBBING if rubs else _HARDER
        most = (1.0 + share) * self.steps(self._softest, harder, axis)
        return (1.0 - share) * self.steps(axis=axis) <= steps <= most

    def judge_steps(self, axis: int, steps: float, stays: float = 0.0) -> None:
        """Raises SafetyStop where steps per radian are not those of the model, as `has_steps`."""
        if not self.has_steps(axis, steps, stays):
            raise self._wrong_steps(axis, steps, self.steps(axis=axis), stays)

    def judge_growth(self, axis: int, steps: float, stiffness: float) -> None:
        """Raises SafetyStop where a bend grows by steps nearer to half or twice the model's of this stiffness [N/m]."""
        if not 0.5 < (steps / (meant := self.steps(stiffness, axis=axis))) ** 2 < 2.0:
            raise self._wrong_steps(axis, steps, meant)

    def _wrong_steps(self, axis: int, steps: float, meant: float, stays: float = 0.0) -> SafetyStop:
        ratio, unit = steps / meant, self._spools.step
        taken = f"{1e3 * steps * unit:.3g} mm of tendon" if self.own else f"{steps:.0f} steps"
        model = f"{1e3 * meant * unit:.3g} mm" if self.own else f"{meant:.0f}"
        words, slips = self._words, "a slipping tendon, or others that were taut"
        problem = (
            f"{words.motors[axis]} takes {taken} for one radian, {ratio:.2f} times what the model says ({model}); "
            f"likely {self._rubs(stays)}{words.scale}, or {slips if ratio > 1.0 else words.loose}"
        )
        return SafetyStop(problem, "homing", words.rescale)

    def judge_slack(self, axis: int, slack: float, stays: float = 0.0) -> None:
        """Raises SafetyStop where a tendon was taut before anything was reeled in.

        A wrist that stays bent by `stays` [rad] when nothing pulls has friction of its own, which stretches the tendon
        by which its taut point is found, and may hold it as far across a plane that alone is seen.
        """
        if slack >= -self._homing.taut - self._stretch(stays) - (self.lever * stays if self._planes == 1 else 0.0):
            return
        likely = f"; likely {rubs}it was not let out" if (rubs := self._rubs(stays)) else ""
        problem = f"tendon {self._numbers[axis]} was taut by {-1e3 * slack:.2f} mm when homing began{likely}"
        raise SafetyStop(problem, "homing", self._words.taut)

    def judge_friction(self, axis: int, friction: float, stays: float) -> None:
        """Raises SafetyStop where a tendon sticks by more than `homing.sticks` between reeling in and letting go [m].

        A wrist that stays bent by up to `stays` [rad] when nothing pulls has friction of its own, which stretches a
        tendon by as much once more each way.
        """
        if friction <= self._homing.sticks + 2.0 * self._stretch(stays):
            return
        problem = f"tendon {self._numbers[axis]} sticks: {1e3 * friction:.2f} mm between reeling in and letting go"
        raise SafetyStop(problem, "homing", "see whether it chafes or a sheath is bent sharply; or raise homing.sticks")

    def judge_slackened(self, bend: Bend) -> None:
        """Raises SafetyStop where a wrist that nothing should hold moves when its tendons are let out further."""
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self._still_moved(bend, *self._nearest(bend))

    def _still_moved(self, bend: Bend, pulls: int, holds: int) -> SafetyStop:
        """The stop of a wrist that moved toward the tendon of one axis, away from another's."""
        problem = f"a slackened wrist still moved by {math.degrees(bend.askew):.1f} deg when it was slackened further"
        likely = (
            f"tendon {self._numbers[holds]} is shorter than it was, caught or slipped on its pulley, or "
            f"{self._words.motors[pulls]} turns the wrong way"
        )
        fix = f"see tendons and motors, then {self._words.again}"
        return SafetyStop(f"{problem}; likely {likely}", "homing", fix)

    def judge_cocontraction(self, bend: Bend) -> None:
        """Raises SafetyStop where a slackened wrist bends when one side's tendons are let out further."""
        if bend.askew > SLACK * math.radians(self._homing.bend_deg):
            raise self._against_each_other(bend, self._nearest(bend)[0])

    def _against_each_other(self, bend: Bend, pulls: int) -> SafetyStop:
        """The stop of a wrist that bent toward the tendon of an axis."""
        whose = "" if self.own else f" (axis {pulls})"
        problem = (
            f"{AGAINST}: the slackened wrist bent by {math.degrees(bend.askew):.1f} deg when one "
            f"side was let out; likely tendon {self._numbers[pulls]}{whose} and one opposite are shorter than the "
            f"motors' positions say: {self._words.against}"
        )
        return SafetyStop(problem, "homing", f"see tendons, motor cables and their shields, then {self._words.again}")

    def judge_small_move(self, axis: int, reeled: float, bend: Bend, stiffness: float | None = None) -> None:
        """Raises SafetyStop where reeling in by so many steps beyond the taut point did not bend as it should.

        Tendons are as believed, or of the stiffness [N/m] that homing has measured.
        """
        meant, size = reeled / self.steps(stiffness, axis=axis), self.size(bend)
        if max(size, abs(np.nan_to_num(bend.away))) < LEAST * meant:
            raise self.bends_too_little(axis, bend, meant)
        self.judge_side(axis, bend)
        if size > MOST * meant:
            self.judge_steps(axis, reeled / size)

    def bends_too_little(self, axis: int, bend: Bend, meant: float) -> SafetyStop:
        """The stop of an axis that bends the wrist by less than was meant [rad]."""
        problem = (
            f"{self._words.motors[axis]} bends the wrist by {math.degrees(self.along(axis, bend)):.1f} deg "
            f"instead of {math.degrees(meant):.1f} deg; likely it turns the wrong way, its tendon is off the pulley, "
            "or it has no power"
        )
        return SafetyStop(problem, "homing", f"{self._words.again}; see motor, drive and tendon")
