"""Zero of a rig, by small guarded moves: where each tendon is just taut on the straight wrist, and which way it turns.

One motor after the other reels in by small moves until the marker shows a bend, and lets go again; one whose positive
steps pay out shows none and is tried the other way round. Then all tendons are slackened, so that none holds against
another, and each in turn is reeled in through its taut point. From there the bend grows linearly with the tendon, so a
line through the bent readings crosses the straight angle at the taut point; its slope gives steps per radian.

Friction inside a wrist leaves it bent where it was let go. So a bend counts from where the wrist rested before: after a
bend by the tendon opposite, since friction turns bends aside that follow another's. Straight is the middle of where it
rests after bends to all sides.
"""

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Self

import numpy as np

from wristctl.board.messages import AXES, JOG_RATE
from wristctl.config.hw_run import Homing, RigSettings
from wristctl.config.wrist import WristParameters
from wristctl.trial.expected_moves import Bend, ExpectedMoves, middle
from wristctl.trial.resting import judge_slack
from wristctl.trial.rig_belief import names_of_planes, numbers_of
from wristctl.trial.spools import Spools, spools_of
from wristctl.trial.supervised_wait import Motors, Patience, Reading
from wristctl.trial.tracking import Tracking
from wristctl.wrist.tendon_layout import TendonLayout

log = logging.getLogger(__name__)

# Times as long for each reading, where a result is doubtful.
_AGAIN = 4
# A bend at which homing stops.
_FURTHEST_DEG = 10.0
# Share of the least bend that a wrist at rest may seem to move by from one reading to the next.
_STILL = 0.2


@dataclass(frozen=True)
class Zero:
    """Result of homing; values (T,) in the order of the motors: of a board tendons 1, 2, 4, 5."""

    signs: tuple[int, ...]
    """1 where positive steps reel in, -1 where they pay out."""
    steps_per_radian: tuple[float, ...]
    """Reeled in for one radian of bend, near the straight wrist."""
    markers: tuple[float, ...]
    """Angle between the markers on the straight wrist, as each camera sees it, or as a rig looks [rad]."""
    slack: tuple[float, ...]
    """Reeled in until the tendon was taut on the straight wrist [m]."""
    friction: tuple[float, ...] = (0.0,) * AXES
    """Path between reeling in and letting go for the same bend [m]."""
    directions: tuple[float, ...] = ()
    """Direction in which each tendon bends the wrist, from ulnar toward flexion [rad]; of one camera none."""
    targets: tuple[float, ...] = ()
    """Of a rig that takes targets: those at which each tendon of the straight wrist is just taut [facts.unit]."""

    def plain(self) -> dict[str, Any]:
        """For JSON; the angle before a second camera is `marker_2`."""
        first, *others = self.markers
        known = {
            "signs": self.signs,
            "steps_per_radian": self.steps_per_radian,
            "marker": first,
            "slack": self.slack,
            "friction": self.friction,
        }
        further = {f"marker_{camera}": angle for camera, angle in enumerate(others, 2)}
        some = {"directions": self.directions, "targets": self.targets}
        return known | further | {name: values for name, values in some.items() if values}

    @classmethod
    def of_plain(cls, table: dict[str, Any]) -> Self:
        """Read what `plain` has given. Raises KeyError, TypeError and ValueError."""
        signs, slopes, slack = (tuple(table[name]) for name in ("signs", "steps_per_radian", "slack"))
        markers = tuple(float(table[name]) for name in ("marker", "marker_2") if name == "marker" or name in table)
        friction = tuple(table.get("friction", (0.0,) * len(signs)))
        directions, targets = (tuple(table.get(name, ())) for name in ("directions", "targets"))
        return cls(signs, slopes, markers, slack, friction, directions, targets)


class Line(NamedTuple):
    """Bend by what an axis has reeled in, a line; where the wrist rested after it was let go."""

    slope: float
    """Bend toward the axis by a microstep [rad]."""
    offset: float
    friction: float
    """Path between reeling in and letting go for the same bend [steps]."""
    rest: Bend

    @property
    def per_radian(self) -> float:
        """Microsteps that a radian takes."""
        return 1.0 / abs(self.slope)

    def taut(self, straight: float) -> float:
        """Where the tendon is just taut on a wrist at this angle [steps]."""
        return (straight - self.offset) / self.slope


def rest_of(board: Motors, tracking: Tracking, expected: ExpectedMoves, homing: Homing) -> Reading:
    """Where a wrist rests that has been let go: once it moves no more, and at the latest after `homing.let_go`."""
    patience, clock = Patience(board), board.transport
    deadline, before = clock.now() + homing.let_go, None
    while True:
        patience.wait(homing.rest)
        reading = patience.reading(tracking, homing.frames)
        if before is not None:
            moved = expected.size(expected.bend(before, reading))
            if moved < _STILL * math.radians(homing.bend_deg) or clock.now() >= deadline:
                return reading
        before = reading


class Finder:
    """Finds zero of enabled motors with slack tendons, one axis at a time.

    Positions are microsteps reeled in from where the finder began.
    """

    def __init__(
        self, board: Motors, tracking: Tracking, rig: RigSettings, wrist: WristParameters, plane: str,
        expected: ExpectedMoves,
    ) -> None:  # fmt: skip
        self._board, self._tracking, self._expected = board, tracking, expected
        settings, spools = self._settings, self._spools = rig.homing, spools_of(rig.actuator)
        planes = names_of_planes(rig.planes, plane)
        self._judge_slack = partial(judge_slack, settings=rig, wrist=wrist, planes=planes)
        self._slack, self._pull, self._move = (
            max(1, round(length / spools.step)) for length in (settings.slack, settings.pull, settings.move)
        )
        self._start = board.read().position
        self._at, self._signs = np.zeros(len(self._start), int), np.ones(len(self._start), int)
        self._bend = math.radians(settings.bend_deg)
        self._straight = Patience(board).reading(tracking, 4 * settings.frames)
        self._rest, self._stays = expected.bend(self._straight, self._straight), 0.0
        self.directions = [math.nan] * len(self._start)
        """Direction of each axis that has been measured in two planes [rad]."""

    @property
    def began(self) -> tuple[float, float]:
        """Marker angles of the wrist as it stood at first [rad], the second one nan in one plane."""
        return self._straight.theta, self._straight.beside

    def sense(self, axis: int, tried: Sequence[int]) -> int:
        """Find which way the axis turns, and about where its tendon bends the wrist [steps].

        A small bend to another side than the tendon's is doubtful: a larger one is read with more time, and judged.
        """
        for self._signs[axis] in tried:
            for reeled in range(2 * self._move, self._slack + 2 * self._move, 2 * self._move):
                self._reel(axis, reeled)
                moved = self._bent(axis).since(self._rest)
                if moved.askew > self._bend:
                    if self._expected.told(axis, moved)[0] != axis:
                        self._reel(axis, reeled + 2 * self._move)
                        moved = self._bent(axis, _AGAIN).since(self._rest)
                    self._let_go(axis, 0)
                    if self._expected.own and self._signs[axis] < 0:
                        raise self._expected.wrong_sense(axis)
                    self._expected.judge_side(axis, moved)
                    return reeled
            self._let_go(axis, 0)
        raise self._expected.does_not_bend(axis, len(tried) == 1)

    def slacken(self) -> None:
        """Let all tendons go, so far that none holds against another while it is measured. SafetyStop where it sags."""
        self._at[:] = -2 * self._pull
        self._go()
        self._rest = self._rests()
        self._judge_slack(self._rest)

    def line(self, axis: int, about: int) -> Line:
        """How the wrist bends by an axis that bends it at `about`. Lets go again.

        Steps that are not the model's are measured once more, with more time for each reading, before they are judged.
        """
        measured = self._measured(axis, about, 1)
        if not self._expected.has_steps(axis, measured.per_radian, self._stays):
            measured = self._measured(axis, about, _AGAIN)
        self._expected.judge_steps(axis, measured.per_radian, self._stays)
        return measured

    def _measured(self, axis: int, about: int, slowly: int) -> Line:
        reeled, bends = [], []
        along, rested = self._expected.along, self._rest
        for position in range(min(0, about - 3 * self._move), about + 2 * self._pull, self._move):
            self._reel(axis, position)
            bend = self._bent(axis, slowly)
            if abs(along(axis, bend.since(rested))) > self._bend:
                reeled.append(position)
                bends.append(bend)
            if reeled and position - reeled[0] >= 0.7 * self._pull:  # any further, the tendons opposite may hold it
                break
        if len(reeled) < 3:
            self._let_go(axis, -2 * self._pull)
            self._judge_slack(self._rest)  # one that sags slowly has gone on
            raise self._expected.pulls_differently(axis)
        slope, offset = np.polyfit(reeled, [along(axis, bent) for bent in bends], 1)
        self._reel(axis, reeled[0])
        Patience(self._board).wait(4.0 * self._settings.rest)  # a wrist that is let go comes back by its springs alone
        back = self._bent(axis)
        self._let_go(axis, -2 * self._pull)
        self.directions[axis] = self._expected.judge_line(axis, bend.since(rested), reeled, bends)
        held = abs(along(axis, back.since(self._rest))) > 0.5 * self._bend  # the tendon was not slack yet
        friction = (along(axis, back) - offset) / slope - reeled[0] if held else 0.0
        line = Line(float(slope), float(offset), float(friction), self._rest)
        if reeled[0] <= 0:  # it bends the wrist where it was at the start: the line alone may err by friction
            self._expected.judge_slack(axis, line.taut(0.0) * self._spools.step, self._stays)
        return line

    def turn(self, axes: Sequence[int], about: Sequence[int]) -> dict[int, Line]:
        """Lines of axes that pull against each other, by `about` where they bend the wrist, each after the other one.

        One that has no other is measured after the one that pulls against it most.
        """
        against = axes[-1] if len(axes) > 1 else self._expected.against(axes[0])
        self._reel(against, about[against] + self._pull)
        self._bent(against)
        self._let_go(against, -2 * self._pull)  # friction inside holds it there
        return {axis: self.line(axis, about[axis]) for axis in axes}

    def lines(self, about: Sequence[int]) -> tuple[list[Line], Bend, list[float]]:
        """Lines of all axes, by `about` where they bend the wrist; where it is straight, and where each tendon of it is
        just taut [steps]."""
        measured = {axis: line for turns in self._expected.turns for axis, line in self.turn(turns, about).items()}
        lines = [measured[axis] for axis in range(len(about))]
        straight = middle([line.rest for line in lines])
        return lines, straight, [line.taut(self._expected.along(axis, straight)) for axis, line in enumerate(lines)]

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
        if self._expected.size(bend) > math.radians(_FURTHEST_DEG):
            self._reel(axis, -2 * self._pull)
            raise self._expected.bent_too_far(axis, bend)
        return bend

    def _let_go(self, axis: int, reeled: int) -> None:
        """Let an axis go, and read the wrist: how far it stays bent is by friction of its own."""
        self._reel(axis, reeled)
        self._rest = self._rests()
        self._stays = max(self._stays, self._expected.size(self._rest))

    def _rests(self) -> Bend:
        rest = rest_of(self._board, self._tracking, self._expected, self._settings)
        return self._expected.bend(self._straight, rest)

    def _reel(self, axis: int, reeled: int) -> None:
        self._at[axis] = reeled
        self._go()

    def _go(self) -> None:
        self._board.jog(list(self._start + self._signs * self._at))


def slacken(
    board: Motors, spools: Spools, settings: Homing, signs: Sequence[int], times: float = 1.0
) -> tuple[int, ...]:
    """Let the tendons of a homed wrist go, so that nothing holds it; where the motors then stand [steps].

    They are let out by so many times `homing.pull`.
    """
    reeled = -round(times * settings.pull / spools.step)
    position: tuple[int, ...] = board.go_to([reeled * sign for sign in signs], JOG_RATE).position
    return position


def find_zero(
    board: Motors, tracking: Tracking, settings: RigSettings, wrist: WristParameters, plane: str,
    signs: Sequence[int] | None = None, layout: TendonLayout | None = None,
) -> Zero:  # fmt: skip
    """Find zero of enabled motors with slack tendons, and call that their zero; `signs` where they are known.

    `layout` has the tendons that they wind; None: the board's four.

    Raises SafetyStop where a tendon does not bend the wrist, bends it too far, the wrong way or by another's steps, was
    taut before or sticks, or where the marker is lost. In two planes readings of the slack wrist have been taken off.
    """
    expected, spools = ExpectedMoves(settings, wrist, plane, layout), spools_of(settings.actuator)
    finder, count = Finder(board, tracking, settings, wrist, plane, expected), len(expected.plus)
    about = [finder.sense(axis, (1, -1) if signs is None else (signs[axis],)) for axis in range(count)]
    finder.slacken()
    lines, straight, taut = finder.lines(about)
    slopes = tuple(line.per_radian for line in lines)
    slack, sticking = tuple(spools.step * at for at in taut), tuple(spools.step * line.friction for line in lines)
    stays = max(expected.size(line.rest.since(straight)) for line in lines)
    for axis in range(count):
        expected.judge_friction(axis, sticking[axis], stays)
    senses = finder.settle(taut)
    for tendon, sense, length, slope in zip(numbers_of(layout), senses, slack, slopes, strict=True):
        log.info("tendon %d: sense %+d, slack %.2f mm, %.0f steps per rad", tendon, sense, 1e3 * length, slope)
    seen = zip(tracking.zero, finder.began, straight, strict=False)
    markers = tuple(began + bent + taken_off for taken_off, began, bent in seen)
    directions = tuple(direction for direction in finder.directions if math.isfinite(direction))
    return Zero(senses, slopes, markers, slack, sticking, directions)
