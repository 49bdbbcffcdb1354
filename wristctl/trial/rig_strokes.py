"""Strokes of one motor before the camera: it takes its tendon up until the wrist bends, then reels in fast."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE, Flag, State, Target
from wristctl.config.hw_run import RigSettings
from wristctl.trial.patience import Patience
from wristctl.trial.prepare import prepare
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.step_latency import MotorStroke
from wristctl.trial.tracking import Tracking

COUNT = 24
_STROKE, _SPEED = 1e-3, 15e-3
"""Tendon [m] reeled in by a stroke, about 4 deg of bend; how fast [m/s]."""
_TAKEN_UP, _FURTHEST = math.radians(1.0), math.radians(12.0)
"""Bend [rad] at which the tendon counts as taut; at which strokes end."""
_MOVE, _REST = 0.12e-3, 0.15
"""Tendon [m] taken up by one move, and the pause [s] after it."""
_BEFORE, _AFTER, _BACK = 0.15, 0.35, 0.6
"""Seconds for which a stroke is watched before and after it begins; then for the way back."""
_SILENCE = 0.5
"""Seconds of silence that the board bears: moves end at their goals, whatever becomes of this computer."""
_UNDERWAY = 0.5e-3
"""Seconds until the board has read a command."""


class RigStrokes:
    """Strokes of one axis, which bends the wrist by `furthest` [rad] at most.

    The board is enabled, and where the motors stand is called zero: no homing outlives this.
    """

    def __init__(
        self, board: Board, tracking: Tracking, settings: RigSettings, axis: int, furthest: float = _FURTHEST
    ) -> None:
        self._furthest, self._taut = furthest, min(_TAKEN_UP, 0.5 * furthest)
        self._board, self._tracking, self._axis = board, tracking, axis
        self._step, self._slack = spools_of(settings.actuator).step, settings.homing.slack
        patient = settings.safety.model_copy(update={"watchdog": max(_SILENCE, settings.safety.watchdog)})
        prepare(board, settings.model_copy(update={"safety": patient}))
        board.home()
        self._straight = Patience(board).angle(tracking, 10)

    def strokes(self, count: int = COUNT, told: Callable[[int], None] = lambda done: None) -> list[MotorStroke]:
        """Do so many; the tendon is slack again in the end. Raises SafetyStop, BoardError and CameraError."""
        low, _ = self.taken_up()
        high = low + round(math.copysign(_STROKE / self._step, low))
        found, rng = [], np.random.default_rng(0)
        for k in range(count):
            self._watch(low, JOG_RATE, _BACK)
            # at random, so that strokes begin anywhere between two pictures
            found.append(self._stroke(low, high, _BEFORE * rng.uniform(0.6, 1.4)))
            told(k + 1)
        self.let_go()
        return found

    def let_go(self) -> None:
        """Back to where the motor stood at first."""
        self._board.go_to((0,) * AXES, JOG_RATE)

    def taken_up(self) -> tuple[int, float]:
        """The position [steps] at which the tendon bends the wrist a little, and the bend [rad].

        The position's sign is the motor's sense. Raises SafetyStop where the tendon bends nothing.
        """
        move = max(1, round(_MOVE / self._step))
        for sense in (1, -1):
            for reeled in range(move, round(self._slack / self._step) + move, move):
                self._watch(sense * reeled, JOG_RATE, _REST)
                if abs(bend := self._bend()) > self._taut:
                    return sense * reeled, bend
            self._watch(0, JOG_RATE, _REST)
        what = f"axis {self._axis} does not bend the wrist within {1e3 * self._slack:g} mm"
        raise SafetyStop(what, "one axis alone", "see its tendon and power; --axis tries another; homing.slack")

    def _bend(self) -> float:
        bend = Patience(self._board).angle(self._tracking, 3) - self._straight
        if abs(bend) > self._furthest:
            what = f"axis {self._axis} bent the wrist by {math.degrees(bend):.1f} deg"
            raise SafetyStop(what, fix="slacken all tendons")
        return bend

    def _stroke(self, low: int, high: int, before: float) -> MotorStroke:
        rest, moved = self._watch(low, JOG_RATE, before), self._watch(high, round(_SPEED / self._step), _AFTER)
        (time, position), (stamped, angle) = (np.concatenate([rest[k], moved[k]]).T for k in range(2))
        if len(angle) and np.abs(angle - self._straight).max() > self._furthest:
            raise SafetyStop(f"a stroke of axis {self._axis} bends the wrist too far", fix="slacken all tendons")
        return MotorStroke(time, position, stamped, angle)

    def _watch(self, goal: int, rate: int, seconds: float) -> tuple[np.ndarray, np.ndarray]:
        """Go to `goal` and watch, so long and until it is there: positions and angles (n, 2), each after its time."""
        board, clock = self._board, self._board.transport
        one, two, three, four = (goal * (k == self._axis) for k in range(AXES))
        board.send(Target((one, two, three, four), (rate,) * 4))
        fed = clock.now()
        end, positions, angles = fed + seconds, [], []
        status = board.read()
        while (now := clock.now()) < end or Flag.MOVING in status.flags:
            status = board.read()
            if status.state is not State.ENABLED:
                raise board.faulted(status)
            positions.append((now + _UNDERWAY, status.position[self._axis]))
            if now - fed > 0.2 * _SILENCE:
                board.ping()
                fed = now
            angles += [(each.time, each.theta) for each in self._tracking.look() if math.isfinite(each.theta)]
            clock.wait(1e-3)
        return np.array(positions, float).reshape(-1, 2), np.array(angles, float).reshape(-1, 2)
