"""Zero of a rig, by small guarded moves: where each tendon is just taut on the straight wrist, and which way it turns.

One motor after the other reels in by small moves until the marker shows a bend, and lets go again; one whose positive
steps pay out shows none and is tried the other way round. Then all tendons are slackened, so that none holds against
another, and each in turn is reeled in through its taut point. From there the bend grows linearly with the tendon, so a
line through the bent readings crosses the straight angle at the taut point; its slope gives steps per radian.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE
from wristctl.config.hw_run import Homing
from wristctl.trial.patience import Patience
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import Spools, on_plus_side
from wristctl.trial.tracking import Tracking
from wristctl.wrist.directions import ACTIVE

log = logging.getLogger(__name__)

_FURTHEST_DEG = 10.0
"""A bend at which homing stops."""


@dataclass(frozen=True)
class Zero:
    """What homing finds; axes in the order of tendons 1, 2, 4, 5."""

    signs: tuple[int, ...]
    """1 where positive steps reel in, -1 where they pay out."""
    steps_per_radian: tuple[float, ...]
    """Reeled in for one radian of bend, near the straight wrist."""
    marker: float
    """Angle between the markers on the straight wrist [rad]."""
    slack: tuple[float, ...]
    """Reeled in until the tendon was taut [m]."""

    def plain(self) -> dict[str, Any]:
        """For JSON."""
        return {name: getattr(self, name) for name in self.__dataclass_fields__}


class _Finder:
    """Moves one axis at a time; positions are microsteps reeled in from where the finder began."""

    def __init__(self, board: Board, tracking: Tracking, spools: Spools, settings: Homing, plane: str) -> None:
        self._board, self._tracking, self._settings = board, tracking, settings
        self._plus = on_plus_side(plane)
        self._slack, self._pull, self._move = (
            max(1, round(length / spools.step)) for length in (settings.slack, settings.pull, settings.move)
        )
        self._start = board.read().position
        self._at, self._signs = np.zeros(AXES, int), np.ones(AXES, int)
        self._bend = math.radians(settings.bend_deg)
        self.straight = Patience(board).angle(tracking, 4 * settings.frames)

    def sense(self, axis: int, tried: Sequence[int]) -> int:
        """Find which way the axis turns, and about where its tendon bends the wrist [steps]."""
        for self._signs[axis] in tried:
            for reeled in range(2 * self._move, self._slack + 2 * self._move, 2 * self._move):
                self._reel(axis, reeled)
                if abs(self._bent(axis)) > self._bend:
                    self._let_go(axis, 0)
                    return reeled
            self._let_go(axis, 0)
        slack, fix = 1e3 * self._settings.slack, "see that the tendon is on its pulley and the motor has power"
        what = f"axis {axis} (tendon {ACTIVE[axis]}) does not bend the wrist within {slack:g} mm"
        raise SafetyStop(what, "homing", f"{fix}; or raise homing.slack")

    def slacken(self) -> None:
        """Let all tendons go, so far that none holds against another while it is measured."""
        self._at[:] = -2 * self._pull
        self._go()

    def taut(self, axis: int, about: int) -> tuple[float, float]:
        """The taut point [steps] and steps per radian of an axis that bends the wrist at `about`. Lets go again."""
        reeled, bends = [], []
        for at in range(about - 3 * self._move, about + self._pull, self._move):
            self._reel(axis, at)
            bend = self._bent(axis)
            if abs(bend) > self._bend:
                reeled.append(at)
                bends.append(bend)
        self._let_go(axis, -2 * self._pull)
        if len(reeled) < 3:
            raise SafetyStop(f"tendon {ACTIVE[axis]} pulls differently each time", "homing", "see whether it slips")
        slope, offset = np.polyfit(reeled, bends, 1)
        if (slope > 0.0) != bool(self._plus[axis]):
            what = f"axis {axis} bends the wrist to the other side than tendon {ACTIVE[axis]} should"
            raise SafetyStop(what, "homing", "check which tendon is on which motor, and markers.positive")
        return float(-offset / slope), float(1.0 / abs(slope))

    def settle(self, taut: Sequence[float]) -> tuple[int, ...]:
        """Take up every tendon's slack, all at once, and call that zero. Senses of turning."""
        self._at[:] = np.rint(taut)
        self._go()
        self._board.home()
        return tuple(map(int, self._signs))

    def _bent(self, axis: int) -> float:
        """Angle [rad] from straight. Raises SafetyStop where it is too large."""
        patience = Patience(self._board)
        patience.wait(self._settings.rest)
        bend = patience.angle(self._tracking, self._settings.frames) - self.straight
        if abs(bend) > math.radians(_FURTHEST_DEG):
            self._reel(axis, -2 * self._pull)
            what = f"axis {axis} bent the wrist by {math.degrees(bend):.1f} deg while homing"
            raise SafetyStop(what, "homing", "slacken all tendons first")
        return bend

    def _let_go(self, axis: int, reeled: int) -> None:
        self._reel(axis, reeled)
        clock = self._board.transport
        deadline = clock.now() + self._settings.let_go
        while abs(self._bent(axis)) > 0.5 * self._bend and clock.now() < deadline:
            pass

    def _reel(self, axis: int, reeled: int) -> None:
        self._at[axis] = reeled
        self._go()

    def _go(self) -> None:
        self._board.jog(list(self._start + self._signs * self._at))


def slacken(board: Board, spools: Spools, settings: Homing, signs: Sequence[int]) -> tuple[int, ...]:
    """Let the tendons of a homed wrist go, so that nothing holds it; where the motors then stand [steps]."""
    reeled = -round(settings.pull / spools.step)
    one, two, four, five = (reeled * sign for sign in signs)
    return board.go_to((one, two, four, five), JOG_RATE).position


def find_zero(
    board: Board, tracking: Tracking, spools: Spools, settings: Homing, plane: str, signs: Sequence[int] | None = None
) -> Zero:
    """Find zero of an enabled board with slack tendons, and home the board there; `signs` where they are known.

    Raises SafetyStop where a tendon does not bend the wrist, bends it too far or the wrong way, or the marker is lost.
    """
    finder = _Finder(board, tracking, spools, settings, plane)
    about = [finder.sense(axis, (1, -1) if signs is None else (signs[axis],)) for axis in range(AXES)]
    finder.slacken()
    taut, slopes = zip(*[finder.taut(axis, about[axis]) for axis in range(AXES)], strict=True)
    senses = finder.settle(taut)
    slack = tuple(spools.step * each for each in taut)
    for each in zip(ACTIVE, senses, slack, slopes, strict=True):
        log.info("tendon %d: sense %+d, slack %.2f mm, %.0f steps per rad", each[0], each[1], 1e3 * each[2], each[3])
    return Zero(senses, slopes, finder.straight, slack)
