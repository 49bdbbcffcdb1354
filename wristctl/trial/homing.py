"""Zero of a rig, by small guarded moves: where each tendon is just taut on the straight wrist, and which way it turns.

One motor after the other reels in by small moves until the marker shows a bend, and lets go again; one whose positive
steps pay out shows none and is tried the other way round. Then all tendons are slackened, so that none holds against
another, and each in turn is reeled in through its taut point. From there the bend grows linearly with the tendon, so a
line through the bent readings crosses the straight angle at the taut point; its slope gives steps per radian.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE
from wristctl.config.hw_run import Homing, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import Spools, on_plus_side, spools_of
from wristctl.trial.supervised_wait import Patience, Reading
from wristctl.trial.tracking import Tracking
from wristctl.wrist.directions import ACTIVE, DIRECTIONS, away_of, in_plane
from wristctl.wrist.out_of_plane import across_of

log = logging.getLogger(__name__)

# Springs that are stiffer than believed and friction may ask for so many times the pull that the model says.
_HARDER = 1.5
# Shares of the believed bend that a small move may make: soft tendons and where zero was found.
_LEAST, _MOST = 0.6, 1.35
# Share of the least bend that a wrist without a taut tendon may move by: noise, and springs that creep.
_SLACK = 0.7
_SCREWED = "check which tendon is on which motor, and markers.positive"


class Bend(NamedTuple):
    """In the plane, and away from the camera; rad, the latter nan where the marker's size is not measured."""

    theta: float
    away: float

    @property
    def askew(self) -> float:
        """Size of the bend, in any direction."""
        return math.hypot(self.theta, self.away if math.isfinite(self.away) else 0.0)


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
        """Reeled in for one radian in the plane, by tendons as believed or of this stiffness."""
        k = self._spools.stiffness if stiffness is None else stiffness
        path = self._offset * (1.0 + self._ratio) + harder * self._stiffness / (self._offset * k)
        return path / self._spools.step

    def bend(self, straight: Reading, reading: Reading) -> Bend:
        """Bend of the wrist against a reading of the straight wrist."""
        return Bend(reading.theta - straight.theta, -self._scale * math.log(reading.size / straight.size))

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

    def has_steps(self, steps: float) -> bool:
        """Whether steps per radian are those of the model, within `homing.steps_tolerance`."""
        share = self._homing.steps_tolerance
        return (1.0 - share) * self.steps() <= steps <= (1.0 + share) * self.steps(self._softest, _HARDER)

    def judge_steps(self, axis: int, steps: float) -> None:
        """Raises SafetyStop where steps per radian are not those of the model."""
        if self.has_steps(steps):
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

    def judge_slack(self, axis: int, slack: float) -> None:
        """Raises SafetyStop where a tendon was taut before anything was reeled in."""
        if slack >= -self._homing.taut:
            return
        problem = f"tendon {ACTIVE[axis]} was taut by {-1e3 * slack:.2f} mm when homing began"
        raise SafetyStop(problem, "homing", "slacken all tendons first: wristctl hw slacken, or by hand")

    def judge_friction(self, axis: int, friction: float) -> None:
        """Raises SafetyStop where a tendon sticks by more than `homing.sticks` between reeling in and letting go."""
        if friction <= self._homing.sticks:
            return
        problem = f"tendon {ACTIVE[axis]} sticks: {1e3 * friction:.2f} mm between reeling in and letting go"
        fix = "see whether it chafes or its sheath is bent sharply; or raise homing.sticks"
        raise SafetyStop(problem, "homing", fix)

    def judge_slackened(self, bend: Bend) -> None:
        """Raises SafetyStop where a wrist that nothing should hold moves when its tendons are let out further."""
        if bend.askew <= _SLACK * math.radians(self._homing.bend_deg):
            return
        away = 1 if bend.away > 0.0 else -1
        pulls, holds = self._axis_of(bend.theta > 0.0, away), self._axis_of(bend.theta < 0.0, -away)
        problem = f"a slackened wrist still moved by {math.degrees(bend.askew):.1f} deg when it was slackened further"
        likely = (
            f"tendon {ACTIVE[holds]} is shorter than it was, caught or slipped on its pulley, or axis {pulls} "
            f"(tendon {ACTIVE[pulls]}) turns the wrong way"
        )
        fix = "see tendons and motors, then calibrate the wrist again"
        raise SafetyStop(f"{problem}; likely {likely}", "homing", fix)

    def judge_cocontraction(self, bend: Bend) -> None:
        """Raises SafetyStop where a slackened wrist bends when one side's tendons are let out further."""
        if bend.askew <= _SLACK * math.radians(self._homing.bend_deg):
            return
        pulls = self._axis_of(bend.theta > 0.0, 1 if bend.away > 0.0 else -1)
        problem = (
            f"tendons pull against each other: the slackened wrist bent by {math.degrees(bend.askew):.1f} deg when one "
            f"side was let out; likely tendon {ACTIVE[pulls]} (axis {pulls}) and one opposite are shorter than the "
            "motors' positions say: steps that nobody counted, a knot, or zero positions that are wrong"
        )
        fix = "see tendons, motor cables and their shields, then calibrate the wrist again"
        raise SafetyStop(problem, "homing", fix)

    def judge_small_move(self, axis: int, reeled: float, bend: Bend) -> None:
        """Raises SafetyStop where reeling in by so many steps beyond the taut point did not bend as it should."""
        meant = reeled / self.steps()
        if max(abs(bend.theta), abs(bend.away) if math.isfinite(bend.away) else 0.0) < _LEAST * meant:
            problem = (
                f"axis {axis} (tendon {ACTIVE[axis]}) bends the wrist by {math.degrees(bend.theta):.1f} deg instead of "
                f"{math.degrees(meant):.1f} deg; likely it turns the wrong way, its tendon is off the pulley, or it "
                "has no power"
            )
            raise SafetyStop(problem, "homing", "calibrate the wrist again; see motor, drive and tendon")
        self.judge_side(axis, bend)
        if abs(bend.theta) > _MOST * meant:
            self.judge_steps(axis, reeled / abs(bend.theta))


# Times as long for each reading, where a result is doubtful.
_AGAIN = 4
# A bend at which homing stops.
_FURTHEST_DEG = 10.0


@dataclass(frozen=True)
class Zero:
    """Result of homing; axes in the order of tendons 1, 2, 4, 5."""

    signs: tuple[int, ...]
    """1 where positive steps reel in, -1 where they pay out."""
    steps_per_radian: tuple[float, ...]
    """Reeled in for one radian of bend, near the straight wrist."""
    marker: float
    """Angle between the markers on the straight wrist [rad]."""
    slack: tuple[float, ...]
    """Reeled in until the tendon was taut [m]."""
    friction: tuple[float, ...] = (0.0,) * AXES
    """Path between reeling in and letting go for the same bend [m]."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


class _Finder:
    """Moves one axis at a time; positions are microsteps reeled in from where the finder began."""

    def __init__(
        self, board: Board, tracking: Tracking, spools: Spools, settings: Homing, expected: ExpectedMoves
    ) -> None:  # fmt: skip
        self._board, self._tracking, self._settings, self._expected = board, tracking, settings, expected
        self._spools = spools
        self._slack, self._pull, self._move = (
            max(1, round(length / spools.step)) for length in (settings.slack, settings.pull, settings.move)
        )
        self._start = board.read().position
        self._at, self._signs = np.zeros(AXES, int), np.ones(AXES, int)
        self._bend = math.radians(settings.bend_deg)
        self._straight = Patience(board).reading(tracking, 4 * settings.frames)

    @property
    def straight(self) -> float:
        """Marker angle of the straight wrist [rad]."""
        return self._straight.theta

    def sense(self, axis: int, tried: Sequence[int]) -> int:
        """Find which way the axis turns, and about where its tendon bends the wrist [steps]."""
        for self._signs[axis] in tried:
            for reeled in range(2 * self._move, self._slack + 2 * self._move, 2 * self._move):
                self._reel(axis, reeled)
                bend = self._bent(axis)
                if bend.askew > self._bend:
                    self._let_go(axis, 0)
                    self._expected.judge_side(axis, bend)
                    return reeled
            self._let_go(axis, 0)
        slack, fix = 1e3 * self._settings.slack, "see that the tendon is on its pulley and the motor has power"
        problem = f"axis {axis} (tendon {ACTIVE[axis]}) does not bend the wrist within {slack:g} mm"
        raise SafetyStop(problem, "homing", f"{fix}; or raise homing.slack")

    def slacken(self) -> None:
        """Let all tendons go, so far that none holds against another while it is measured."""
        self._at[:] = -2 * self._pull
        self._go()

    def taut(self, axis: int, about: int) -> tuple[float, float, float]:
        """Taut point [steps], steps per radian and friction [steps] of an axis that bends at `about`. Lets go again.

        Steps that are not the model's are measured once more, with more time for each reading, before they are judged.
        """
        measured = self._measured(axis, about, 1)
        if not self._expected.has_steps(measured[1]):
            measured = self._measured(axis, about, _AGAIN)
        self._expected.judge_steps(axis, measured[1])
        return measured

    def _measured(self, axis: int, about: int, slowly: int) -> tuple[float, float, float]:
        reeled, bends = [], []
        for position in range(min(0, about - 3 * self._move), about + self._pull, self._move):
            self._reel(axis, position)
            bend = self._bent(axis, slowly)
            if abs(bend.theta) > self._bend:
                reeled.append(position)
                bends.append(bend.theta)
            if reeled and position - reeled[0] >= 0.7 * self._pull:  # any further, the tendons opposite may hold it
                break
        if len(reeled) < 3:
            self._let_go(axis, -2 * self._pull)
            raise SafetyStop(f"tendon {ACTIVE[axis]} pulls differently each time", "homing", "see whether it slips")
        slope, offset = np.polyfit(reeled, bends, 1)
        self._reel(axis, reeled[0])
        Patience(self._board).wait(4.0 * self._settings.rest)  # a wrist that is let go comes back by its springs alone
        friction = (self._bent(axis).theta - offset) / slope - reeled[0]
        self._let_go(axis, -2 * self._pull)
        self._expected.judge_side(axis, bend)
        if reeled[0] <= 0:  # it bends the wrist where it was at the start: the line alone may err by friction
            self._expected.judge_slack(axis, -offset / slope * self._spools.step)
        return float(-offset / slope), float(1.0 / abs(slope)), float(friction)

    def settle(self, taut: Sequence[float]) -> tuple[int, ...]:
        """Take up every tendon's slack, all at once, and call that zero. Senses of turning."""
        self._at[:] = np.rint(taut)
        self._go()
        self._board.home()
        return tuple(map(int, self._signs))

    def _bent(self, axis: int, slowly: int = 1) -> Bend:
        """From straight, of so many times the usual rest and frames. Raises SafetyStop where it is too far."""
        patience = Patience(self._board)
        patience.wait(slowly * self._settings.rest)
        bend = self._expected.bend(self._straight, patience.reading(self._tracking, slowly * self._settings.frames))
        if abs(bend.theta) > math.radians(_FURTHEST_DEG):
            self._reel(axis, -2 * self._pull)
            problem = f"axis {axis} bent the wrist by {math.degrees(bend.theta):.1f} deg while homing"
            raise SafetyStop(problem, "homing", "slacken all tendons first")
        return bend

    def _let_go(self, axis: int, reeled: int) -> None:
        self._reel(axis, reeled)
        clock = self._board.transport
        deadline = clock.now() + self._settings.let_go
        while abs(self._bent(axis).theta) > 0.5 * self._bend and clock.now() < deadline:
            pass

    def _reel(self, axis: int, reeled: int) -> None:
        self._at[axis] = reeled
        self._go()

    def _go(self) -> None:
        self._board.jog(list(self._start + self._signs * self._at))


def slacken(
    board: Board, spools: Spools, settings: Homing, signs: Sequence[int], times: float = 1.0
) -> tuple[int, ...]:
    """Let the tendons of a homed wrist go, so that nothing holds it; where the motors then stand [steps].

    They are let out by so many times `homing.pull`.
    """
    reeled = -round(times * settings.pull / spools.step)
    one, two, four, five = (reeled * sign for sign in signs)
    return board.go_to((one, two, four, five), JOG_RATE).position


def find_zero(
    board: Board, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str,
    signs: Sequence[int] | None = None,
) -> Zero:  # fmt: skip
    """Find zero of an enabled board with slack tendons, and home the board there; `signs` where they are known.

    Raises SafetyStop where a tendon does not bend the wrist, bends it too far, the wrong way or by another's steps, was
    taut before or sticks, or where the marker is lost.
    """
    expected, spools = ExpectedMoves(settings, wrist, plane), spools_of(settings.actuator)
    finder = _Finder(board, tracking, spools, settings.homing, expected)
    about = [finder.sense(axis, (1, -1) if signs is None else (signs[axis],)) for axis in range(AXES)]
    finder.slacken()
    taut, slopes, friction = zip(*[finder.taut(axis, about[axis]) for axis in range(AXES)], strict=True)
    slack, sticking = (tuple(spools.step * steps for steps in lengths) for lengths in (taut, friction))
    for axis in range(AXES):
        expected.judge_friction(axis, sticking[axis])
    senses = finder.settle(taut)
    for tendon, sense, length, slope in zip(ACTIVE, senses, slack, slopes, strict=True):
        log.info("tendon %d: sense %+d, slack %.2f mm, %.0f steps per rad", tendon, sense, 1e3 * length, slope)
    return Zero(senses, slopes, finder.straight, slack, sticking)
