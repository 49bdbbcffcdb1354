"""Strokes of one motor before the camera: it takes its tendon up until the wrist bends, then reels in fast."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence

import numpy as np

from wristctl.board.driver import Board
from wristctl.board.messages import AXES, JOG_RATE, Flag, State, Target
from wristctl.config.hw_run import RigSettings
from wristctl.trial.patience import Patience
from wristctl.trial.prepare import prepare
from wristctl.trial.ramped_move import RampedMove
from wristctl.trial.safety import SafetyStop
from wristctl.trial.spools import spools_of
from wristctl.trial.step_latency import MotorStroke
from wristctl.trial.tracking import Tracking

COUNT, MOST = 24, 96
"""Strokes after which one may know enough; that are made at most."""
_BEGUN, _ENDED, _LONGEST, _SPEED = math.radians(3.0), math.radians(6.0), 6e-3, 40e-3
"""Bend [rad] between which strokes go, the tendon taut at both ends; how much of it [m] they reel in at most, and how
fast [m/s]."""
_SAMPLED = 1e-3
"""Seconds between two points of a stroke's course."""
_TAKEN_UP, _FURTHEST = math.radians(1.0), math.radians(12.0)
"""Bend [rad] at which the tendon counts as taut; at which strokes end."""
_MOVE, _REST = 0.12e-3, 0.15
"""Tendon [m] taken up by one move, and the pause [s] after it."""
_BEFORE, _AFTER, _BACK, _SETTLED = 0.15, 0.35, 0.4, 0.8
"""Seconds for which a stroke is watched before and after it begins; for the way back, and up to where it begins."""
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
        spools = spools_of(settings.actuator)
        self._step, self._acceleration, self._slack = spools.step, spools.acceleration, settings.homing.slack
        patient = settings.safety.model_copy(update={"watchdog": max(_SILENCE, settings.safety.watchdog)})
        prepare(board, settings.model_copy(update={"safety": patient}))
        board.home()
        self._straight = Patience(board).angle(tracking, 10)

    def strokes(self, told: Callable[[int], None] = lambda done: None) -> Iterator[Sequence[MotorStroke]]:
        """All strokes so far, whenever COUNT more are done, up to MOST; the tendon stays taut.

        Raises SafetyStop, BoardError and CameraError.
        """
        taut, _ = self.taken_up()
        sense = 1 if taut > 0 else -1
        low, _ = self._crept(taut, sense, _BEGUN, _LONGEST)
        high, _ = self._crept(low, sense, _ENDED, _LONGEST)
        found, rng = list[MotorStroke](), np.random.default_rng(0)
        while len(found) < MOST:
            self._watch(0, JOG_RATE, _BACK)  # slack: friction is to hold back already when the stroke begins
            self._watch(low, JOG_RATE, _SETTLED)
            # at random, so that strokes begin anywhere between two pictures
            found.append(self._stroke(low, high, _BEFORE * rng.uniform(0.6, 1.4)))
            told(len(found))
            if len(found) % COUNT == 0:
                yield found

    def let_go(self) -> None:
        """Back to where the motor stood at first."""
        self._board.go_to((0,) * AXES, JOG_RATE)

    def taken_up(self) -> tuple[int, float]:
        """The position [steps] at which the tendon bends the wrist a little, and the bend [rad].

        The position's sign is the motor's sense. Raises SafetyStop where the tendon bends nothing.
        """
        for sense in (1, -1):
            position, bend = self._crept(0, sense, self._taut, self._slack)
            if abs(bend) > self._taut:
                return position, bend
            self._watch(0, JOG_RATE, _REST)
        what = f"axis {self._axis} does not bend the wrist within {1e3 * self._slack:g} mm"
        raise SafetyStop(what, "one axis alone", "see its tendon and power; --axis tries another; homing.slack")

    def _crept(self, begin: int, sense: int, wanted: float, most: float) -> tuple[int, float]:
        """Where [steps] slowly reeling in `most` [m] at most, from `begin`, has bent the wrist so far [rad]."""
        move, bend = max(1, round(_MOVE / self._step)), 0.0
        for reeled in range(move, round(most / self._step) + move, move):
            self._watch(begin + sense * reeled, JOG_RATE, _REST)
            if abs(bend := self._bend()) > wanted:
                break
        return begin + sense * reeled, bend

    def _bend(self) -> float:
        bend = Patience(self._board).angle(self._tracking, 3) - self._straight
        if abs(bend) > self._furthest:
            what = f"axis {self._axis} bent the wrist by {math.degrees(bend):.1f} deg"
            raise SafetyStop(what, fix="slacken all tendons")
        return bend

    def _stroke(self, low: int, high: int, before: float) -> MotorStroke:
        move = RampedMove(high - low, round(_SPEED / self._step), self._acceleration)
        rest, moved = self._watch(low, JOG_RATE, before), self._watch(high, round(move.rate), _AFTER)
        stamped, angle = np.concatenate([rest[1], moved[1]]).T
        time = np.arange(rest[0][0, 0], moved[0][-1, 0], _SAMPLED)
        answered, steps = moved[0].T
        position = low + move.course(time - move.began(answered, steps - low))
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
        moving = True
        while (now := clock.now()) < end or moving:
            status = board.read()
            if status.state is not State.ENABLED:
                raise board.faulted(status)
            moving = Flag.MOVING in status.flags
            positions.append((now + _UNDERWAY, status.position[self._axis]))
            if now - fed > 0.2 * _SILENCE:
                board.ping()
                fed = now
            angles += [(each.time, each.theta) for each in self._tracking.look() if math.isfinite(each.theta)]
            clock.wait(1e-3)
        return np.array(positions, float).reshape(-1, 2), np.array(angles, float).reshape(-1, 2)
