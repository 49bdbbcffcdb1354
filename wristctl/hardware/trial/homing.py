"""Zero of a rig, by small guarded moves: where each tendon is just taut on the straight wrist, and which way it turns.

One motor after the other reels in by small moves until the marker shows a bend, then a little further, and lets go
again. The bend grows linearly with the tendon beyond the taut point, so a line through the bent readings crosses the
straight angle there; its slope gives steps per radian. A motor whose positive steps pay out shows no bend and is tried
the other way round.
"""

from __future__ import annotations

import logging
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from wristctl.config.hw_run import Homing
from wristctl.hardware.board import Board
from wristctl.hardware.trial.eye import Eye
from wristctl.hardware.trial.safety import SafetyStop
from wristctl.hardware.trial.spools import TENDONS, Spools, on_plus_side

Array = NDArray[np.float64]

log = logging.getLogger(__name__)

_FURTHEST_DEG = 10.0
"""A bend at which homing stops."""
_PULSE = 0.02
"""Seconds between two signs of life to the board while waiting."""


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


class Patience:
    """Waits and reads the marker while it keeps the board's link alive."""

    def __init__(self, board: Board, eye: Eye) -> None:
        self._board, self._eye = board, eye

    def wait(self, seconds: float) -> None:
        """Let time pass."""
        end = self._board.transport.now() + seconds
        while (left := end - self._board.transport.now()) > 0.0:
            self._board.ping()
            self._board.transport.wait(min(left, _PULSE))

    def angle(self, frames: int, patience: float = 2.0) -> float:
        """Median marker angle [rad] of the next usable frames. Raises SafetyStop where none come."""
        found: list[float] = []
        self._eye.look()
        began, verdict = self._board.transport.now(), "no frame"
        while len(found) < frames:
            self.wait(_PULSE)
            for seen in self._eye.look():
                verdict = str(seen.verdict)
                if seen.time >= began and math.isfinite(seen.theta):
                    found.append(seen.theta)
            if self._board.transport.now() - began > patience:
                fix = "see that the camera sees both markers, sharp and well lit"
                raise SafetyStop(f"the marker's angle could not be read ({verdict})", "homing", fix)
        return float(np.median(found))


class _Finder:
    def __init__(self, board: Board, patience: Patience, spools: Spools, settings: Homing, plane: str) -> None:
        self._board, self._patience, self._spools, self._settings = board, patience, spools, settings
        self._plus = on_plus_side(plane)
        self._move = max(1, round(settings.move / spools.step))
        self._start = list(board.read().position)
        self._bend = math.radians(settings.bend_deg)

    def straight(self) -> float:
        return self._patience.angle(4 * self._settings.frames)

    def find(self, axis: int, senses: Sequence[int], straight: float) -> tuple[int, float, float]:
        """Sense of turning, taut point [steps reeled in] and steps per radian of one axis."""
        for sense in senses:
            reeled, bends = self._pull(axis, sense, straight)
            if bends:
                break
        else:
            tendon, slack = TENDONS[axis], 1e3 * self._settings.slack
            fix = "see that the tendon is on its pulley and the motor has power; or raise homing.slack"
            raise SafetyStop(f"axis {axis} (tendon {tendon}) does not bend the wrist within {slack:g} mm", "homing", fix)
        slope, offset = np.polyfit(reeled, bends, 1)
        if (slope > 0.0) != bool(self._plus[axis]):
            what = f"axis {axis} bends the wrist to the other side than tendon {TENDONS[axis]} should"
            raise SafetyStop(what, "homing", "check which tendon is on which motor, and markers.positive")
        return sense, float(-offset / slope), float(1.0 / abs(slope))

    def _pull(self, axis: int, sense: int, straight: float) -> tuple[list[float], list[float]]:
        """Reel in until the wrist bends, and on; positions [steps] and angles of the bent readings. Lets go again."""
        reeled, bends = [], []
        furthest, beyond = self._settings.slack / self._spools.step, self._settings.pull / self._spools.step
        at = 0
        while at < furthest and (not reeled or at < reeled[0] + beyond):
            at += self._move
            self._jog(axis, sense * at)
            bend = self._read() - straight
            if abs(bend) > math.radians(_FURTHEST_DEG):
                self._jog(axis, 0)
                what = f"axis {axis} bent the wrist by {math.degrees(bend):.1f} deg while homing"
                raise SafetyStop(what, "homing", "slacken all tendons first")
            if abs(bend) > self._bend:
                reeled.append(float(at))
                bends.append(bend)
                furthest = math.inf
        self._jog(axis, 0)
        self._let_go(straight)
        return reeled, bends

    def _let_go(self, straight: float) -> None:
        clock = self._board.transport
        deadline = clock.now() + self._settings.let_go
        while abs(self._read() - straight) > 0.5 * self._bend and clock.now() < deadline:
            pass

    def _read(self) -> float:
        self._patience.wait(self._settings.rest)
        return self._patience.angle(self._settings.frames)

    def _jog(self, axis: int, reeled: int) -> None:
        self._board.jog([start + reeled * (k == axis) for k, start in enumerate(self._start)])

    def settle(self, signs: Sequence[int], taut: Sequence[float]) -> None:
        """Take up every tendon's slack, all at once, and call that zero."""
        there = [start + sign * round(reeled) for start, sign, reeled in zip(self._start, signs, taut, strict=True)]
        self._board.jog(there)
        self._board.home()


def find_zero(
    board: Board, eye: Eye, spools: Spools, settings: Homing, plane: str, signs: Sequence[int] | None = None
) -> Zero:
    """Find zero of an enabled board with slack tendons, and home the board there; `signs` where they are known.

    Raises SafetyStop where a tendon does not bend the wrist, bends it too far or the wrong way, or the marker is lost.
    """
    finder = _Finder(board, Patience(board, eye), spools, settings, plane)
    straight = finder.straight()
    found = []
    for axis, tendon in enumerate(TENDONS):
        found.append(finder.find(axis, (1, -1) if signs is None else (signs[axis],), straight))
        sense, taut, steps = found[-1]
        log.info("tendon %d: sense %+d, slack %.2f mm, %.0f steps per rad", tendon, sense, 1e3 * taut * spools.step, steps)
    senses, taut_points, slopes = zip(*found, strict=True)
    finder.settle(senses, taut_points)
    return Zero(senses, slopes, straight, tuple(spools.step * taut for taut in taut_points))
